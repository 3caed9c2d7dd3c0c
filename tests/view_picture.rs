//! The window as it is seen from outside: on a display of its own, the real program.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

#[path = "support/desktop.rs"]
mod desktop;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};

use desktop::Desktop;

const PATIENCE: Duration = Duration::from_secs(120);

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
    let path = std::env::temp_dir().join(format!("pointillist-view-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&path).unwrap();
    path
}

fn view(desktop: &Desktop, folder: &Path, options: &[&str]) -> Child {
    let mut command = program();
    command.current_dir(folder).env("DISPLAY", &desktop.display).arg("view").arg(scene()).args(options);
    command.spawn().unwrap()
}

fn terminate(viewer: &Child) {
    assert!(Command::new("kill").args(["-TERM", &viewer.id().to_string()]).status().unwrap().success());
}

/// Waits for the end, which must come.
fn end(viewer: &mut Child) -> ExitStatus {
    let start = Instant::now();
    loop {
        if let Some(status) = viewer.try_wait().unwrap() {
            return status;
        }
        if start.elapsed() > PATIENCE {
            let _ = viewer.kill();
            panic!("the viewer did not end");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// R, G, B of a PNG.
fn png(path: &Path) -> (u32, u32, Vec<u8>) {
    let mut reader =
        png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgb);
    (info.width, info.height, bytes)
}

/// R, G, B of the window.
fn shot(desktop: &Desktop, window: u32) -> Option<(u32, u32, Vec<u8>)> {
    let (width, height, bgrx) = desktop.pixels(window)?;
    Some((width, height, bgrx.chunks_exact(4).flat_map(|p| [p[2], p[1], p[0]]).collect()))
}

fn figures(folder: &Path) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join("figures.json")).unwrap()).unwrap()
}

#[test]
fn the_window_equals_the_headless_picture() {
    let folder = folder("equal");
    let options = ["--size", "160x120", "--samples", "150000", "--deterministic"];
    let rendered = program()
        .current_dir(&folder)
        .arg("render")
        .arg(scene())
        .args(options)
        .args(["--quiet", "-o", "headless.png"])
        .status();
    assert!(rendered.unwrap().success());
    let wanted = png(&folder.join("headless.png"));
    let desktop = Desktop::start(400, 300);
    let all = [&options[..], &["--no-panel", "-o", "window.png", "--json", "figures.json"]].concat();
    let mut viewer = view(&desktop, &folder, &all);
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    let start = Instant::now();
    let mut seen = shot(&desktop, window);
    while seen.as_ref() != Some(&wanted) && start.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(100));
        seen = shot(&desktop, window);
    }
    terminate(&viewer);
    assert!(end(&mut viewer).success());
    assert!(seen.unwrap() == wanted, "the window shows another picture than the headless PNG");
    assert!(png(&folder.join("window.png")) == wanted, "the picture written at the end is another one");
    assert_eq!(figures(&folder)["validation_messages"], 0);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn resizes_and_drags_leave_a_picture() {
    let folder = folder("drag");
    let desktop = Desktop::start(500, 400);
    let mut viewer = view(
        &desktop,
        &folder,
        &["--size", "128x128", "--no-panel", "-o", "last.png", "--json", "figures.json"],
    );
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    std::thread::sleep(Duration::from_secs(2));
    for (width, height) in [(192, 192), (96, 160), (300, 200), (1, 1), (128, 128)] {
        desktop.resize(window, width, height);
        std::thread::sleep(Duration::from_millis(300));
    }
    desktop.pointer(100, 100);
    desktop.button(2, true);
    for i in 0..10 {
        desktop.pointer(100 - 2 * i, 100 + i);
        std::thread::sleep(Duration::from_millis(30));
    }
    desktop.button(2, false);
    std::thread::sleep(Duration::from_secs(2));
    terminate(&viewer);
    assert!(end(&mut viewer).success());
    let (width, height, rgb) = png(&folder.join("last.png"));
    assert_eq!((width, height), (128, 128));
    assert!(rgb.iter().any(|c| *c > 100), "the picture is dark");
    let figures = figures(&folder);
    assert_eq!(figures["validation_messages"], 0);
    assert!(figures["resizes"].as_u64().unwrap() >= 4, "{figures:#}");
    assert!(figures["epochs"].as_u64().unwrap() >= 5, "{figures:#}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_lost_display_costs_no_picture() {
    let folder = folder("display");
    let desktop = Desktop::start(300, 300);
    let mut viewer = view(&desktop, &folder, &["--size", "96x96", "-o", "last.png"]);
    desktop.find("ointillist", PATIENCE).unwrap();
    std::thread::sleep(Duration::from_secs(2));
    drop(desktop); // kills the X server
    let status = end(&mut viewer);
    assert!(!status.success() && status.code().is_some(), "{status}");
    assert_eq!(png(&folder.join("last.png")).0, 96);
    std::fs::remove_dir_all(folder).unwrap();
}
