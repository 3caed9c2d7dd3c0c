//! The `dipole` of version 0.6, which is rendered as a medium behind a boundary.

use miette::{Diagnostic, Severity};

use pointillist::scene::desc::{
    BsdfDesc, MediumDesc, MediumId, MediumInterface, PhaseDesc, SceneDesc, ShapeDesc,
};
use pointillist::scene::{FindingKind, Loaded, SceneError, SceneWarning, load_str};
use pointillist::spectrum::Spectrum;
use pointillist::spectrum::dispersion::Ior;

/// A scene of version 0.6 whose body begins in line 2.
fn try_read(body: &str) -> Result<Loaded, SceneError> {
    let text = format!(
        "<scene version='0.6.0'><integrator type='path'><integer name='maxDepth' value='6'/></integrator>\
         <sensor type='perspective'/><emitter type='constant'/>\n{body}</scene>"
    );
    load_str("t.xml", &text, &[])
}

/// A scene that is read without a warning; the remark on the version and others.
fn read(body: &str) -> (SceneDesc, Vec<SceneWarning>) {
    let Loaded { desc, warnings } = try_read(body).unwrap_or_else(|e| panic!("{body}: {e:?}"));
    assert!(warnings.iter().all(|w| w.severity() == Some(Severity::Advice)), "{warnings:?}");
    (desc, warnings)
}

fn shape(bsdf: &str, inside: &str) -> String {
    format!("<shape type='sphere'>{bsdf}<subsurface type='dipole'>{inside}</subsurface></shape>")
}

/// The interior of a shape, and its bsdf.
fn of<'a>(desc: &'a SceneDesc, shape: &ShapeDesc) -> (&'a MediumDesc, &'a BsdfDesc) {
    let MediumInterface { interior: Some(MediumId(id)), exterior: None } = shape.medium_interface else {
        panic!("{:?}", shape.medium_interface)
    };
    (&desc.media[id as usize], &desc.bsdfs[shape.bsdf.0 as usize])
}

fn constant(value: f32) -> Spectrum {
    Spectrum::Constant(value)
}

#[test]
fn a_dipole_is_a_medium_behind_a_boundary() {
    let plastic = "<bsdf type='plastic'><spectrum name='diffuseReflectance' value='0'/></bsdf>";
    let inside = "<spectrum name='sigmaS' value='3'/><spectrum name='sigmaA' value='1'/><float name='scale' value='20'/>\
                  <float name='g' value='.5'/><float name='intIOR' value='1.4'/><integer name='irrSamples' value='64'/>";
    let (desc, warnings) = read(&shape(plastic, inside));
    let (medium, boundary) = of(&desc, &desc.shapes[0]);
    assert_eq!(medium.sigma_t.uniform(), Some(&constant(4.0)));
    assert_eq!(medium.albedo.uniform(), Some(&constant(0.75)));
    assert!(medium.scale == 20.0 && medium.phase == PhaseDesc::HenyeyGreenstein { g: 0.5 }, "{medium:?}");
    let BsdfDesc::Dielectric(glass) = boundary else { panic!("{boundary:?}") };
    assert_eq!(glass.int_ior, Ior::Constant(1.4));
    // What is beneath a surface is seen by every method of version 0.6, however short its paths.
    assert!(desc.has_media() && desc.integrator.max_depth.is_none());
    let told = |words: &str| warnings.iter().filter(|w| w.to_string().contains(words)).count();
    assert_eq!((told("the subsurface `dipole`"), told("`irr_samples`")), (1, 1), "{warnings:?}");
}

/// The default is the first skin, as in version 0.6; indices are those of the materials unless given.
#[test]
fn materials_have_names_and_indices() {
    let index = |inside: &str| {
        let (desc, _) = read(&shape("", inside));
        let (medium, boundary) = of(&desc, &desc.shapes[0]);
        let BsdfDesc::Dielectric(glass) = boundary else { panic!("{boundary:?}") };
        let rgb = medium.sigma_t.uniform().unwrap().reflected_rgb();
        (rgb, [glass.int_ior.clone(), glass.ext_ior.clone()])
    };
    let near = |rgb: [f32; 3], wanted: [f32; 3]| {
        assert!(rgb.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 0.02 * b), "{rgb:?}, not {wanted:?}");
    };
    let ior = |n: f32| [n, 1.0].map(Ior::Constant);
    let (skin, indices) = index("");
    near(skin, [0.772, 1.05, 1.49]);
    assert_eq!(indices, ior(1.3));
    let (marble, indices) = index("<string name='material' value='Marble'/>");
    near(marble, [2.1921, 2.6241, 3.0071]);
    assert_eq!(indices, ior(1.5));
    let (_, indices) = index("<string name='intIOR' value='water'/>");
    assert_eq!(indices, ["water", "air"].map(|name| Ior::named(name).unwrap()));
}

