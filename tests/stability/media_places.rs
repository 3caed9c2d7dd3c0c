//! Lamps and cameras across boundaries of media, and lamps upon them.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};
use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3};

use pointillist::scene::desc::*;
use pointillist::spectrum::Spectrum;
use pointillist::stream::UvWindow;
use pointillist::tracer::integrator::RenderContext;
use pointillist::tracer::medium::MediumIndex;
use pointillist::tracer::{Camera, Scene};

use crate::Row;
use crate::media::{DISTANCE, METHODS, PLAN, STANDARD_ERRORS, apart, cube, found, largest_distance, mean_in};
use crate::support::agreement::{Method, Plan};
use crate::support::scenes::*;

/// A lamp in the plane y = 0 that faces −y, and if `foggy` a box of absorbing fog into whose top the lower half of it dips.
fn lamp_in_fog(foggy: bool) -> SceneDesc {
    let mut desc = empty();
    desc.integrator.max_depth = Some(2);
    if foggy {
        let fog = medium(&mut desc, 1.0, 0.0, PhaseDesc::Isotropic);
        let to_world = cube(DVec3::new(-1.0, -1.0, 0.0), DVec3::ONE);
        boundary(&mut desc, ShapeKind::Cube, to_world, fog);
    }
    let black = material(&mut desc, grey(0.0));
    let turn = DQuat::from_rotation_x(FRAC_PI_2);
    let half = DVec3::new(0.5, 0.5, 1.0);
    let to_world = DAffine3::from_scale_rotation_translation(half, turn, DVec3::Z);
    shape(&mut desc, ShapeKind::Rectangle, to_world, black, 1.0);
    desc
}

/// A lamp that is half in fog is seen as it is by every method, and lights what is outside.
#[test]
fn m13_lamp_across_a_boundary() {
    let mut desc = lamp_in_fog(true);
    desc.camera = look(DVec3::new(0.0, -3.0, 1.0), DVec3::Y, 6.0);
    let (steps, half) = (400, 3f64.to_radians().tan());
    let at = |i: i32| half * ((f64::from(i) + 0.5) / f64::from(steps) * 2.0 - 1.0);
    let along = |x: f64, z: f64| if z < 0.0 { (-(1.0 + x * x + z * z).sqrt()).exp() } else { 1.0 };
    let expected = (0..steps * steps).map(|i| along(at(i % steps), at(i / steps))).sum::<f64>()
        / f64::from(steps * steps);
    Row {
        case: "M13 lamp that dips into fog, seen by all methods",
        measure: STANDARD_ERRORS,
        figure: largest_distance(&desc, &METHODS, PLAN, expected),
        naive: ("one medium around the lamp", apart((1.0, 0.0), (expected, 0.0))),
        bound: DISTANCE,
    }
    .check();
    let lit = |foggy: bool| {
        let mut desc = lamp_in_fog(foggy);
        let matt = material(&mut desc, grey(0.5));
        let wall = DAffine3::from_rotation_translation(
            DQuat::from_rotation_x(-FRAC_PI_2),
            DVec3::new(0.0, -2.0, 1.0),
        );
        shape(&mut desc, ShapeKind::Rectangle, wall, matt, 0.0);
        desc.camera = look(DVec3::new(0.0, -1.5, 1.0), DVec3::NEG_Y, 40.0);
        desc
    };
    let by_paths = found(&lit(true), Method::Path, PLAN);
    let others = [Method::Particle, Method::Bidirectional, Method::Photon, Method::Vcm];
    let figure = others.map(|method| {
        let paths_per_pixel = if method == Method::Particle { 16384 } else { 1024 };
        let found = found(&lit(true), method, Plan { paths_per_pixel, ..PLAN });
        println!("{method:?}: {found:?}, {by_paths:?} by paths");
        apart(found, by_paths)
    });
    Row {
        case: "M13 wall lit by a lamp that dips into fog, all methods against paths",
        measure: STANDARD_ERRORS,
        figure: figure.into_iter().fold(0.0, f64::max),
        naive: ("one medium around the lamp", apart(found(&lit(false), Method::Path, PLAN), by_paths)),
        bound: DISTANCE,
    }
    .check();
}

