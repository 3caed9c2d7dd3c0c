//! The pictures of `golden/regress.toml` have not changed: the Cornell boxes, the furnace, and every scene of one plugin.
//!
//! `pointillist regress run` says so by statistics, and how small a change it would have found. A failing test never updates a reference:
//! `pointillist regress update tests/golden CASE --reason …` does, once the scene agrees with Mitsuba (`tests/mitsuba/regress.toml`).

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use std::path::{Path, PathBuf};
use std::process::Command;

use pointillist::regress::manifest::{MANIFEST, read_plan};
use serde_json::Value;

#[path = "support/place.rs"]
mod place;

fn manifest_folder() -> PathBuf {
    place::root().join("tests/golden")
}

/// A folder for one test, with nothing in it.
fn empty_folder(name: &str) -> PathBuf {
    let target = place::told("CARGO_TARGET_TMPDIR", env!("CARGO_TARGET_TMPDIR"));
    let folder = target.join("golden").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// What a run says.
struct Outcome {
    code: Option<i32>,
    cases: Vec<Value>,
    /// What it printed.
    text: String,
}

/// Runs the cases of a manifest on all cores. The first seed is given: what is tested here are the statistics, also where all bits are
/// those of the reference.
fn run(manifest: &Path, results: &Path, words: &[&str]) -> Outcome {
    let jobs = std::thread::available_parallelism().map_or(1, usize::from).to_string();
    std::fs::create_dir_all(results).unwrap();
    let report = results.join("report.json");
    let mut command =
        Command::new(place::told("CARGO_BIN_EXE_pointillist", env!("CARGO_BIN_EXE_pointillist")));
    command.args(["regress", "run", "--quiet", "--seed-base", "1000", "--jobs", &jobs]);
    command.arg(manifest).arg("--results").arg(results).arg("--json").arg(&report).args(words);
    let output = command.output().unwrap();
    let text =
        [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned()).concat();
    let cases = std::fs::read_to_string(&report).map_or_else(
        |_| Vec::new(),
        |json| serde_json::from_str::<Value>(&json).unwrap()["cases"].as_array().unwrap().clone(),
    );
    Outcome { code: output.status.code(), cases, text }
}

/// No picture has changed, every reference has a case, and a change of brightness as small as the manifest asks for would have been found.
#[test]
fn pictures_have_not_changed() {
    let manifest = manifest_folder();
    let plan = read_plan(&manifest, None).unwrap();
    let Outcome { code, cases, text } = run(&manifest, &empty_folder("results"), &[]);
    println!("{text}");
    assert_eq!(code, Some(0));
    assert_eq!(cases.len(), plan.cases.len());
    assert!(!text.contains("no case of this manifest is compared with"));
    for (case, planned) in cases.iter().zip(&plan.cases) {
        let wanted = planned.budget.detect.expect("every case says what is to be found");
        let found = case["judgement"]["detectable"].as_f64().unwrap();
        assert!(found <= wanted, "{}: only a change of {found} would have been found", planned.name);
    }
    // What was noticed before there was a manifest.
    for (name, wanted) in
        [("cornell", 0.004), ("cornell_spheres", 0.006), ("furnace", 0.002), ("bsdf_diffuse", 0.01)]
    {
        let planned = plan.cases.iter().find(|case| case.name == name).unwrap();
        assert!(planned.budget.detect.is_some_and(|detect| detect <= wanted), "{name} asks for less");
    }
}

/// Every scene of one plugin is a case, with the size and filter of its own.
#[test]
fn every_plugin_has_a_case() {
    let plan = read_plan(&manifest_folder(), None).unwrap();
    let files =
        std::fs::read_dir(place::root().join("scenes/plugins")).unwrap().map(|file| file.unwrap().path());
    let mut scenes = 0;
    for scene in files.filter(|path| path.extension().is_some_and(|e| e == "xml")) {
        let name = scene.file_stem().unwrap().to_str().unwrap();
        let case = plan.cases.iter().find(|case| case.name == name);
        let case = case.unwrap_or_else(|| panic!("{name} has no case"));
        assert!(case.scene.ends_with(format!("scenes/plugins/{name}.xml")) && case.size.is_none());
        scenes += 1;
    }
    assert!(scenes >= 70, "only {scenes} scenes");
}

/// An albedo of a face of the furnace that is 3 % too large is a change: judged as strictly as in the whole manifest.
#[test]
fn a_changed_albedo_is_found() {
    let (folder, root) = (empty_folder("planted"), place::root());
    let scene = std::fs::read_to_string(root.join("scenes/furnace.xml")).unwrap();
    let albedo = r#"name="top" value="0.75""#;
    assert!(scene.contains(albedo));
    std::fs::write(folder.join("furnace.xml"), scene.replace(albedo, r#"name="top" value="0.7725""#))
        .unwrap();
    let manifest = std::fs::read_to_string(manifest_folder().join(MANIFEST)).unwrap();
    let path = |path: &Path| path.to_str().unwrap().to_owned();
    let manifest = manifest
        .replace("../../scenes/furnace.xml", "furnace.xml")
        .replace("../../", &format!("{}/", path(&root)));
    let references = path(&manifest_folder().join("references"));
    std::fs::write(folder.join(MANIFEST), format!("references = '{references}'\n{manifest}")).unwrap();
    let outcome = run(&folder, &folder.join("results"), &["--case", "furnace"]);
    let [case] = &outcome.cases[..] else { panic!("{}", outcome.text) };
    assert_eq!((case["verdict"].as_str(), outcome.code), (Some("changed"), Some(1)), "{case}");
    assert!(case["sentence"].as_str().unwrap().contains("brightness"), "{case}");
}
