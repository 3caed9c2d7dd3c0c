//! The scenes of the project load without a warning, and say what their files say.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use pointillist::scene::desc::texture::SpectrumTexture;
use pointillist::scene::desc::{BsdfDesc, ConductorDesc, DielectricDesc, FovAxis, LightDesc, ShapeKind};
use pointillist::scene::{LoadOptions, Loaded, SceneDesc, SceneError, load, load_previewing};

use crate::support::bmp::grey_bmp;

fn scene(name: &str, overrides: &[(&str, &str)]) -> Loaded {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let overrides: Vec<(String, String)> =
        overrides.iter().map(|(n, v)| ((*n).into(), (*v).into())).collect();
    load(&path, &overrides).unwrap_or_else(|e| panic!("{e:?}"))
}

#[test]
fn every_scene_loads_without_a_warning() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let files = std::fs::read_dir(folder).expect("the folder is there").map(|f| f.expect("readable").path());
    let xml: Vec<PathBuf> = files.filter(|p| p.extension().is_some_and(|e| e == "xml")).collect();
    assert!(xml.len() >= 3);
    for path in xml {
        let text = std::fs::read_to_string(&path).expect("text");
        let after_header = text.split_once("?>").map_or(text.as_str(), |(_, rest)| rest);
        assert!(
            after_header.trim_start().starts_with("<!--"),
            "{} must open with what it shows",
            path.display()
        );
        let loaded = load(&path, &[]).unwrap_or_else(|e| panic!("{e:?}"));
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    }
}

#[test]
fn cornell_is_the_box() {
    let desc = scene("cornell.xml", &[("spp", "7"), ("max_depth", "3")]).desc;
    assert_eq!((desc.film.width, desc.film.height), (512, 512));
    assert_eq!(desc.film.rfilter, None);
    assert_eq!((desc.samples_per_pixel, desc.integrator.max_depth), (Some(7), Some(3)));
    assert_eq!(
        (desc.camera.perspective().unwrap().fov, desc.camera.perspective().unwrap().fov_axis),
        (37.8, FovAxis::Smaller)
    );
    assert_eq!(desc.shapes.len(), 8);
    let by_id =
        |id: &str| desc.shapes.iter().find(|s| s.id.as_deref() == Some(id)).expect("named in the file");
    // Every wall looks into the room, whose middle is (0, 2.75, 0).
    for wall in ["floor", "ceiling", "back", "left", "right", "lamp"] {
        let m = by_id(wall).to_world;
        let inwards = DVec3::new(0.0, 2.75, 0.0) - m.transform_point3(DVec3::ZERO);
        assert!(m.transform_vector3(DVec3::Z).dot(inwards) > 0.0, "{wall} looks outwards");
    }
    // +x of a camera is on its left: the red wall must be at larger x than the green one.
    assert!(by_id("left").to_world.translation.x > by_id("right").to_world.translation.x);
    let corner = by_id("floor").to_world.transform_point3(DVec3::new(1.0, 1.0, 0.0));
    assert!((corner - DVec3::new(2.775, 0.0, -2.8)).length() < 1e-12, "{corner}");
    // Blocks stand on the floor.
    for block in ["tall_block", "short_block"] {
        let low = by_id(block).to_world.transform_point3(DVec3::new(0.3, -1.0, 0.9)).y;
        assert!(low.abs() < 1e-12, "{block} at {low}");
    }
    assert!(desc.shapes.iter().filter(|s| s.emission.is_some()).count() == 1);
}

#[test]
fn spheres_are_a_mirror_and_glass() {
    let desc = scene("cornell_spheres.xml", &[("ior", "1.7")]).desc;
    let mut kinds: Vec<&str> = Vec::new();
    for s in desc.shapes.iter().filter(|s| matches!(s.kind, ShapeKind::Sphere { .. })) {
        kinds.push(match &desc.bsdfs[s.bsdf.0 as usize] {
            BsdfDesc::Conductor(ConductorDesc { eta, k, .. }) => {
                assert!(eta.is_black() && k.is_constant() && k.max() == 1.0);
                "mirror"
            }
            BsdfDesc::Dielectric(DielectricDesc { int_ior, ext_ior, .. }) => {
                assert_eq!(format!("{int_ior:?} {ext_ior:?}"), "Constant(1.7) Constant(1.0)");
                "glass"
            }
            other => panic!("{other:?}"),
        });
    }
    assert_eq!(kinds, ["mirror", "glass"]);
}

