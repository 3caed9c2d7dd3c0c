//! The window on tracers in other processes: the same picture as its own tracer makes, edits that reach all of them, and one that dies.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

use crate::support::desktop::Desktop;
use crate::viewer::{end, end_when, figures, folder, png, program, scene, spawn, viewer, words};

/// `pointillist serve`; dropping it kills it.
struct Tracer {
    process: Child,
    address: String,
}

impl Tracer {
    fn start(options: &[&str]) -> Self {
        let mut command = program();
        command.arg("serve").arg(scene()).args(["--listen", "127.0.0.1:0", "--threads", "1"]).args(options);
        let mut process = command.stderr(Stdio::piped()).spawn().unwrap();
        let mut said = BufReader::new(process.stderr.take().unwrap());
        let mut line = String::new();
        said.read_line(&mut line).unwrap();
        std::thread::spawn(move || std::io::copy(&mut said, &mut std::io::sink()));
        let address = line.split(" on ").nth(1).and_then(|rest| rest.split(',').next());
        let address = address.unwrap_or_else(|| panic!("no address: {line}")).to_owned();
        Self { process, address }
    }
}

impl Drop for Tracer {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Opens the window without naming the scene.
fn view(desktop: &Desktop, folder: &Path, options: &[&str]) -> Child {
    spawn(viewer(desktop, folder).env("POINTILLIST_STATE", folder.join("state")).args(options))
}

const ENDED: &str = "the render has ended";

/// Mean and mean square difference of two pictures of the same size, of 255.
fn difference(a: &Path, b: &Path) -> (f64, f64) {
    let ((width, height, a), other) = (png(a), png(b));
    assert_eq!((width, height), (other.0, other.1));
    let differences = a.iter().zip(&other.2).map(|(a, b)| f64::from(*a) - f64::from(*b));
    let n = a.len() as f64;
    let (sum, square) = differences.fold((0.0, 0.0), |(sum, square), d| (sum + d, square + d * d));
    (sum / n, square / n)
}

const OPTIONS: [&str; 14] = [
    "--size",
    "96x96",
    "--samples",
    "600000",
    "--exposure",
    "1",
    "--denoise",
    "off",
    "-o",
    "last.png",
    "--json",
    "figures.json",
    "--integrator",
    "path",
];

#[test]
fn the_picture_is_that_of_its_own_tracer() {
    let desktop = Desktop::start(300, 300);
    let [own, theirs] = ["own", "theirs"].map(|name| folder(&format!("elsewhere-{name}")));
    let output = end_when(crate::viewer::view(&desktop, &own, &OPTIONS), &[ENDED]);
    assert!(output.status.success(), "{}", words(&output));
    // Two tracers with short samples; the scene comes from the first.
    let tracers = [Tracer::start(&[]), Tracer::start(&[])];
    let connect = ["--connect", &tracers[0].address, "--connect", &tracers[1].address, "--compress", "on"];
    let output = end_when(view(&desktop, &theirs, &[&OPTIONS[..], &connect].concat()), &[ENDED]);
    assert!(output.status.success(), "{}", words(&output));
    let seen = figures(&theirs);
    assert_eq!(seen["tracers"].as_array().unwrap().len(), 2);
    assert!(seen["tracers"].as_array().unwrap().iter().all(|tracer| tracer["well"] == true), "{seen:#}");
    let (mean, square) = difference(&own.join("last.png"), &theirs.join("last.png"));
    assert!(mean.abs() < 0.5 && square < 40.0, "mean {mean}, mean square {square}");
    [own, theirs].iter().for_each(|folder| std::fs::remove_dir_all(folder).unwrap());
}

/// Camera moves reach both tracers. One is killed: the window says so and goes on with the other.
#[test]
fn edits_reach_all_tracers_and_one_may_die() {
    let desktop = Desktop::start(400, 400);
    let folder = folder("elsewhere-edits");
    let mut tracers = vec![Tracer::start(&[]), Tracer::start(&[])];
    let options = ["--size", "256x256", "--no-panel", "--json", "figures.json", "-o", "last.png"];
    let connect = ["--connect", &tracers[0].address, "--connect", &tracers[1].address];
    let viewer = view(&desktop, &folder, &[&options[..], &connect].concat());
    let window = desktop.find_picture("cornell", Duration::from_secs(60)).unwrap();
    for k in 0..6 {
        desktop.pointer(128, 128);
        desktop.button(1, true);
        desktop.pointer(128 + 10 * k, 128);
        std::thread::sleep(Duration::from_millis(150));
        desktop.button(1, false);
        if k == 3 {
            tracers.pop();
        }
        std::thread::sleep(Duration::from_millis(300));
    }
    assert!(desktop.pixels(window).is_some());
    let output = end_when(viewer, &["the picture stays"]);
    assert!(output.status.success(), "{}", words(&output));
    let seen = figures(&folder);
    assert!(seen["epochs"].as_u64().unwrap() > 2, "{seen:#}");
    assert!(seen["rasterised_samples"].as_u64().unwrap() > 1000, "{seen:#}");
    let well: Vec<bool> =
        seen["tracers"].as_array().unwrap().iter().map(|tracer| tracer["well"] == true).collect();
    assert_eq!(well, [true, false], "{seen:#}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn what_cannot_be_shown_is_an_error() {
    let desktop = Desktop::start(200, 200);
    let folder = folder("elsewhere-errors");
    let fails = |options: &[&str], wanted: &str| {
        let output = end(view(&desktop, &folder, options));
        let said = words(&output).replace("\n  │ ", " ");
        assert!(output.status.code() == Some(1) && said.contains(wanted), "{options:?}: {said}");
    };
    fails(&[], "there is no scene to show");
    fails(&["--connect", "127.0.0.1:1"], "cannot be fetched");
    fails(&["--connect", "127.0.0.1:1", "--deterministic"], "exclude each other");
    fails(&["--connect", "127.0.0.1:1", "--token-file", "no.such"], "cannot read no.such");
    std::fs::write(folder.join("short"), "secret\n").unwrap();
    fails(&["--connect", "127.0.0.1:1", "--token-file", "short"], "16 characters or more");
    std::fs::remove_dir_all(folder).unwrap();
}