/// A rough coat is a rough boundary, and what lets light through is one already.
#[test]
fn boundaries_have_the_roughness_of_their_coats() {
    let coat =
        "<bsdf type='twosided'><bsdf type='roughplastic'><float name='alpha' value='.3'/></bsdf></bsdf>";
    let (desc, _) = read(&shape(coat, ""));
    let BsdfDesc::RoughDielectric(rough) = of(&desc, &desc.shapes[0]).1 else { panic!("{:?}", desc.bsdfs) };
    assert_eq!((rough.roughness.alpha, &rough.int_ior), ([0.3; 2], &Ior::Constant(1.3)));
    let equal = "<float name='intIOR' value='1.2'/><float name='extIOR' value='1.2'/>";
    let (desc, _) = read(&shape(coat, equal));
    assert!(matches!(of(&desc, &desc.shapes[0]).1, BsdfDesc::Dielectric(_)), "nothing refracts");
    for plugin in ["null", "roughdielectric"] {
        let (desc, _) = read(&shape(&format!("<bsdf type='{plugin}' id='own'/>"), ""));
        let id = desc.shapes[0].bsdf.0 as usize;
        assert_eq!(desc.names.bsdfs[id].id.as_deref(), Some("own"), "{plugin}");
    }
}

/// A subsurface that two shapes refer to is one medium, with a boundary for each bsdf.
#[test]
fn a_dipole_is_shared() {
    let of_shape = |bsdf: &str| format!("<shape type='sphere'>{bsdf}<ref id='wax'/></shape>");
    let rough = "<bsdf type='roughplastic'/>";
    let body = ["", "", rough].map(of_shape).concat();
    let (desc, warnings) = read(&format!("<subsurface type='dipole' id='wax'/>{body}"));
    assert_eq!((desc.media.len(), desc.names.media[0].id.as_deref()), (1, Some("wax")));
    let [first, second, third] = [0, 1, 2].map(|i| desc.shapes[i].bsdf);
    assert!(first == second && first != third);
    assert!(desc.shapes.iter().all(|s| s.medium_interface.interior == Some(MediumId(0))));
    assert_eq!(warnings.iter().filter(|w| w.to_string().contains("`dipole`")).count(), 1, "{warnings:?}");
}

#[test]
fn what_cannot_be_is_told() {
    for (body, words) in [
        ("<shape type='cube'><subsurface type='multipole'/></shape>".to_owned(), "only `dipole` is read"),
        (shape("<bsdf type='null'/><medium type='homogeneous' name='interior'/>", ""), "has an `interior`"),
    ] {
        let Loaded { warnings, desc } = try_read(&body).unwrap();
        let warning = warnings.iter().find(|w| w.to_string().contains(words));
        let warning = warning.unwrap_or_else(|| panic!("{words}: {warnings:?}"));
        assert!(warning.severity() != Some(Severity::Advice) && warning.location().1 == 2, "{warning:?}");
        assert!(!desc.has_media() && desc.integrator.max_depth == Some(6), "it is left out");
    }
    for (inside, words, kind) in [
        ("<float name='g' value='1'/>", "between -1 and 1", FindingKind::Value),
        ("<string name='material' value='skin3'/>", "no medium is known", FindingKind::Value),
        ("<float name='scale' value='-1'/>", "from 0 to 1e12", FindingKind::Value),
        ("<float name='intIOR' value='0'/>", "above 0", FindingKind::Value),
        ("<float name='sigmaS' value='1'/><float name='albedo' value='1'/>", "not both", FindingKind::Value),
    ] {
        let error = try_read(&shape("", inside)).map(|_| ()).expect_err(inside);
        assert!(error.to_string().contains(words), "{inside}: {error}");
        assert_eq!((error.kind(), error.location().1), (kind, 2), "{inside}");
    }
    let two = "<shape type='cube'><subsurface type='dipole'/><subsurface type='dipole'/></shape>";
    assert!(try_read(two).map(|_| ()).expect_err(two).to_string().contains("a second <subsurface>"));
}
