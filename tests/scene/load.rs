//! The scenes of the project load without a warning, and say what their files say.

use std::path::{Path, PathBuf};

use glam::DVec3;
use pointillist::scene::desc::{BsdfDesc, ConductorDesc, DielectricDesc, FovAxis, LightDesc, ShapeKind};
use pointillist::scene::{Loaded, load};

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
    assert_eq!((desc.camera.fov, desc.camera.fov_axis), (37.8, FovAxis::Smaller));
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
