//! Numbers of materials by textures, and mesh attributes: what is read, and what is refused at its place.

use pointillist::scene::desc::texture::SpectrumTexture;
use pointillist::scene::desc::*;
use pointillist::scene::{FindingKind, Loaded, SceneError, load_str};
use pointillist::spectrum::Spectrum;

const BESIDE: &str = "<sensor type=\"perspective\"/><emitter type=\"constant\"/>";

/// Reads a scene beside the pictures and meshes of the plugins' scenes; its body begins in line 2.
fn read(body: &str) -> Result<Loaded, SceneError> {
    let name = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/plugins/test.xml");
    load_str(name, &format!("<scene version=\"3.0.0\">{BESIDE}\n{body}\n</scene>"), &[])
}

fn attribute(name: &str, attribute: &str) -> String {
    format!(
        "<texture name=\"{name}\" type=\"mesh_attribute\"><string name=\"name\" value=\"{attribute}\"/></texture>"
    )
}

fn patch(kind: &str, material: &str) -> String {
    format!("<shape type=\"{kind}\"><string name=\"filename\" value=\"patch.{kind}\"/>{material}</shape>")
}

fn diffuse(name: &str) -> String {
    format!("<bsdf type=\"diffuse\">{}</bsdf>", attribute("reflectance", name))
}

/// The only mesh keeps what is asked for, each a number of values.
fn kept(body: &str) -> Vec<(String, usize)> {
    let desc = read(body).unwrap_or_else(|e| panic!("{body}: {e:?}")).desc;
    let [mesh] = desc.meshes.as_slice() else { panic!("{} meshes", desc.meshes.len()) };
    mesh.attributes.iter().map(|a| (a.name.clone(), a.values.len())).collect()
}

#[test]
fn meshes_keep_what_is_asked_for() {
    assert_eq!(kept(&patch("ply", &diffuse("vertex_color"))), [("vertex_color".to_owned(), 27)]);
    assert_eq!(kept(&patch("ply", &diffuse("face_color"))), [("face_color".to_owned(), 24)]);
    assert_eq!(kept(&patch("ply", "<bsdf type=\"diffuse\"/>")), []);
    assert_eq!(kept(&patch("obj", "<bsdf type=\"diffuse\"/>")), []);
    let nested = format!(
        "<bsdf type=\"twosided\"><bsdf type=\"roughconductor\">{}<texture name=\"specular_reflectance\" type=\"checkerboard\">{}\
         </texture></bsdf></bsdf>",
        attribute("alpha", "vertex_rough"),
        attribute("color0", "face_color")
    );
    let two = [("face_color".to_owned(), 24), ("vertex_rough".to_owned(), 9)];
    let mut found = kept(&patch("ply", &nested));
    found.sort();
    assert_eq!(found, two);
}

/// The numbers of one material never share a place, and a name has the same place everywhere.
#[test]
fn numbers_have_places() {
    let principled = |number: &str| {
        let both = attribute("base_color", "vertex_color") + &attribute("roughness", number);
        patch("ply", &format!("<bsdf type=\"principled\">{both}</bsdf>"))
    };
    let body = patch("ply", &diffuse("face_color"))
        + &patch(
            "ply",
            &format!("<bsdf type=\"roughconductor\">{}</bsdf>", attribute("alpha", "face_shine")),
        )
        + &principled("face_shine")
        + &principled("vertex_rough");
    let desc = read(&body).expect("valid").desc;
    let mut layouts = Vec::new();
    for bsdf in &desc.bsdfs {
        match bsdf {
            BsdfDesc::Principled(p) => {
                let SpectrumTexture::Attribute(color) = &p.base_color else { panic!("{p:?}") };
                layouts.push(color.layout);
                assert!((color.layout.mean[0] - 4.35 / 9.0).abs() < 1e-5 && p.textures.len() == 1, "{p:?}");
            }
            BsdfDesc::RoughConductor(metal) => {
                let Some(AlphaTexture::Isotropic(alpha)) = metal.alpha.as_deref() else {
                    panic!("{metal:?}")
                };
                assert!((alpha.mean_scalar() - 0.55).abs() < 1e-5);
            }
            _ => {}
        }
    }
    assert!(layouts.len() == 2 && layouts[0] == layouts[1] && layouts[0].colored, "{layouts:?}");
}

