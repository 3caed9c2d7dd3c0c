//! `--light-groups` and `mix`: layers that add up to the picture, on both devices, and mixes of them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use pointillist::image::exr::{self, Layers};
use pointillist::image::layer;

/// A floor, a ball of glass, two lamps and a sky.
const SCENE: &str = r#"<scene version="3.0.0">
<sensor type="perspective"><float name="fov" value="45"/><transform name="to_world"><lookat origin="0,2,-6" target="0,.5,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film></sensor>
<shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/></transform></shape>
<shape type="sphere"><float name="radius" value=".7"/><transform name="to_world"><translate y=".7"/></transform><bsdf type="dielectric"/></shape>
<shape type="sphere" id="lamp1"><float name="radius" value=".3"/><transform name="to_world"><translate x="-2" y="2"/></transform>
<emitter type="area"><rgb name="radiance" value="9,3,1"/></emitter></shape>
<emitter type="point" id="lamp2"><point name="position" x="2" y="3" z="-1"/><rgb name="intensity" value="2,4,8"/></emitter>
<emitter type="constant" id="sky"><rgb name="radiance" value=".2,.3,.5"/></emitter>
</scene>"#;

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cli_light_groups").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).expect("a folder can be made");
    fs::write(path.join("scene.xml"), SCENE).expect("the scene can be written");
    path
}

fn run(dir: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(dir).args(args).output().expect("the program runs")
}

#[track_caller]
fn succeed(dir: &Path, args: &[&str]) -> Output {
    let output = run(dir, args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

#[track_caller]
fn fail(dir: &Path, args: &[&str], why: &str) {
    let output = run(dir, args);
    let said = String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(!output.status.success() && said.contains(why), "{args:?}: {said}");
}

fn render(dir: &Path, args: &[&str]) -> Layers {
    succeed(dir, &[&["render", "scene.xml", "--quiet", "--spp", "16", "-o", "out.exr"], args].concat());
    exr::read(&dir.join("out.exr")).expect("the picture can be read")
}

fn pixels(layers: &Layers, name: &str) -> Vec<[f32; 3]> {
    layer::named(layers, name).unwrap_or_else(|| panic!("no layer {name}")).pixels()
}

/// The largest difference of the picture from the sum of these layers, over its largest value.
fn difference(layers: &Layers, groups: &[&str]) -> f32 {
    let groups: Vec<_> = groups.iter().map(|name| pixels(layers, name)).collect();
    let (mut most, mut largest) = (0.0f32, 0.0f32);
    for (i, pixel) in pixels(layers, "").iter().enumerate() {
        for c in 0..3 {
            let sum: f32 = groups.iter().map(|group| group[i][c]).sum();
            most = most.max((sum - pixel[c]).abs());
            largest = largest.max(pixel[c]);
        }
    }
    most / largest
}

#[test]
fn layers_add_up_to_the_picture_that_is_made_without() {
    let dir = folder("sum");
    // "0" is the first Vulkan device, lavapipe where there is no GPU.
    for device in ["cpu", "0"] {
        for integrator in ["path", "light", "bidirectional", "photon", "vcm"] {
            let common = ["--device", device, "--integrator", integrator, "--deterministic"];
            let with = render(&dir, &[&common[..], &["--light-groups"]].concat());
            let without = render(&dir, &common);
            assert_eq!(
                with.channel("G"),
                without.channel("G"),
                "{device}, {integrator}: the picture is another"
            );
            let off = difference(&with, &["lamp1", "lamp2", "sky"]);
            assert!(off < 3e-6, "{device}, {integrator}: the sum is off by {off}");
            for name in ["lamp1", "lamp2", "sky"] {
                let light: f32 = pixels(&with, name).iter().flatten().sum();
                assert!(light > 0.1, "{device}, {integrator}: {name} is black");
            }
        }
    }
}

#[test]
fn other_options_work_with_groups() {
    let dir = folder("options");
    let named = ["--light-groups", "key=lamp1,lamp2;fill=sky"];
    for options in [
        &["--adaptive", "--spp", "32"][..],
        &["--denoise", "wavelet"],
        &["--error", "20%", "--spp", "64"],
        &["--time", "1"],
        &["--aov", "albedo"],
    ] {
        let mut args = vec!["render", "scene.xml", "--quiet", "--device", "cpu", "-o", "out.exr"];
        args.extend(named);
        args.extend(options);
        if options[0] == "--time" || options.contains(&"--spp") {
            succeed(&dir, &args);
        } else {
            args.extend(["--spp", "8"]);
            succeed(&dir, &args);
        }
        let layers = exr::read(&dir.join("out.exr")).expect("the picture can be read");
        let off = difference(&layers, &["key", "fill"]);
        assert!(off < 3e-6, "{options:?}: the sum is off by {off}");
        let said = format!("{:?}", layers.attribute("command"));
        assert!(said.contains("--light-groups 'key=lamp1,lamp2;fill=sky'"), "{said}");
    }
}

#[test]
fn groups_and_their_memory_are_told() {
    let dir = folder("told");
    let args = [
        "render",
        "scene.xml",
        "--light-groups",
        "key=lamp2",
        "--device",
        "cpu",
        "--spp",
        "1",
        "-o",
        "out.exr",
        "--json",
        "-",
    ];
    let output = succeed(&dir, &args);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        said.contains("2 groups of lights: key (lamp2), others (lamp1, sky); their films take 0.0 MiB"),
        "{said}"
    );
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let expected = serde_json::json!([{"name": "key", "emitters": ["lamp2"]}, {"name": "others", "emitters": ["lamp1", "sky"]}]);
    assert_eq!(json["light_groups"], expected);
}

#[test]
fn what_cannot_be_is_refused_at_once() {
    let dir = folder("refused");
    let exr = ["-o", "out.exr"];
    for (args, why) in [
        (
            &["--light-groups", "key=lamp3"][..],
            "no emitter `lamp3` for the group `key` help: did you mean `lamp1`? known here: lamp1, lamp2, sky",
        ),
        (&["--light-groups", "a=sky;b=sky"], "the emitter `sky` is named twice"),
        (&["--light-groups", "light=sky"], "the picture's file has such a layer"),
        (&["--light-groups", "--check-plan", "1"], "leave --check-plan away"),
        (&["--light-groups", "--reweight-fireflies"], "leave --reweight-fireflies away"),
        (&["--light-groups", "--integrator", "depth"], "shows distances"),
        (&["--light-groups", "--state", "s.state"], "a state cannot be kept with --light-groups"),
        (&["--light-groups", "sky", "--aov", "sky:albedo"], "would be there twice"),
    ] {
        fail(&dir, &[&["render", "scene.xml", "--device", "cpu", "--quiet"], &exr[..], args].concat(), why);
    }
    fail(&dir, &["render", "scene.xml", "--light-groups"], "give -o FILE.exr");
}

/// A medium that shines is an emitter like any other, named by its id.
#[test]
fn a_fire_is_a_group() {
    let dir = folder("fire");
    let fire = "<shape type='sphere'><float name='radius' value='.5'/><bsdf type='null'/><medium type='homogeneous' id='fire' \
                name='interior'><float name='radiance' value='40'/></medium></shape></scene>";
    let scene =
        SCENE.replace("</scene>", fire).replace("<integrator type='path'", "<integrator type='volpath'");
    fs::write(dir.join("fire.xml"), scene).expect("the scene can be written");
    let args = ["render", "fire.xml", "--device", "cpu", "--spp", "16", "--light-groups", "-o", "out.exr"];
    let output = succeed(&dir, &args);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("4 groups of lights: lamp1, lamp2, sky, fire"), "{said}");
    let layers = exr::read(&dir.join("out.exr")).expect("the picture can be read");
    assert!(difference(&layers, &["lamp1", "lamp2", "sky", "fire"]) < 1e-5);
    assert!(pixels(&layers, "fire").iter().any(|pixel| pixel[1] > 0.1));
}

