//! `pointillist explain` and `--effects`: the plan on the command line, in files and in figures.

use std::process::{Command, Output};

use serde_json::Value;

fn run(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).env("POINTILLIST_VALIDATION", "1");
    command.args(args).output().unwrap()
}

#[track_caller]
fn json(args: &[&str]) -> Value {
    let output = run(args);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !errors.contains("Validation"), "{args:?}: {errors}");
    serde_json::from_slice(&output.stdout).unwrap()
}

fn entry<'a>(plan: &'a Value, effect: &str) -> &'a Value {
    plan["plan"].as_array().unwrap().iter().find(|e| e["effect"] == effect).unwrap()
}

fn client_entry<'a>(plan: &'a Value, effect: &str) -> &'a Value {
    let mut all = plan["plan"].as_array().unwrap().iter();
    all.find(|e| e["effect"] == effect && e["side"] == "client").unwrap()
}

/// A path-traced scene has one stream: its images, passes and pipelines, and no other.
#[test]
fn explain_measures_what_is_on() {
    let plan = json(&["explain", "scenes/cornell_spheres.xml", "--size", "64x64", "--prices", "--json"]);
    assert!(plan["plan"].as_array().unwrap().len() > 20);
    let glass = entry(&plan, "transmission");
    assert_eq!(glass["on"], true);
    assert!(glass["place"].as_str().unwrap().starts_with("scenes/cornell_spheres.xml:"));
    assert!(glass["share"].as_f64().unwrap().abs() < 1.0);
    let light = client_entry(&plan, "light-stream");
    assert_eq!((light["on"].as_bool(), light["bytes"].as_u64()), (Some(false), Some(0)));
    // Two floats for each of four sums, and mip levels of one of them.
    let camera = entry(&plan, "camera-stream")["bytes"].as_u64().unwrap();
    assert!((70 * 70 * 37..80 * 80 * 38).contains(&camera), "{camera}");
    let names: Vec<&str> =
        plan["memory"].as_array().unwrap().iter().map(|m| m[0].as_str().unwrap()).collect();
    assert!(
        names.iter().all(|n| !n.starts_with("light") && !n.starts_with("glare") && *n != "atlas"),
        "{names:?}"
    );
    // What is told of the film's memory is what was allocated for it.
    let bytes = |key: &str| -> u64 {
        plan[key].as_array().unwrap().iter().map(|image| image[1].as_u64().unwrap()).sum()
    };
    let ratio = bytes("film_memory") as f64 / bytes("memory") as f64;
    assert!((0.95..1.05).contains(&ratio), "{ratio}: {} {}", plan["film_memory"], plan["memory"]);
    let pipelines = plan["pipelines"].to_string();
    for absent in ["glare", "bilateral", "error_view"] {
        assert!(!pipelines.contains(absent), "{pipelines}");
    }
    // What is off and could be on has a price, and every effect says what decides it.
    for effect in ["glare", "masking", "variance", "noise-filter"] {
        assert!(client_entry(&plan, effect)["if_on"].as_f64().unwrap() > 0.0, "{effect}");
    }
    assert!(entry(&plan, "noise-filter")["once"].as_f64().unwrap() > 0.0);
    let off = [
        "light-stream",
        "dispersion",
        "glossy",
        "environment",
        "light-choice",
        "lens",
        "opacity",
        "textures",
        "bump",
        "gather",
    ];
    for effect in off {
        assert!(entry(&plan, effect)["if_on_share"].as_f64().unwrap() > -0.9, "{effect}");
    }
    for entry in plan["plan"].as_array().unwrap() {
        assert!(entry["at_run_time"].as_str().unwrap().len() > 10, "{entry}");
    }
    let both = json(&[
        "explain",
        "scenes/cornell.xml",
        "--integrator",
        "bidirectional",
        "--size",
        "64x64",
        "--prices",
        "--json",
    ]);
    let bytes = |effect: &str| client_entry(&both, effect)["bytes"].as_u64().unwrap();
    assert_eq!(bytes("light-stream"), bytes("camera-stream"));
}

