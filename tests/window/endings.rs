//! Failures of the window system: the device or the surface is lost, or there is no display at all.

use std::io::Read;
use std::path::Path;
use std::process::Child;
use std::time::Instant;

use crate::support::desktop::Desktop;
use crate::viewer::{Listened, PATIENCE, end, end_when, figures, folder, png, program, scene, words};

/// Paths that are traced: the picture is finished soon, and known exactly.
pub const PATHS: u64 = 60_000;

pub fn view(desktop: &Desktop, folder: &Path, options: &[&str]) -> Child {
    let paths = PATHS.to_string();
    let picture =
        ["--size", "96x96", "--samples", &paths, "--exposure", "1", "-o", "last.png", "-o", "last.exr"];
    // A method that is chosen while the window is open would begin the picture anew.
    let all = [&picture[..], &["--integrator", "path", "--json", "figures.json"], options].concat();
    crate::viewer::view(desktop, folder, &all)
}

/// What the viewer says when all paths are in the picture.
pub const ENDED: &str = "the render has ended";

/// Mean of all channels of the PNG, of 255.
pub fn mean(folder: &Path) -> f64 {
    let (width, height, bytes) = png(&folder.join("last.png"));
    assert_eq!((width, height), (96, 96));
    bytes.iter().map(|byte| f64::from(*byte)).sum::<f64>() / bytes.len() as f64
}

/// Camera paths that the picture's file says it holds.
pub fn paths_in(folder: &Path) -> u64 {
    let bytes = std::fs::read(folder.join("last.exr")).unwrap();
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(8192)]).into_owned();
    let at = text.find("--samples ").unwrap_or_else(|| panic!("no command in the file"));
    let digits: String = text[at + 10..].chars().take_while(char::is_ascii_digit).collect();
    digits.parse().unwrap()
}

/// The picture that an undisturbed viewer leaves.
fn undisturbed(desktop: &Desktop) -> f64 {
    let folder = folder("undisturbed");
    let output = end_when(view(desktop, &folder, &[]), &[ENDED]);
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
    let output =
        end_when(view(&desktop, &once, &["--lose-device-after", "20"]), &[ENDED, "the device was lost"]);
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

/// A device with memory for a small picture only, and a larger one is asked for. The picture keeps its size, all of its samples and its
/// window.
#[test]
fn a_picture_too_large_for_the_device_leaves_the_last_one() {
    let desktop = Desktop::start(1400, 1100);
    let wanted = undisturbed(&desktop);
    let folder = folder("memory");
    let mut viewer = view(&desktop, &folder, &["--no-panel", "--device-memory", "32"]);
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    // Mean of the window's middle, of 255; `None` while it is being made or resized.
    let brightness = || {
        let (width, height, pixels) = desktop.pixels(window)?;
        let rows = pixels.chunks(4 * width as usize).skip(height as usize / 3).take(height as usize / 3);
        let middle = rows.flat_map(|row| &row[4 * (width as usize / 3)..4 * (2 * width as usize / 3)]);
        let (sum, count) = middle.fold((0.0, 0.0), |(sum, n), byte| (sum + f64::from(*byte), n + 1.0));
        Some((width, sum / count))
    };
    let mut wait = |size: u32| {
        let start = Instant::now();
        while !matches!(brightness(), Some((width, mean)) if width == size && mean > 30.0) {
            if let Some(status) = viewer.try_wait().unwrap() {
                let mut said = String::new();
                viewer.stderr.take().unwrap().read_to_string(&mut said).unwrap();
                panic!("the viewer ended with {status}: {said}");
            }
            assert!(
                start.elapsed() < PATIENCE,
                "no picture in a window of {size} pixels: {:?}",
                brightness()
            );
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
    };
    wait(96);
    // What is shown while the scene is loaded is bright, too, and before the first picture there is nothing to go back to.
    std::thread::sleep(std::time::Duration::from_secs(3));
    // The picture is stretched.
    desktop.resize(window, 960, 960);
    wait(960);
    assert!(desktop.focus(window, PATIENCE));
    let mut viewer = Listened::new(viewer);
    viewer.wait_for(ENDED);
    // The same shape, and another one. A key may be lost while the window gets the keyboard.
    for size in [(960, 960), (1300, 960)] {
        desktop.resize(window, size.0, size.1);
        std::thread::sleep(std::time::Duration::from_millis(500));
        let (start, said) = (Instant::now(), viewer.times("keeps its 96×96 pixels"));
        while viewer.times("keeps its 96×96 pixels") == said && start.elapsed() < PATIENCE {
            [true, false].into_iter().for_each(|down| desktop.key(u32::from('n'), down));
            std::thread::sleep(std::time::Duration::from_millis(500));
        }
        assert!(viewer.times("keeps its 96×96 pixels") > said, "{size:?} was not refused");
    }
    let output = viewer.terminate();
    assert!(output.status.success(), "{}", words(&output));
    assert!(words(&output).contains("no GPU memory for"), "{}", words(&output));
    let seen = figures(&folder);
    assert_eq!((&seen["validation_messages"], &seen["epochs"]), (&0.into(), &1.into()), "{seen:#}");
    assert_eq!(paths_in(&folder), PATHS);
    assert!((mean(&folder) - wanted).abs() < 1.0, "{} instead of {wanted}", mean(&folder));
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_lost_surface_is_replaced() {
    let folder = folder("surface");
    let desktop = Desktop::start(300, 300);
    let lost = ["--fail-call", "acquire,20,1,ERROR_SURFACE_LOST_KHR"];
    let output = end_when(view(&desktop, &folder, &lost), &[ENDED, "surface was lost"]);
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
    let output = end_when(view(&desktop, &folder, &["--hdr", "hdr10"]), &[ENDED, "no HDR10"]);
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
