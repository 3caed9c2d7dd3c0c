//! `pointillist compare` as a user meets it: files of any program in, figures and maps out, nothing overwritten.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, LayerAttributes, LineOrder,
    Vec2, WritableImage, f16,
};
use pointillist::color::palette;
use pointillist::image::exr::{self, Layers};
use serde_json::Value;

/// An empty folder for one test.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("compare_cli").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn run(dir: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(dir).arg("compare").args(args).output().unwrap()
}

#[track_caller]
fn succeed(dir: &Path, args: &[&str]) -> String {
    let output = run(dir, args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[track_caller]
fn json(dir: &Path, args: &[&str]) -> Value {
    serde_json::from_str(&succeed(dir, &[args, &["--json"]].concat())).unwrap()
}

#[track_caller]
fn refused(dir: &Path, args: &[&str], words: &[&str]) {
    let output = run(dir, args);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    // Long lines are broken between a bar and blanks.
    let flat = errors.replace('│', " ").split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(output.status.code(), Some(1), "{args:?}: {errors}");
    assert!(words.iter().all(|w| flat.contains(w)), "{args:?}: {errors}");
}

/// The figure of this name.
#[track_caller]
fn metric<'a>(figures: &'a Value, name: &str) -> &'a Value {
    let all = figures["metrics"].as_array().unwrap();
    all.iter().find(|m| m["metric"] == name).unwrap_or_else(|| panic!("no {name} in {figures}"))
}

const SIZE: (usize, usize) = (20, 10);

/// Some picture, with `change` applied to its pixels.
fn pixels(change: impl Fn(usize, [f32; 3]) -> [f32; 3]) -> Vec<[f32; 3]> {
    let pixel = |i: usize| [0.25 + (i % 7) as f32 / 8.0, 0.5, 0.125 * (i % 3) as f32];
    (0..SIZE.0 * SIZE.1).map(|i| change(i, pixel(i))).collect()
}

/// Writes a file as this program does.
fn ours(path: &Path, pixels: &[[f32; 3]], variance: Option<f32>) {
    let mut layers = Layers { width: SIZE.0, height: SIZE.1, ..Layers::default() };
    for (k, name) in ["R", "G", "B"].into_iter().enumerate() {
        layers.push(name, pixels.iter().map(|p| p[k]));
    }
    if let Some(variance) = variance {
        layers.push("variance.Y", pixels.iter().map(|_| variance));
        layers.push("camera.Y", pixels.iter().map(|_| 7.0));
    }
    exr::write(path, &layers).unwrap();
}

/// Writes a file as others do: any channels, tiled, its data window away from the origin.
fn theirs(path: &Path, channels: Vec<(&str, FlatSamples)>) {
    let list = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
    let blocks = Blocks::Tiles(Vec2(8, 8));
    let encoding = Encoding { compression: Compression::PIZ, blocks, line_order: LineOrder::Unspecified };
    let own = LayerAttributes { layer_position: Vec2(-5, 300), ..LayerAttributes::default() };
    let layer = ::exr::prelude::Layer::new(Vec2(SIZE.0, SIZE.1), own, encoding, AnyChannels::sort(list));
    Image::from_layer(layer).write().to_file(path).unwrap();
}

fn halves(pixels: &[[f32; 3]], k: usize) -> FlatSamples {
    FlatSamples::F16(pixels.iter().map(|p| f16::from_f32(p[k])).collect())
}

#[test]
fn equal_pictures_have_no_error() {
    let dir = folder("equal");
    ours(&dir.join("a.exr"), &pixels(|_, p| p), Some(1e-4));
    let figures = json(&dir, &["a.exr", "a.exr"]);
    for name in ["relmse", "trimmed", "smape", "flip", "delta-e"] {
        assert_eq!(metric(&figures, name)["value"], 0.0, "{name}");
        assert!(metric(&figures, name).get("worst").is_none());
    }
    assert_eq!(
        (&metric(&figures, "z")["value"], &metric(&figures, "z")["details"]["mean_z2"]),
        (&1.0.into(), &0.0.into())
    );
    assert!(metric(&figures, "rse")["value"].as_f64().unwrap() > 0.01);
    assert_eq!((&figures["width"], &figures["height"]), (&20.into(), &10.into()));
}

