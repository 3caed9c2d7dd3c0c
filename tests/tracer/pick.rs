//! Picking: which shape of the description is seen at a point of the picture.

use glam::{DAffine3, DVec3, Vec3};

use crate::support::scenes::*;
use pointillist::scene::desc::*;
use pointillist::spectrum::Spectrum;
use pointillist::stream::UvWindow;
use pointillist::tracer::Camera;
use pointillist::tracer::accel::Ray;

#[test]
fn the_nearest_shape_its_place_and_its_distance() {
    let mut desc = empty();
    let m = material(&mut desc, grey(0.5));
    let at = |x: f64, z: f64| DAffine3::from_translation(DVec3::new(x, 0.0, z));
    shape(&mut desc, sphere(DVec3::new(0.0, 0.0, 9.0), 1.0), DAffine3::IDENTITY, m, 0.0);
    shape(&mut desc, ShapeKind::Rectangle, at(0.0, 5.0), m, 0.0);
    shape(&mut desc, ShapeKind::Disk, at(10.0, 5.0), m, 3.0);
    shape(&mut desc, ShapeKind::Cube, at(20.0, 5.0), m, 0.0);
    environment(&mut desc);
    let scene = prepare(&desc);
    let along = |x: f32| scene.pick(&Ray::new(Vec3::new(x, 0.0, 0.0), Vec3::Z));
    let seen = |x| along(x).map(|p| (p.shape, p.distance.round(), p.position.z.round()));
    assert_eq!(seen(0.0), Some((1, 5.0, 5.0)));
    // A light is a shape like another, also from its dark side.
    assert_eq!(seen(10.0), Some((2, 5.0, 5.0)));
    assert_eq!(seen(20.0), Some((3, 4.0, 4.0)));
    assert_eq!(seen(-10.0), None);
    let behind = scene.pick(&Ray::new(Vec3::new(0.0, 0.0, 20.0), -Vec3::Z)).map(|p| p.shape);
    assert_eq!(behind, Some(0));
    // The length of the direction does not matter.
    let long = scene.pick(&Ray::new(Vec3::ZERO, Vec3::Z * 0.25)).map(|p| p.distance.round());
    assert_eq!(long, Some(5.0));
}

/// What is mostly not there is looked through.
#[test]
fn behind_what_is_not_there() {
    let mut desc = empty();
    let inner = material(&mut desc, grey(0.5));
    let at = |z: f64| DAffine3::from_translation(DVec3::new(0.0, 0.0, z));
    shape(&mut desc, ShapeKind::Rectangle, at(5.0), inner, 0.0);
    let nothing = material(&mut desc, NullDesc.into());
    shape(&mut desc, ShapeKind::Cube, at(5.0), nothing, 0.0);
    for (opacity, seen) in [(0.1, 0), (0.9, 2)] {
        let mask = MaskDesc { bsdf: inner, opacity: Spectrum::Constant(opacity).into() };
        let mask = material(&mut desc, mask.into());
        shape(&mut desc, ShapeKind::Disk, at(2.0), mask, 0.0);
        let found = prepare(&desc).pick(&Ray::new(Vec3::ZERO, Vec3::Z)).map(|p| p.shape);
        assert_eq!(found, Some(seen), "opacity {opacity}");
        desc.shapes.truncate(2);
    }
}

#[test]
fn of_two_shapes_back_to_back_the_side_that_is_seen() {
    for kind in [ShapeKind::Rectangle, ShapeKind::Disk] {
        let mut desc = empty();
        let m = material(&mut desc, grey(0.5));
        for flip in [false, true] {
            shape(&mut desc, kind.clone(), DAffine3::IDENTITY, m, 1.0);
            desc.shapes.last_mut().expect("just added").flip_normals = flip;
        }
        let scene = prepare(&desc);
        let pick = |z: f32| {
            scene
                .pick(&Ray::new(Vec3::new(0.2, 0.3, z), Vec3::new(0.0, 0.0, -z.signum())))
                .expect("something is there")
        };
        assert_eq!((pick(2.0).shape, pick(-3.0).shape), (0, 1), "{kind:?}");
        assert_eq!((pick(2.0).distance, pick(-3.0).distance), (2.0, 3.0));
    }
}