/// An environment above the plane of a sea, which has no other boundary: from below nothing arrives.
#[test]
fn m13_environment_over_a_sea() {
    let mut desc = empty();
    desc.integrator.max_depth = Some(2);
    let water = medium(&mut desc, 2.0, 0.0, PhaseDesc::Isotropic);
    boundary(&mut desc, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::splat(3.0)), water);
    let matt = material(&mut desc, grey(0.5));
    let bottom = DAffine3::from_scale_rotation_translation(
        DVec3::splat(0.5),
        DQuat::IDENTITY,
        DVec3::new(0.0, 0.0, -0.3),
    );
    shape(&mut desc, ShapeKind::Rectangle, bottom, matt, 0.0);
    desc.camera = look(DVec3::new(0.02, 0.01, 0.5), DVec3::NEG_Z, 20.0);
    environment(&mut desc);
    let by_paths = found(&desc, Method::Path, PLAN);
    let figure = [Method::Particle, Method::Bidirectional, Method::Vcm].map(|method| {
        let paths_per_pixel = if method == Method::Particle { 65536 } else { 1024 };
        let found = found(&desc, method, Plan { paths_per_pixel, ..PLAN });
        println!("{method:?}: {found:?}, {by_paths:?} by paths");
        apart(found, by_paths)
    });
    Row {
        case: "M13 bottom of a sea under an environment, all methods against paths",
        measure: STANDARD_ERRORS,
        figure: figure.into_iter().fold(0.0, f64::max),
        naive: ("water all around", apart((0.0, 0.0), by_paths)),
        bound: DISTANCE,
    }
    .check();
}

/// Light that comes infinitely far through fog does not arrive, by whatever method.
#[test]
fn m13_light_from_infinity_ends_in_fog() {
    let mut desc = empty();
    desc.integrator.max_depth = Some(4);
    desc.camera.perspective_mut().unwrap().fov = 40.0;
    desc.camera.medium = Some(medium(&mut desc, 0.2, 0.9, PhaseDesc::Isotropic));
    let matt = material(&mut desc, grey(0.5));
    shape(&mut desc, sphere(DVec3::new(0.0, 0.0, 4.0), 1.0), DAffine3::IDENTITY, matt, 0.0);
    let irradiance = Spectrum::Constant(1.0);
    let direction = DVec3::Z;
    desc.lights.push(LightDesc::Directional { direction, irradiance, place: Place::default() });
    for method in [Method::Path, Method::Particle, Method::Bidirectional, Method::Photon, Method::Vcm] {
        assert_eq!(found(&desc, method, Plan { seeds: 2, ..PLAN }), (0.0, 0.0), "{method:?}");
    }
}

/// A scene with a cube of absorbing fog around the origin, of half side 1, in even light.
fn cube_of_fog() -> SceneDesc {
    let mut desc = empty();
    let fog = medium(&mut desc, 1.0, 0.0, PhaseDesc::Isotropic);
    boundary(&mut desc, ShapeKind::Cube, DAffine3::IDENTITY, fog);
    environment(&mut desc);
    desc
}

fn context(desc: &SceneDesc) -> RenderContext {
    let camera = Camera::of(desc).expect("the camera is valid");
    let scene: Arc<Scene> = prepare(desc).into();
    RenderContext::new(scene, camera, &desc.integrator, 1, UvWindow::PICTURE)
}

/// The rays of a camera of parallel rays and those of a wide lens begin on both sides of a boundary.
#[test]
fn m14_camera_across_a_boundary() {
    // Both are so far from the face x = 1, looking along it.
    let inside = 0.1;
    let from = DVec3::new(1.0 - inside, 0.0, 0.0);
    let mut parallel = cube_of_fog();
    parallel.camera = look(from, DVec3::Z, 40.0);
    parallel.camera.projection = ProjectionDesc::Orthographic;
    parallel.camera.to_world.matrix3 *= 0.5;
    let mut lens = cube_of_fog();
    lens.camera = look(from, DVec3::Z, 0.01);
    lens.camera.perspective_mut().unwrap().lens = LensDesc::round(0.3, 1e6);
    // The shares of the square of half side .5 and of the disk of radius .3 on this side of a line through .1.
    let h: f64 = inside / 0.3;
    let of_disk = 1.0 - FRAC_1_PI * (h.acos() - h * (1.0 - h * h).sqrt());
    for (what, desc, share) in
        [("parallel rays", &parallel, 0.5 + inside), ("rays from a lens of radius .3", &lens, of_disk)]
    {
        let expected = share * (-1f64).exp() + 1.0 - share;
        // Light paths find no environment behind a lens of no field of view.
        let methods =
            if desc.camera.is_orthographic() { &METHODS[..] } else { &[Method::Path, Method::Photon] };
        let one_medium = RenderContext { on_boundary: false, ..context(desc) };
        Row {
            case: &format!("M14 {what} that begin on both sides of a boundary"),
            measure: STANDARD_ERRORS,
            figure: largest_distance(desc, methods, PLAN, expected),
            naive: ("one medium around the camera", apart(mean_in(one_medium, 1 << 12), (expected, 0.0))),
            bound: DISTANCE,
        }
        .check();
    }
}

