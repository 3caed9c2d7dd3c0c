//! Textures over space: values against Mitsuba 3.9.1, where surfaces lie, and what is refused.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use miette::Diagnostic;

use pointillist::scene::desc::BsdfDesc;
use pointillist::scene::desc::texture::{SpectrumTexture, TexturePoint};
use pointillist::scene::{FindingKind, Loaded, SceneError, load_str};
use pointillist::spectrum::SampledWavelengths;
use pointillist::tracer::Scene;
use pointillist::tracer::accel::Ray;
use pointillist::tracer::bsdf::{Bsdf, ScatteringModel};

/// A `.vol` of these points and channels, whose values are made by a rule.
fn grid(encoding: i32, size: [i32; 4], value: impl Fn(usize) -> Vec<u8>) -> Vec<u8> {
    let mut bytes = b"VOL\x03".to_vec();
    [encoding].iter().chain(&size).for_each(|n| bytes.extend(n.to_le_bytes()));
    [-1f32, -2.0, 0.0, 3.0, 1.0, 0.5].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    let count = size.iter().product::<i32>() as usize;
    (0..count).for_each(|i| bytes.extend(value(i)));
    bytes
}

/// Eleven values in turns, seven steps at a time.
fn sevenths(i: usize) -> f32 {
    (i * 7 % 11) as f32 / 11.0
}

fn floats(size: [i32; 4]) -> Vec<u8> {
    grid(1, size, |i| sevenths(i).to_le_bytes().to_vec())
}

/// An empty folder with grids in it.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("volumes_{name}"));
    let _ = std::fs::remove_dir_all(&folder); // not there the first time
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("one.vol"), floats([4, 3, 2, 1])).unwrap();
    std::fs::write(folder.join("three.vol"), floats([4, 3, 2, 3])).unwrap();
    std::fs::write(folder.join("six.vol"), floats([2, 2, 2, 6])).unwrap();
    folder
}

/// A scene in the folder; its body begins in line 2.
fn try_read(folder: &Path, body: &str) -> Result<Loaded, SceneError> {
    let beside = "<sensor type='perspective'/><emitter type='constant'/>";
    let text = format!("<scene version='3.0.0'>{beside}\n{body}\n</scene>");
    load_str(&folder.join("scene.xml").display().to_string(), &text, &[])
}

fn read(folder: &Path, body: &str) -> Loaded {
    try_read(folder, body).unwrap_or_else(|e| panic!("{body}: {e:?}"))
}

fn volume(name: &str, inner: &str) -> String {
    format!("<texture name='{name}' type='volume'>{inner}</texture>")
}

fn of_file(file: &str, more: &str) -> String {
    format!("<volume type='gridvolume'><string name='filename' value='{file}'/>{more}</volume>")
}

fn matt(inner: &str) -> String {
    format!("<bsdf type='diffuse'>{}</bsdf>", volume("reflectance", inner))
}

fn reflectance(loaded: &Loaded) -> SpectrumTexture {
    match &loaded.desc.bsdfs[0] {
        BsdfDesc::Diffuse(matt) => matt.reflectance.clone(),
        other => panic!("{other:?}"),
    }
}

const TURNED: &str = "<transform name='to_world'><scale x='2' y='3' z='.5'/><rotate z='1' angle='30'/><translate x='1' y='-2' z='.5'/></transform>";

