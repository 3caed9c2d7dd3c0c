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
    let text = succeeds(&study(&place, &[&common[..], &["--knobs", "methods", "--budget", "8"]].concat()));
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
    assert!(points(&first) >= 2);
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
    let samples = |study: &Value| study["reference"]["samples_per_pixel"].as_f64().unwrap();
    // Each part has a run of its own: on a slow machine the first might leave no time for the other.
    for (knobs, budget) in [("methods", "9"), ("effects", "10"), ("numeric", "8"), ("replicates", "8")] {
        succeeds(&study(&place, &[&common[..], &["--knobs", knobs, "--budget", budget]].concat()));
    }
    let second = json(&out);
    assert!(points(&second) > points(&first), "{} {}", points(&second), points(&first));
    assert!(samples(&second) > samples(&first));
    assert_eq!(commands(&second), 5);
    assert_eq!(second["numeric"].as_array().unwrap().len(), 2);
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

/// A coloured cloud on a grid over a floor, in even light.
const CLOUD: &str = r#"<scene version="3.0.0">
<sensor type="perspective"><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0,2,5" target="0,.6,0" up="0,1,0"/></transform></sensor>
<emitter type="constant"/>
<shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/></transform></shape>
<shape type="cube"><transform name="to_world"><scale value=".5"/><translate y="1"/></transform><bsdf type="null"/>
<medium type="heterogeneous" name="interior" id="cloud"><float name="albedo" value=".9"/><float name="scale" value="4"/>
<volume name="sigma_t" type="gridvolume"><string name="filename" value="cloud.vol"/>
<transform name="to_world"><translate x="-.5" y="-.5" z="-.5"/><translate y="1"/></transform></volume></medium></shape>
</scene>"#;

/// Media, their grids and their colours each have a price: time, share of the variance, and what the picture loses without them.
#[test]
fn media_have_prices() {
    let place = folder("media");
    let mut grid = b"VOL\x03".to_vec();
    [1, 3, 3, 3, 3_i32].iter().for_each(|n| grid.extend(n.to_le_bytes()));
    [0.0, 0.0, 0.0, 1.0, 1.0, 1.0_f32].iter().for_each(|v| grid.extend(v.to_le_bytes()));
    for i in 0..27_u8 {
        let density = f32::from(i * 7 % 5);
        [0.5, 1.0, 2.0].iter().for_each(|share| grid.extend((share * density).to_le_bytes()));
    }
    std::fs::write(place.join("cloud.vol"), grid).unwrap();
    let scene = place.join("cloud.xml");
    std::fs::write(&scene, CLOUD).unwrap();
    let out = place.join("cloud");
    let [scene, path] = [&scene, &out].map(|path| path.display().to_string());
    let common = [scene.as_str(), "--methods", "path", "-o", &path];
    for (knobs, budget) in [("methods", "6"), ("effects", "16")] {
        succeeds(&study(&place, &[&common[..], &["--knobs", knobs, "--budget", budget]].concat()));
    }
    let told = json(&out);
    let effects = told["effects"].as_array().unwrap();
    let price = |name: &str| effects.iter().find(|effect| effect["name"] == name).unwrap();
    for name in ["media", "grid-media", "chromatic-media"] {
        let price = price(name);
        assert_eq!(price["on"].as_bool(), Some(true), "{price}");
        assert!(price["reason"].as_str().unwrap().contains("cloud"), "{price}");
        assert!(price["time"]["value"].as_f64().unwrap() > 0.2, "{price}");
        assert!(price["variance"].as_f64().is_some() && price["loss"].as_f64().is_some(), "{price}");
    }
    // Without the cloud paths are shorter, and the floor in even light has less noise and another picture.
    let media = price("media");
    assert!(media["time"]["value"].as_f64().unwrap() > 1.0, "{media}");
    assert!(media["variance"].as_f64().unwrap() > 0.1 && media["loss"].as_f64().unwrap() > 0.01, "{media}");
}

/// The error curve of a render of so many seconds: samples per pixel and error of 95 % of the picture.
fn long_render(place: &Path, scene: &str, method: &str, size: &str, seconds: &str) -> Vec<[f64; 2]> {
    let [json, png] = ["long.json", "long.png"].map(|name| place.join(name).display().to_string());
    let output = Command::new(env!("CARGO_BIN_EXE_pointillist"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env("POINTILLIST_STATE", place)
        .args(["render", scene, "--integrator", method, "--size", size, "--seed", "77", "--time", seconds])
        .args(["--device", "cpu", "-o", &png, "--json", &json])
        .output()
        .unwrap();
    succeeds(&output);
    let report: Value = serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
    let pixels: f64 = size.split('x').map(|side| side.parse::<f64>().unwrap()).product();
    let number = |value: &Value| value.as_f64().unwrap();
    let curve = report["error"]["curve"].as_array().unwrap();
    curve.iter().map(|at| [number(&at[1]) / pixels, number(&at[2])]).collect()
}

/// What a study claims is what long renders show: the method that it names is among the best, errors come down when it says, and no method
/// is accused of a wrong brightness. Times are compared as samples, so that no speed is asserted.
#[test]
fn a_study_keeps_its_word() {
    let place = folder("word");
    for (scene, size, budget) in
        [("scenes/cornell.xml", "96x96", "12"), ("scenes/staircase2/scene.xml", "64x64", "10")]
    {
        let out = place.join(size);
        let path = out.display().to_string();
        let common = [scene, "--size", size, "--budget", budget, "--methods", "path,bidirectional"];
        let output = study(&place, &[&common[..], &["--knobs", "methods", "-o", &path]].concat());
        let text = succeeds(&output);
        assert!(text.contains("Use ") && text.contains("Runner-up: "), "{text}");
        assert!(!text.contains("mean brightness is"), "{text}");
        let told = json(&out);
        assert!(
            told["stability"].as_array().unwrap().iter().all(|s| s["energy"]["value"].is_f64()),
            "{told}"
        );
        let named = text.split("Use ").nth(1).unwrap().split(':').next().unwrap();
        let mut ends = Vec::new();
        for method in told["methods"].as_array().unwrap() {
            let name = method["name"].as_str().unwrap();
            let curve = long_render(&place, scene, name, size, "6");
            ends.push((name.to_string(), curve.last().unwrap()[1]));
            // The largest error of the study that the render has come down to in more than a few samples.
            let last =
                method["points"].as_array().unwrap().iter().rev().find(|p| p["relative"].is_array()).unwrap();
            let rate = last["samples_per_pixel"].as_f64().unwrap() / last["seconds"].as_f64().unwrap();
            for price in method["prices"].as_array().unwrap() {
                let target = price["error"].as_f64().unwrap();
                let Some(at) = curve.iter().position(|at| at[1] <= target).filter(|at| *at > 0) else {
                    continue;
                };
                let told = |bound: &str| price["seconds"][bound].as_f64().unwrap() * rate;
                // A 90 % interval misses one time in ten: this is a wider one.
                let (low, high) = (told("low") / 1.5, told("high") * 1.5);
                let [before, after] = [curve[at - 1][0], curve[at][0]];
                assert!(
                    low <= after && before <= high,
                    "{name} to {target}: {before}–{after}, told {low}–{high}"
                );
            }
        }
        let best = ends.iter().map(|end| end.1).fold(f64::INFINITY, f64::min);
        let own = ends.iter().find(|end| end.0 == named).unwrap().1;
        // Error falls with the root of time, about: this is within 1.5 of the best time.
        assert!(own < 1.25 * best, "{named} has {own}, the best {best}");
    }
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