#[test]
fn differences_are_found_where_they_are() {
    let dir = folder("different");
    let changed = pixels(|i, p| if i == 4 * 20 + 13 { [2.0; 3] } else { p.map(|c| 1.01 * c) });
    ours(&dir.join("a.exr"), &changed, Some(1e-4));
    ours(&dir.join("b.exr"), &pixels(|_, p| p), Some(1e-4));
    let figures = json(&dir, &["a.exr", "b.exr"]);
    for name in ["relmse", "trimmed", "smape", "flip", "delta-e", "z"] {
        let worst = &metric(&figures, name)["worst"];
        assert_eq!((&worst["x"], &worst["y"]), (&13.into(), &4.into()), "{name}: {worst}");
    }
    let value = |name: &str| metric(&figures, name)["value"].as_f64().unwrap();
    assert!(value("trimmed") < 0.1 * value("relmse"), "{figures}");
    assert!((value("z") - 0.995).abs() < 1e-9, "{figures}");
    let table = succeed(&dir, &["a.exr", "b.exr", "--metric", "smape,z,smape"]);
    let rows: Vec<&str> = table.lines().map(|l| l.split_whitespace().next().unwrap()).collect();
    assert_eq!(rows, ["METRIC", "smape", "z", "critical"], "{table}");
    assert!(table.contains("at 13,4") && table.contains("less is better"), "{table}");
    // Exposure acts on what is displayed, and on nothing else.
    let dark = json(&dir, &["a.exr", "b.exr", "--exposure", "0.01"]);
    assert!(metric(&dark, "delta-e")["value"].as_f64().unwrap() < 0.5 * value("delta-e"));
    assert_eq!(metric(&dark, "relmse"), metric(&figures, "relmse"));
}

/// Half floats, integers, layers, grey, tiles and windows of any place give the picture that floats do.
#[test]
fn files_of_other_programs_are_read() {
    let dir = folder("foreign");
    let all = pixels(|_, p| p);
    ours(&dir.join("b.exr"), &all, None);
    let layer = |prefix: &'static str, names: [&'static str; 3]| {
        let name = move |k: usize| &*Box::leak(format!("{prefix}{}", names[k]).into_boxed_str());
        [0, 1, 2].map(|k| (name(k), halves(&all, k)))
    };
    let rgb = ["R", "G", "B"];
    let other = |prefix: &'static str| layer(prefix, rgb).map(|(n, _)| (n, FlatSamples::F32(vec![9.0; 200])));
    for (name, channels) in [
        ("plain", layer("", rgb).to_vec()),
        ("layer", layer("beauty.", rgb).to_vec()),
        ("blender", layer("ViewLayer.Combined.", rgb).to_vec()),
        ("nuke", layer("rgba.", ["red", "green", "blue"]).to_vec()),
        ("both", [layer("", rgb), other("albedo.")].concat()),
    ] {
        theirs(&dir.join("a.exr"), channels);
        let figures = json(&dir, &["a.exr", "b.exr"]);
        assert_eq!(metric(&figures, "relmse")["value"], 0.0, "{name}");
        let left_out: Vec<_> = figures["left_out"].as_array().unwrap().iter().map(|l| &l["metric"]).collect();
        assert_eq!(left_out, ["rse", "z"], "{name}");
    }
    theirs(&dir.join("a.exr"), [layer("beauty.", rgb), other("albedo.")].concat());
    refused(&dir, &["a.exr", "b.exr"], &["a.exr", "beauty", "albedo", "--layer NAME"]);
    refused(
        &dir,
        &["a.exr", "b.exr", "--layer", "beauty"],
        &["b.exr", "no layer “beauty”", "without a name"],
    );
    let figures = json(&dir, &["a.exr", "b.exr", "--layer", "beauty,"]);
    assert_eq!(
        (&figures["picture"]["layer"], &metric(&figures, "smape")["value"]),
        (&"beauty".into(), &0.0.into())
    );
    assert!(succeed(&dir, &["a.exr", "b.exr", "--layer", "beauty,"]).contains("a.exr: layer beauty"));
    let grey = FlatSamples::U32(vec![1; 200]);
    theirs(&dir.join("grey.exr"), vec![("Y", grey), ("A", FlatSamples::F32(vec![1.0; 200]))]);
    ours(&dir.join("white.exr"), &pixels(|_, _| [1.0; 3]), None);
    assert_eq!(metric(&json(&dir, &["grey.exr", "white.exr"]), "relmse")["value"], 0.0);
    theirs(&dir.join("depth.exr"), vec![("Z", FlatSamples::F32(vec![1.0; 200]))]);
    refused(&dir, &["depth.exr", "b.exr"], &["depth.exr", "no layer has R, G, B", "channels are Z"]);
}

