//! Two eyes in the real window: switched on and off, composed in other layouts, and found under the pointer.

use std::path::Path;

use crate::support::desktop::Desktop;
use crate::viewer::{Listened, PATIENCE, end, figures, folder, png, program, scene, view, words};
use pointillist::image::{Attribute, exr};

const CTRL: u32 = 0xffe3;

const ENDED: &str = "the render has ended";

fn press(desktop: &Desktop, key: char) {
    [true, false].into_iter().for_each(|down| desktop.key(u32::from(key), down));
}

fn press_ctrl(desktop: &Desktop, key: char) {
    desktop.key(CTRL, true);
    press(desktop, key);
    desktop.key(CTRL, false);
}

/// Mean signal of the columns from `from` to `to` of a picture of this width.
fn mean(rgb: &[u8], width: usize, from: usize, to: usize) -> f64 {
    let row = |row: &[u8]| row[3 * from..3 * to].iter().map(|c| f64::from(*c)).sum::<f64>();
    let sum: f64 = rgb.chunks_exact(3 * width).map(row).sum();
    sum / (rgb.len() as f64 * (to - from) as f64 / width as f64)
}

/// The picture of two eyes is twice as wide, and shows the scene from two places; with one eye again it is what it was. Another layout is the
/// same samples: the render does not begin anew.
#[test]
fn two_eyes_are_switched_on_composed_and_switched_off() {
    let (desktop, folder) = (Desktop::start(400, 300), folder("stereo"));
    let options = ["--size", "96x64", "--samples", "100000", "--integrator", "path", "--no-panel"];
    let options = [&options[..], &["--json", "figures.json"]].concat();
    let mut viewer = Listened::new(view(&desktop, &folder, &options));
    viewer.wait_for(ENDED);
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    assert!(desktop.focus(window, PATIENCE));
    let save = |viewer: &mut Listened, number: usize| {
        press(&desktop, 'p');
        let name = format!("cornell-{number:03}.png");
        viewer.wait_for(&format!("saved {name}"));
        png(&folder.join(name))
    };
    press_ctrl(&desktop, 'e');
    viewer.wait_for_times(ENDED, 2);
    let (width, height, both) = save(&mut viewer, 1);
    assert_eq!((width, height), (192, 64));
    let [left, right] = [mean(&both, 192, 0, 96), mean(&both, 192, 96, 192)];
    assert!(left > 20.0 && (left / right - 1.0).abs() < 0.1, "{left} {right}");
    let is_same = |row: &[u8]| row[..3 * 96] == row[3 * 96..];
    assert!(!both.chunks_exact(3 * 192).any(is_same), "the right eye's picture is a copy of the left one's");
    for (number, layout, size) in [(2, "Side by side, half width", (96, 64)), (3, "Over/under", (96, 128))] {
        press(&desktop, 'y');
        viewer.wait_for(layout);
        let (width, height, _) = save(&mut viewer, number);
        assert_eq!((width, height), size, "{layout}");
    }
    // The list ends without a layer for each eye, which surfaces of X windows do not have here, and begins again.
    (0..10).for_each(|_| press(&desktop, 'y'));
    viewer.wait_for("Checkerboard");
    viewer.wait_for_times("Side by side", 2);
    assert_eq!(viewer.times("maxImageArrayLayers"), 0);
    assert_eq!(viewer.times(ENDED), 2, "a layout traces nothing");
    // What sees one eye is refused by its name.
    for (key, what) in [('b', "a region"), ('l', "a light mix")] {
        press_ctrl(&desktop, key);
        viewer.wait_for(&format!("{what} goes with one eye only"));
    }
    press(&desktop, 'k');
    viewer.wait_for("a comparison goes with one eye only");
    // An EXR file has the sums of both eyes.
    press(&desktop, 'e');
    viewer.wait_for("saved cornell-001.exr");
    let [left, right] = views(&folder.join("cornell-001.exr"));
    for view in [&left, &right] {
        assert_eq!((view.width, view.height), (96, 64));
        assert!(view.channel("camera.Y").is_some() && view.channel("variance.camera").is_some());
    }
    assert_ne!(left.channel("camera.Y"), right.channel("camera.Y"));
    press_ctrl(&desktop, 'e');
    viewer.wait_for("the picture is that of one eye");
    viewer.wait_for_times(ENDED, 3);
    let (width, height, _) = save(&mut viewer, 4);
    assert_eq!((width, height), (96, 64));
    assert!(viewer.terminate().status.success());
    let figures = figures(&folder);
    assert_eq!(figures["epochs"], 3, "{figures:#}");
    assert_eq!(figures["validation_messages"], 0, "{figures:#}");
    std::fs::remove_dir_all(folder).unwrap();
}

/// The views of both eyes in an EXR file.
fn views(path: &Path) -> [exr::Layers; 2] {
    let file = exr::read(path).unwrap();
    ["left", "right"].map(|view| file.view(view).unwrap())
}

