//! Rough materials and plastic as scene files say them: Mitsuba's defaults, and faults at their place.

use miette::{GraphicalReportHandler, GraphicalTheme};
use pointillist::scene::desc::{
    BsdfDesc, Facets, PlasticDesc, RoughConductorDesc, RoughDielectricDesc, Roughness,
};
use pointillist::scene::{Loaded, SceneError, load_str};
use pointillist::spectrum::{Spectrum, dispersion::Ior};

/// A disk of a material, in the second line of a scene.
fn read(material: &str) -> Result<Loaded, SceneError> {
    let others = "<sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/></sensor><emitter type=\"constant\"/>";
    let scene = format!("<scene version=\"3.0.0\">{others}\n<shape type=\"disk\">{material}</shape></scene>");
    load_str("t.xml", &scene, &[])
}

fn bsdf(text: &str) -> BsdfDesc {
    let loaded = read(text).unwrap_or_else(|e| panic!("{text}: {e:?}"));
    assert!(loaded.warnings.is_empty(), "{text}: {:?}", loaded.warnings);
    loaded.desc.bsdfs[loaded.desc.shapes[0].bsdf.0 as usize].clone()
}

/// The error as the user sees it.
fn refuse(text: &str) -> String {
    let Err(error) = read(text) else { panic!("this must be refused: {text}") };
    let mut out = String::new();
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor());
    handler.render_report(&mut out, &error).expect("a string never fails");
    out
}

#[test]
fn rough_materials() {
    let rough = |text: &str| match bsdf(text) {
        BsdfDesc::RoughConductor(RoughConductorDesc { roughness, .. })
        | BsdfDesc::RoughDielectric(RoughDielectricDesc { roughness, .. }) => roughness,
        other => panic!("{text}: {other:?}"),
    };
    for kind in ["roughconductor", "roughdielectric"] {
        let of = |inner: &str| rough(&format!("<bsdf type=\"{kind}\">{inner}</bsdf>"));
        assert_eq!(of(""), Roughness { facets: Facets::Beckmann, alpha: [0.1; 2] });
        let ggx = "<string name=\"distribution\" value=\"GGX\"/><float name=\"alpha\" value=\"0.3\"/>";
        assert_eq!(of(ggx), Roughness { facets: Facets::Ggx, alpha: [0.3; 2] });
        for bad in [
            "<string name=\"distribution\" value=\"phong\"/>",
            "<float name=\"alpha\" value=\"-0.1\"/>",
            "<float name=\"alpha_u\" value=\"0.1\"/>",
            "<float name=\"alpha_v\" value=\"0.1\"/>",
            "<float name=\"alpha\" value=\"1\"/><float name=\"alpha_u\" value=\"1\"/><float name=\"alpha_v\" value=\"1\"/>",
            "<texture name=\"alpha\" type=\"bitmap\"/>",
        ] {
            assert!(refuse(&format!("<bsdf type=\"{kind}\">{bad}</bsdf>")).contains("t.xml:2:"), "{bad}");
        }
        let warnings = |inner: &str| {
            read(&format!("<bsdf type=\"{kind}\">{inner}</bsdf>")).expect("readable").warnings.len()
        };
        assert_eq!(warnings("<float name=\"alpha\" value=\"0\"/>"), 1);
        assert_eq!(warnings("<boolean name=\"sample_visible\" value=\"false\"/>"), 1);
        let both = "<float name=\"alpha_u\" value=\"0.1\"/><float name=\"alpha_v\" value=\"0.2\"/>";
        assert_eq!(warnings(both), 0);
    }
    let same = "<float name=\"int_ior\" value=\"1.2\"/><float name=\"ext_ior\" value=\"1.2\"/>";
    refuse(&format!("<bsdf type=\"roughdielectric\">{same}</bsdf>"));
    refuse("<bsdf type=\"twosided\"><bsdf type=\"roughdielectric\"/></bsdf>");
    let BsdfDesc::Plastic(PlasticDesc {
        int_ior,
        ext_ior,
        diffuse_reflectance,
        specular_reflectance,
        nonlinear,
    }) = bsdf("<bsdf type=\"plastic\"/>")
    else {
        panic!("plastic")
    };
    assert_eq!((int_ior, Some(ext_ior)), (Ior::Constant(1.49), Ior::named("air")));
    assert_eq!(diffuse_reflectance, Spectrum::Constant(0.5));
    assert!(specular_reflectance == Spectrum::Constant(1.0) && !nonlinear);
}