/// `eval_1` of the same files at four places, and one colour.
#[test]
fn values_are_those_of_mitsuba() {
    let folder = folder("values");
    let places = [[0.3, 0.4, 0.6], [1.7, -0.3, 2.2], [-2.6, 3.1, -0.4], [0.02, 0.97, 0.5]];
    let string = |name: &str, value: &str| format!("<string name='{name}' value='{value}'/>");
    let (nearest, boxed) =
        (string("filter_type", "nearest"), "<boolean name='use_grid_bbox' value='true'/>".to_owned());
    let (repeat, mirror) = (string("wrap_mode", "repeat"), string("wrap_mode", "mirror"));
    let turned = TURNED.to_owned();
    for (file, more, expected) in [
        ("one", String::new(), [0.488727, 0.545455, 0.090909, 0.409091]),
        ("one", nearest.clone(), [0.818182, 0.545455, 0.090909, 0.727273]),
        ("one", repeat.clone(), [0.488727, 0.418, 0.419636, 0.419736]),
        ("one", mirror.clone(), [0.488727, 0.383636, 0.290909, 0.409091]),
        ("one", mirror + &nearest, [0.818182, 0.636364, 0.363636, 0.727273]),
        ("one", boxed.clone(), [0.461818, 0.330909, 0.090909, 0.538182]),
        ("one", turned.clone(), [0.51178, 0.476277, 0.090909, 0.582557]),
        ("three", turned + &boxed + &repeat, [0.61985, 0.509783, 0.423827, 0.58634]),
        ("three", String::new(), [0.350413, 0.395988, 0.747512, 0.702057]),
        ("six", String::new(), [0.493212, 0.348485, 0.560606, 0.530303]),
    ] {
        let loaded = read(&folder, &matt(&of_file(&format!("{file}.vol"), &more)));
        assert_eq!(loaded.warnings.len(), usize::from(file == "six"), "{:?}", loaded.warnings);
        let texture = reflectance(&loaded);
        assert_eq!(texture.is_grey(), file != "three");
        for (place, expected) in places.iter().zip(expected) {
            let at = TexturePoint { p: Vec3::from(*place), ..TexturePoint::default() };
            let found = texture.scalar(&at);
            assert!((found - expected).abs() < 1e-4, "{file} {more} at {place:?}: {found}, not {expected}");
        }
    }
    // Absolute names, and colours: the mean of all channels is that of the eleven values, but for the last turn.
    let absolute = folder.join("three.vol").display().to_string();
    let mean = reflectance(&read(&folder, &matt(&of_file(&absolute, "")))).mean().reflected_rgb();
    let by_hand = |c: usize| (0..24).map(|i| sevenths(3 * i + c)).sum::<f32>() / 24.0;
    (0..3).for_each(|c| assert!((mean[c] - by_hand(c)).abs() < 2e-3, "{mean:?}"));
    // Places that are no numbers are some place.
    for p in [Vec3::NAN, Vec3::INFINITY, Vec3::splat(-1e30), Vec3::splat(1e17)] {
        let texture = reflectance(&read(&folder, &matt(&of_file("one.vol", ""))));
        assert!(texture.scalar(&TexturePoint { p, ..TexturePoint::default() }).is_finite());
    }
}

/// Halves and bytes, which Mitsuba does not read, have the values of floats; a constant volume is a colour.
#[test]
fn encodings_and_constants() {
    let folder = folder("encodings");
    let half = |i: usize| half_bits(sevenths(i)).to_le_bytes().to_vec();
    std::fs::write(folder.join("half.vol"), grid(2, [4, 3, 2, 1], half)).unwrap();
    let byte = |i: usize| vec![(255.0 * sevenths(i)).round() as u8];
    std::fs::write(folder.join("byte.vol"), grid(3, [4, 3, 2, 1], byte)).unwrap();
    let of = |file: &str| reflectance(&read(&folder, &matt(&of_file(file, ""))));
    let (float, half, byte) = (of("one.vol"), of("half.vol"), of("byte.vol"));
    for i in 0..50 {
        let p = Vec3::new(0.02 * i as f32, 0.7 - 0.01 * i as f32, 0.3 + 0.015 * i as f32);
        let at = TexturePoint { p, ..TexturePoint::default() };
        let expected = float.scalar(&at);
        assert!((half.scalar(&at) - expected).abs() < 1e-3 && (byte.scalar(&at) - expected).abs() < 3e-3);
    }
    let constant = "<volume type='constvolume'><rgb name='value' value='.1, .5, .9'/></volume>";
    let SpectrumTexture::Uniform(spectrum) = reflectance(&read(&folder, &matt(constant))) else {
        panic!("a constant is the same everywhere")
    };
    let [r, g, b] = spectrum.reflected_rgb();
    assert!((r - 0.1).abs() + (g - 0.5).abs() + (b - 0.9).abs() < 0.01);
    let exponent = volume("exponent", "<volume type='constvolume'><float name='value' value='40'/></volume>");
    let loaded = read(&folder, &format!("<bsdf type='phong'>{exponent}</bsdf>"));
    assert!(loaded.warnings.is_empty() && loaded.desc.bsdfs[0].plugin() == "phong", "{:?}", loaded.warnings);
}