/// Each eye's picture is denoised by itself and has an error of its own, which the files and the figures hold; noise masking reads the variance of
/// both.
#[test]
fn each_eye_is_filtered_and_has_an_error() {
    let (desktop, folder) = (Desktop::start(400, 300), folder("stereo-filter"));
    let options =
        ["--size", "64x64", "--samples", "400000", "--integrator", "path", "--no-panel", "--vm", "0.5"];
    let of_eyes = [
        "--stereo",
        "--interocular",
        "2",
        "--denoise",
        "wavelet",
        "--json",
        "figures.json",
        "-o",
        "eyes.exr",
        "-o",
        "eyes.png",
    ];
    let mut viewer = Listened::new(view(&desktop, &folder, &[&options[..], &of_eyes].concat()));
    viewer.wait_for(ENDED);
    let output = viewer.terminate();
    assert!(output.status.success(), "{}", words(&output));
    let seen = views(&folder.join("eyes.exr"));
    let rgb = |view: &exr::Layers, layer: &str| {
        ["R", "G", "B"].map(|c| view.channel(&format!("{layer}{c}")).unwrap().to_vec()).concat()
    };
    let distance = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>();
    for (own, other) in [(0, 1), (1, 0)] {
        let denoised = rgb(&seen[own], "denoised.");
        let [to_own, to_other] = [own, other].map(|eye| distance(&denoised, &rgb(&seen[eye], "")));
        assert!(to_own > 0.0 && to_own < 0.8 * to_other, "eye {own}: {to_own} {to_other}");
        let Some(Attribute::Text(error)) = seen[own].attribute("error") else { panic!("no error is stated") };
        assert!(error.contains("in 95 % of the picture"), "{error}");
    }
    let (width, height, both) = png(&folder.join("eyes.png"));
    assert_eq!((width, height), (128, 64));
    let [left, right] = [mean(&both, 128, 0, 64), mean(&both, 128, 64, 128)];
    assert!(left > 20.0 && (left / right - 1.0).abs() < 0.15, "{left} {right}");
    let figures = figures(&folder);
    let p95 = |of: &str| figures["eyes"][of]["p95"]["value"].as_f64().unwrap();
    let [left, right, both] = ["left", "right", "both"].map(p95);
    assert!(
        left > 0.001 && right < 0.5 && (left.min(right)..=left.max(right)).contains(&both),
        "{figures:#}"
    );
    assert!(figures.get("error").is_none());
    // Every path counts once for each eye.
    for eye in ["left", "right"] {
        let curve = figures["eyes"][eye]["curve"].as_array().unwrap();
        assert_eq!(curve[curve.len() - 1][1].as_f64(), Some(400_000.0), "{eye}");
    }
    assert_eq!(figures["validation_messages"], 0, "{figures:#}");
    std::fs::remove_dir_all(folder).unwrap();
}

/// The distances at which the eyes were told to converge.
fn distances(said: &str) -> Vec<f64> {
    let parts = said.split("the eyes converge at a distance of ").skip(1);
    parts.map(|part| part.split(' ').next().unwrap().parse().unwrap()).collect()
}

/// The pointer finds the wall at the back of the box in the pictures of both eyes. Other eyes begin another epoch.
#[test]
fn the_pointer_finds_the_same_point_in_both_pictures() {
    let (desktop, folder) = (Desktop::start(400, 300), folder("stereo-pointer"));
    let options = ["--size", "96x96", "--samples", "50000", "--integrator", "path", "--no-panel"];
    let of_eyes = ["--stereo", "--interocular", "0.05", "--json", "figures.json"];
    let mut viewer = Listened::new(view(&desktop, &folder, &[&options[..], &of_eyes].concat()));
    viewer.wait_for(ENDED);
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    assert!(desktop.focus(window, PATIENCE));
    // Both pictures, of 192×96 pixels, are shown at half of their size in the middle of the window.
    let converge = |viewer: &mut Listened, (x, y), times: usize| {
        desktop.pointer(x, y);
        press(&desktop, 'v');
        viewer.wait_for_times("the eyes converge at a distance of", times);
    };
    // The floor, and the wall at the back in both pictures.
    converge(&mut viewer, (24, 68), 1);
    viewer.wait_for_times(ENDED, 2);
    converge(&mut viewer, (24, 36), 2);
    viewer.wait_for_times(ENDED, 3);
    converge(&mut viewer, (72, 36), 3);
    desktop.pointer(24, 8);
    press(&desktop, 'v');
    viewer.wait_for("there is no picture here");
    let output = viewer.terminate();
    assert!(output.status.success());
    let [of_floor, of_left, of_right] = distances(&words(&output))[..] else { panic!("{}", words(&output)) };
    assert!(of_floor < 10.0, "{of_floor}");
    assert!((of_left - 13.6).abs() < 0.1 && (of_right - 13.6).abs() < 0.1, "{of_left} {of_right}");
    let figures = figures(&folder);
    assert_eq!(figures["stereo"]["interocular"], 0.05, "{figures:#}");
    assert_eq!(figures["validation_messages"], 0, "{figures:#}");
    std::fs::remove_dir_all(folder).unwrap();
}

/// Surfaces of X windows have images of one layer here. The line that refuses a layer for each eye names that limit, and another layout.
#[test]
fn a_layer_for_each_eye_is_refused_where_there_is_one() {
    let (desktop, folder) = (Desktop::start(400, 300), folder("stereo-layers"));
    let output = end(view(&desktop, &folder, &["--size", "96x64", "--stereo", "swapchain"]));
    assert!(!output.status.success());
    // Without the margin of a report's lines.
    let said = words(&output).replace('│', " ").split_whitespace().collect::<Vec<_>>().join(" ");
    for part in ["swapchain", "has at most 1", "maxImageArrayLayers", "another layout"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert!(!said.contains("panicked"), "{said}");
    std::fs::remove_dir_all(folder).unwrap();
}

/// What two eyes do not go with is an error before anything is opened.
#[test]
fn options_of_one_eye_are_refused() {
    let refused = |options: &[&str]| {
        let output = program().arg("view").arg(scene()).arg("--stereo").args(options).output().unwrap();
        assert!(!output.status.success(), "{options:?}");
        words(&output)
    };
    assert!(refused(&["--deterministic"]).contains("not rasterised in index order"));
    assert!(refused(&["--tev", "localhost:14158"]).contains("tev is shown one eye"));
}
