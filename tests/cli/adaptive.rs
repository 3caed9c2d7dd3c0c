//! `render --adaptive`: the same bytes for any number of threads, what the report says, and what it does not go with.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use pointillist::image::exr;
use serde_json::Value;

/// A folder of this test's own, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("adaptive").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn run(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command.args(args).output().unwrap()
}

const SCENE: [&str; 8] =
    ["render", "scenes/cornell_spheres.xml", "--size", "64x48", "--device", "cpu", "--quiet", "--json=-"];

fn with<'a>(more: &[&'a str]) -> Vec<&'a str> {
    SCENE.iter().chain(more).copied().collect()
}

#[track_caller]
fn json(more: &[&str]) -> Value {
    let output = run(&with(more));
    assert!(output.status.success(), "{more:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let place = folder("threads");
    for method in ["path", "bidirectional", "photon"] {
        let render = |threads: &str, more: &[&str]| {
            let file = place.join(format!("{method}{threads}{}.exr", more.len())).display().to_string();
            let common = ["--spp", "24", "--deterministic", "--integrator", method, "--threads", threads];
            let report = json(&[&common[..], &["-o", &file], more].concat());
            (std::fs::read(file).unwrap(), report)
        };
        let (one, report) = render("1", &["--adaptive"]);
        for threads in ["2", "5"] {
            let (bytes, other) = render(threads, &["--adaptive"]);
            assert!(bytes == one, "{method}, {threads} threads");
            assert_eq!(
                (&other["camera_paths"], &other["adaptive"]),
                (&report["camera_paths"], &report["adaptive"])
            );
        }
        let (even, plain) = render("1", &[]);
        assert!(even != one && plain.get("adaptive").is_none(), "{method}");
        let density = report["adaptive"]["density"].as_array().unwrap();
        let [least, median, most] = [0, 1, 2].map(|i| density[i].as_f64().unwrap());
        assert!(
            (0.25..1.0).contains(&least) && least <= median && median <= most && most > 1.2,
            "{density:?}"
        );
        let pilot = report["adaptive"]["pilot_samples_per_pixel"].as_f64().unwrap();
        assert!((3.9..12.0).contains(&pilot), "{pilot}");
        // As many as asked for, in all.
        let [paths, wanted] = [&report, &plain].map(|report| report["camera_paths"].as_u64().unwrap());
        assert!(paths.abs_diff(wanted) < 8, "{paths} {wanted}");
    }
}

/// The file names the option, and holds no variance within pixels: that takes samples of equal weight.
#[test]
fn the_file_says_how_it_was_made() {
    let file = folder("file").join("a.exr").display().to_string();
    let common = ["--spp", "16", "-o", &file];
    let has = |channel: &str| exr::read(file.as_ref()).unwrap().channel(channel).is_some();
    for deterministic in [&["--deterministic"][..], &[]] {
        json(&[&common[..], deterministic, &["--adaptive"]].concat());
        assert!(has("camera.W") && !has("variance.Y") && !has("variance.camera"));
        let bytes = std::fs::read(&file).unwrap();
        assert!(bytes.windows(11).any(|part| part == b" --adaptive"));
        json(&[&common[..], deterministic].concat());
        assert!(has("variance.Y") && has("variance.camera"));
    }
}

/// Time and error end it, too; a render that ends within its pilot says so.
#[test]
fn time_and_error_end_it() {
    let file = folder("goals").join("a.png").display().to_string();
    let error = json(&["--error", "30%", "--adaptive", "--deterministic", "-o", &file]);
    assert_eq!(error["error"]["reached"], true);
    assert!(error["samples_per_pixel"].as_f64().unwrap() > 16.0 && error["adaptive"].is_object(), "{error}");
    let timed = json(&["--time", "1.5", "--adaptive", "-o", &file]);
    assert!(timed["adaptive"]["pilot_samples_per_pixel"].as_f64().unwrap() >= 3.9, "{timed}");
    let early = run(&with(&["--error", "200%", "--adaptive", "--deterministic", "-o", &file]));
    let said = String::from_utf8_lossy(&early.stderr);
    assert!(early.status.success() && said.contains("the render has ended before its pilot"), "{said}");
}

#[test]
fn what_it_does_not_go_with_is_an_error() {
    let cases: [(&[&str], &str); 12] = [
        (&["--spp", "15"], "needs 16 samples per pixel or more here"),
        (&["--samples", "2000"], "needs 16 samples per pixel or more here"),
        (&["--integrator", "light"], "`light` traces none"),
        (&["--replicates", "1"], "does not go with --replicates 1"),
        (&["--check-plan", ".1"], "does not go with --check-plan"),
        (&["--first-index", "8"], "does not go with --first-index"),
        (&["--reweight-fireflies"], "does not go with --reweight-fireflies"),
        (&["--vm", "1"], "does not go with --vm"),
        (&["--show", "camera-variance"], "does not go with --show"),
        (&["--deterministic", "--time", "1"], "does not go with --deterministic and --time"),
        (&["--state", "target/tmp/adaptive.state"], "a state cannot be kept with --adaptive"),
        (&["--integrator", "depth", "--spp", "1"], "needs 16 samples per pixel"),
    ];
    let place = folder("bad");
    let file = place.join("a.png").display().to_string();
    for (args, wanted) in cases {
        let output = run(&[&with(args)[..], &["--adaptive", "-o", &file]].concat());
        let said = String::from_utf8_lossy(&output.stderr).replace("\n  │ ", " ");
        assert!(
            !output.status.success() && said.contains(wanted) && said.contains("help:"),
            "{args:?}: {said}"
        );
    }
    // A pilot is whole chunks of both randomisations.
    let tiny = run(&[
        "render",
        "scenes/cornell.xml",
        "--size",
        "8x8",
        "--spp",
        "16",
        "--filter",
        "box",
        "--adaptive",
        "-o",
        &file,
    ]);
    let said = String::from_utf8_lossy(&tiny.stderr).replace("\n  │ ", " ");
    assert!(!tiny.status.success() && said.contains("needs 64 samples per pixel or more here"), "{said}");
    for subcommand in ["view", "shard", "serve"] {
        let output = run(&[subcommand, "scenes/cornell.xml", "--adaptive"]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && said.contains("unexpected argument '--adaptive'"), "{said}");
    }
    assert!(!Path::new(&file).exists());
}
