//! The error of a render: stated without a reference, true against one, and a reason to stop.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use pointillist::image::compare::Picture;
use serde_json::Value;

/// A folder of this test's own, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("render_error").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn run(state: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).env("POINTILLIST_STATE", state);
    command.args(args).output().unwrap()
}

#[track_caller]
fn json(state: &Path, args: &[&str]) -> Value {
    let output = run(state, args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[track_caller]
fn fails(args: &[&str], wanted: &str) {
    let output = run(&folder("bad"), args);
    let errors = String::from_utf8_lossy(&output.stderr).replace("\n  │ ", " ");
    assert!(!output.status.success() && errors.contains(wanted), "{args:?}: {errors}");
}

const SCENE: [&str; 8] =
    ["render", "scenes/cornell.xml", "--size", "64x64", "--device", "cpu", "--quiet", "--json=-"];

fn with<'a>(more: &[&'a str]) -> Vec<&'a str> {
    SCENE.iter().chain(more).copied().collect()
}

/// The same bytes and the same end for any number of threads; the error is what was asked for, by the half of the pixels
/// that did not decide.
#[test]
fn a_render_stops_at_its_error_and_always_at_the_same_place() {
    let place = folder("stop");
    let out = |name: &str| place.join(name).display().to_string();
    let (one, two) = (out("one.exr"), out("two.exr"));
    let stop = |file: &str, threads: &str| {
        json(&place, &with(&["--error", "10%", "--deterministic", "--threads", threads, "-o", file]))
    };
    let (a, b) = (stop(&one, "1"), stop(&two, "3"));
    assert_eq!(a["camera_paths"], b["camera_paths"]);
    assert_eq!(std::fs::read(&one).unwrap(), std::fs::read(&two).unwrap());
    let error = &a["error"];
    assert_eq!((error["reached"].as_bool(), error["target"].as_f64()), (Some(true), Some(0.1)));
    let p95 = error["p95"]["value"].as_f64().unwrap();
    assert!((0.06..0.14).contains(&p95), "{error}");
    assert!(error["p95"]["low"].as_f64().unwrap() < p95 && p95 < error["p95"]["high"].as_f64().unwrap());
    assert!(error["curve"].as_array().unwrap().len() > 3);
    // What was predicted on the way is in the log, with what came of it.
    let log = std::fs::read_to_string(place.join("predictions.jsonl")).unwrap();
    assert!(log.lines().count() >= 2 && log.contains("\"reached\":"), "{log}");
    let printed = run(&place, &["study", "--predictions"]);
    let text = String::from_utf8_lossy(&printed.stdout);
    assert!(text.contains("scenes/cornell.xml path") && text.contains("all"), "{text}");
}

/// Whichever comes first.
#[test]
fn time_and_samples_end_a_render_too() {
    let place = folder("first");
    let file = place.join("a.png").display().to_string();
    let short = json(&place, &with(&["--error", "0.01%", "--spp", "8", "-o", &file]));
    assert_eq!(
        (short["error"]["reached"].as_bool(), short["samples_per_pixel"].as_f64().unwrap() < 9.0),
        (Some(false), true)
    );
    let timed = json(&place, &with(&["--error", "0.01%", "--time", "0.4", "-o", &file]));
    assert_eq!(timed["error"]["reached"].as_bool(), Some(false));
    assert!(timed["seconds"]["render"].as_f64().unwrap() < 20.0);
    // One randomisation does not know its error, and gives another picture of as many paths.
    let alone = json(&place, &with(&["--spp", "8", "--replicates", "1", "-o", &file]));
    assert!(alone.get("error").is_none());
    // Too few samples for any.
    let few = json(&place, &with(&["--samples", "100", "-o", &file]));
    assert!(few.get("error").is_none(), "{few}");
}

#[test]
fn what_cannot_be_is_said_in_one_sentence() {
    fails(
        &["render", "scenes/cornell.xml", "--error", "1%", "--replicates", "1"],
        "which one randomisation alone does not tell",
    );
    fails(
        &["render", "scenes/cornell.xml", "--error", "1%", "--check-plan", "0.1"],
        "which one randomisation alone does not tell",
    );
    fails(&["render", "scenes/cornell.xml", "--error=-3%"], "such as 1% or 0.01");
    fails(&["render", "scenes/cornell.xml", "--error", "many"], "such as 1% or 0.01");
    fails(&["study"], "required");
    fails(&["study", "scenes/nowhere.xml"], "scenes/nowhere.xml");
    fails(&["study", "scenes/cornell.xml", "--peer", "nonsense"], "NAME=SECONDS:FILE.exr");
    fails(&["study", "--collect", "scenes", "-o", "target/tmp/none"], "there is no study in scenes");
}

