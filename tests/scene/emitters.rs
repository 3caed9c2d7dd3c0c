//! Lights whose emission varies: what is read, shared, changed and refused.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pointillist::scene::desc::emission_texture::EmissionTexels;
use pointillist::scene::desc::{LightDesc, ProjectorDesc, SpotDesc};
use pointillist::scene::edit::{NewValue, Target};
use pointillist::scene::{FindingKind, Loaded, SceneError, load};
use pointillist::spectrum::Spectrum;

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scene_emitters").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder for tests");
    let pixels =
        "1 2 3  0.5 0 -1".split_whitespace().flat_map(|v| v.parse::<f32>().expect("a number").to_le_bytes());
    let bytes: Vec<u8> = b"PF\n2 1\n-1.0\n".iter().copied().chain(pixels).collect();
    std::fs::write(folder.join("two.pfm"), bytes).expect("a picture for tests");
    folder
}

fn read(name: &str, body: &str) -> Result<Loaded, SceneError> {
    let file = folder(name).join("t.xml");
    std::fs::write(&file, format!("<scene version='3.0.0'><sensor type='perspective'/>\n{body}\n</scene>"))
        .expect("a file for tests");
    load(&file, &[])
}

fn lamp(emission: &str) -> String {
    format!("<shape type='rectangle'><emitter type='area'>{emission}</emitter></shape>")
}

const PICTURE: &str =
    "<texture type='bitmap' id='p' name='radiance'><string name='filename' value='two.pfm'/></texture>";

#[test]
fn a_texture_that_shines_is_unbounded_and_shared() {
    let again = "<ref id='p' name='radiance'/>";
    let lit = "<spectrum type='d65' name='radiance'><float name='scale' value='3'/>\
               <texture type='bitmap'><string name='filename' value='two.pfm'/></texture></spectrum>";
    let loaded = read("shared", &[lamp(PICTURE), lamp(again), lamp(lit)].concat()).expect("valid");
    let shapes = &loaded.desc.shapes;
    let textures: Vec<_> =
        shapes.iter().map(|s| s.emission_profile.texture.clone().expect("a texture")).collect();
    assert!(Arc::ptr_eq(&textures[0], &textures[1]) && !Arc::ptr_eq(&textures[0], &textures[2]));
    let maps: Vec<_> = textures
        .iter()
        .map(|t| match &t.texels {
            EmissionTexels::Picture(map) => map.clone(),
            EmissionTexels::Squares(..) => panic!("a picture"),
        })
        .collect();
    assert!(Arc::ptr_eq(&maps[0], &maps[2]), "one picture");
    let brightness = 0.2126 + 0.7152 * 2.0 + 0.0722 * 3.0;
    assert!((maps[0].luminance(0, 0) - brightness).abs() < 1e-5 && maps[0].rows() == 1);
    assert_eq!(shapes[0].emission, Some(Spectrum::Constant(1.0)));
    assert_eq!(shapes[2].emission, Some(Spectrum::Constant(3.0)));
    // The negative texel is told of once.
    let warnings: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert!(
        warnings.iter().filter(|w| w.contains("1 have negative components")).count() == 1,
        "{warnings:?}"
    );
}

#[test]
fn textured_lights_are_edited_by_a_factor() {
    let projector = format!(
        "<emitter type='projector'>{}</emitter>",
        PICTURE.replace("radiance", "irradiance").replace(" id='p'", "")
    );
    let spot = "<emitter type='spot'><texture type='checkerboard' name='texture'/></emitter>";
    let mut desc = read("edited", &[&lamp(PICTURE), &projector, spot].concat()).expect("valid").desc;
    for target in [Target::Emission(0), Target::Light(0), Target::Light(1)] {
        target.set(&mut desc, NewValue::Scale(2.0)).expect("a factor");
    }
    assert_eq!(desc.shapes[0].emission, Some(Spectrum::Constant(2.0)));
    assert_eq!(*desc.lights[0].spectrum(), Spectrum::Constant(2.0));
    assert_eq!(*desc.lights[1].spectrum(), Spectrum::D65(2.0));
    for target in [Target::EmissionColor(0), Target::LightColor(0)] {
        assert!(target.get(&desc).is_err(), "texels have colours of their own");
    }
    assert!(Target::LightColor(1).get(&desc).is_ok());
}

