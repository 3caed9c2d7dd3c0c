//! Blends and masks as scene files say them, and faults at their place.

use glam::Vec2;

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
    Scene::prepare(&loaded.desc).unwrap_or_else(|e| panic!("{text}: {e:?}"));
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
        BsdfDesc::Mask(MaskDesc { opacity, .. }) => opacity.scalar(&Vec2::new(0.2, 0.2).into()),
        other => panic!("{text}: {other:?}"),
    };
    assert_eq!(opacity(""), 0.5);
    assert_eq!(opacity("<float name='opacity' value='0.25'/>"), 0.25);
    assert_eq!(opacity("<rgb name='opacity' value='0.75'/>"), 0.75);
    // Mitsuba has the two the other way round where they are numbers.
    let board = "<float name='color0' value='0.875'/><float name='color1' value='0.125'/>";
    assert_eq!(opacity(&format!("<texture type='checkerboard' name='opacity'>{board}</texture>")), 0.125);
    let two = format!("{MATT}<bsdf type='conductor'/><float name='weight' value='0.25'/>");
    let BsdfDesc::Blend(BlendDesc { weight, bsdfs }) = bsdf(&blend(&two)) else { panic!("a blend") };
    assert!(weight.scalar(&Vec2::ZERO.into()) == 0.25 && bsdfs[0] != bsdfs[1]);
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
        mask(&format!("{MATT}<float name='opacity' value='-1'/>")),
        mask(&format!(
            "{MATT}<texture type='bitmap' name='opacity'><string name='filename' value='none.png'/></texture>"
        )),
        blend(&format!("{MATT}{MATT}<texture type='cloud' name='weight'/>")),
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
    let says = |text: &str, what: &str| {
        let loaded = read(text).expect("readable");
        let [warning] = loaded.warnings.as_slice() else { panic!("{text}: {:?}", loaded.warnings) };
        assert!(
            format!("{warning:?}").contains(what) && format!("{warning:?}").contains("t.xml"),
            "{warning:?}"
        );
        loaded.desc.bsdfs[loaded.desc.shapes[0].bsdf.0 as usize].clone()
    };
    // Glass in a blend does not disperse, and that is said; with holes it does.
    says(&blend(&format!("{MATT}{}{half}", mask("<bsdf type='dielectric'/>"))), "does not disperse");
    bsdf(&mask("<bsdf type='dielectric'/>"));
    let red =
        says(&mask(&format!("{MATT}<rgb name='opacity' value='1, 0, 0'/>")), "the same for all colours");
    let BsdfDesc::Mask(MaskDesc { opacity, .. }) = red else { panic!("a mask") };
    assert!((opacity.scalar(&Vec2::ZERO.into()) - 0.2126).abs() < 2e-3, "the luminance of red");
    let whole = read(&mask(&format!("{MATT}<float name='opacity' value='1'/>"))).expect("readable");
    let prepared = Scene::prepare(&whole.desc).expect("valid");
    assert_eq!(prepared.material_class(), MaterialClass::Diffuse);
}