/// Fireflies are reweighted only where that is asked for, and the files say so. The share of the largest sample is always told.
#[test]
fn fireflies_are_reweighted_on_request() {
    let place = folder("fireflies");
    let out = |name: &str| place.join(name).display().to_string();
    let (plain, reweighted, shown) = (out("plain.exr"), out("reweighted.exr"), out("reweighted.png"));
    let common = ["--spp", "4", "--integrator", "path", "--deterministic"];
    let render = |more: &[&str]| json(&place, &with(&[&common[..], more].concat()));
    let a = render(&["-o", &plain]);
    let b = render(&["-o", &reweighted, "-o", &shown, "--reweight-fireflies"]);
    let one = a["error"]["light"]["largest"]["one"].as_f64().unwrap();
    assert!(one > 1e-4 && one < 0.05, "{one}");
    assert_eq!((&a["withheld"], &a["error"]["besides"]), (&Value::Null, &Value::Null));
    let withheld = b["withheld"].as_f64().unwrap();
    assert!(withheld > 0.0 && withheld < 0.3, "{withheld}");
    assert_eq!(b["error"]["besides"], "the reweighting of fireflies");
    for (file, named) in [(&plain, false), (&reweighted, true), (&shown, true)] {
        let bytes = std::fs::read(file).unwrap();
        let has = |text: &str| bytes.windows(text.len()).any(|part| part == text.as_bytes());
        assert!(
            has("Zirr") == named && has("--reweight-fireflies=1") == named && has("of the light"),
            "{file}"
        );
    }
    let again = out("again.exr");
    render(&["-o", &again, "--reweight-fireflies=1"]);
    assert_eq!(std::fs::read(&again).unwrap(), std::fs::read(&reweighted).unwrap());
    let wrong = with(&["--reweight-fireflies=0"]);
    fails(&wrong, "--reweight-fireflies");
}

/// The noise filter changes what is displayed and nothing else: the sums of an EXR file are those of a run without it, its layer and the
/// PNG file are the same for any number of threads, and the files and the report say what the error is of.
#[test]
fn noise_is_filtered_on_request() {
    let place = folder("denoise");
    let out = |name: &str| place.join(name).display().to_string();
    let common = ["--spp", "4", "--integrator", "bidirectional", "--deterministic"];
    let render = |more: &[&str]| json(&place, &with(&[&common[..], more].concat()));
    let (plain, shown) = (out("plain.exr"), out("plain.png"));
    let a = render(&["-o", &plain, "-o", &shown]);
    assert_eq!(a["error"]["besides"], Value::Null);
    let files = ["1", "2"].map(|threads| {
        let (sums, shown) = (out(&format!("{threads}.exr")), out(&format!("{threads}.png")));
        let b = render(&["--denoise", "wavelet", "--threads", threads, "-o", &sums, "-o", &shown]);
        assert_eq!(b["error"]["besides"], "the noise filter, of the picture without it");
        (std::fs::read(sums).unwrap(), std::fs::read(shown).unwrap())
    });
    assert!(files[0] == files[1]);
    let has = |bytes: &[u8], text: &str| bytes.windows(text.len()).any(|part| part == text.as_bytes());
    assert!(
        has(&files[0].0, "denoised.G")
            && has(&files[0].0, "by wavelet")
            && has(&files[0].1, "--denoise wavelet")
    );
    let read = |file: &str| Picture::read(Path::new(file), None).unwrap();
    assert!(read(&plain).rgb == read(&out("1.exr")).rgb);
    assert_ne!(std::fs::read(&shown).unwrap(), files[0].1);
    fails(&with(&["--denoise", "wavelet", "--replicates", "1"]), "two randomisations");
    fails(&with(&["--denoise", "wavelet", "--show", "camera-variance"]), "the picture to be shown");
    fails(&with(&["--denoise", "wavelet", "--reweight-fireflies"]), "all samples alike");
    fails(&with(&["--denoise", "median"]), "wavelet");
}

/// The filter takes noise from a picture of few samples, and leaves one of many as it is: its squared error relative to that of the picture
/// without it, by pictures of other seeds, which have the noise of the latter and nothing else in common.
#[test]
fn the_filter_fades_as_the_picture_converges() {
    let place = folder("converged");
    let pixels = |file: &str, layer| Picture::read(Path::new(file), layer).unwrap().rgb.into_pixels();
    let stated = std::cell::RefCell::new(Vec::new());
    let render = |spp: &str| {
        ["1", "2", "3", "4"].map(|seed| {
            let file = place.join(format!("{spp}-{seed}.exr")).display().to_string();
            let report =
                json(&place, &with(&["--spp", spp, "--seed", seed, "--denoise", "wavelet", "-o", &file]));
            stated.borrow_mut().push(report["error"]["denoised"]["rel_mse"]["value"].as_f64());
            [pixels(&file, None), pixels(&file, Some("denoised"))]
        })
    };
    let converged = render("400");
    stated.borrow_mut().clear();
    let weights: Vec<[f64; 3]> = (0..converged[0][0].len())
        .map(|i| {
            [0, 1, 2].map(|c| {
                let mean = converged.iter().map(|layers| f64::from(layers[0][i][c])).sum::<f64>() / 4.0;
                1.0 / (mean * mean + 0.01)
            })
        })
        .collect();
    let difference = |a: &[[f32; 3]], b: &[[f32; 3]]| -> f64 {
        let relative = |((a, b), weight): ((&[f32; 3], &[f32; 3]), &[f64; 3])| {
            (0..3).map(|c| f64::from((a[c] - b[c]).powi(2)) * weight[c]).sum::<f64>()
        };
        a.iter().zip(b).zip(&weights).map(relative).sum()
    };
    // What is stated of its error, against the mean of the converged pictures.
    let reference: Vec<[f32; 3]> = (0..weights.len())
        .map(|i| [0, 1, 2].map(|c| converged.iter().map(|layers| layers[0][i][c]).sum::<f32>() / 4.0))
        .collect();
    let some = render("16");
    let said: f64 = stated.borrow().iter().map(|stated| stated.expect("it is large enough")).sum();
    let truth = some.iter().map(|layers| difference(&layers[1], &reference)).sum::<f64>();
    let ratio = said / (truth / (3 * weights.len()) as f64);
    println!("stated over true relMSE of filtered pictures: {ratio:.3}");
    assert!((0.5..2.0).contains(&ratio), "{ratio}");
    for (rendered, most) in [(render("1"), 0.8), (converged.clone(), 1.1)] {
        let pairs = || (0..4).flat_map(|a| (0..4).map(move |b| (a, b))).filter(|(a, b)| a != b);
        let sum = |layer: usize| -> f64 {
            pairs().map(|(a, b)| difference(&rendered[a][layer], &rendered[b][0])).sum()
        };
        // Each difference has the other picture's error in it: half of that of two pictures without the filter.
        let ratio = 2.0 * sum(1) / sum(0) - 1.0;
        println!("{ratio:.3}, at most {most}");
        assert!(ratio < most, "{ratio}, at most {most}");
    }
}

