//! The real program on a display of its own: its window as seen from outside.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use glam::{DVec2, Vec2};
use pointillist::client::post_process::{PanoramaProjection, PanoramaView};

use crate::support::desktop::Desktop;
use crate::viewer::{
    Listened, PATIENCE, end, figures, folder, png, program, scene, terminate, view, view_of,
};

/// R, G, B of the window.
fn shot(desktop: &Desktop, window: u32) -> Option<(u32, u32, Vec<u8>)> {
    let (width, height, bgrx) = desktop.pixels(window)?;
    Some((width, height, bgrx.chunks_exact(4).flat_map(|p| [p[2], p[1], p[0]]).collect()))
}

const CTRL: u32 = 0xffe3;

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

/// The window after changes of camera and lens shows, bit for bit, what the scene that is saved from it renders to without a window; undone, it
/// shows the first picture again.
#[test]
fn a_saved_scene_renders_to_what_the_window_shows() {
    let folder = folder("saved");
    let options = ["--size", "128x96", "--samples", "60000", "--deterministic", "--integrator", "path"];
    let render = |scene: &Path, name: &str| {
        let mut command = program();
        command.current_dir(&folder).arg("render").arg(scene).args(options).args(["--quiet", "-o", name]);
        assert!(command.status().unwrap().success());
        png(&folder.join(name))
    };
    let desktop = Desktop::start(400, 300);
    let display = ["--no-panel", "--json", "figures.json"];
    let mut viewer = Listened::new(view(&desktop, &folder, &[&options[..], &display].concat()));
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    assert!(desktop.focus(window, PATIENCE));
    let shows = |wanted: &(u32, u32, Vec<u8>), what: &str| {
        let start = Instant::now();
        while shot(&desktop, window).as_ref() != Some(wanted) {
            assert!(start.elapsed() < PATIENCE, "the window does not show {what}");
            std::thread::sleep(Duration::from_millis(100));
        }
    };
    let press = |held: Option<u32>, key: char| {
        held.into_iter().for_each(|held| desktop.key(held, true));
        desktop.key(u32::from(key), true);
        desktop.key(u32::from(key), false);
        held.into_iter().for_each(|held| desktop.key(held, false));
        std::thread::sleep(Duration::from_millis(100));
    };
    let first = render(&scene(), "first.png");
    shows(&first, "the scene's picture");
    desktop.pointer(30, 30);
    desktop.button(1, true);
    for step in 1..=5 {
        desktop.pointer(30 + 3 * step, 30 + step);
        std::thread::sleep(Duration::from_millis(20));
    }
    desktop.button(1, false);
    press(None, ']');
    press(Some(CTRL), 's');
    viewer.wait_for("saved ");
    let mut saved = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let saved = saved.find(|path| path.extension().is_some_and(|ending| ending == "xml")).unwrap();
    let changed = render(&saved, "changed.png");
    assert!(changed != first, "the changes are seen");
    shows(&changed, "the saved scene's picture");
    press(Some(CTRL), 'z');
    press(Some(CTRL), 'z');
    shows(&first, "the first picture after undo");
    assert!(viewer.terminate().status.success());
    assert_eq!(figures(&folder)["validation_messages"], 0);
    std::fs::remove_dir_all(folder).unwrap();
}

/// A panorama opens as the view into it that `--look-around` writes without a window, bit for bit. An arrow turns the view, A shows the flat panorama
/// and the view again as it was left, and files are flat.
#[test]
fn a_panorama_is_looked_around_in() {
    const RIGHT: u32 = 0xff53;
    let folder = folder("panorama");
    let scene = folder.join("panorama.xml");
    let text = "<scene version=\"3.0.0\"><sensor type=\"spherical\"><film type=\"hdrfilm\"><integer name=\"width\" value=\"160\"/>\
                <integer name=\"height\" value=\"80\"/></film></sensor><emitter type=\"constant\"/><shape type=\"sphere\">\
                <point name=\"center\" x=\"1\" y=\"0.5\" z=\"3\"/><bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.7 0.3 0.1\"/>\
                </bsdf></shape></scene>";
    std::fs::write(&scene, text).unwrap();
    let options = ["--samples", "60000", "--deterministic", "--integrator", "path"];
    let render = |name: &str, more: &[&str]| {
        let mut command = program();
        command.current_dir(&folder).arg("render").arg(&scene).args(options).args(more);
        assert!(command.args(["--quiet", "-o", name]).status().unwrap().success());
        png(&folder.join(name))
    };
    let ahead = PanoramaView::ahead(PanoramaProjection::Spherical);
    let turned = ahead.turned(DVec2::new(-0.1, 0.0), Vec2::new(160.0, 80.0));
    let flat = render("flat.png", &[]);
    let [ahead, turned] =
        [ahead, turned].map(|view| render("view.png", &["--look-around", view.text().as_str()]));
    assert!(flat != ahead && ahead != turned);
    let desktop = Desktop::start(400, 300);
    let display = ["--no-panel", "-o", "window.png", "--json", "figures.json"];
    let all = [&options[..], &display].concat();
    let mut viewer = Listened::new(view_of(&scene, &desktop, &folder, &all));
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    assert!(desktop.focus(window, PATIENCE));
    let press = |key: u32| {
        desktop.key(key, true);
        desktop.key(key, false);
    };
    let shows = |wanted: &(u32, u32, Vec<u8>), what: &str| {
        let start = Instant::now();
        while shot(&desktop, window).as_ref() != Some(wanted) {
            assert!(start.elapsed() < PATIENCE, "the window does not show {what}");
            std::thread::sleep(Duration::from_millis(100));
        }
    };
    shows(&ahead, "the view ahead");
    press(RIGHT);
    shows(&turned, "the turned view");
    press(u32::from('p'));
    viewer.wait_for("saved panorama-001.png");
    press(u32::from('a'));
    shows(&flat, "the flat panorama");
    press(u32::from('a'));
    shows(&turned, "the view as it was left");
    assert!(viewer.terminate().status.success());
    for saved in ["panorama-001.png", "window.png"] {
        assert!(png(&folder.join(saved)) == flat, "{saved} is not the flat panorama");
    }
    assert_eq!(figures(&folder)["validation_messages"], 0);
    std::fs::remove_dir_all(folder).unwrap();
}