#[test]
fn faults_have_a_place() {
    let error = |body: &str, kind: FindingKind, words: &str| {
        let e = read(body).map(|_| ()).expect_err(body);
        let (message, line) = (e.to_string(), e.location().1);
        assert!(
            e.kind() == kind && line == 2 && message.contains(words),
            "{body}: {:?} {line} {message}",
            e.kind()
        );
    };
    let missing = FindingKind::Missing;
    error(&patch("ply", &diffuse("vertex_colour")), missing, "`vertex_colour`");
    error(&patch("obj", &diffuse("vertex_color")), missing, "`obj`");
    error(&format!("<shape type=\"sphere\">{}</shape>", diffuse("face_color")), missing, "`sphere`");
    let group = format!("<shape type=\"shapegroup\">{}</shape>", patch("obj", &diffuse("face_color")));
    error(&group, missing, "`face_color`");
    error(&patch("ply", &diffuse("colour")), FindingKind::Value, "names no attribute");
    let three = attribute("base_color", "vertex_color") + &attribute("roughness", "vertex_rough");
    let three = three + &attribute("metallic", "face_shine");
    error(&patch("ply", &format!("<bsdf type=\"principled\">{three}</bsdf>")), FindingKind::Limit, "no room");
    let unnamed = "<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"mesh_attribute\"/></bsdf>";
    error(unnamed, missing, "`name`");
}

/// Textures of numbers in files of version 0.6 and in those of version 3.
#[test]
fn numbers_by_textures() {
    let ramp = |name: &str| {
        format!(
            "<texture name=\"{name}\" type=\"bitmap\"><string name=\"filename\" value=\"ramp.png\"/><boolean name=\"raw\" value=\"true\"/></texture>"
        )
    };
    let bsdf = |text: &str| {
        let loaded = read(text).unwrap_or_else(|e| panic!("{text}: {e:?}"));
        (loaded.desc.bsdfs[0].clone(), loaded.warnings.len())
    };
    let (BsdfDesc::RoughConductor(metal), 0) = bsdf(&format!(
        "<bsdf type=\"roughconductor\">{}<float name=\"alpha_v\" value=\".2\"/></bsdf>",
        ramp("alpha_u")
    )) else {
        panic!("rough metal without warnings")
    };
    let mean = (40.0 + 26.0 * 3.5 + 4.0 * 3.5) / 255.0;
    assert!((metal.roughness.alpha[0] - mean).abs() < 0.01 && metal.roughness.alpha[1] == 0.2, "{metal:?}");
    assert!(matches!(metal.alpha.as_deref(), Some(AlphaTexture::Anisotropic(_))));
    let colour = "<bsdf type=\"roughdielectric\"><rgb name=\"alpha\" value=\".3\"/></bsdf>";
    let (BsdfDesc::RoughDielectric(glass), 0) = bsdf(colour) else { panic!("rough glass") };
    assert!(glass.alpha.is_none() && glass.roughness.alpha == [0.3; 2]);
    let (BsdfDesc::RoughPlastic(plastic), 1) =
        bsdf(&format!("<bsdf type=\"roughplastic\">{}</bsdf>", ramp("alpha")))
    else {
        panic!("rough plastic with a warning")
    };
    assert!((plastic.roughness.alpha[0] - mean).abs() < 0.01);
    let numbers =
        ["roughness", "metallic", "anisotropic", "spec_tint", "sheen", "sheen_tint", "flatness", "clearcoat"];
    let all: String =
        numbers.iter().chain(&["clearcoat_gloss", "spec_trans"]).map(|name| ramp(name)).collect();
    let (BsdfDesc::Principled(p), 0) = bsdf(&format!("<bsdf type=\"principled\">{all}</bsdf>")) else {
        panic!("principled")
    };
    assert!(p.textures.len() == 9 && !p.spec_trans.is_black() && (p.lobes.flatness - mean).abs() < 0.01);
    let thin: String = ["roughness", "eta", "diff_trans", "spec_trans", "sheen"].map(ramp).concat();
    let (BsdfDesc::PrincipledThin(p), 0) = bsdf(&format!("<bsdf type=\"principledthin\">{thin}</bsdf>"))
    else {
        panic!("principledthin")
    };
    assert!(p.textures.len() == 3 && p.diff_trans.varies() && p.transmittance == Spectrum::Constant(1.0));
    let none = "<bsdf type=\"principled\"><texture name=\"specular\" type=\"checkerboard\"/></bsdf>";
    assert_eq!(read(none).map(|_| ()).expect_err("a number").location().1, 2);
}