/// A point light shines through a ball of glass, beside an even sky. No path from the camera can hit it, so that the picture lacks the caustic
/// for good: the stated error counts it, and the render does not stop.
#[test]
fn a_caustic_that_paths_cannot_find_is_an_error() {
    let place = folder("caustic");
    let scene = place.join("scene.xml");
    let text = r#"<scene version="3.0.0">
        <integrator type="path"/>
        <sensor type="perspective">
            <float name="fov" value="40"/>
            <transform name="to_world"><lookat origin="0, -6, 4" target="0, 0, 0" up="0, 0, 1"/></transform>
            <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="64"/></film>
        </sensor>
        <emitter type="constant"><rgb name="radiance" value="0.2"/></emitter>
        <emitter type="point"><point name="position" x="0" y="0" z="5"/><rgb name="intensity" value="20"/></emitter>
        <shape type="sphere"><point name="center" x="0" y="0" z="1.2"/><bsdf type="dielectric"/></shape>
        <shape type="rectangle">
            <transform name="to_world"><scale value="8"/></transform>
            <bsdf type="diffuse"/>
        </shape>
    </scene>"#;
    std::fs::write(&scene, text).unwrap();
    let render = |method: &str, more: &[&str]| {
        let scene = scene.display().to_string();
        let args = ["render", &scene, "--integrator", method, "--device", "cpu", "--quiet", "--json=-"];
        let png = place.join("out.png").display().to_string();
        json(&place, &[&args[..], more, &["-o", &png]].concat())["error"].clone()
    };
    let path = render("path", &["--spp", "64"]);
    let missing = path["light"]["missing"].as_f64().unwrap();
    // 4.1 % are missing, as long renders of both methods tell.
    assert!(
        (0.015..0.08).contains(&missing) && path["light"]["caustics"].as_f64().unwrap() > 0.5 * missing,
        "{path}"
    );
    assert!(path["unfound"].as_str().is_some_and(|text| text.contains("caustics")), "{path}");
    // Parts of the same render lack as much, while their scene is there.
    let parts = ["1", "2"].map(|number| place.join(format!("{number}.state")).display().to_string());
    let scene_name = scene.display().to_string();
    for (number, part) in ["1", "2"].into_iter().zip(&parts) {
        let args = ["shard", &scene_name, "--integrator", "path", "--spp", "64", "--quiet", "--of", "2"];
        let output = run(&place, &[&args[..], &["--number", number, "-o", part]].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let merge = ["merge", &parts[0], &parts[1], "--quiet", "--json=-"];
    let merged = json(&place, &merge)["error"].clone();
    let ratio = merged["light"]["missing"].as_f64().unwrap() / missing;
    assert!((ratio - 1.0).abs() < 0.01, "{merged} {path}");
    std::fs::write(&scene, text.replace("value=\"20\"", "value=\"21\"")).unwrap();
    let output = run(&place, &merge);
    let told = String::from_utf8_lossy(&output.stderr).replace("\n  │ ", " ");
    assert!(
        output.status.success() && told.contains("knows nothing of light") && told.contains("has changed"),
        "{told}"
    );
    std::fs::write(&scene, text).unwrap();
    // Bidirectional tracing finds it on the floor, and has nothing to tell.
    let both = render("bidirectional", &["--spp", "64"]);
    assert!(both["light"]["missing"].as_f64().unwrap() < 0.5 * missing, "{both}");
    let stopped = render("path", &["--error", "5%", "--error-at", "p99", "--time", "3"]);
    assert_eq!(stopped["reached"].as_bool(), Some(false), "{stopped}");
}