/// SIGUSR1, as it asks a render for a snapshot, saves the picture of a window, which goes on.
#[test]
fn a_signal_saves_the_picture() {
    let folder = folder("signal");
    let desktop = Desktop::start(300, 300);
    let mut viewer = view(&desktop, &folder, &["--size", "96x96", "--no-panel"]);
    desktop.find_picture("ointillist", PATIENCE).unwrap();
    let start = Instant::now();
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
    let window = desktop.find_picture("ointillist", PATIENCE).unwrap();
    assert!(desktop.focus(window, PATIENCE));
    for (width, height) in [(192, 192), (96, 160), (300, 200), (1, 1), (128, 128)] {
        desktop.resize(window, width, height);
        std::thread::sleep(Duration::from_millis(300));
        fill_window(&desktop);
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

/// Asks for a picture as large as the window.
fn fill_window(desktop: &Desktop) {
    [true, false].into_iter().for_each(|down| desktop.key(u32::from('n'), down));
}

/// While the window is resized the picture fills it as far as its shape lets it, and stays the same one, with the same samples. It is
/// made anew when that is asked for.
#[test]
fn a_resize_makes_no_film() {
    let folder = folder("steps");
    let desktop = Desktop::start(500, 400);
    let options = ["--size", "128x128", "--no-panel", "--samples", "100000", "--integrator", "path"];
    let outputs = ["-o", "last.png", "--json", "figures.json"];
    let options = [&options[..], &outputs].concat();
    let mut viewer = Listened::new(view(&desktop, &folder, &options));
    viewer.wait_for("the render has ended");
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    std::thread::sleep(Duration::from_millis(500));
    let mut filled = 0;
    for i in 1..=40 {
        desktop.resize(window, 128 + 4 * i, 128 + 2 * i);
        std::thread::sleep(Duration::from_millis(40));
        // The last row shows the picture's: the bright floor; beside it is nothing.
        let is_filled = |(width, height, rgb): (u32, u32, Vec<u8>)| {
            let last = &rgb[3 * (width * (height - 1)) as usize..];
            let bright: Vec<_> = last.chunks(3).map(|pixel| pixel.iter().any(|c| *c > 20)).collect();
            let beside = (width - height) as usize / 4;
            bright.iter().filter(|bright| **bright).count() > 60 && !bright[..beside].contains(&true)
        };
        filled += u32::from(shot(&desktop, window).is_some_and(is_filled));
    }
    std::thread::sleep(Duration::from_secs(1));
    assert!(viewer.terminate().status.success());
    let (width, height, _) = png(&folder.join("last.png"));
    assert_eq!((width, height), (128, 128));
    let seen = figures(&folder);
    assert_eq!((&seen["validation_messages"], &seen["resizes"]), (&0.into(), &0.into()), "{seen:#}");
    assert_eq!(seen["epochs"], 1, "{seen:#}");
    assert!(filled >= 10, "{filled} of 40 looks saw a picture up to the edge");
    std::fs::remove_dir_all(&folder).unwrap();
    std::fs::create_dir(&folder).unwrap();
    let mut viewer = Listened::new(view(&desktop, &folder, &options));
    viewer.wait_for("the render has ended");
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    desktop.resize(window, 288, 208);
    assert!(desktop.focus(window, PATIENCE));
    std::thread::sleep(Duration::from_millis(500));
    fill_window(&desktop);
    std::thread::sleep(Duration::from_secs(1));
    assert!(viewer.terminate().status.success());
    let (width, height, _) = png(&folder.join("last.png"));
    assert_eq!((width, height), (288, 208));
    assert_eq!(figures(&folder)["resizes"], 1);
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
