//! What makes the first second of a view readable: the noise filter, the last picture of another view, the exposure and the method.

use std::path::Path;
use std::process::Child;
use std::time::Duration;

use crate::support::desktop::Desktop;
use crate::viewer::{Listened, PATIENCE, end_when, figures, folder, png, spawn, terminate, viewer, words};

fn view(desktop: &Desktop, folder: &Path, scene: &str, options: &[&str]) -> Child {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(scene);
    let all = ["--size", "96x96", "--no-panel", "-o", "last.png", "-o", "last.exr", "--json", "figures.json"];
    spawn(viewer(desktop, folder).arg(scene).args(all).args(options))
}

/// Mean absolute difference of neighbouring pixels of the PNG, of 255.
fn roughness(folder: &Path) -> f64 {
    let (width, _, rgb) = png(&folder.join("last.png"));
    let row = 3 * width as usize;
    let differences = rgb.iter().zip(&rgb[row..]).map(|(a, b)| f64::from(a.abs_diff(*b)));
    differences.sum::<f64>() / rgb.len() as f64
}

/// Mean and roughness of the luminance in the EXR file.
fn sums(folder: &Path) -> [f64; 2] {
    let image = exr::prelude::read_first_flat_layer_from_file(folder.join("last.exr")).unwrap();
    let channel = |name: &str| image.layer_data.channel_data.list.iter().find(|c| c.name.eq(name)).unwrap();
    let values: Vec<_> = channel("G").sample_data.values_as_f32().map(f64::from).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let rough = values.windows(2).map(|pair| (pair[0] - pair[1]).abs()).sum::<f64>() / values.len() as f64;
    [mean, rough / mean]
}

/// The picture is shown through the noise filter unless that is turned off; the sums are the same either way.
#[test]
fn noise_is_filtered_in_the_picture_and_not_in_the_sums() {
    let desktop = Desktop::start(200, 200);
    let measured = ["wavelet", "off"].map(|denoise| {
        let folder = folder(denoise);
        let options = ["--samples", "18432", "--exposure", "1", "--integrator", "path", "--denoise", denoise];
        let output = end_when(view(&desktop, &folder, "cornell.xml", &options), &["the render has ended"]);
        assert!(output.status.success(), "{}", words(&output));
        let measured = (roughness(&folder), sums(&folder));
        std::fs::remove_dir_all(folder).unwrap();
        measured
    });
    let [(filtered, sums), (plain, others)] = measured;
    assert!(filtered < 0.7 * plain, "{filtered} and {plain}");
    for (a, b) in sums.into_iter().zip(others) {
        assert!((a - b).abs() < 0.02 * b, "{a} and {b}");
    }
}

/// After a move of the camera the last picture stands in for samples, unless that is turned off, and steers the first of them if asked to; files know nothing of it.
#[test]
fn the_last_picture_stands_in_for_samples() {
    let desktop = Desktop::start(200, 200);
    // Slow enough that there are few samples when the map is there.
    let all = ["--exposure", "1", "--integrator", "path", "--threads", "1"];
    for (options, wanted, steers) in
        [(&["--steer"][..], true, true), (&[], true, false), (&["--no-reproject", "--steer"], false, false)]
    {
        let folder = folder("move");
        let viewer = view(&desktop, &folder, "cornell.xml", &[&all[..], options].concat());
        desktop.find_picture("ointillist", PATIENCE).unwrap();
        // A picture of few samples is not worth keeping.
        std::thread::sleep(Duration::from_secs(2));
        desktop.pointer(48, 48);
        desktop.button(1, true);
        for x in [50, 54, 58, 62] {
            desktop.pointer(x, 48);
            std::thread::sleep(Duration::from_millis(200));
        }
        desktop.button(1, false);
        std::thread::sleep(Duration::from_secs(2));
        let output = terminate(viewer);
        assert!(output.status.success(), "{}", words(&output));
        let figures = figures(&folder);
        assert!(figures["epochs"].as_u64().unwrap() > 2, "{figures:#}");
        assert_eq!(figures["reprojections"].as_u64().unwrap() > 0, wanted, "{figures:#}");
        assert_eq!(figures["steered_epochs"].as_u64().unwrap() > 0, steers, "{figures:#}");
        assert_eq!(figures["validation_messages"], 0);
        std::fs::remove_dir_all(folder).unwrap();
    }
}

/// A file that names path tracing gives no order: the window begins with it, and changes to what suits the scene.
#[test]
fn the_window_chooses_the_method() {
    let desktop = Desktop::start(200, 200);
    for (options, wanted) in [(&[][..], "bidirectional"), (&["--integrator", "path"], "path")] {
        let folder = folder("method");
        let mut viewer = Listened::new(view(&desktop, &folder, "veach_door.xml", options));
        desktop.find("ointillist", PATIENCE).unwrap();
        match options.is_empty() {
            true => viewer.wait_for("auto: bidirectional"),
            // Long enough for a choice.
            false => std::thread::sleep(Duration::from_secs(3)),
        }
        let output = viewer.terminate();
        assert!(output.status.success(), "{}", words(&output));
        assert_eq!(figures(&folder)["integrator"], wanted, "{}", words(&output));
        std::fs::remove_dir_all(folder).unwrap();
    }
}

/// A scene that is dark without help is shown in a middle grey, and the number of it is in the picture's file.
#[test]
fn the_exposure_follows_the_light() {
    let desktop = Desktop::start(200, 200);
    let mean = |options: &[&str]| {
        let folder = folder("exposure");
        let all = [&["--integrator", "path", "--samples", "60000"][..], options].concat();
        let output = end_when(view(&desktop, &folder, "veach_plates.xml", &all), &["the render has ended"]);
        assert!(output.status.success(), "{}", words(&output));
        let (_, _, rgb) = png(&folder.join("last.png"));
        std::fs::remove_dir_all(folder).unwrap();
        rgb.iter().map(|byte| f64::from(*byte)).sum::<f64>() / rgb.len() as f64
    };
    let (dark, followed) = (mean(&["--exposure", "0.05"]), mean(&[]));
    // 18 % grey is 117 of 255 by a gamma of 2.2.
    assert!(dark < 60.0 && (90.0..150.0).contains(&followed), "{dark} and {followed}");
}
