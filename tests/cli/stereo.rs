//! `--stereo`: views of EXR files, and pictures of both eyes.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use pointillist::image::exr;

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

fn render(dir: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(dir).args(["render", "scene.xml"]).args(args).output().expect("the program runs")
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
        let mean = |view: &str, of: &str| {
            let view = file.view(view).expect("the view is there");
            let (_, values) =
                view.channels.iter().find(|(name, _)| name == of).expect("the channel is there");
            values.iter().sum::<f32>() / values.len() as f32
        };
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
        (&["--stereo", "--convergence", "toed-in"], "trapezoids"),
        (&["--stereo", "--interocular", "0"], "above 0"),
        (&["--interocular", "1"], "--stereo"),
        (&["--stereo", "--adaptive"], "--adaptive"),
        (&["--stereo", "--denoise", "wavelet"], "--denoise"),
        (&["--stereo", "--light-groups", "-o", "x.exr"], "--light-groups"),
        (&["--stereo", "--state", "x.state"], "--state"),
        (&["-o", "x.mpo"], ".exr or .png"),
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
