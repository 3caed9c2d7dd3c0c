//! `--aov` and the integrator `depth`: layers of a scene whose values are known.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use pointillist::image::exr::{self, Layers};

/// A wall of 4 × 4 metres at distance 3 with a ball of radius 0.5 in its middle; the picture shows 2 × 2 metres by parallel rays.
const SCENE: &str = r#"<scene version="3.0.0">
<sensor type="orthographic"><float name="near_clip" value="0.5"/><transform name="to_world"><lookat origin="0,0,3" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/><rfilter type="box"/></film></sensor>
<emitter type="constant"/>
<shape type="rectangle"><transform name="to_world"><scale value="2"/></transform><bsdf type="plastic"><rgb name="diffuse_reflectance" value=".6 .3 .1"/></bsdf></shape>
<shape type="sphere"><float name="radius" value="0.5"/><bsdf type="conductor"/></shape>
</scene>"#;

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cli_layers").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    fs::write(path.join("scene.xml"), SCENE).unwrap();
    path
}

fn run(dir: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    let fixed = ["render", "scene.xml", "--device", "cpu", "--quiet", "--spp", "64"];
    command.current_dir(dir).args(fixed).args(args).output().unwrap()
}

fn layers(dir: &Path, args: &[&str]) -> Layers {
    let output = run(dir, &[args, &["-o", "out.exr"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    exr::read(&dir.join("out.exr")).unwrap()
}

#[test]
fn layers_hold_what_is_seen_first() {
    let dir = folder("values");
    let list = "a:albedo,depth,pp:position,uv,nn:sh_normal,gn:geo_normal,pi:prim_index,si:shape_index";
    let seen = layers(&dir, &["--aov", list]);
    let at = |channel: &str, x: usize, y: usize| {
        seen.channel(channel).unwrap_or_else(|| panic!("no {channel}"))[y * 16 + x]
    };
    let near = |channel: &str, x: usize, y: usize, wanted: f32, within: f32| {
        let found = at(channel, x, y);
        assert!((found - wanted).abs() <= within, "{channel} at {x}, {y}: {found}, not {wanted}");
    };
    // A corner pixel, an eighth of a metre wide: its middle is 1/16 from the edge.
    for (channel, wanted) in [
        ("a.R", 0.6),
        ("a.G", 0.3),
        ("a.B", 0.1),
        ("depth.T", 2.5),
        ("pp.X", -0.9375),
        ("pp.Y", 0.9375),
        ("pp.Z", 0.0),
        ("uv.U", 0.5 - 0.9375 / 4.0),
        ("uv.V", 0.5 + 0.9375 / 4.0),
        ("nn.Z", 1.0),
        ("gn.Z", 1.0),
        ("pi.I", 0.0),
        ("si.I", 1.0),
    ] {
        near(channel, 0, 0, wanted, 4e-3);
    }
    // The ball mirrors: it has no albedo, and its top is half a metre nearer.
    near("a.G", 7, 7, 0.0, 0.0);
    near("depth.T", 7, 7, 2.5 - 0.49, 0.01);
    near("si.I", 8, 8, 2.0, 0.0);
    near("nn.X", 7, 7, -0.125, 0.01);
    // Layers change nothing of the picture.
    let (with, without) =
        (layers(&dir, &["--aov", "nn:sh_normal", "--deterministic"]), layers(&dir, &["--deterministic"]));
    assert_eq!(with.channel("R"), without.channel("R"));
    // What is written repeats them.
    let text = format!("{:?}", seen.attribute("command"));
    assert!(text.contains("--aov a:albedo,depth:depth"), "{text}");
}

#[test]
fn a_picture_of_distances_is_their_layer() {
    let dir = folder("depth");
    let seen = layers(&dir, &["--integrator", "depth", "--aov", "depth"]);
    let [r, g, depth] = ["R", "G", "depth.T"].map(|c| seen.channel(c).unwrap());
    let mut flat = 0;
    for ((r, g), depth) in r.iter().zip(g).zip(depth) {
        assert!((r - g).abs() < 1e-4 * depth, "grey");
        // On the wall nothing is left to chance.
        if (depth - 2.5).abs() < 1e-5 {
            assert!((r - 2.5).abs() < 1e-3, "{r}");
            flat += 1;
        }
    }
    assert!(flat > 150, "{flat}");
}

/// A slab of fog between camera and wall: boundaries are looked through, and the layers of media have a closed form.
#[test]
fn layers_of_media() {
    let dir = folder("media");
    let fog = r#"<shape type="cube"><transform name="to_world"><scale x="3" y="3" z=".5"/><translate z="1.5"/></transform>
<bsdf type="null"/><medium type="homogeneous" name="interior"><float name="sigma_t" value=".8"/><float name="albedo" value=".9"/></medium></shape>"#;
    let list = "t:transmittance,sd:scattering_depth,depth,si:shape_index";
    let seen = |text: &str| {
        fs::write(dir.join("scene.xml"), text).unwrap();
        let seen = layers(&dir, &["--aov", list]);
        ["t.R", "t.G", "t.B", "sd.T", "depth.T", "si.I"].map(|channel| seen.channel(channel).unwrap()[0])
    };
    let (foggy, clear) = (seen(&SCENE.replace("</scene>", &format!("{fog}</scene>"))), seen(SCENE));
    // Distances count from the near clip plane, half a metre before the camera, where the fog is half a metre away.
    let transmittance = (-0.8f32).exp();
    let scattering = 0.5 + 1.0 / 0.8 - transmittance / (1.0 - transmittance);
    for (found, wanted) in foggy.into_iter().zip([transmittance; 3].into_iter().chain([scattering, 2.5, 1.0]))
    {
        assert!((found - wanted).abs() < 1e-4, "{found}, not {wanted}");
    }
    for (found, wanted) in clear.into_iter().zip([1.0, 1.0, 1.0, 0.0, 2.5, 1.0]) {
        assert!((found - wanted).abs() < 1e-5, "{found}, not {wanted}");
    }
}

#[test]
fn wrong_lists_are_refused_before_anything_is_rendered() {
    let dir = folder("wrong");
    for list in ["albedos", "a:dp_du", "camera:depth", "a:depth,a:depth"] {
        let output = run(&dir, &["--aov", list, "-o", "out.exr"]);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && !text.contains("panicked"), "{list}: {text}");
        assert!(list == "a:depth,a:depth" || list == "camera:depth" || text.contains("sh_normal"), "{text}");
        assert!(!dir.join("out.exr").exists());
    }
    // Layers without a file that can hold them are told of.
    let output = run(&dir, &["--aov", "depth", "-o", "out.png"]);
    assert!(output.status.success() && String::from_utf8_lossy(&output.stderr).contains("EXR"));
    let large = run(
        &dir,
        &["--aov", "a:albedo,b:albedo,c:albedo,d:albedo", "--size", "16384x16384", "-o", "out.exr"],
    );
    let text = String::from_utf8_lossy(&large.stderr).into_owned();
    assert!(!large.status.success() && text.contains("too large") && text.contains("--size"), "{text}");
}
