//! Blends and masks as scene files say them, and faults at their place.

use pointillist::scene::desc::{BlendDesc, BsdfDesc, MaskDesc};
use pointillist::scene::{Loaded, SceneError, load_str};
use pointillist::tracer::{MaterialClass, Scene};

/// A disk of a material, in the second line of a scene.
fn read(material: &str) -> Result<Loaded, SceneError> {
    let others =
        "<sensor type='perspective'><float name='fov' value='40'/></sensor><emitter type='constant'/>";
    let scene = format!("<scene version='3.0.0'>{others}\n<shape type='disk'>{material}</shape></scene>");
    load_str("t.xml", &scene, &[])
}

fn bsdf(text: &str) -> BsdfDesc {
    let loaded = read(text).unwrap_or_else(|e| panic!("{text}: {e:?}"));
    assert!(loaded.warnings.is_empty(), "{text}: {:?}", loaded.warnings);
    let prepared = Scene::prepare(&loaded.desc).unwrap_or_else(|e| panic!("{text}: {e:?}"));
    assert_eq!(prepared.material_class(), MaterialClass::Mixed, "{text}");
    loaded.desc.bsdfs[loaded.desc.shapes[0].bsdf.0 as usize].clone()
}

const MATT: &str = "<bsdf type='diffuse'/>";

fn mask(inner: &str) -> String {
    format!("<bsdf type='mask'>{inner}</bsdf>")
}

fn blend(inner: &str) -> String {
    format!("<bsdf type='blendbsdf'>{inner}</bsdf>")
}

#[test]
fn masks_and_blends() {
    let opacity = |text: &str| match bsdf(&mask(&format!("{MATT}{text}"))) {
        BsdfDesc::Mask(MaskDesc { opacity, .. }) => opacity,
        other => panic!("{text}: {other:?}"),
    };
    assert_eq!(opacity(""), 0.5);
    assert_eq!(opacity("<float name='opacity' value='0.25'/>"), 0.25);
    assert_eq!(opacity("<rgb name='opacity' value='0.75'/>"), 0.75);
    let two = format!("{MATT}<bsdf type='conductor'/><float name='weight' value='0.25'/>");
    let BsdfDesc::Blend(BlendDesc { weight, bsdfs }) = bsdf(&blend(&two)) else { panic!("a blend") };
    assert!(weight == 0.25 && bsdfs[0] != bsdfs[1]);
    let both = format!("<bsdf type='twosided'>{}</bsdf>", blend(&two));
    read(&both).expect("a blend may be shown on both sides");
    bsdf(&mask(&both));
}

#[test]
fn faults() {
    let half = "<float name='weight' value='0.5'/>";
    let nested = |inner: &str| blend(&format!("{inner}{inner}{half}"));
    for bad in [
        mask(""),
        mask(&format!("{MATT}{MATT}")),
        mask(&format!("{MATT}<rgb name='opacity' value='1, 0, 0'/>")),
        mask(&format!("{MATT}<float name='opacity' value='-1'/>")),
        mask("<ref id='nothing'/>"),
        blend(MATT),
        blend(&format!("{MATT}{MATT}{MATT}{half}")),
        blend(&format!("{MATT}{MATT}")),
        blend(&format!("{MATT}{MATT}<string name='weight' value='half'/>")),
        // Eight materials.
        nested(&nested(&nested(MATT))),
        // What lets light through has two sides.
        format!("<bsdf type='twosided'>{}</bsdf>", mask(MATT)),
        format!("<bsdf type='twosided'>{}</bsdf>", nested("<bsdf type='dielectric'/>")),
        "<bsdf type='mask' id='me'><ref id='me'/></bsdf>".to_string(),
    ] {
        let Err(error) = read(&bad) else { panic!("this must be refused: {bad}") };
        assert!(format!("{error:?}").contains("t.xml"), "{bad}: {error:?}");
    }
    read(&nested(&nested(MATT))).expect("four materials are not too many");
    // Glass in a mixture does not disperse, and that is said.
    let loaded = read(&mask("<bsdf type='dielectric'/>")).expect("readable");
    assert_eq!(loaded.warnings.len(), 1);
    let whole = read(&mask(&format!("{MATT}<float name='opacity' value='1'/>"))).expect("readable");
    let prepared = Scene::prepare(&whole.desc).expect("valid");
    assert_eq!(prepared.material_class(), MaterialClass::Mixed);
}
