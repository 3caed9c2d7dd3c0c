//! The window states the error of its picture in its figures, computes it anew after a resize, and never stalls for it.

use std::path::Path;
use std::process::Child;
use std::time::Duration;

use crate::support::desktop::Desktop;
use crate::viewer::{PATIENCE, end_when, figures, folder, scene, spawn, terminate, viewer};
use pointillist::image::{Attribute, exr};

/// Opens the window with a log of predictions of its own.
fn view(desktop: &Desktop, folder: &Path, options: &[&str]) -> Child {
    spawn(viewer(desktop, folder).env("POINTILLIST_STATE", folder).arg(scene()).args(options))
}

const ENDED: &str = "the render has ended";

#[test]
fn the_figures_hold_the_error_and_the_log_the_predictions() {
    let folder = folder("error");
    let desktop = Desktop::start(300, 300);
    let options = ["--size", "96x96", "--samples", "500000", "--json", "figures.json"];
    let output = end_when(view(&desktop, &folder, &options), &[ENDED]);
    assert!(output.status.success());
    let error = figures(&folder)["error"].clone();
    let p95 = error["p95"]["value"].as_f64().unwrap();
    assert!(p95 > 0.001 && p95 < 0.5, "{error:#}");
    assert!(error["p95"]["low"].as_f64().unwrap() < p95 && error["p95"]["high"].as_f64().unwrap() > p95);
    assert_eq!((error["target"].as_f64(), error["quantile"].as_str()), (Some(0.01), Some("95 %")));
    let curve = error["curve"].as_array().unwrap();
    assert!(curve.len() >= 5 && curve[0][2].as_f64() > curve[curve.len() - 1][2].as_f64(), "{error:#}");
    // Every path is in the last look, whatever the thread was behind.
    assert_eq!(curve[curve.len() - 1][1].as_f64(), Some(500_000.0));
    let log = std::fs::read_to_string(folder.join("predictions.jsonl")).unwrap();
    assert!(log.lines().count() >= 1 && log.contains("\"target\":0.01"), "{log}");
    for line in log.lines() {
        let said: serde_json::Value = serde_json::from_str(line).unwrap();
        let [at, low, value, high] = ["at", "seconds/low", "seconds/value", "seconds/high"]
            .map(|name| said.pointer(&format!("/prediction/{name}")).and_then(|v| v.as_f64()).unwrap());
        assert!(at < value && low < value && value < high, "{line}");
        // The look at the end predicts too.
        assert!(said["ended"].as_f64().unwrap() >= at, "{line}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn one_randomisation_knows_no_error() {
    let folder = folder("no-error");
    let desktop = Desktop::start(300, 300);
    let options = ["--size", "64x64", "--samples", "100000", "--replicates", "1", "--json", "figures.json"];
    let output = end_when(view(&desktop, &folder, &options), &[ENDED]);
    assert!(output.status.success());
    assert!(figures(&folder)["error"].is_null());
    assert!(!folder.join("predictions.jsonl").exists());
    std::fs::remove_dir_all(folder).unwrap();
}

/// With a larger film of the same shape the epoch goes on, and its samples are counted again for the new film; a drag begins many epochs.
#[test]
fn the_error_is_that_of_the_picture_after_resizes_and_drags() {
    resize_and_drag("error-resize", "0");
}

/// The same where the device sums, beside the loop: first coarsely, then from the samples that were kept.
#[test]
fn the_error_is_that_of_the_picture_of_a_gpu_after_resizes_and_drags() {
    resize_and_drag("error-resize-gpu", "1");
}

fn resize_and_drag(name: &str, as_gpu: &str) {
    let folder = folder(name);
    let desktop = Desktop::start(400, 400);
    let options =
        ["--size", "64x64", "--no-panel", "--samples", "300000", "--json", "figures.json", "-o", "last.exr"];
    let mut command = viewer(&desktop, &folder);
    command.env("POINTILLIST_STATE", &folder).env("POINTILLIST_AS_GPU", as_gpu);
    let mut viewer = spawn(command.arg(scene()).args(options));
    let window = desktop.find_picture("ointillist", PATIENCE).unwrap();
    desktop.pointer(40, 40);
    desktop.button(1, true);
    for i in 0..60 {
        desktop.pointer(40 + i % 7, 40 + i % 5);
        std::thread::sleep(Duration::from_millis(16));
    }
    desktop.button(1, false);
    std::thread::sleep(Duration::from_millis(800));
    desktop.resize(window, 128, 128);
    assert!(desktop.focus(window, PATIENCE));
    std::thread::sleep(Duration::from_millis(500));
    [true, false].into_iter().for_each(|down| desktop.key(u32::from('n'), down));
    std::thread::sleep(Duration::from_secs(6));
    assert!(viewer.try_wait().unwrap().is_none());
    assert!(terminate(viewer).status.success());
    let figures = figures(&folder);
    assert!(figures["epochs"].as_u64().unwrap() > 5 && figures["validation_messages"] == 0, "{figures:#}");
    let curve = figures["error"]["curve"].as_array().unwrap();
    // In the look at the end all paths that the picture holds, each once; how many depends on the machine.
    let paths = curve[curve.len() - 1][1].as_f64().unwrap();
    let picture = exr::read(&folder.join("last.exr")).unwrap();
    let held = picture.attributes.iter().find(|(name, _)| name == "cameraPaths").unwrap();
    assert_eq!(held.1, Attribute::Number(paths), "{figures:#}");
    assert!(paths > 16_384.0 && paths <= 300_000.0, "{figures:#}");
    std::fs::remove_dir_all(folder).unwrap();
}