#[test]
fn maps_are_written_as_colours_and_as_numbers() {
    let dir = folder("maps");
    ours(&dir.join("a.exr"), &pixels(|i, p| if i == 25 { [3.0; 3] } else { p }), Some(1e-4));
    ours(&dir.join("b.exr"), &pixels(|_, p| p), Some(1e-4));
    let table = succeed(&dir, &["a.exr", "b.exr", "--map", "map.png"]);
    assert!(table.contains("map.png: flip from 0, black, to 1"), "{table}");
    let map = image::open(dir.join("map.png")).unwrap().into_rgb8();
    let rgb: Vec<[u8; 3]> = map.pixels().map(|pixel| pixel.0).collect();
    assert_eq!((map.width(), map.height(), rgb[199]), (20, 10, palette::color(0.0)));
    let brightness = |p: [u8; 3]| p.iter().map(|c| u32::from(*c)).sum::<u32>();
    let brightest = rgb.iter().map(|p| brightness(*p)).max().unwrap();
    assert!(brightness(rgb[25]) == brightest && brightest > 100, "{:?} of {brightest}", rgb[25]);
    let figures = json(&dir, &["a.exr", "b.exr", "--map", "map.exr", "--metric", "relmse,flip"]);
    let map = exr::read(&dir.join("map.exr")).unwrap();
    let relmse = map.channel("Y").unwrap();
    let mean = relmse.iter().map(|&v| f64::from(v)).sum::<f64>() / 200.0;
    assert!((mean - metric(&figures, "relmse")["value"].as_f64().unwrap()).abs() < 1e-6 * mean);
    assert_eq!(relmse.iter().filter(|v| **v > 0.0).count(), 1);
    succeed(&dir, &["a.exr", "b.exr", "--json=figures.json"]);
    let text = fs::read_to_string(dir.join("figures.json")).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&text).unwrap()["reference"]["file"], "b.exr");
    for name in ["trimmed", "smape", "delta-e", "rse", "z"] {
        succeed(&dir, &["a.exr", "b.exr", "--map", "map.png", "--metric", name]);
    }
}

#[test]
fn pixels_that_are_not_finite_count_as_wrong() {
    let dir = folder("nan");
    let odd = |value: f32| pixels(move |i, p| if i == 41 { [p[0], value, p[2]] } else { p });
    ours(&dir.join("b.exr"), &pixels(|_, p| p), Some(1e-4));
    for value in [f32::NAN, f32::INFINITY] {
        ours(&dir.join("a.exr"), &odd(value), Some(1e-4));
        let figures = json(&dir, &["a.exr", "b.exr", "--map", "map.png"]);
        assert_eq!(figures["picture"]["not_finite"], 1);
        assert!(metric(&figures, "relmse")["value"].is_null());
        assert_eq!(metric(&figures, "trimmed")["value"], 0.0);
        assert_eq!(metric(&figures, "smape")["value"].as_f64().unwrap(), 1.0 / 200.0);
        for name in ["smape", "flip", "delta-e"] {
            let worst = &metric(&figures, name)["worst"];
            assert_eq!(
                (&worst["x"], &worst["y"], &worst["value"]),
                (&1.into(), &2.into(), &1.0.into()),
                "{name}"
            );
        }
        let table = succeed(&dir, &["a.exr", "b.exr"]);
        assert!(table.contains("inf") && table.contains("a.exr: 1 pixel is not finite"), "{table}");
    }
}

