//! `pointillist study`: a folder that grows, and what is made of it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("study_cli").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn study(place: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).env("POINTILLIST_STATE", place);
    let size: &[&str] = if args.contains(&"--size") { &[] } else { &["--size", "32x32"] };
    command.args(["study", "--device", "cpu"]).args(size).args(args).output().unwrap()
}

#[track_caller]
fn succeeds(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn json(folder: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join("study.json")).unwrap()).unwrap()
}

/// Parts can be measured one after another; a second run adds to the first, and a line that a crash has cut is no obstacle.
#[test]
fn a_study_grows_and_keeps_what_it_has() {
    let place = folder("grows");
    let out = place.join("cornell");
    let path = out.display().to_string();
    let common = ["scenes/cornell.xml", "--methods", "path,photon", "-o", &path];
    let text =
        succeeds(&study(&place, &[&common[..], &["--knobs", "methods,numeric", "--budget", "6"]].concat()));
    assert!(text.lines().count() <= 24 && text.contains("path"), "{text}");
    let first = json(&out);
    assert_eq!(first["methods"].as_array().unwrap().len(), 2);
    let points = |study: &Value| {
        study["methods"][0]["points"]
            .as_array()
            .unwrap()
            .iter()
            .map(|p| p["runs"].as_u64().unwrap())
            .sum::<u64>()
    };
    assert!(points(&first) >= 2 && first["numeric"].as_array().unwrap().len() == 2);
    // Nothing else was asked for.
    assert_eq!(first["missing"].as_array().map(Vec::len), Some(0));
    let commands = |study: &Value| study["command"].as_str().unwrap().lines().count();
    assert_eq!(commands(&first), 1);
    assert!(first["reference"]["rel_mse"].as_f64().unwrap() > 0.0);
    // Cut off while a line was written.
    let lines = out.join("measurements.jsonl");
    let mut torn = std::fs::read_to_string(&lines).unwrap();
    torn.push_str("{\"measured\":\"run\",\"meth");
    std::fs::write(&lines, torn).unwrap();
    let reference = std::fs::read(out.join("reference.exr")).unwrap();
    // Each part has a run of its own: on a slow machine the first might leave no time for the other.
    for (knobs, budget) in [("methods,effects", "8"), ("replicates", "4")] {
        succeeds(&study(&place, &[&common[..], &["--knobs", knobs, "--budget", budget]].concat()));
    }
    let second = json(&out);
    assert!(points(&second) > points(&first), "{} {}", points(&second), points(&first));
    assert_eq!(std::fs::read(out.join("reference.exr")).unwrap(), reference);
    assert_eq!(commands(&second), 3);
    let effects = second["effects"].as_array().unwrap();
    let wavelengths = effects.iter().find(|e| e["name"] == "wavelengths").unwrap();
    assert_eq!(wavelengths["on"].as_bool(), Some(true));
    assert!(wavelengths["time"]["value"].as_f64().unwrap() > 0.5 && wavelengths["loss"].as_f64().is_some());
    assert!(second["schemes"][0]["stated"]["value"].as_f64().unwrap() > 0.0);
    let page = std::fs::read_to_string(out.join("index.html")).unwrap();
    assert!(
        page.contains("data:image/png")
            && ["src=\"http", "href=\"http", "url(http", "@import"].iter().all(|net| !page.contains(net))
    );
    assert!(std::fs::read_to_string(out.join("study.csv")).unwrap().lines().count() > 3);
    // The page of all.
    let all = place.join("pages");
    let output = study(&place, &["--collect", place.to_str().unwrap(), "-o", all.to_str().unwrap()]);
    succeeds(&output);
    assert!(all.join("index.html").exists() && all.join("cornell.html").exists());
}