/// Through the camera, as a click does: what projects to a place in the picture is what is picked there.
#[test]
fn a_click_finds_what_is_drawn_there() {
    let mut desc = empty();
    desc.camera = look(DVec3::new(3.0, 2.0, -8.0), DVec3::new(-0.3, -0.2, 1.0), 50.0);
    let m = material(&mut desc, grey(0.5));
    let centers: Vec<DVec3> = (0..9).map(|i| DVec3::new(f64::from(i % 3), f64::from(i / 3), 1.0)).collect();
    for &center in &centers {
        shape(&mut desc, sphere(center, 0.2), DAffine3::IDENTITY, m, 0.0);
    }
    let (scene, camera) = (prepare(&desc), Camera::of(&desc).expect("the camera is valid"));
    for (i, center) in centers.iter().enumerate() {
        let project =
            |p: Vec3| camera.view(p, [0.5; 2], &UvWindow::PICTURE).expect("in front of the camera").uv;
        let uv = project(center.as_vec3());
        let found = scene.pick(&camera.ray(uv.map(f64::from), [0.5; 2]).unwrap()).expect("a sphere is there");
        assert_eq!(found.shape, i as u32);
        let to_center = camera.position().distance(center.as_vec3());
        assert!((found.distance + 0.2 - to_center).abs() < 1e-4, "{found:?}");
        let again = project(found.position.as_vec3());
        assert!((0..2).all(|k| (again[k] - uv[k]).abs() < 1e-5), "{again:?} {uv:?}");
    }
}

/// What is picked is an index into the shapes of the description, also where shapes were dropped or are many.
#[test]
fn shapes_that_were_dropped_keep_their_numbers() {
    let mut desc = empty();
    let m = material(&mut desc, grey(0.5));
    shape(&mut desc, sphere(DVec3::ZERO, 0.0), DAffine3::IDENTITY, m, 1.0);
    shape(&mut desc, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)), m, 0.0);
    shape(&mut desc, ShapeKind::Disk, DAffine3::from_translation(DVec3::Z), m, 0.0);
    let found = prepare(&desc).pick(&Ray::new(Vec3::ZERO, Vec3::Z));
    assert_eq!(found.map(|p| p.shape), Some(2));
    assert_eq!(prepare(&empty()).pick(&Ray::new(Vec3::ZERO, Vec3::Z)), None);
}

/// A ball of fog before a wall, in a haze around the camera: what lets less than half of the light through is picked, and the shape that it
/// is entered by; the wall of the other side if neither does.
#[test]
fn media_that_hide_what_is_behind_them() {
    for (in_ball, in_haze, picked) in [
        (0.1, 0.0, None),
        (1.0, 0.0, Some((0, Some(0)))),
        (0.1, 0.05, Some((1, Some(0)))),
        (0.1, 0.2, Some((1, None))),
        // Together they hide the wall, and neither does alone: it is the one in which half is reached.
        (0.2, 0.05, Some((0, Some(0)))),
    ] {
        let mut desc = empty();
        let fog = medium(&mut desc, in_ball, 0.5, PhaseDesc::Isotropic);
        let haze = medium(&mut desc, in_haze, 0.5, PhaseDesc::Isotropic);
        let at = |z: f64| DAffine3::from_translation(DVec3::new(0.0, 0.0, z));
        boundary(&mut desc, sphere(DVec3::new(0.0, 0.0, 7.0), 2.0), DAffine3::IDENTITY, fog);
        desc.shapes[0].medium_interface.exterior = Some(haze);
        let wall = material(&mut desc, grey(0.5));
        shape(&mut desc, ShapeKind::Rectangle, at(15.0), wall, 0.0);
        desc.camera.medium = Some(haze);
        // A thin veil in the haze and another in the ball are passed and hold nothing.
        let null = material(&mut desc, NullDesc.into());
        shape(&mut desc, ShapeKind::Disk, at(2.0), null, 0.0);
        shape(&mut desc, ShapeKind::Disk, at(5.5), null, 0.0);
        let scene = prepare(&desc);
        let ray = Ray::new(Vec3::ZERO, Vec3::Z);
        let found = scene.pick_medium(&ray, scene.medium_ahead(&ray));
        assert_eq!(found.map(|m| (m.medium.0, m.shape)), picked, "σₜ {in_ball} and {in_haze}");
        assert_eq!(scene.pick(&ray).map(|p| p.shape), Some(1), "σₜ {in_ball} and {in_haze}");
    }
}
