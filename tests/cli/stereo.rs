//! `--stereo`: views of EXR files, and pictures of both eyes.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use pointillist::image::{Attribute, exr};
use serde_json::Value;

/// A wall behind a ball that is nearer to the camera; the subject is the ball, 3 units away.
const SCENE: &str = r#"<scene version="3.0.0">
<sensor type="perspective"><float name="fov" value="40"/><transform name="to_world"><lookat origin="0,0,-4" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="32"/></film></sensor>
<shape type="rectangle"><transform name="to_world"><scale value="20"/><rotate x="1" angle="180"/><translate z="9"/></transform>
<bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>
<shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value=".8,.1,.1"/></bsdf></shape>
<emitter type="constant"/>
</scene>"#;

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cli_stereo").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).expect("a folder can be made");
    fs::write(path.join("scene.xml"), SCENE).expect("the scene can be written");
    path
}

fn run(dir: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(dir).args(args).output().expect("the program runs")
}

fn render(dir: &Path, args: &[&str]) -> Output {
    run(dir, &[&["render", "scene.xml"], args].concat())
}

/// What the program writes to standard output.
#[track_caller]
fn program(dir: &Path, args: &[&str]) -> String {
    let output = run(dir, args);
    assert!(output.status.success(), "{args:?}: {}", said(&output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ")
}

#[track_caller]
fn succeed(dir: &Path, args: &[&str]) -> String {
    let output = render(dir, args);
    assert!(output.status.success(), "{args:?}: {}", said(&output));
    said(&output)
}

/// Width and height of a PNG file, from its header.
fn png_size(path: &Path) -> [u32; 2] {
    let bytes = fs::read(path).expect("the picture is there");
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()))
}

/// The wall behind the screen is farther right for the right eye; the ball in its plane is at the same place for both.
#[test]
fn views_of_an_exr_file() {
    for device in [&["--device", "cpu"][..], &[]] {
        let dir = folder(&format!("views{}", device.len()));
        let args = ["--stereo", "--spp", "64", "-o", "eyes.exr", "--aov", "depth,position", "--quiet"];
        succeed(&dir, &[&args[..], device].concat());
        let file = exr::read(&dir.join("eyes.exr")).expect("the file can be read");
        assert_eq!(file.views, ["left", "right"]);
        let mean = |view: &str, of: &str| mean(&file.view(view).expect("the view is there"), of);
        let [left, right] = ["left", "right"].map(|view| mean(view, "G"));
        assert!((left / right - 1.0).abs() < 0.02, "{left} {right}");
        // 3/30 between the eyes: both look at the same middle of the ball, and beside it at the wall from another place.
        let [left, right] = ["left", "right"].map(|view| mean(view, "position.X"));
        assert!(left != right && (left + right).abs() < 0.1 * (left - right).abs() + 0.05, "{left} {right}");
    }
}

#[test]
fn pictures_of_both_eyes() {
    let dir = folder("pictures");
    let said = succeed(
        &dir,
        &["--stereo", "--spp", "4", "--device", "cpu", "-o", "eyes.png", "-o", "eyes.jps", "-o", "eyes.mpo"],
    );
    assert!(said.contains("two eyes, 0.100 units apart") && said.contains("comfortable"), "{said}");
    assert_eq!(png_size(&dir.join("eyes.png")), [96, 32]);
    assert!(fs::read(dir.join("eyes.jps")).unwrap().windows(8).any(|bytes| bytes == b"_JPSJPS_"));
    assert!(fs::read(dir.join("eyes.mpo")).unwrap().windows(4).any(|bytes| bytes == b"MPF\0"));
    for (layout, size) in [("over-under", [48, 64]), ("anaglyph", [48, 32]), ("checkerboard", [48, 32])] {
        succeed(&dir, &["--stereo", layout, "--spp", "1", "--device", "cpu", "-o", "eyes.png", "--quiet"]);
        assert_eq!(png_size(&dir.join("eyes.png")), size, "{layout}");
    }
    succeed(&dir, &["--stereo", "pair", "--spp", "1", "--device", "cpu", "-o", "one.png", "--quiet"]);
    for name in ["one_left.png", "one_right.png"] {
        assert_eq!(png_size(&dir.join(name)), [48, 32], "{name}");
    }
    assert!(!dir.join("one.png").exists());
}

