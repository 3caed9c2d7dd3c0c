//! Renders that are interrupted, and renders in pieces: the picture is that of one uninterrupted run.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// A folder of this test's own, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("state").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn command(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(args);
    command
}

fn output(args: &[&str]) -> Output {
    command(args).output().unwrap()
}

#[track_caller]
pub(super) fn runs(args: &[&str]) -> String {
    let output = output(args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The command fails with one error, in which these words stand.
#[track_caller]
fn fails(args: &[&str], wanted: &str) {
    let output = output(args);
    let error = String::from_utf8_lossy(&output.stderr).replace("\n  │ ", " ").replace("\n        ", " ");
    assert!(
        !output.status.success() && error.contains(wanted) && !error.contains("panicked"),
        "{args:?}: {error}"
    );
}

#[track_caller]
pub(super) fn same(a: &Path, b: &Path) {
    assert!(
        std::fs::read(a).unwrap() == std::fs::read(b).unwrap(),
        "{} and {} differ",
        a.display(),
        b.display()
    );
}

const SCENE: [&str; 3] = ["scenes/cornell.xml", "--size", "64x64"];

fn with<'a>(subcommand: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [subcommand].iter().chain(&SCENE).chain(more).copied().collect()
}

/// Killed twice and gone on with, a render has the bytes of one that was let run; at most the time between two states is lost.
#[test]
fn a_killed_render_goes_on_where_its_state_ends() {
    let place = folder("killed");
    let name = |name: &str| place.join(name).display().to_string();
    let (state, whole, resumed) = (name("a.state"), name("whole.exr"), name("resumed.exr"));
    runs(&with("render", &["--spp", "60", "--device", "cpu", "--deterministic", "-o", &whole, "--quiet"]));
    let first = with("render", &["--spp", "60", "--state", &state, "--state-every", "0.05", "-o", &resumed]);
    let next = ["render", "--resume", &state, "--state-every", "0.05", "-o", &resumed];
    for args in [&first[..], &next[..]] {
        let mut run = command(args).stderr(Stdio::null()).spawn().unwrap();
        let before = std::fs::metadata(&state).ok().and_then(|meta| meta.modified().ok());
        let deadline = Instant::now() + Duration::from_secs(60);
        while Instant::now() < deadline && run.try_wait().unwrap().is_none() {
            let now = std::fs::metadata(&state).ok().and_then(|meta| meta.modified().ok());
            if now != before {
                break;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        run.kill().unwrap();
        run.wait().unwrap();
        assert!(runs(&["info", &state]).contains("indices: 0–"));
    }
    runs(&["render", "--resume", &state, "-o", &resumed, "--quiet"]);
    same(whole.as_ref(), resumed.as_ref());
    // Further than was asked for at first, and back in one.
    let more = name("more.exr");
    runs(&["render", "--resume", &state, "--spp", "70", "-o", &more, "--quiet"]);
    runs(&with("render", &["--spp", "70", "--device", "cpu", "--deterministic", "-o", &whole, "--quiet"]));
    same(whole.as_ref(), more.as_ref());
}

/// A render that stops at an error stops at the same path when it was interrupted.
#[test]
fn an_error_is_reached_at_the_same_path_after_an_interruption() {
    let place = folder("error");
    let name = |name: &str| place.join(name).display().to_string();
    let (state, whole, resumed) = (name("a.state"), name("whole.exr"), name("resumed.exr"));
    let goal = ["--error", "8%", "--quiet"];
    let paths = |args: &[&str]| {
        let report: Value = serde_json::from_str(&runs(&[args, &["--json=-"]].concat())).unwrap();
        report["camera_paths"].as_u64().unwrap()
    };
    let one = paths(&[&with("render", &["--state", &name("b.state"), "-o", &whole])[..], &goal].concat());
    let mut run = command(
        &[&with("render", &["--state", &state, "--state-every", "0.05", "-o", &resumed])[..], &goal].concat(),
    )
    .stderr(Stdio::null())
    .spawn()
    .unwrap();
    let deadline = Instant::now() + Duration::from_secs(60);
    while Instant::now() < deadline && !Path::new(&state).exists() {
        std::thread::sleep(Duration::from_millis(2));
    }
    run.kill().unwrap();
    run.wait().unwrap();
    let two = paths(&["render", "--resume", &state, "-o", &resumed, "--quiet"]);
    assert_eq!(one, two);
    same(whole.as_ref(), resumed.as_ref());
}

/// The merge of parts, by any method, is the picture of one run, also through a merged state.
#[test]
fn parts_become_the_picture_of_one_run() {
    for (method, of) in [("path", 3), ("bidirectional", 4), ("light", 2), ("photon", 2)] {
        let place = folder(method);
        let name = |name: &str| place.join(name).display().to_string();
        let settings = ["--spp", "8", "--integrator", method, "--quiet"];
        let (exr, png) = (name("whole.exr"), name("whole.png"));
        let whole = ["--device", "cpu", "--deterministic", "-o", &exr, "-o", &png];
        runs(&[&with("render", &settings)[..], &whole].concat());
        let parts: Vec<String> = (1..=of).map(|number| name(&format!("{number}.state"))).collect();
        for (number, part) in (1..=of).zip(&parts) {
            let (number, of) = (number.to_string(), of.to_string());
            let share = ["--of", &of, "--number", &number, "-o", part, "--threads", &number];
            runs(&[&with("shard", &settings)[..], &share].concat());
        }
        let backwards: Vec<&str> = parts.iter().rev().map(String::as_str).collect();
        let (half, merged, shown) = (name("half.state"), name("merged.exr"), name("merged.png"));
        runs(&[&["merge"][..], &backwards[..1], &["-o", &half, "--quiet"]].concat());
        let rest =
            [&["merge", &half][..], &backwards[1..], &["-o", &merged, "-o", &shown, "--quiet"]].concat();
        runs(&rest);
        same(exr.as_ref(), merged.as_ref());
        same(png.as_ref(), shown.as_ref());
        // A part that is complete is left alone.
        let before = std::fs::metadata(&parts[0]).unwrap().len();
        let again = ["--of", &of.to_string(), "--number", "1", "-o", &parts[0]].map(String::from);
        let again: Vec<&str> = again.iter().map(String::as_str).collect();
        runs(&[&with("shard", &settings)[..], &again].concat());
        assert_eq!(std::fs::metadata(&parts[0]).unwrap().len(), before);
    }
}

/// The error of what is shown through the noise filter is stated of parts and of renders that go on, about as it is of one render.
#[test]
fn the_error_of_filtered_pictures_is_known_of_parts() {
    let place = folder("filtered");
    let name = |name: &str| place.join(name).display().to_string();
    let stated = |args: &[&str]| -> Option<f64> {
        let picture = name("out.png");
        let more = ["--denoise", "wavelet", "-o", &picture, "--quiet", "--json=-"];
        let report: Value = serde_json::from_str(&runs(&[args, &more].concat())).unwrap();
        report["error"]["denoised"]["rel_mse"]["value"].as_f64()
    };
    let settings = ["--spp", "32", "--integrator", "path"];
    let whole = stated(&with("render", &settings)).unwrap();
    let parts: Vec<String> = (1..=3).map(|number| name(&format!("{number}.state"))).collect();
    for (number, part) in ["1", "2", "3"].iter().zip(&parts) {
        let share = ["--of", "3", "--number", number, "-o", part, "--quiet"];
        runs(&[&with("shard", &settings)[..], &share].concat());
    }
    let merge: Vec<&str> = ["merge"].into_iter().chain(parts.iter().map(String::as_str)).collect();
    let merged = stated(&merge).unwrap();
    let (state, half) = (name("half.state"), name("half.png"));
    let begun = ["--spp", "16", "--integrator", "path", "--state", &state, "-o", &half, "--quiet"];
    runs(&with("render", &begun));
    let resumed = stated(&["render", "--resume", &state, "--spp", "32"]).unwrap();
    for other in [merged, resumed] {
        assert!((0.6..1.6).contains(&(other / whole)), "{whole}, {merged}, {resumed}");
    }
    // In whatever number and order parts come, and the file has the same bytes.
    let ninths: Vec<String> = (1..=9).map(|number| name(&format!("ninth{number}.state"))).collect();
    for (number, part) in (1..=9).zip(&ninths) {
        let number = number.to_string();
        let share = ["--of", "9", "--number", &number, "-o", part, "--quiet"];
        runs(&[&with("shard", &settings)[..], &share].concat());
    }
    let [there, back] = ["there.exr", "back.exr"].map(name);
    let merge = |parts: Vec<&str>, file: &str| stated(&[&["merge"][..], &parts[..], &["-o", file]].concat());
    let forwards = merge(ninths.iter().map(String::as_str).collect(), &there);
    let backwards = merge(ninths.iter().rev().map(String::as_str).collect(), &back);
    assert!(forwards.is_some() && backwards.is_some(), "{forwards:?}, {backwards:?}");
    same(there.as_ref(), back.as_ref());
    let [one, one_state] = ["one.exr", "one.state"].map(name);
    stated(&with("render", &[&settings[..], &["--state", &one_state, "-o", &one]].concat()));
    same(there.as_ref(), one.as_ref());
    // A sixteenth more is too little to try the filter with.
    assert_eq!(stated(&["render", "--resume", &state, "--spp", "34"]), None);
}

/// What is missing, there twice, foreign or damaged is named and refused, or left out if that is asked for; the counts are then those of
/// what is there.
#[test]
fn parts_that_do_not_belong_are_named() {
    let place = folder("foreign");
    let name = |name: &str| place.join(name).display().to_string();
    let part = |file: &str, number: &str, more: &[&str]| {
        let file = name(file);
        let share = ["--spp", "4", "--of", "3", "--number", number, "-o", &file, "--quiet"];
        runs(&[&with("shard", more)[..], &share].concat());
        file
    };
    let [one, two, three] = ["1", "2", "3"].map(|number| part(&format!("{number}.state"), number, &[]));
    let seed = part("seed.state", "2", &["--seed", "9"]);
    let picture = name("picture.exr");
    let size = name("size.state");
    runs(&[
        "shard", SCENE[0], "--size", "65x64", "--spp", "4", "--of", "3", "--number", "2", "-o", &size,
        "--quiet",
    ]);
    let broken = name("broken.state");
    let mut bytes = std::fs::read(&two).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&broken, bytes).unwrap();
    fails(&["merge", &one, &three, "-o", &picture], "parts of the picture are missing: 2 of 3");
    fails(&["merge", &one, &two, &one], "both hold the indices 0–");
    fails(&["merge", &one, &seed], "seed is 9 instead of 0");
    fails(&["merge", &one, &size], "is the state of another picture: film is");
    fails(&["merge", &one, &broken], "its checksum is not that of its bytes");
    fails(&["merge", &one, "scenes/cornell.xml"], "is not the state of a render");
    fails(&["merge", &one, "-o", &one], "it is one of the states to merge");
    fails(&["merge", &one, &name("none.state")], "cannot read");
    fails(&["render", "--resume", &one, "--seed", "3"], "--seed cannot be changed");
    fails(&[&with("render", &["--state", &one])[..], &["-o", &picture]].concat(), "exists already");
    fails(
        &[&with("render", &["--state", &name("c.state"), "--reweight-fireflies"])[..], &["-o", &picture]]
            .concat(),
        "--reweight-fireflies",
    );
    fails(
        &[&with("shard", &["--of", "3", "--number", "2"])[..], &["-o", &one]].concat(),
        "is the state of part 1 of 3",
    );
    assert!(!Path::new(&picture).exists());
    let json = runs(&[
        "merge",
        &broken,
        &one,
        &seed,
        &three,
        &one,
        "--allow-missing",
        "-o",
        &picture,
        "--json=-",
        "--quiet",
    ]);
    let report: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((report["states"].as_u64(), report["left_out"].as_array().unwrap().len()), (Some(2), 3));
    assert_eq!(report["missing_parts"], serde_json::json!([2]));
    let info = runs(&["info", &picture]);
    assert!(info.contains(&format!("cameraPaths: {}", report["camera_paths"])), "{info}");
    assert!(info.contains("stopped: "), "{info}");
    let wanted = runs(&["merge", &one, &two, &three, "--error", "1%"]);
    assert!(wanted.contains("times the samples") && wanted.contains("with --number 4 to"), "{wanted}");
}