/// The bits of a number in [0, 1) as a half, rounded down.
fn half_bits(v: f32) -> u16 {
    if v == 0.0 {
        return 0;
    }
    let bits = v.to_bits();
    (((bits >> 23) as i32 - 127 + 15) as u16) << 10 | (bits >> 13 & 0x3ff) as u16
}

/// The albedo of a surface is the value at its place in world space: far from the origin, large and small, on round shapes and on what an
/// instance shows; so is an opacity.
#[test]
fn surfaces_show_the_values_where_they_lie() {
    let folder = folder("places");
    let lambda = SampledWavelengths::sample(0.3);
    for (origin, size) in [(0.0, 1.0), (1000.0, 1.0), (0.0, 1e-3), (-5e4, 300.0)] {
        let place = format!(
            "<transform name='to_world'><scale value='{}'/><translate x='{origin}' y='{origin}' z='{origin}'/></transform>",
            2.0 * size
        );
        let bsdf = format!("<bsdf type='twosided' id='b'>{}</bsdf>", matt(&of_file("one.vol", &place)));
        let alone = |kind: &str| format!("<shape type='{kind}'>{place}<ref id='b'/></shape>");
        let group = "<shape type='shapegroup' id='g'><shape type='sphere'><ref id='b'/></shape></shape>";
        let shown = format!("{group}<shape type='instance'><ref id='g'/>{place}</shape>");
        for (what, shape) in [
            ("rectangle", alone("rectangle")),
            ("cube", alone("cube")),
            ("sphere", alone("sphere")),
            ("disk", alone("disk")),
            ("instance", shown),
        ] {
            let desc = read(&folder, &format!("{bsdf}{shape}")).desc;
            let scene = Scene::prepare(&desc).unwrap();
            let bsdfs = &desc.bsdfs;
            let texture = bsdfs.iter().find_map(|bsdf| match bsdf {
                BsdfDesc::Diffuse(matt) if matt.reflectance.varies() => Some(matt.reflectance.clone()),
                _ => None,
            });
            let (texture, mut seen) = (texture.expect("a volume"), Vec::new());
            for i in 0..20 {
                let across = DVec3::new(0.09 * f64::from(i) - 0.8, 0.5 - 0.05 * f64::from(i), 3.0);
                let from = desc.space.point(DVec3::splat(origin) + across * (2.0 * size)).as_vec3();
                let Some(hit) = scene.closest(&Ray::new(from, -Vec3::Z)) else { continue };
                let surface = scene.surface_material(&hit);
                let value = surface.bsdf::<Bsdf>(&lambda).eval(Vec3::Z, Vec3::Z).expect("lit").0;
                let albedo = value.0.x * std::f32::consts::PI;
                // Far from the origin, world space has fewer digits than the space that is traced in: by the shape's own.
                let at = (desc.space.world_point(hit.point.p) - DVec3::splat(origin)) / (2.0 * size);
                let expected = sample(at);
                assert!((albedo - expected).abs() < 2e-3, "{what} at {at}: {albedo}, not {expected}");
                seen.push(albedo);
            }
            assert!(texture.asks_place() && seen.len() > 8, "{what}: {}", seen.len());
            let mean = seen.iter().sum::<f32>() / seen.len() as f32;
            assert!(seen.iter().any(|v| (v - mean).abs() > 0.03), "{what}: {seen:?}");
        }
    }
    // An edited scene has them where they were.
    let place = "<transform name='to_world'><scale value='70'/></transform>";
    let board = "<texture name='color0' type='checkerboard'/>";
    let product = format!(
        "<bsdf type='diffuse'><texture name='reflectance' type='product'>{board}{}</texture></bsdf>",
        volume("color1", &of_file("three.vol", place))
    );
    let desc = read(&folder, &format!("<shape type='rectangle'>{place}{product}</shape>")).desc;
    let anew = Scene::prepare(&desc).unwrap();
    let edited = anew.edited(&desc).unwrap();
    let value = |scene: &Scene| {
        let from = desc.space.point(DVec3::new(13.0, 20.0, 100.0)).as_vec3();
        let hit = scene.closest(&Ray::new(from, -Vec3::Z)).expect("it is below");
        scene.surface_material(&hit).bsdf::<Bsdf>(&lambda).eval(Vec3::Z, Vec3::Z).expect("lit").0.0
    };
    assert_eq!(value(&anew), value(&edited));
    let thin = format!(
        "<bsdf type='mask'>{}<bsdf type='diffuse'/></bsdf>",
        volume("opacity", &of_file("one.vol", place))
    );
    let desc = read(&folder, &format!("<shape type='rectangle'>{place}{thin}</shape>")).desc;
    let scene = Scene::prepare(&desc).unwrap();
    let from = desc.space.point(DVec3::new(13.0, 20.0, 100.0)).as_vec3();
    // By chance rays pass it: the first that does not tells.
    let hit = (0..100).find_map(|i| scene.closest(&Ray::new(from + Vec3::Z * (0.001 * i as f32), -Vec3::Z)));
    let opacity = scene.opacity(&hit.expect("met at last"));
    assert!((opacity - sample(DVec3::new(13.0, 20.0, 0.0) / 70.0)).abs() < 1e-3, "{opacity}");
}