#[test]
fn a_mix_is_made_and_found_again() {
    let dir = folder("mix");
    let layers = render(&dir, &["--device", "cpu", "--light-groups"]);
    let sets = ["--set", "lamp1=2", "--set", "sky=0,0.5,3"];
    let output = succeed(&dir, &[&["mix", "out.exr", "-o", "mix.exr", "-o", "mix.png"], &sets[..]].concat());
    assert_eq!(String::from_utf8_lossy(&output.stdout), "--set lamp1=2 --set lamp2=1 --set sky=0,0.5,3\n");
    let mix = exr::read(&dir.join("mix.exr")).expect("the mix can be read");
    assert!(difference(&mix, &["lamp1", "lamp2", "sky"]) < 1e-6);
    let (lamp, mixed) = (pixels(&layers, "lamp1"), pixels(&mix, "lamp1"));
    assert!(lamp.iter().zip(&mixed).all(|(a, b)| (0..3).all(|c| b[c] == 2.0 * a[c])));
    let png = fs::read(dir.join("mix.png")).expect("the PNG is there");
    assert_eq!(png[..4], *b"\x89PNG");
    // The factors of the mix are found in it.
    let output = succeed(&dir, &["mix", "out.exr", "--like", "mix.exr", "--set", "lamp2=1"]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let found: Vec<f32> = said
        .split_whitespace()
        .filter_map(|word| word.split_once('='))
        .flat_map(|(_, factors)| {
            factors.split(',').map(|f| f.parse().expect("a number")).collect::<Vec<f32>>()
        })
        .collect();
    let expected = [2.0, 2.0, 2.0, 1.0, 0.0, 0.5, 3.0];
    assert_eq!(found.len(), expected.len(), "{said}");
    assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 2e-3), "{said}");
    fail(&dir, &["mix", "out.exr", "-o", "a.png", "--set", "lamp3=1"], "did you mean `lamp1`?");
    fail(&dir, &["mix", "out.exr", "-o", "a.png", "--set", "sky=-1"], "expected GROUP=F or GROUP=R,G,B");
    fail(&dir, &["mix", "out.exr", "-o", "out.exr"], "would overwrite out.exr");
    fail(&dir, &["mix", "out.exr"], "there is nothing to do");
    render(&dir, &["--device", "cpu"]);
    fail(&dir, &["mix", "out.exr", "-o", "a.png"], "has no pictures of groups of lights");
}
