//! Normal maps and bump maps as scene files say them, and faults at their place.

use std::path::Path;

use pointillist::scene::desc::BsdfDesc;
use pointillist::scene::{Loaded, SceneError, load_str};
use pointillist::tracer::{MaterialClass, Scene};

/// A disk of a material, in a scene beside the pictures of the table scenes.
fn read_as(version: &str, material: &str) -> Result<Loaded, SceneError> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/plugins/t.xml");
    let others =
        "<sensor type='perspective'><float name='fov' value='40'/></sensor><emitter type='constant'/>";
    let scene = format!("<scene version='{version}'>{others}\n<shape type='disk'>{material}</shape></scene>");
    load_str(&beside.display().to_string(), &scene, &[])
}

fn read(material: &str) -> Result<Loaded, SceneError> {
    read_as("3.0.0", material)
}

const MATT: &str = "<bsdf type='diffuse'/>";

fn picture(attributes: &str, more: &str) -> String {
    format!(
        "<texture {attributes} type='bitmap'><string name='filename' value='bsdf_bumpmap.png'/>{more}</texture>"
    )
}

const RAW: &str = "<boolean name='raw' value='true'/>";

fn normal_map(inner: &str) -> String {
    format!("<bsdf type='normalmap'>{}{inner}</bsdf>", picture("name='normalmap'", RAW))
}

fn bump_map(inner: &str) -> String {
    format!("<bsdf type='bumpmap'>{}{inner}</bsdf>", picture("name='anything'", RAW))
}

#[test]
fn parameters_and_nesting() {
    let two = |inner: &str| format!("<bsdf type='twosided'>{inner}</bsdf>");
    let blend = |inner: &str| {
        format!("<bsdf type='blendbsdf'><float name='weight' value='0.5'/>{inner}{MATT}</bsdf>")
    };
    let mask = |inner: &str| format!("<bsdf type='mask'>{inner}</bsdf>");
    for text in [
        normal_map(MATT),
        bump_map(MATT),
        two(&bump_map(MATT)),
        normal_map(&two(MATT)),
        normal_map(
            "<bsdf type='roughdielectric'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/></bsdf>",
        ),
        blend(&two(&normal_map(MATT))),
        bump_map(&blend(&two(MATT))),
        mask(&bump_map(MATT)),
    ] {
        let loaded = read(&text).unwrap_or_else(|e| panic!("{text}: {e:?}"));
        assert!(loaded.warnings.is_empty(), "{text}: {:?}", loaded.warnings);
        let scene = Scene::prepare(&loaded.desc).unwrap_or_else(|e| panic!("{text}: {e:?}"));
        assert_eq!(scene.material_class(), MaterialClass::Mixed, "{text}");
    }
    let flags = "<boolean name='flip_invalid_normals' value='false'/><boolean name='use_shadowing_function' value='false'/>";
    let scaled = format!("{MATT}{flags}<float name='scale' value='2'/>");
    let of = |text: &str| {
        let desc = read(text).expect("valid").desc;
        desc.bsdfs[desc.shapes[0].bsdf.0 as usize].clone()
    };
    let (BsdfDesc::BumpMap(plain), BsdfDesc::BumpMap(given)) = (of(&bump_map(MATT)), of(&bump_map(&scaled)))
    else {
        panic!("bump maps")
    };
    assert!(plain.scale == 1.0 && plain.bump.flip_invalid_normals && plain.bump.use_shadowing_function);
    assert!(given.scale == 2.0 && !given.bump.flip_invalid_normals && !given.bump.use_shadowing_function);
}

/// Version 0.6 gives the texture no name, and its values are those of the file.
#[test]
fn version_0_6() {
    let old = format!("<bsdf type='bumpmap'>{}{MATT}</bsdf>", picture("", RAW));
    let desc = read_as("0.6.0", &old).expect("valid").desc;
    assert!(desc.bsdfs.iter().any(|bsdf| matches!(bsdf, BsdfDesc::BumpMap(_))));
}

/// A map that is decoded as a colour is what the file asks for, and hardly what it means.
#[test]
fn decoded_maps_are_told_of() {
    for (text, name) in [
        (format!("<bsdf type='normalmap'>{}{MATT}</bsdf>", picture("name='normalmap'", "")), "normalmap"),
        (format!("<bsdf type='bumpmap'>{}{MATT}</bsdf>", picture("", "")), "bumpmap"),
    ] {
        let loaded = read(&text).expect("valid");
        let told = format!("{:?}", loaded.warnings);
        assert!(told.contains("sRGB") && told.contains(name) && told.contains(":2:"), "{told}");
    }
}

#[test]
fn faults() {
    let board = "<texture name='normalmap' type='checkerboard'/>";
    for bad in [
        format!("<bsdf type='normalmap'>{MATT}</bsdf>"),
        format!("<bsdf type='bumpmap'>{MATT}</bsdf>"),
        normal_map(""),
        bump_map(""),
        normal_map(&format!("{MATT}{MATT}")),
        normal_map(&bump_map(MATT)),
        bump_map(&format!("{}{MATT}", picture("", RAW))),
        format!("<bsdf type='normalmap'>{board}{MATT}</bsdf>"),
        format!("<bsdf type='bumpmap'>{board}{MATT}</bsdf>"),
        format!("<bsdf type='normalmap'><rgb name='normalmap' value='.5, .5, 1'/>{MATT}</bsdf>"),
        bump_map(&format!("{MATT}<float name='scale' value='nan'/>")),
        bump_map("<ref id='nothing'/>"),
        "<bsdf type='measured'><string name='filename' value='x.bsdf'/></bsdf>".to_owned(),
    ] {
        let Err(error) = read(&bad) else { panic!("{bad} is no error") };
        assert!(format!("{error:?}").contains(":2:"), "{bad}: {error:?}");
    }
}