/// A camera outside fog whose rays begin within, on its near clip plane.
#[test]
fn m14_near_clip_plane_in_fog() {
    let mut desc = cube_of_fog();
    desc.camera = look(DVec3::new(0.1, 0.2, -1.5), DVec3::Z, 0.01);
    desc.camera.near_clip = 1.0;
    let expected = (-1.5f64).exp();
    let around_the_lens = RenderContext { medium: MediumIndex::VACUUM, ..context(&desc) };
    assert!(!around_the_lens.on_boundary, "the rays begin in one medium");
    let methods = [Method::Path, Method::Bidirectional, Method::Photon];
    Row {
        case: "M14 rays that begin in fog on the near clip plane of a camera outside",
        measure: STANDARD_ERRORS,
        figure: largest_distance(&desc, &methods, PLAN, expected),
        naive: ("the medium around the lens", apart(mean_in(around_the_lens, 1 << 12), (expected, 0.0))),
        bound: DISTANCE,
    }
    .check();
}

/// A lamp that is half holes lies in the top of fog, over another one: what shows through the holes comes through the fog. In either order of
/// the shapes; of another size than the fog or of the same, and of that also with its back to the camera, where one face is the back of the other.
#[test]
fn m15_lamp_with_holes_upon_fog() {
    let expected_of = |front: bool| f64::from(u8::from(front)) + 0.5 * (-0.8f64).exp();
    let (mut figure, mut naive) = (0f64, 0f64);
    for (lamp_first, side, front) in [
        (true, 0.7, true),
        (false, 0.7, true),
        (true, 1.0, true),
        (false, 1.0, true),
        (true, 1.0, false),
        (false, 1.0, false),
    ] {
        let mut desc = empty();
        desc.camera = look(DVec3::new(0.1, 0.2, 2.0), DVec3::NEG_Z, 0.01);
        let black = material(&mut desc, grey(0.0));
        let holes = MaskDesc { bsdf: black, opacity: Spectrum::Constant(0.5).into() }.into();
        let holes = material(&mut desc, holes);
        let turn = if front { DQuat::IDENTITY } else { DQuat::from_rotation_x(PI) };
        let lamp = DAffine3::from_scale_rotation_translation(DVec3::splat(side), turn, DVec3::Z);
        if lamp_first {
            shape(&mut desc, ShapeKind::Rectangle, lamp, holes, 1.0);
        }
        let fog = medium(&mut desc, 1.0, 0.0, PhaseDesc::Isotropic);
        let to_world = cube(DVec3::new(-1.0, -1.0, 0.2), DVec3::ONE);
        boundary(&mut desc, ShapeKind::Cube, to_world, fog);
        if !lamp_first {
            shape(&mut desc, ShapeKind::Rectangle, lamp, holes, 1.0);
        }
        shape(&mut desc, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::splat(2.0)), black, 1.0);
        let expected = expected_of(front);
        let methods = [Method::Path, Method::Bidirectional, Method::Photon];
        figure = figure.max(largest_distance(&desc, &methods, PLAN, expected));
        let no_fog = expected + 0.5 * (1.0 - (-0.8f64).exp());
        naive = naive.max(apart((no_fog, 0.0), (expected, 0.0)));
    }
    Row {
        case: "M15 fog below a lamp with holes",
        measure: STANDARD_ERRORS,
        figure,
        naive: ("the boundary is missed", naive),
        bound: DISTANCE,
    }
    .check();
}