/// The same picture however many threads trace it.
#[test]
fn deterministic_for_any_number_of_threads() {
    let dir = folder("threads");
    let file = |threads: &str| {
        let args = ["--stereo", "--spp", "64", "--deterministic", "--device", "cpu", "--quiet"];
        succeed(&dir, &[&args[..], &["--threads", threads, "-o", "eyes.png"]].concat());
        fs::read(dir.join("eyes.png")).expect("the picture is there")
    };
    assert!(file("1") == file("3"));
}

#[test]
fn what_two_eyes_do_not_go_with_is_refused() {
    let dir = folder("refused");
    for (args, why) in [
        (&["--stereo", "sideways"][..], "the layouts are side-by-side"),
        (&["--stereo", "swapchain"], "only the window of `pointillist view` has layers"),
        (&["--stereo", "--convergence", "toed-in"], "trapezoids"),
        (&["--stereo", "--interocular", "0"], "above 0"),
        (&["--interocular", "1"], "--stereo"),
        (&["--stereo", "--check-plan", "1"], "--check-plan"),
        (&["--stereo", "--reweight-fireflies"], "--reweight-fireflies"),
        (&["--stereo", "--light-groups", "left=constant", "-o", "x.exr"], "`left` is the name of a view"),
        (&["-o", "x.mpo"], ".exr or .png"),
        (
            &["--aov", "disparity", "-o", "x.exr"],
            "`disparity:disparity` is the disparity between the pictures",
        ),
    ] {
        let output = render(&dir, args);
        assert!(!output.status.success() && said(&output).contains(why), "{args:?}: {}", said(&output));
    }
    let text = SCENE.replace("perspective", "orthographic").replace(r#"<float name="fov" value="40"/>"#, "");
    fs::write(dir.join("scene.xml"), text).expect("the scene can be written");
    let output = render(&dir, &["--stereo", "--spp", "1"]);
    let said = said(&output);
    assert!(!output.status.success() && said.contains("line 2, column 1"), "{said}");
}

/// Renders both eyes on the processor, and returns the report.
#[track_caller]
fn report(dir: &Path, args: &[&str]) -> Value {
    let output = render(dir, &[&["--stereo", "--device", "cpu", "--quiet", "--json=-"], args].concat());
    assert!(output.status.success(), "{args:?}: {}", said(&output));
    serde_json::from_slice(&output.stdout).expect("a report")
}

/// The views of a file.
fn views(path: &Path) -> [exr::Layers; 2] {
    let file = exr::read(path).expect("the file can be read");
    ["left", "right"].map(|view| file.view(view).expect("the view is there"))
}

/// The mean of a channel.
fn mean(view: &exr::Layers, channel: &str) -> f32 {
    let values = view.channel(channel).unwrap_or_else(|| panic!("no {channel}"));
    values.iter().sum::<f32>() / values.len() as f32
}

/// The relMSE of a layer against R, G and B of a reference.
fn rel_mse(picture: &exr::Layers, layer: &str, reference: &exr::Layers) -> f64 {
    let channels = |of: &exr::Layers, layer: &str| {
        ["R", "G", "B"].map(|c| of.channel(&format!("{layer}{c}")).expect("the channel is there").to_vec())
    };
    let (own, truth) = (channels(picture, layer), channels(reference, ""));
    let pixels = own[0].len();
    let relative = |i: usize| {
        let squares = |c: usize| f64::from(own[c][i] - truth[c][i]).powi(2);
        let [r, g, b] = [0, 1, 2].map(|c| f64::from(truth[c][i]));
        let luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        (squares(0) + squares(1) + squares(2)) / 3.0 / (luminance * luminance + 0.01)
    };
    (0..pixels).map(relative).sum::<f64>() / pixels as f64
}

/// The errors that are stated of each eye and of both are those against a reference, and stand in report, summary and files.
#[test]
fn the_error_of_each_eye_is_stated() {
    let dir = folder("errors");
    let truth = ["--spp", "2048", "--seed", "9", "-o", "truth.exr"];
    report(&dir, &truth);
    let report = report(&dir, &["--spp", "16", "-o", "eyes.exr", "-o", "eyes.png"]);
    assert!(report.get("error").is_none());
    let (found, truth) = (views(&dir.join("eyes.exr")), views(&dir.join("truth.exr")));
    let mut stated = Vec::new();
    for (i, eye) in ["left", "right"].into_iter().enumerate() {
        let error = &report["eyes"][eye];
        let value = error["rel_mse"]["value"].as_f64().expect("a number");
        let against = rel_mse(&found[i], "", &truth[i]);
        assert!((0.5..2.0).contains(&(value / against)), "{eye}: {value} for {against}");
        assert!(error["p95"]["low"].as_f64() < error["p95"]["high"].as_f64(), "{error}");
        stated.push(value);
    }
    let both = &report["eyes"]["both"];
    let mean = 0.5 * (stated[0] + stated[1]);
    assert!((both["rel_mse"]["value"].as_f64().expect("a number") / mean - 1.0).abs() < 1e-9, "{both}");
    let p95 = |of: &str| report["eyes"][of]["p95"]["value"].as_f64().expect("a number");
    let [low, high] = [p95("left").min(p95("right")), p95("left").max(p95("right"))];
    assert!((low..=high).contains(&p95("both")), "{low} {high} {both}");
    let note = |view: &exr::Layers, name: &str| match view.attribute(name) {
        Some(Attribute::Text(text)) => text.clone(),
        other => panic!("{name}: {other:?}"),
    };
    for view in &found {
        assert!(note(view, "error").contains("in 95 % of the picture"), "{}", note(view, "error"));
        assert!(note(view, "errorOfBothEyes").contains("fully correlated"));
    }
    let png = fs::read(dir.join("eyes.png")).expect("the picture is there");
    assert!(png.windows(15).any(|bytes| bytes == b"errorOfBothEyes"));
    let told = succeed(&dir, &["--stereo", "--spp", "16", "--device", "cpu", "-o", "eyes.png"]);
    for part in ["; left eye: error ", "; right eye: error ", "; both eyes: error ", "relMSE"] {
        assert!(told.contains(part), "{told}");
    }
}

/// A render ends when both eyes have reached the error, at the same place for any number of threads.
#[test]
fn the_worse_eye_decides_when_to_stop() {
    let dir = folder("stop");
    let stop = |threads: &str| {
        let args =
            ["--error", "6%", "--spp", "4096", "--deterministic", "--threads", threads, "-o", "eyes.png"];
        let report = report(&dir, &args);
        (report, fs::read(dir.join("eyes.png")).expect("the picture is there"))
    };
    let ((one, bytes), (three, same)) = (stop("1"), stop("3"));
    assert!(bytes == same && one["camera_paths"] == three["camera_paths"]);
    assert!(one["samples_per_pixel"].as_f64() < Some(4000.0), "{one}");
    for eye in ["left", "right"] {
        let error = &one["eyes"][eye];
        assert_eq!(error["reached"], true, "{error}");
        assert!(error["p95"]["value"].as_f64() < Some(0.09), "{error}");
    }
}

/// The noise filter takes noise from the pictures of both eyes, and what is composed of them is composed of the filtered ones.
#[test]
fn both_eyes_are_denoised() {
    let dir = folder("denoised");
    report(&dir, &["--spp", "2048", "--seed", "9", "-o", "truth.exr"]);
    let filtered =
        ["--spp", "4", "--deterministic", "--denoise", "wavelet", "-o", "eyes.exr", "-o", "eyes.png"];
    report(&dir, &filtered);
    report(&dir, &["--spp", "4", "--deterministic", "-o", "plain.png"]);
    let (found, truth) = (views(&dir.join("eyes.exr")), views(&dir.join("truth.exr")));
    for (i, eye) in ["left", "right"].into_iter().enumerate() {
        let [plain, denoised] = ["", "denoised."].map(|layer| rel_mse(&found[i], layer, &truth[i]));
        assert!(denoised < 0.9 * plain, "{eye}: {denoised} of {plain}");
        assert!(found[i].attribute("denoised").is_some(), "{eye}");
    }
    let [shown, plain] = ["eyes.png", "plain.png"].map(|name| fs::read(dir.join(name)).expect("is there"));
    assert!(shown != plain && png_size(&dir.join("eyes.png")) == [96, 32]);
    // With enough samples the error of the filtered pictures is stated, too.
    let stated = report(&dir, &["--spp", "64", "--denoise", "wavelet", "-o", "eyes.png"]);
    for eye in ["left", "right"] {
        let [plain, denoised] = [&stated["eyes"][eye], &stated["eyes"][eye]["denoised"]]
            .map(|error| error["rel_mse"]["value"].as_f64().expect("a number"));
        assert!(denoised > 0.0 && denoised < 1.2 * plain, "{eye}: {denoised} of {plain}");
    }
}

/// The wall is behind the plane of convergence, in which the front of the ball lies, and each view has the disparity by its own name.
#[test]
fn disparity_is_a_layer_of_each_view() {
    let dir = folder("disparity");
    report(&dir, &["--spp", "1", "--aov", "disparity,depth", "-o", "eyes.exr"]);
    // Half of the width of the picture at distance 1; the eyes are 3/30 apart and converge at 3.
    let half = 20f32.to_radians().tan();
    let wall = 48.0 * 0.1 / (2.0 * half) * (1.0 / 13.0 - 1.0 / 3.0);
    for (view, name) in views(&dir.join("eyes.exr")).iter().zip(["disparityL.x", "disparityR.x"]) {
        let disparity = view.channel(name).unwrap_or_else(|| panic!("no {name} in {:?}", view.attributes));
        assert!((disparity[0] - wall).abs() < 1e-3, "{name}: {} for {wall}", disparity[0]);
        let middle = disparity[16 * 48 + 24];
        assert!(middle <= 0.01 && middle > -0.1, "{name}: {middle}");
        assert!(view.channels.iter().filter(|(name, _)| name.starts_with("disparity")).count() == 1);
    }
}

/// A render that was interrupted goes on to the bits of one that was not, in both eyes, by every kind of method; and without a state, too, the
/// picture is the same.
#[test]
fn both_eyes_go_on_from_a_state() {
    for method in ["path", "bidirectional", "photon", "light"] {
        let dir = folder(&format!("state_{method}"));
        let common = ["--stereo", "--integrator", method, "--device", "cpu", "--quiet"];
        let begin = |more: &[&str]| succeed(&dir, &[&common[..], more].concat());
        begin(&["--spp", "6", "--state", "a.state", "-o", "begun.exr"]);
        begin(&["--spp", "12", "--state", "whole.state", "-o", "whole.exr", "-o", "whole.png"]);
        begin(&["--spp", "12", "--deterministic", "-o", "plain.exr"]);
        let resume = ["render", "--resume", "a.state", "--spp", "12", "--quiet"];
        let outputs = ["-o", "resumed.exr", "-o", "resumed.png"];
        program(&dir, &[&resume[..], &outputs].concat());
        let whole = views(&dir.join("whole.exr"));
        for other in ["resumed.exr", "plain.exr"] {
            for (whole, other_view) in whole.iter().zip(&views(&dir.join(other))) {
                assert!(whole.channels == other_view.channels, "{method}: {other} differs");
            }
        }
        if method == "path" {
            let bytes = |name: &str| fs::read(dir.join(name)).expect("the file is there");
            assert!(bytes("whole.exr") == bytes("resumed.exr") && bytes("whole.png") == bytes("resumed.png"));
        }
        let [left, right] = whole;
        assert!(left.channel("G") != right.channel("G"), "{method}: both eyes see the same");
    }
}

/// States of two eyes have another version of the format, and say where the eyes are; those of one eye are what they were. Their eyes stay,
/// and how both are shown is free.
#[test]
fn states_say_how_many_eyes_they_have() {
    let dir = folder("states");
    let version = |name: &str| fs::read(dir.join(name)).expect("the state is there")[8];
    succeed(&dir, &["--spp", "1", "--state", "one.state", "-o", "x.png", "--quiet"]);
    succeed(&dir, &["--spp", "1", "--stereo", "--state", "two.state", "-o", "x.png", "--quiet"]);
    assert_eq!([version("one.state"), version("two.state")], [1, 2]);
    assert!(program(&dir, &["info", "two.state"]).contains("eyes: two eyes, 0.100 units apart"));
    let shown = ["render", "--resume", "two.state", "--spp", "2", "-o", "x.png", "--quiet"];
    program(&dir, &[&shown[..], &["--stereo", "over-under"]].concat());
    assert_eq!(png_size(&dir.join("x.png")), [48, 64]);
    for (args, why) in [
        (&["one.state", "--stereo"][..], "--stereo cannot be changed"),
        (&["two.state", "--stereo", "--interocular", "0.2"], "--interocular cannot be changed"),
        (&["two.state", "--stereo", "--convergence", "4"], "--convergence cannot be changed"),
    ] {
        let output = run(&dir, &[&["render", "--resume"], args].concat());
        assert!(!output.status.success() && said(&output).contains(why), "{args:?}: {}", said(&output));
    }
    let output = run(&dir, &["merge", "two.state", "-o", "x.exr"]);
    assert!(
        !output.status.success() && said(&output).contains("the pictures of two eyes"),
        "{}",
        said(&output)
    );
}

/// More paths where the pilot found errors of either eye: the same bytes for any number of threads, and no other picture.
#[test]
fn adaptive_sampling_of_both_eyes() {
    let dir = folder("adaptive");
    let common = ["--spp", "64", "--deterministic"];
    for method in ["path", "bidirectional", "photon"] {
        let render = |threads: &str, more: &[&str]| {
            let method = ["--integrator", method, "--threads", threads, "-o", "eyes.exr"];
            let report = report(&dir, &[&common[..], &method, more].concat());
            (report, fs::read(dir.join("eyes.exr")).expect("is there"), views(&dir.join("eyes.exr")))
        };
        let (report, one, adaptive) = render("1", &["--adaptive"]);
        let (_, three, _) = render("3", &["--adaptive"]);
        assert!(one == three, "{method}");
        let density = |i: usize| report["adaptive"]["density"][i].as_f64().expect("a density");
        assert!(density(0) < 1.0 && density(2) > 1.0, "{report}");
        let (_, even, plain) = render("1", &[]);
        assert!(even != one, "{method}");
        for (adaptive, plain) in adaptive.iter().zip(&plain) {
            let [adaptive, plain] = [adaptive, plain].map(|view| mean(view, "G"));
            assert!((adaptive / plain - 1.0).abs() < 0.1, "{method}: {adaptive} {plain}");
        }
    }
}

/// In each view the layers of the groups add up to the picture, which is that without groups within noise: each eye has the light of all its
/// paths, also where the other has none of them.
#[test]
fn light_groups_add_up_in_each_view() {
    let dir = folder("groups");
    let lamp = r#"<emitter type="point" id="lamp"><point name="position" x="2" y="3" z="-3"/><rgb name="intensity" value="800,400,200"/></emitter>
<emitter type="constant" id="sky"/>"#;
    fs::write(dir.join("scene.xml"), SCENE.replace(r#"<emitter type="constant"/>"#, lamp))
        .expect("is written");
    for method in ["path", "light", "bidirectional", "photon", "vcm"] {
        let common = ["--spp", "64", "--integrator", method, "--deterministic", "-o", "eyes.exr"];
        report(&dir, &common);
        let without = views(&dir.join("eyes.exr"));
        let report = report(&dir, &[&common[..], &["--light-groups"]].concat());
        assert_eq!(report["light_groups"].as_array().map(Vec::len), Some(2), "{report}");
        for (view, without) in views(&dir.join("eyes.exr")).iter().zip(&without) {
            let value = |name: &str| view.channel(name).unwrap_or_else(|| panic!("no {name}"));
            let (picture, lamp, sky) = (value("G"), value("lamp.G"), value("sky.G"));
            let largest = picture.iter().copied().fold(0.0, f32::max);
            for i in 0..picture.len() {
                let off = (lamp[i] + sky[i] - picture[i]).abs() / largest;
                assert!(off < 3e-6, "{method}: the sum is off by {off}");
            }
            assert!(mean(view, "lamp.G") > 0.01 && mean(view, "sky.G") > 0.01, "{method}: a group is black");
            let [grouped, plain] = [view, without].map(|view| mean(view, "G"));
            assert!((grouped / plain - 1.0).abs() < 0.25, "{method}: {grouped} with groups, {plain} without");
        }
        let [left, right] = views(&dir.join("eyes.exr"));
        assert!(
            left.channel("lamp.G") != right.channel("lamp.G"),
            "{method}: both eyes have the same layers"
        );
    }
    let output =
        run(&dir, &["render", "scene.xml", "--stereo", "--light-groups", "--spp", "1", "-o", "eyes.exr"]);
    assert!(output.status.success() && said(&output).contains("the eyes share none"), "{}", said(&output));
}
