//! The real program on a display of its own: its window as seen from outside.

use std::process::Command;
use std::time::{Duration, Instant};

use crate::support::desktop::Desktop;
use crate::viewer::{PATIENCE, end, figures, folder, png, program, scene, terminate, view};

/// R, G, B of the window.
fn shot(desktop: &Desktop, window: u32) -> Option<(u32, u32, Vec<u8>)> {
    let (width, height, bgrx) = desktop.pixels(window)?;
    Some((width, height, bgrx.chunks_exact(4).flat_map(|p| [p[2], p[1], p[0]]).collect()))
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
    let viewer = view(&desktop, &folder, &all);
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    let start = Instant::now();
    let mut seen = shot(&desktop, window);
    while seen.as_ref() != Some(&wanted) && start.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(100));
        seen = shot(&desktop, window);
    }
    assert!(terminate(viewer).status.success());
    assert!(seen.unwrap() == wanted, "the window shows another picture than the headless PNG");
    assert!(png(&folder.join("window.png")) == wanted, "the picture written at the end is another one");
    assert_eq!(figures(&folder)["validation_messages"], 0);
    std::fs::remove_dir_all(folder).unwrap();
}

/// SIGUSR1, as it asks a render for a snapshot, saves the picture of a window, which goes on.
#[test]
fn a_signal_saves_the_picture() {
    let folder = folder("signal");
    let desktop = Desktop::start(300, 300);
    let mut viewer = view(&desktop, &folder, &["--size", "96x96", "--no-panel"]);
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    let start = Instant::now();
    // There is a picture once something in the window is bright.
    let is_bright = || shot(&desktop, window).is_some_and(|(_, _, rgb)| rgb.iter().any(|c| *c > 100));
    while !is_bright() && start.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(Command::new("kill").args(["-USR1", &viewer.id().to_string()]).status().unwrap().success());
    let saved = folder.join("cornell-001.png");
    while !saved.exists() && start.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(50));
    }
    assert_eq!(png(&saved).0, 96);
    assert!(viewer.try_wait().unwrap().is_none(), "the window has closed");
    assert!(terminate(viewer).status.success());
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn resizes_and_drags_leave_a_picture() {
    let folder = folder("drag");
    let desktop = Desktop::start(500, 400);
    let viewer = view(
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
    assert!(terminate(viewer).status.success());
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
    let viewer = view(&desktop, &folder, &["--size", "96x96", "-o", "last.png"]);
    desktop.find("ointillist", PATIENCE).unwrap();
    std::thread::sleep(Duration::from_secs(2));
    drop(desktop); // kills the X server
    let status = end(viewer).status;
    assert!(!status.success() && status.code().is_some(), "{status}");
    assert_eq!(png(&folder.join("last.png")).0, 96);
    std::fs::remove_dir_all(folder).unwrap();
}