/// The grid of one channel at a place of the unit cube, by hand.
fn sample(at: DVec3) -> f32 {
    let size = [4, 3, 2];
    let at: [f64; 3] = std::array::from_fn(|axis| at[axis] * f64::from(size[axis]) - 0.5);
    let mut sum = 0.0;
    for corner in 0..8 {
        let (mut weight, mut index) = (1.0, [0; 3]);
        for axis in 0..3 {
            let (cell, upper) = (at[axis].floor(), corner >> axis & 1);
            weight *= if upper == 1 { at[axis] - cell } else { 1.0 - (at[axis] - cell) };
            index[axis] = (cell as i32 + upper).clamp(0, size[axis] - 1);
        }
        sum += weight * f64::from(sevenths(((index[2] * 3 + index[1]) * 4 + index[0]) as usize));
    }
    sum as f32
}

/// Broken files and places where no texture over space can stand: one error with its line, which names the file.
#[test]
fn what_is_refused() {
    let folder = folder("refused");
    let whole = floats([4, 3, 2, 1]);
    let with = |at: usize, bytes: &[u8]| {
        let mut file = whole.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        file
    };
    for (what, bytes) in [
        ("too short", b"VO".to_vec()),
        ("no `.vol`", with(0, b"LOV")),
        ("version 2", with(3, &[2])),
        ("ends in its header", whole[..40].to_vec()),
        ("encoding", with(4, &7i32.to_le_bytes())),
        ("directions", with(4, &4i32.to_le_bytes())),
        ("is none", with(8, &0i32.to_le_bytes())),
        ("is none", with(20, &(-1i32).to_le_bytes())),
        ("of values, and the file has", with(8, &i32::MAX.to_le_bytes())),
        (
            "of values, and the file has",
            [with(8, &i32::MAX.to_le_bytes())[..12].to_vec(), vec![0x7f; 60]].concat(),
        ),
        ("of values, and the file has", whole[..whole.len() - 1].to_vec()),
    ] {
        std::fs::write(folder.join("broken.vol"), bytes).unwrap();
        let error = try_read(&folder, &matt(&of_file("broken.vol", ""))).expect_err(what);
        assert_eq!((error.kind(), error.location().1), (FindingKind::File, 2), "{what}: {error:?}");
        assert!(error.to_string().contains(what) && error.to_string().contains("broken.vol"), "{error}");
    }
    // What is behind the values is told.
    std::fs::write(folder.join("long.vol"), [whole.clone(), vec![1, 2, 3]].concat()).unwrap();
    let loaded = read(&folder, &matt(&of_file("long.vol", "")));
    assert!(loaded.warnings.len() == 1 && loaded.warnings[0].to_string().contains("3 bytes"));
    let empty_box = {
        let mut file = whole;
        file[24..28].copy_from_slice(&9f32.to_le_bytes());
        file
    };
    std::fs::write(folder.join("empty_box.vol"), empty_box).unwrap();
    let boxed = "<boolean name='use_grid_bbox' value='true'/>";
    let flat = "<transform name='to_world'><scale z='0'/></transform>";
    let shining = format!(
        "<shape type='disk'><emitter type='area'>{}</emitter></shape>",
        volume("radiance", &of_file("one.vol", ""))
    );
    let spot = format!("<emitter type='spot'>{}</emitter>", volume("texture", &of_file("one.vol", "")));
    let bump = format!(
        "<bsdf type='bumpmap'>{}<bsdf type='diffuse'/></bsdf>",
        volume("map", &of_file("one.vol", ""))
    );
    let other = "<volume type='other'/>";
    for (what, body) in [
        ("holds a <volume>", matt("")),
        ("second <volume>", matt(&of_file("one.vol", "").repeat(2))),
        ("other", matt(other)),
        ("box", matt(&of_file("empty_box.vol", boxed))),
        ("inverse", matt(&of_file("one.vol", flat))),
        ("missing.vol", matt(&of_file("missing.vol", ""))),
        ("filename", matt("<volume type='gridvolume'/>")),
        ("wrap_mode", matt(&of_file("one.vol", "<string name='wrap_mode' value='around'/>"))),
        ("`volume` does not shine", shining),
        ("spot", spot),
        ("picture", bump),
    ] {
        let error = try_read(&folder, &body).expect_err(what);
        assert!(error.location().1 == 2 && error.to_string().contains(what), "{what}: {error:?}");
    }
}

