//! A region of the picture that is traced alone, in the real window: dragged, saved, released.

use std::path::{Path, PathBuf};
use std::process::Child;
use std::time::{Duration, Instant};

use pointillist::image::compare::{Measured, z_test};
use pointillist::image::exr;

use crate::support::desktop::Desktop;
use crate::viewer::{Listened, PATIENCE, folder, program, scene, view, view_as_gpu};

/// Side of the picture, and the region's corner and side: multiples of the coarsest internal resolution.
const SIDE: usize = 96;
const CORNER: usize = 24;
const PART: usize = 40;

const CTRL: u32 = 0xffe3;
const SHIFT: u32 = 0xffe1;

/// What an EXR file says: the mean luminance with its variance, all channels as they are, and the weights of the camera samples.
struct Saved {
    measured: Measured,
    channels: Vec<Vec<u32>>,
    weights: Vec<f32>,
}

fn read(path: &Path) -> Saved {
    let layers = exr::read(path).unwrap();
    let channel = |name: &str| {
        let (_, values) = layers.channels.iter().find(|(channel, _)| channel == name).unwrap();
        values.clone()
    };
    let [r, g, b, variance] = ["R", "G", "B", "variance.Y"].map(channel);
    let mean = r.iter().zip(&g).zip(&b).map(|((r, g), b)| f64::from(0.2126 * r + 0.7152 * g + 0.0722 * b));
    let measured = Measured {
        width: layers.width,
        height: layers.height,
        mean: mean.collect(),
        variance: variance.iter().map(|v| f64::from(*v)).collect(),
    };
    let channels = layers.channels.iter().map(|(_, values)| values.iter().map(|v| v.to_bits()).collect());
    Saved { measured, channels: channels.collect(), weights: channel("camera.W") }
}

fn is_inside(i: usize) -> bool {
    let part = CORNER..CORNER + PART;
    part.contains(&(i % SIDE)) && part.contains(&(i / SIDE))
}

/// The pixels of the region.
fn crop(of: &Measured) -> Measured {
    let part = |values: &[f64]| (0..SIDE * SIDE).filter(|i| is_inside(*i)).map(|i| values[i]).collect();
    Measured { width: PART, height: PART, mean: part(&of.mean), variance: part(&of.variance) }
}

/// Mean weight of the camera samples inside and outside.
fn weights(saved: &Saved) -> [f32; 2] {
    [true, false].map(|inside| {
        let part: Vec<f32> =
            (0..SIDE * SIDE).filter(|i| is_inside(*i) == inside).map(|i| saved.weights[i]).collect();
        part.iter().sum::<f32>() / part.len() as f32
    })
}

/// Outside nothing changes, bit for bit; inside there are soon many more samples, and their mean is that of another render. After it is
/// released the region keeps them. With two streams, whose MIS weights are others in a region.
#[test]
fn a_dragged_region_gets_all_samples_and_changes_nothing_else() {
    drag_region("region", view);
}

/// The same where the device sums, beside the loop.
#[test]
fn a_dragged_region_of_a_gpu_gets_all_samples_and_changes_nothing_else() {
    drag_region("region-gpu", view_as_gpu);
}

fn drag_region(name: &str, view: impl Fn(&Desktop, &Path, &[&str]) -> Child) {
    let (desktop, folder) = (Desktop::start(300, 300), folder(name));
    let size = format!("{SIDE}x{SIDE}");
    let common = ["--size", &size, "--integrator", "bidirectional", "--vm", "1"];
    let of_view = ["--samples", "60000", "--denoise", "off", "--no-panel"];
    let mut viewer = Listened::new(view(&desktop, &folder, &[&common[..], &of_view].concat()));
    viewer.wait_for("the render has ended");
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    assert!(desktop.focus(window, PATIENCE));
    let save = |viewer: &mut Listened, name: &str| -> PathBuf {
        desktop.key(u32::from('e'), true);
        desktop.key(u32::from('e'), false);
        viewer.wait_for(&format!("saved {name}"));
        folder.join(name)
    };
    let before = read(&save(&mut viewer, "cornell-001.exr"));
    for key in [CTRL, SHIFT] {
        desktop.key(key, true);
    }
    let to = |x: usize, y: usize| desktop.pointer(x as i32, y as i32);
    to(CORNER, CORNER);
    desktop.button(1, true);
    for step in 1..=4 {
        to(CORNER + PART * step / 4, CORNER + PART * step / 4);
        std::thread::sleep(Duration::from_millis(20));
    }
    desktop.button(1, false);
    for key in [SHIFT, CTRL] {
        desktop.key(key, false);
    }
    viewer.wait_for("only 40×40 pixels are traced");
    let start = Instant::now();
    let mut number = 2;
    let traced = loop {
        let saved = read(&save(&mut viewer, &format!("cornell-{number:03}.exr")));
        let [inside, outside] = weights(&saved);
        if inside > 8.0 * outside {
            break saved;
        }
        assert!(start.elapsed() < PATIENCE, "{inside} samples per pixel of the region, {outside} outside");
        std::thread::sleep(Duration::from_millis(300));
        number += 1;
    };
    desktop.key(CTRL, true);
    desktop.key(u32::from('b'), true);
    desktop.key(u32::from('b'), false);
    desktop.key(CTRL, false);
    viewer.wait_for("the whole picture is traced again");
    let released = read(&save(&mut viewer, &format!("cornell-{:03}.exr", number + 1)));
    assert!(viewer.terminate().status.success());
    for after in [&traced, &released] {
        for (channel, known) in after.channels.iter().zip(&before.channels) {
            assert!((0..SIDE * SIDE).all(|i| is_inside(i) || channel[i] == known[i]));
        }
    }
    assert!(weights(&released)[0] >= weights(&traced)[0]);
    let reference = folder.join("reference.exr");
    let mut render = program();
    render
        .arg("render")
        .arg(scene())
        .args(common)
        .args(["--seed", "77", "--spp", "64", "--device", "cpu", "-q"]);
    assert!(render.arg("-o").arg(&reference).status().unwrap().success());
    let reference = crop(&read(&reference).measured);
    for (name, saved) in [("before", &before), ("traced", &traced), ("released", &released)] {
        let test = z_test(&crop(&saved.measured), &reference, 0.01).unwrap();
        println!("{name}: {test:?}");
        // Stated variances are those of independent samples, so that z is smaller than it could be.
        assert!(test.accepted == 1.0 && test.mean_z2 < 1.3, "{name}: {test:?}");
        assert!((test.mean_ratio - 1.0).abs() < 4.0 * test.mean_ratio_error, "{name}: {test:?}");
    }
    let variance = |of: &Saved| crop(&of.measured).variance.iter().sum::<f64>();
    assert!(variance(&traced) < 0.2 * variance(&before));
    std::fs::remove_dir_all(folder).unwrap();
}