#[test]
fn furnace_faces_look_outwards_and_make_a_closed_cube() {
    let desc = scene("furnace.xml", &[]).desc;
    assert!(matches!(desc.lights.as_slice(), [LightDesc::Constant { .. }]));
    assert_eq!(desc.integrator.max_depth, None);
    let mut sum = DVec3::ZERO;
    for s in &desc.shapes {
        let normal = s.to_world.transform_vector3(DVec3::Z);
        let center = s.to_world.translation;
        assert!((normal - center).length() < 1e-12, "{:?}", s.id);
        sum += center;
    }
    assert_eq!(desc.shapes.len(), 6);
    assert!(sum.length() < 1e-12);
}

/// The side of the picture of the first material, and a texel of it.
fn picture(desc: &SceneDesc) -> (usize, f32) {
    let BsdfDesc::Diffuse(diffuse) = &desc.bsdfs[0] else { panic!("{:?}", desc.bsdfs) };
    let SpectrumTexture::Bitmap(texture) = &diffuse.reflectance else {
        panic!("{:?}", desc.bsdfs);
    };
    (texture.bitmap.width(), texture.bitmap.texel(0, 0)[0])
}

/// Where large pictures take long to read there is a scene without them before, with the same meshes; where they are small, or cannot be
/// read, there is the scene, or the error, as ever.
#[test]
fn large_pictures_have_a_preview() {
    let folder = std::env::temp_dir().join(format!("pointillist-preview-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join("scene.xml");
    let text = r#"<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/>
        <shape type="obj"><string name="filename" value="one.obj"/><bsdf type="diffuse">
        <texture type="bitmap" name="reflectance"><string name="filename" value="wall.bmp"/></texture></bsdf></shape></scene>"#;
    std::fs::write(&path, text).expect("written");
    std::fs::write(folder.join("one.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n")
        .expect("written");
    let load = |side, length| -> (Vec<SceneDesc>, Result<Loaded, SceneError>) {
        let bytes = grey_bmp(side, 200);
        std::fs::write(folder.join("wall.bmp"), &bytes[..bytes.len().min(length)]).expect("written");
        let mut previews = Vec::new();
        let mut take = |desc| previews.push(desc);
        let loaded = load_previewing(&path, &LoadOptions::default(), &Arc::default(), &mut take);
        (previews, loaded)
    };
    let (previews, loaded) = load(64, usize::MAX);
    assert_eq!((previews.len(), picture(&loaded.expect("valid").desc).0), (0, 64));
    let (previews, loaded) = load(2500, usize::MAX);
    let loaded = loaded.expect("valid");
    let ([preview], true) = (previews.as_slice(), loaded.warnings.is_empty()) else { panic!("{loaded:?}") };
    let [grey, white] = [preview, &loaded.desc].map(picture);
    assert_eq!((grey.0, white.0), (1, 2500));
    assert!((grey.1 - 0.2158).abs() < 1e-3 && (white.1 - 0.5776).abs() < 1e-3, "{grey:?} {white:?}");
    assert!(Arc::ptr_eq(&preview.meshes[0], &loaded.desc.meshes[0]), "the mesh was read twice");
    // The error comes after the preview, at the same place as without one.
    let (previews, loaded) = load(2500, 17_000_000);
    let error = loaded.expect_err("cut off").to_string();
    assert!(previews.len() == 1 && error.contains("wall.bmp"), "{error}");
    assert_eq!(error, pointillist::scene::load(&path, &[]).expect_err("cut off").to_string());
    std::fs::remove_dir_all(folder).expect("removed");
}