/// What was measured of one thing is not mixed with another.
#[test]
fn other_scenes_references_and_peers() {
    let place = folder("others");
    let out = place.join("one");
    let path = out.display().to_string();
    let short = ["--methods", "path", "--knobs", "methods", "--budget", "3", "-o", &path];
    succeeds(&study(&place, &[&["scenes/cornell.xml"], &short[..]].concat()));
    let refused = study(&place, &[&["scenes/furnace.xml"], &short[..]].concat());
    let errors = String::from_utf8_lossy(&refused.stderr).replace("\n  │ ", " ");
    assert!(!refused.status.success() && errors.contains("another scene"), "{errors}");
    // A picture of another program, here our own; and a reference that is given.
    let exr = out.join("reference.exr").display().to_string();
    let peer = format!("Other path=1.5:{exr}");
    let given = place.join("two").display().to_string();
    let args =
        ["scenes/cornell.xml", "--methods", "path", "--knobs", "methods", "--budget", "3", "-o", &given];
    succeeds(&study(&place, &[&args[..], &["--against", &exr, "--peer", &peer]].concat()));
    let study_json = json(Path::new(&given));
    let other = study_json["methods"].as_array().unwrap().iter().find(|m| m["peer"] == true).unwrap();
    assert_eq!(
        (other["name"].as_str(), other["points"][0]["seconds"].as_f64()),
        (Some("Other path"), Some(1.5))
    );
    assert_eq!(study_json["reference"]["made_by"].as_str(), Some("given"));
    // An earlier version of the program may have left one.
    let _ = std::fs::remove_dir_all(Path::new(env!("CARGO_MANIFEST_DIR")).join("target/tmp/study_cli/wrong"));
    let wrong = study(
        &place,
        &["scenes/cornell.xml", "--size", "16x16", "--against", &exr, "-o", "target/tmp/study_cli/wrong"],
    );
    let errors = String::from_utf8_lossy(&wrong.stderr).replace("\n  │ ", " ");
    assert!(!wrong.status.success() && errors.contains("has 32×32 pixels"), "{errors}");
}

/// Longer pictures need a longer reference; what was measured against the shorter one counts no more.
#[test]
fn much_more_time_makes_another_reference() {
    let place = folder("longer");
    let path = place.join("one").display().to_string();
    let run = |budget: &str| {
        let args = ["scenes/cornell.xml", "--methods", "path", "--knobs", "methods", "-o", &path];
        succeeds(&study(&place, &[&args[..], &["--budget", budget]].concat()));
        json(Path::new(&path))["reference"]["seconds"].as_f64().unwrap()
    };
    let short = run("2");
    assert!(run("12") > 2.0 * short);
}

/// A reference that is no number cannot be compared with; pixels of other programs that are none count as black.
#[test]
fn pixels_that_are_no_numbers_are_named() {
    use pointillist::image::exr::{Layers, write};
    let place = folder("nan");
    let file = place.join("nan.exr");
    let mut layers = Layers { width: 32, height: 32, ..Layers::default() };
    for name in ["R", "G", "B"] {
        layers.push(name, (0..1024).map(|i| if i == 70 { f32::NAN } else { 0.2 }));
    }
    write(&file, &layers).unwrap();
    let [file, path] = [file, place.join("one")].map(|path| path.display().to_string());
    let args =
        ["scenes/cornell.xml", "--methods", "path", "--knobs", "methods", "--budget", "3", "-o", &path];
    let refused = study(&place, &[&args[..], &["--against", &file]].concat());
    let errors = String::from_utf8_lossy(&refused.stderr).replace("\n  │ ", " ");
    assert!(!refused.status.success() && errors.contains("pixel 6, 2 is not finite"), "{errors}");
    let output = study(&place, &[&args[..], &["--peer", &format!("Other=1:{file}")]].concat());
    succeeds(&output);
    assert!(String::from_utf8_lossy(&output.stderr).contains("1 pixels are not finite"));
    let methods = json(Path::new(&path))["methods"].clone();
    let other = methods.as_array().unwrap().iter().find(|m| m["peer"] == true).unwrap();
    assert!(other["points"][0]["flip"]["value"].as_f64().is_some_and(|flip| flip > 0.0));
}
