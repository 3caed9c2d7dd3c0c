//! The three kinds of files of USD. Those in `usd/` were written by Pixar's `usd-core` 26.11: `stage.usda` by hand, `stage.usdc` by
//! `Sdf.Layer.Export`, `stage.usdz` by `UsdUtils.CreateNewUsdzPackage`.

use std::path::Path;

use glam::DVec3;
use pointillist::scene::desc::texture::SpectrumTexture;
use pointillist::scene::desc::{BsdfDesc, LightDesc, ShapeKind};
use pointillist::scene::{Loaded, load};

use super::models::inner;
use super::usd::{world, write};

const TEXT: &[u8] = include_bytes!("usd/stage.usda");
const CRATE: &[u8] = include_bytes!("usd/stage.usdc");
const PACKAGE: &[u8] = include_bytes!("usd/stage.usdz");
const PICTURE: &[u8] = include_bytes!("usd/picture.png");

fn read(path: &Path) -> Loaded {
    load(path, &[]).unwrap_or_else(|e| panic!("{e:?}"))
}

/// What is seen is the same, and is where `UsdGeom.XformCache` has it; the stage has z up.
#[test]
fn text_crate_and_package_are_one_scene() {
    let files: [(&str, &[u8]); 2] = [("stage.usda", TEXT), ("picture.png", PICTURE)];
    let text = read(&write("file-text", &files));
    let told: Vec<String> = text.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(told[0].contains("`xformOp:scale`"), "it is not in the order of operations: {told:?}");
    assert!(told[1].contains("animations"), "{told:?}");
    let crate_ = read(&write("file-crate", &[("stage.usdc", CRATE), ("picture.png", PICTURE)]));
    // The package has its picture in it.
    let package = read(&write("file-package", &[("stage.usdz", PACKAGE)]));
    let any = read(&write("file-any", &[("stage.usd", CRATE), ("picture.png", PICTURE)]));
    let corners = world(&text.desc);
    for (name, other) in [("usdc", &crate_), ("usdz", &package), ("usd", &any)] {
        assert_eq!(world(&other.desc), corners, "{name}");
        let [a, b] = [&text.desc, &other.desc]
            .map(|desc| (desc.camera.perspective().unwrap().fov, desc.camera.to_world, desc.lights.len()));
        assert_eq!(a, b, "{name}");
        let BsdfDesc::Principled(material) = inner(&other.desc, other.desc.shapes[0].bsdf) else {
            panic!("{name}")
        };
        let SpectrumTexture::Bitmap(texture) = &material.base_color else { panic!("{name}") };
        assert_eq!(texture.bitmap.texel(0, 0), [1.0, 0.0, 0.0], "{name}");
        assert_eq!(other.warnings.len(), 2, "{name}");
    }
    let desc = &text.desc;
    let instances: Vec<DVec3> = desc
        .shapes
        .iter()
        .filter(|shape| matches!(shape.kind, ShapeKind::Instance(_)))
        .map(|shape| (shape.to_world * desc.parts(shape)[0].to_world).transform_point3(DVec3::X))
        .collect();
    // (x, y, z) of the stage is (x, z, −y) here: (3, 0, 0), (3, 3, 0), and the instances of points.
    let expected = [[3.0, 0.0, 0.0], [3.0, 0.0, -3.0], [4.0, 0.0, 0.0], [5.0, 0.0, 0.0]].map(DVec3::from);
    assert!(instances.iter().zip(expected).all(|(a, b)| a.distance(b) < 1e-6), "{instances:?}");
    assert_eq!(instances.len(), 4);
    // A light that is a ball is a shape.
    assert!(!desc.lights.iter().any(|light| matches!(light, LightDesc::Map { .. })));
    assert!(desc.shapes.iter().any(|shape| shape.emission.is_some()));
}