#[test]
fn what_is_left_out_is_said() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("effects_cli");
    std::fs::create_dir_all(&folder).unwrap();
    let exr = folder.join("prism.exr");
    let args = [
        "render",
        "scenes/prism.xml",
        "--size",
        "40x30",
        "--spp",
        "4",
        "--device",
        "cpu",
        "-q",
        "--json",
        "-",
    ];
    let args = [&args[..], &["-o", exr.to_str().unwrap(), "--effects", "-dispersion,-deltas"]].concat();
    let figures = json(&args);
    assert_eq!(figures["left_out"].to_string(), r#"["dispersion","deltas"]"#);
    assert!(entry(&figures, "dispersion")["reason"].as_str().unwrap().contains("--effects"));
    let layers = pointillist::image::exr::read(&exr).unwrap();
    let text = |name: &str| {
        let found = layers.attributes.iter().find(|(n, _)| n == name);
        format!("{:?}", found.unwrap_or_else(|| panic!("no attribute {name}")).1)
    };
    assert!(text("leftOut").contains("dispersion, deltas"));
    assert!(text("command").contains("--effects -dispersion,-deltas"));
    // Without force nothing is said, nor where there is nothing to leave out; the last word counts.
    for effects in ["-lens", "-lens,-environment,-lens", "-dispersion,+dispersion"] {
        let figures = json(&[&args[..args.len() - 2], &["--effects", effects]].concat());
        assert!(figures.get("left_out").is_none(), "{effects}: {figures}");
    }
    let output = run(&[&args[..args.len() - 2], &["--effects", "-lens"]].concat());
    assert!(String::from_utf8_lossy(&output.stderr).contains("changes nothing: the camera is a pinhole"));
    let grey = ["render", "scenes/furnace.xml", "--size", "8x8", "--spp", "1", "--device", "cpu", "-q"];
    let grey = [&grey[..], &["--json", "-", "-o", exr.to_str().unwrap()]].concat();
    assert_eq!(entry(&json(&grey), "wavelengths")["on"], false);
    let forced = json(&[&grey[..], &["--effects", "+wavelengths"]].concat());
    let wavelengths = entry(&forced, "wavelengths");
    assert!(wavelengths["on"] == true && wavelengths["reason"].as_str().unwrap().contains("forced on"));
}

/// The general code confirms the plan, and the picture is the undivided one without the check.
#[test]
fn plans_are_checked() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("effects_cli");
    std::fs::create_dir_all(&folder).unwrap();
    let picture = |name: &str, extra: &[&str]| {
        let png = folder.join(name);
        let args = [
            "render",
            "scenes/furnace.xml",
            "--size",
            "48x48",
            "--spp",
            "8",
            "--device",
            "cpu",
            "-q",
            "--json",
            "-",
        ];
        let args = [&args[..], &["--deterministic", "-o", png.to_str().unwrap()], extra].concat();
        (json(&args), std::fs::read(&png).unwrap())
    };
    let (figures, checked) = picture("a.png", &["--check-plan", "0.5"]);
    let paths = figures["plan_check"]["paths"].as_f64().unwrap() / figures["camera_paths"].as_f64().unwrap();
    assert!((0.45..0.55).contains(&paths), "{paths}");
    let (figures, plain) = picture("b.png", &["--replicates", "1"]);
    assert!(figures.get("plan_check").is_none());
    assert!(checked == plain, "the check has changed the picture");
}

#[test]
fn bad_requests_say_what_to_do() {
    let refused = |args: &[&str], words: &[&str]| {
        let output = run(args);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success(), "{args:?} was accepted");
        assert!(words.iter().all(|w| errors.contains(w)), "{args:?}: {errors}");
    };
    refused(&["explain", "scenes/none.xml"], &["scenes/none.xml"]);
    refused(&["explain", "scenes/cornell.xml", "--json=/nowhere/a.json"], &["/nowhere"]);
    refused(&["explain", "scenes/cornell.xml", "--json=scenes/cornell.xml"], &["overwrite the scene"]);
    refused(&["render", "scenes/cornell.xml", "--effects", "dispersion"], &["+ (on) or - (off)"]);
    refused(&["render", "scenes/cornell.xml", "--effects", "-fog"], &["no such effect", "dispersion"]);
    refused(
        &["render", "scenes/cove.xml", "--effects", "-light-choice"],
        &["-light-choice", "leave the others out"],
    );
    refused(&["render", "scenes/cornell.xml", "--check-plan", "2"], &["between 0 and 1"]);
    let photon =
        ["render", "scenes/cornell.xml", "--check-plan", "1", "--integrator", "photon", "--device", "cpu"];
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("effects_cli");
    std::fs::create_dir_all(&folder).unwrap();
    let png = folder.join("refused.png");
    refused(
        &[&photon[..], &["-o", png.to_str().unwrap()]].concat(),
        &["all of them", "--deterministic", "another --integrator"],
    );
    refused(&["explain", "--json=scenes/none.xml", "scenes/cornell.xml"], &["overwrite a scene"]);
    refused(&["render", "scenes/cornell.xml", "--effects", "+gather"], &["+gather", "--integrator photon"]);
    refused(&["render", "scenes/cornell.xml", "--effects", "+lens"], &["+lens", "thinlens"]);
    let both = ["render", "scenes/cornell.xml", "--integrator", "bidirectional"];
    refused(&[&both[..], &["--effects", "-light-stream"]].concat(), &["--integrator path"]);
}