/// Files of OpenVDB and NanoVDB, there or not: one error with its line that names the format, and what makes a `.vol` of them.
#[test]
fn sparse_grids_are_refused_by_name() {
    let folder = folder("sparse");
    std::fs::write(folder.join("smoke.vdb"), b" BDV\0\0\0\0\xe0\0\0\0").unwrap();
    std::fs::write(folder.join("smoke.nvdb"), b"NanoVDB2").unwrap();
    let smoke = |file: &str| {
        let grid = "<string name='grid' value='density'/>";
        let sigma_t = of_file(file, grid).replace("<volume", "<volume name='sigma_t'");
        format!("<shape type='cube'><medium type='heterogeneous' name='interior'>{sigma_t}</medium></shape>")
    };
    for (file, format, program) in [
        ("smoke.vdb", "OpenVDB", "tools/vdb_to_vol"),
        ("SMOKE.VDB", "OpenVDB", "tools/vdb_to_vol"),
        ("smoke.nvdb", "NanoVDB", "nanovdb_convert"),
        ("missing.nvdb", "NanoVDB", "nanovdb_convert"),
    ] {
        for body in [matt(&of_file(file, "")), smoke(file)] {
            let error = try_read(&folder, &body).expect_err(file);
            assert_eq!((error.kind(), error.location().1), (FindingKind::File, 2), "{file}: {error:?}");
            assert!(error.to_string().contains(file) && error.to_string().contains(format), "{error}");
            let help = Diagnostic::help(&error).map(|help| help.to_string()).unwrap_or_default();
            assert!(help.contains(program) && help.contains("`.vol`"), "{file}: {help}");
        }
    }
    // The program that the help names is there.
    assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/vdb_to_vol").is_file());
}
