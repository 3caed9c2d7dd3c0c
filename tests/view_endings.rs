//! Bad days of the window: the device or the surface is lost, or there is no display at all.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

#[path = "support/desktop.rs"]
mod desktop;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use desktop::Desktop;

const PATIENCE: Duration = Duration::from_secs(120);

/// Paths that are traced: the picture is finished soon, and known exactly.
const PATHS: u64 = 60_000;

fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.env_remove("WAYLAND_DISPLAY").env("POINTILLIST_VALIDATION", "1");
    command
}

fn scene() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.xml")
}

/// A folder of this test alone.
fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("pointillist-endings-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&path).unwrap();
    path
}

fn view(desktop: &Desktop, folder: &Path, options: &[&str]) -> Child {
    let mut command = program();
    command.current_dir(folder).env("DISPLAY", &desktop.display).arg("view").arg(scene());
    command.args(["--size", "96x96", "--samples", &PATHS.to_string(), "-o", "last.png", "-o", "last.exr"]);
    command.args(["--json", "figures.json"]).args(options).stderr(Stdio::piped()).spawn().unwrap()
}

/// Waits for the end, which must come.
fn end(mut viewer: Child) -> Output {
    let start = Instant::now();
    while viewer.try_wait().unwrap().is_none() {
        if start.elapsed() > PATIENCE {
            let _ = viewer.kill();
            panic!("the viewer did not end");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    viewer.wait_with_output().unwrap()
}

/// Ends the viewer as a user does, after this many seconds.
fn end_after(viewer: Child, seconds: u64) -> Output {
    std::thread::sleep(Duration::from_secs(seconds));
    assert!(Command::new("kill").args(["-TERM", &viewer.id().to_string()]).status().unwrap().success());
    end(viewer)
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn figures(folder: &Path) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join("figures.json")).unwrap()).unwrap()
}

/// Mean of all channels of the PNG, of 255.
fn mean(folder: &Path) -> f64 {
    let file = std::fs::File::open(folder.join("last.png")).unwrap();
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!((info.width, info.height), (96, 96));
    bytes.iter().map(|byte| f64::from(*byte)).sum::<f64>() / bytes.len() as f64
}

/// Camera paths that the picture's file says it holds.
fn paths_in(folder: &Path) -> u64 {
    let bytes = std::fs::read(folder.join("last.exr")).unwrap();
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(8192)]).into_owned();
    let at = text.find("--samples ").unwrap_or_else(|| panic!("no command in the file"));
    let digits: String = text[at + 10..].chars().take_while(char::is_ascii_digit).collect();
    digits.parse().unwrap()
}

/// What an undisturbed viewer leaves.
fn undisturbed(desktop: &Desktop) -> f64 {
    let folder = folder("undisturbed");
    let output = end_after(view(desktop, &folder, &[]), 6);
    assert!(output.status.success(), "{}", words(&output));
    assert_eq!(paths_in(&folder), PATHS);
    let mean = mean(&folder);
    std::fs::remove_dir_all(folder).unwrap();
    mean
}

#[test]
fn a_lost_device_is_replaced_once_and_keeps_its_samples() {
    let desktop = Desktop::start(300, 300);
    let wanted = undisturbed(&desktop);
    let once = folder("once");
    let output = end_after(view(&desktop, &once, &["--lose-device-after", "20"]), 8);
    assert!(output.status.success(), "{}", words(&output));
    assert!(words(&output).contains("the device was lost"), "{}", words(&output));
    let figures_once = figures(&once);
    assert_eq!(figures_once["device_losses"], 1);
    assert_eq!(figures_once["validation_messages"], 0);
    // One epoch: nothing was begun anew, and all paths are in the picture.
    assert_eq!(figures_once["epochs"], 1);
    assert_eq!(paths_in(&once), PATHS);
    assert!((mean(&once) - wanted).abs() < 1.0, "{} instead of {wanted}", mean(&once));
    std::fs::remove_dir_all(once).unwrap();

    let twice = folder("twice");
    let options = ["--lose-device-after", "20", "--lose-device-after", "20"];
    let output = end(view(&desktop, &twice, &options));
    assert_eq!(output.status.code(), Some(1), "{}", words(&output));
    assert!(!words(&output).contains("panicked"), "{}", words(&output));
    assert_eq!(figures(&twice)["device_losses"], 2);
    // The samples so far, developed without the device: noisier, and as bright.
    assert!((mean(&twice) - wanted).abs() < 6.0, "{} instead of {wanted}", mean(&twice));
    std::fs::remove_dir_all(twice).unwrap();
}

#[test]
fn a_lost_surface_is_replaced() {
    let folder = folder("surface");
    let desktop = Desktop::start(300, 300);
    let output = end_after(view(&desktop, &folder, &["--lose-surface-after", "20"]), 6);
    assert!(output.status.success(), "{}", words(&output));
    let figures = figures(&folder);
    assert_eq!(figures["surface_losses"], 1);
    assert_eq!(figures["device_losses"], 0);
    assert_eq!(figures["validation_messages"], 0);
    assert_eq!(paths_in(&folder), PATHS);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn colours_that_are_not_offered_are_named_once() {
    let folder = folder("colours");
    let desktop = Desktop::start(300, 300);
    let output = end_after(view(&desktop, &folder, &["--hdr", "hdr10"]), 5);
    assert!(output.status.success(), "{}", words(&output));
    assert_eq!(words(&output).matches("no HDR10 on this display").count(), 1, "{}", words(&output));
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn without_a_display_one_error_says_what_to_do() {
    for display in ["", ":9999"] {
        let output = program().env("DISPLAY", display).arg("view").arg(scene()).output().unwrap();
        let words = words(&output);
        assert_eq!(output.status.code(), Some(1), "{words}");
        assert!(words.contains("no window can be opened") && words.contains("DISPLAY"), "{words}");
        assert!(!words.contains("panicked") && !words.contains(".rs"), "{words}");
    }
}