#[test]
fn projectors_spots_and_beams_are_read() {
    let projector = |more: &str| {
        let text = format!(
            "<emitter type='projector'>{}{more}</emitter>",
            PICTURE.replace("radiance", "irradiance")
        );
        let desc = read("projector", &text).expect("valid").desc;
        let LightDesc::Projector(ProjectorDesc { half_size, irradiance, .. }) = &desc.lights[0] else {
            panic!("{:?}", desc.lights)
        };
        (half_size.to_array(), irradiance.clone())
    };
    let fov = "<float name='fov' value='90'/>";
    let close = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9;
    // As Mitsuba 3.9.1, with a picture twice as wide as high.
    assert!(close(projector(fov).0, [1.0, 0.5]));
    assert!(close(projector(&format!("{fov}<string name='fov_axis' value='smaller'/>")).0, [2.0, 1.0]));
    let diagonal = projector(&format!("{fov}<string name='fov_axis' value='diagonal'/>")).0;
    assert!((diagonal[0] - 2.0 / 5f64.sqrt()).abs() < 1e-9);
    assert_eq!(projector("<float name='scale' value='4'/>").1, Spectrum::Constant(4.0));

    let text = "<emitter type='spot'><rgb name='texture' value='0.5, 0.25, 0.25'/></emitter>";
    let desc = read("spot", text).expect("valid").desc;
    assert!(matches!(&desc.lights[0], LightDesc::Spot(SpotDesc { texture: Some(_), .. })));

    let loaded = read("beam", &lamp("").replace("'area'", "'directionalarea'")).expect("valid");
    assert!(loaded.desc.shapes[0].emission_profile.along_normal);
    let remarks: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert!(remarks.iter().any(|r| r.contains("bidirectional")), "{remarks:?}");
}

/// As in Mitsuba, an area emitter may stand outside of the shape that refers to it.
#[test]
fn an_area_emitter_is_read_where_a_shape_refers_to_it() {
    let light = "<emitter type='area' id='e'><rgb name='radiance' value='2,3,4'/></emitter>";
    let shape = "<shape type='rectangle'><ref id='e'/></shape>";
    let within = read("within", &lamp("<rgb name='radiance' value='2,3,4'/>")).expect("valid").desc;
    for (name, body) in [("before", format!("{light}{shape}")), ("behind", format!("{shape}{light}"))] {
        let loaded = read(name, &body).expect("valid");
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        assert_eq!(
            format!("{:?}", loaded.desc.shapes[0].emission),
            format!("{:?}", within.shapes[0].emission)
        );
    }
    let twice = read("twice", &format!("{light}{shape}{shape}")).expect("valid").desc;
    assert!(twice.shapes.len() == 2 && twice.shapes.iter().all(|shape| shape.emission.is_some()));
    let error = read("nobody", &format!("{light}<shape type='sphere'/>")).expect_err("no shape has it");
    assert!(error.kind() == FindingKind::Plugin && error.location().1 == 2, "{error}");
}

#[test]
fn what_cannot_shine_is_refused_at_its_place() {
    let checks =
        |color: &str| lamp(&format!("<texture type='checkerboard' name='radiance'>{color}</texture>"));
    let projector = |body: &str| format!("<emitter type='projector'>{body}</emitter>");
    let nested = "<texture name='color0' type='checkerboard'/>";
    for (name, body, kind) in [
        ("nested", checks(nested), FindingKind::Value),
        ("negative", checks("<rgb name='color1' value='-1, 0, 0'/>"), FindingKind::Value),
        ("unknown", lamp("<texture type='wood' name='radiance'/>"), FindingKind::Plugin),
        ("nothing", lamp("<texture type='bitmap' name='radiance'/>"), FindingKind::Missing),
        ("missing", lamp(&PICTURE.replace("two.pfm", "none.pfm")), FindingKind::File),
        ("cut short", lamp(&PICTURE.replace("two.pfm", "t.xml")), FindingKind::File),
        ("fov", projector("<float name='fov' value='180'/>"), FindingKind::Value),
        ("scale", projector("<float name='scale' value='-1'/>"), FindingKind::Value),
        (
            "sheared",
            projector("<transform name='to_world'><scale value='2'/></transform>"),
            FindingKind::Value,
        ),
        ("outside", "<emitter type='directionalarea'/>".to_owned(), FindingKind::Plugin),
        ("inside", lamp("").replace("'area'", "'projector'"), FindingKind::Plugin),
    ] {
        let error = read(name, &body).expect_err(name);
        let (_, line, column) = error.location();
        assert!(error.kind() == kind && line == 2 && column > 0, "{name}: {error}");
    }
}