#[test]
fn bad_requests_say_what_to_do_and_leave_files_alone() {
    let dir = folder("refused");
    ours(&dir.join("a.exr"), &pixels(|_, p| p), None);
    ours(&dir.join("b.exr"), &pixels(|_, p| p), Some(0.0));
    let mut small = Layers { width: 2, height: 1, ..Layers::default() };
    ["R", "G", "B"].into_iter().for_each(|name| small.push(name, [1.0, 2.0]));
    exr::write(&dir.join("small.exr"), &small).unwrap();
    fs::write(dir.join("text.exr"), "no picture").unwrap();
    let bytes = fs::read(dir.join("a.exr")).unwrap();
    fs::write(dir.join("cut.exr"), &bytes[..bytes.len() / 2]).unwrap();
    let mut deep = bytes.clone();
    deep[5] |= 1 << 3;
    fs::write(dir.join("deep.exr"), deep).unwrap();
    std::os::unix::fs::symlink("a.exr", dir.join("link.exr")).unwrap();
    for (args, words) in [
        (&["none.exr", "b.exr"][..], &["none.exr", "check the path"][..]),
        (&["a.exr", "text.exr"], &["text.exr", "not an OpenEXR file"]),
        (&["cut.exr", "b.exr"], &["cut.exr", "no picture that can be read"]),
        (&["deep.exr", "b.exr"], &["deep.exr", "deep pixels are not read", "flatten"]),
        (&[".", "b.exr"], &["cannot read ."]),
        (&["a.exr", "small.exr"], &["a.exr has 20×10", "small.exr has 2×1", "same size"]),
        (
            &["a.exr", "b.exr", "--metric", "z"],
            &["z cannot be measured", "a.exr has no channel variance.Y", "render"],
        ),
        (&["a.exr", "b.exr", "--metric", "rse"], &["rse cannot be measured", "a.exr"]),
        (&["b.exr", "a.exr", "--metric", "flip,z"], &["a.exr has no channel variance.Y"]),
        (&["a.exr", "b.exr", "--layer", "a,b,c"], &["--layer takes one name"]),
        (&["a.exr", "b.exr", "--layer", "sky"], &["a.exr", "no layer “sky”"]),
        (&["a.exr", "b.exr", "--map", "a.exr"], &["--map a.exr would overwrite the picture"]),
        (&["a.exr", "b.exr", "--map", "link.exr"], &["link.exr would overwrite the picture"]),
        (&["a.exr", "b.exr", "--json=./b.exr"], &["would overwrite the reference"]),
        (&["a.exr", "b.exr", "--map", "c.png", "--json=c.png"], &["--map and --json", "c.png"]),
        (&["a.exr", "b.exr", "--map", "map.jpg"], &["map.jpg", ".exr or .png"]),
        (&["a.exr", "b.exr", "--map", "nowhere/map.png"], &["nowhere/map.png", "folder does not exist"]),
    ] {
        refused(&dir, args, words);
    }
    assert_eq!(run(&dir, &["a.exr", "b.exr", "--metric", "psnr"]).status.code(), Some(2));
    assert!(fs::read(dir.join("a.exr")).unwrap() == bytes, "a picture was changed");
    let left: Vec<_> = fs::read_dir(&dir).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 7, "{left:?}");
}
