//! Boundaries of media, and media that are very dense.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3, EulerRot, Vec3};

use pointillist::scene::desc::*;
use pointillist::spectrum::{Spectrum, dispersion::Ior};
use pointillist::stream::UvWindow;
use pointillist::tracer::accel::Ray;
use pointillist::tracer::integrator::RenderContext;
use pointillist::tracer::record::{PathEvent, recorded};
use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};

use crate::Row;
use crate::media_grids::grid;
use crate::support::agreement::{Method, Plan, repeat};
use crate::support::scenes::*;
use crate::support::welch;

/// Student's t of 16 seeds exceeds this by chance once in 6000 times.
pub(crate) const DISTANCE: f64 = 5.0;

pub(crate) const STANDARD_ERRORS: &str = "distance of the mean, in standard errors";

pub(crate) const PLAN: Plan = Plan { side: 2, paths_per_pixel: 1024, seeds: 16, window: UvWindow::PICTURE };

pub(crate) const METHODS: [Method; 4] =
    [Method::Path, Method::Particle, Method::Bidirectional, Method::Photon];

/// Mean of a picture over the seeds, and the variance of that mean.
pub(crate) fn found(desc: &SceneDesc, method: Method, plan: Plan) -> (f64, f64) {
    let pictures = repeat(desc, method, plan);
    welch::moments(pictures.iter().map(|picture| picture.iter().sum::<f64>() / picture.len() as f64))
}

/// How far two means lie apart in standard errors.
pub(crate) fn apart(a: (f64, f64), b: (f64, f64)) -> f64 {
    welch::t(a, b, 0.0, f64::from(PLAN.seeds)).0.abs()
}

/// The largest distance of the mean by any of these methods from what is expected.
pub(crate) fn largest_distance(desc: &SceneDesc, methods: &[Method], plan: Plan, expected: f64) -> f64 {
    let of = |&method: &Method| {
        let found = found(desc, method, plan);
        println!("{method:?}: {:.6} ± {:.6}, expected {expected:.6}", found.0, found.1.sqrt());
        apart(found, (expected, 0.0))
    };
    methods.iter().map(of).fold(0.0, f64::max)
}

/// The cube with these corners.
pub(crate) fn cube(low: DVec3, high: DVec3) -> DAffine3 {
    let [half, center] = [0.5 * (high - low), 0.5 * (high + low)];
    DAffine3::from_scale_rotation_translation(half, DQuat::IDENTITY, center)
}

/// The direction in which the light of [`lit_floor`] propagates: not quite downwards.
fn downwards() -> DVec3 {
    DVec3::new(0.1, 0.05, -1.0).normalize()
}

/// A floor under light of one direction that it reflects with the radiance 1, and a camera that looks down from a height of .5.
fn lit_floor() -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.03, 0.02, 0.5), DVec3::NEG_Z, 20.0);
    desc.integrator.max_depth = Some(2);
    let irradiance = Spectrum::Constant((PI / 0.5 / -downwards().z) as f32);
    desc.lights.push(LightDesc::Directional { direction: downwards(), irradiance, place: Place::default() });
    desc
}

fn add_floor(desc: &mut SceneDesc) {
    let matt = material(desc, grey(0.5));
    shape(desc, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::splat(3.0)), matt, 0.0);
}

/// Optical depth of a ray through boxes of media, where surfaces are crossed one at a time and a ray goes on behind what rounding puts into the
/// place of the last. Shape `i` of the scene has `extinctions[i]` within and around it; a shape without any ends the ray. Tells also whether one was met.
fn depth_one_at_a_time(scene: &Scene, mut ray: Ray, extinctions: &[Option<[f64; 2]>]) -> (f64, bool) {
    let (mut depth, mut extinction) = (0.0, 0.0);
    while let Some(at) = scene.first(&ray) {
        depth += extinction * f64::from(at.hit.t);
        let Some([inside, outside]) = extinctions[at.surface as usize] else { return (depth, true) };
        extinction = if ray.direction.dot(at.point.ng) > 0.0 { outside } else { inside };
        ray = at.spawn(ray.direction);
    }
    (if extinction > 0.0 { f64::INFINITY } else { depth }, false)
}

/// Two boxes of absorbing media, one upon the other, which share a plane or are an ulp of it apart or within each other. The lower one
/// is smaller, so that no face is the back of another. In either order.
#[test]
fn m1_media_that_touch() {
    const PLANE: f64 = 1.3;
    let [lower, upper] = [1.0, 2.0];
    let (mut figure, mut naive) = (0f64, 0f64);
    for gap in [0.0, -1.0, 1.0].map(|ulps| ulps * f64::from(f32::EPSILON)) {
        for turned in [false, true] {
            let mut desc = lit_floor();
            let boxes = [
                (lower, cube(DVec3::new(-2.0, -2.0, 1.0), DVec3::new(2.0, 2.0, PLANE))),
                (upper, cube(DVec3::new(-2.5, -2.5, PLANE + gap), DVec3::new(2.5, 2.5, 2.0))),
            ];
            let boxes = if turned { [boxes[1], boxes[0]] } else { boxes };
            for (extinction, to_world) in boxes {
                let medium = medium(&mut desc, extinction as f32, 0.0, PhaseDesc::Isotropic);
                boundary(&mut desc, ShapeKind::Cube, to_world, medium);
            }
            add_floor(&mut desc);
            let depth = (lower * (PLANE - 1.0) + upper * (2.0 - PLANE)) / -downwards().z;
            let expected = (-depth).exp();
            figure = figure.max(largest_distance(&desc, &METHODS, PLAN, expected));
            let scene = prepare(&desc);
            let extinctions = [Some([boxes[0].0, 0.0]), Some([boxes[1].0, 0.0]), None];
            for up in [true, false] {
                let (from, towards) = if up { (0.5, -downwards()) } else { (2.5, downwards()) };
                let ray = Ray::new(Vec3::new(0.03, 0.02, from), towards.as_vec3());
                let (depth, _) = depth_one_at_a_time(&scene, ray, &extinctions);
                let found = (-depth).exp();
                naive = naive.max(apart((found, 0.0), (expected, 0.0)));
            }
        }
    }
    Row {
        case: "M1 media that touch, an ulp apart or within each other, all methods",
        measure: STANDARD_ERRORS,
        figure,
        naive: ("surfaces crossed one at a time", naive),
        bound: DISTANCE,
    }
    .check();
}

/// A box of absorbing medium, and another one with a third within it upon it: three boundaries in one plane, in every order of the shapes.
#[test]
fn m1_three_boundaries_in_a_plane() {
    const PLANE: f64 = 1.3;
    let (mut figure, mut naive) = (0f64, 0f64);
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let mut desc = lit_floor();
        let [lower, upper, inner] = [1.0, 0.5, 2.0];
        let ids = [lower, upper, inner]
            .map(|extinction| medium(&mut desc, extinction as f32, 0.0, PhaseDesc::Isotropic));
        // Extinction within and around, and the box; of different sizes, so that no face is the back of another.
        let boxes = [
            ([lower, 0.0], cube(DVec3::new(-2.0, -2.0, 1.0), DVec3::new(2.0, 2.0, PLANE))),
            ([upper, 0.0], cube(DVec3::new(-2.5, -2.5, PLANE), DVec3::new(2.5, 2.5, 2.0))),
            ([inner, upper], cube(DVec3::new(-1.5, -1.5, PLANE), DVec3::new(1.5, 1.5, 1.7))),
        ];
        for i in order {
            boundary(&mut desc, ShapeKind::Cube, boxes[i].1, ids[i]);
            let around = (i == 2).then_some(ids[1]);
            desc.shapes.last_mut().unwrap().medium_interface.exterior = around;
        }
        add_floor(&mut desc);
        let depth = lower * (PLANE - 1.0) + inner * (1.7 - PLANE) + upper * (2.0 - 1.7);
        let expected = (-depth / -downwards().z).exp();
        figure = figure.max(largest_distance(&desc, &METHODS, PLAN, expected));
        let scene = prepare(&desc);
        let [a, b, c] = order.map(|i| Some(boxes[i].0));
        for up in [true, false] {
            let (from, towards) = if up { (0.5, -downwards()) } else { (2.5, downwards()) };
            let ray = Ray::new(Vec3::new(0.03, 0.02, from), towards.as_vec3());
            let (depth, _) = depth_one_at_a_time(&scene, ray, &[a, b, c, None]);
            naive = naive.max(apart(((-depth).exp(), 0.0), (expected, 0.0)));
        }
    }
    Row {
        case: "M1 three boundaries in one plane, all methods",
        measure: STANDARD_ERRORS,
        figure,
        naive: ("surfaces crossed one at a time", naive),
        bound: DISTANCE,
    }
    .check();
}

/// Two halves of a scattering medium are the whole.
#[test]
fn m1_halves_of_a_medium() {
    let scene = |heights: &[[f64; 2]]| {
        let mut desc = lit_floor();
        desc.camera = look(DVec3::new(0.0, -3.0, 1.2), DVec3::new(0.0, 3.0, -0.5), 40.0);
        desc.integrator.max_depth = Some(12);
        let milk = medium(&mut desc, 4.0, 0.9, PhaseDesc::HenyeyGreenstein { g: 0.4 });
        for (i, &[low, high]) in heights.iter().enumerate() {
            // No face is the back of another.
            let side = 0.8 + 1e-6 * i as f64;
            let to_world = cube(DVec3::new(-side, -side, low), DVec3::new(side, side, high));
            boundary(&mut desc, ShapeKind::Cube, to_world, milk);
        }
        add_floor(&mut desc);
        desc
    };
    let (whole, halves, lower) = ([[0.2, 1.0]], [[0.2, 0.6], [0.6, 1.0]], [[0.2, 0.6]]);
    let (mut figure, mut naive) = (0f64, f64::INFINITY);
    for method in METHODS {
        // From the light the camera is seldom found, and photons have noise of their own.
        let paths_per_pixel = match method {
            Method::Particle | Method::Photon => 16384,
            _ => 512,
        };
        let plan = Plan { side: 4, paths_per_pixel, ..PLAN };
        let [whole, halves, lower] = [&whole[..], &halves, &lower].map(|it| found(&scene(it), method, plan));
        println!("{method:?}: {whole:?} {halves:?} {lower:?}");
        figure = figure.max(apart(halves, whole));
        naive = naive.min(apart(lower, whole));
    }
    Row {
        case: "M1 two halves of milk that touch, against the whole, all methods",
        measure: STANDARD_ERRORS,
        figure,
        naive: ("the second half is missed", naive),
        bound: DISTANCE,
    }
    .check();
}

/// Fog in a box that stands on a floor: its bottom lies in the floor, in either order of the shapes.
#[test]
fn m1_fog_on_a_floor() {
    let (mut figure, mut naive) = (0f64, 0f64);
    for (floor_first, sunk) in [(true, 0.0), (false, 0.0), (false, 1.0), (false, -1.0), (true, 1.0)] {
        let mut desc = lit_floor();
        desc.camera = look(DVec3::new(0.03, 0.02, 1.5), DVec3::NEG_Z, 20.0);
        if floor_first {
            add_floor(&mut desc);
        }
        let fog = medium(&mut desc, 0.7, 0.0, PhaseDesc::Isotropic);
        let bottom = sunk * f64::from(f32::EPSILON);
        let to_world = cube(DVec3::new(-2.0, -2.0, bottom), DVec3::new(2.0, 2.0, 1.0));
        boundary(&mut desc, ShapeKind::Cube, to_world, fog);
        if !floor_first {
            add_floor(&mut desc);
        }
        // Down at once along the axis of the camera, which is narrow: the mean over its angles.
        let steps = 400;
        let half = 10f64.to_radians().tan();
        let at = |i: i32| half * ((f64::from(i) + 0.5) / f64::from(steps) * 2.0 - 1.0);
        let along = |x: f64, y: f64| (-0.7 * (1.0 + x * x + y * y).sqrt()).exp();
        let cells = (0..steps * steps).map(|i| along(at(i % steps), at(i / steps)));
        let expected = cells.sum::<f64>() / f64::from(steps * steps) * (-0.7 / -downwards().z).exp();
        figure = figure.max(largest_distance(&desc, &METHODS, PLAN, expected));
        let scene = prepare(&desc);
        let extinctions = if floor_first { [None, Some([0.7, 0.0])] } else { [Some([0.7, 0.0]), None] };
        let ray = Ray::new(Vec3::new(0.03, 0.02, 1.5), Vec3::new(0.01, 0.02, -1.0).normalize());
        let (down, meets_floor) = depth_one_at_a_time(&scene, ray, &extinctions);
        // A ray that misses the floor sees nothing of its light.
        let found = if meets_floor { (-down - 0.7 / -downwards().z).exp() } else { 0.0 };
        // The camera's other rays differ by less than a hundredth.
        let is_near = (found / expected - 1.0).abs() < 1e-2;
        naive = naive.max(if is_near { 0.0 } else { apart((found, 0.0), (expected, 0.0)) });
    }
    Row {
        case: "M1 fog in a box whose bottom lies in the floor, all methods",
        measure: STANDARD_ERRORS,
        figure,
        naive: ("surfaces crossed one at a time", naive),
        bound: DISTANCE,
    }
    .check();
}

/// Mean over paths of a tracer with this context, and the variance of that mean.
pub(crate) fn mean_in(context: RenderContext, paths: u64) -> (f64, f64) {
    let tracer = PathTracer { context };
    let mut sink = Luminances::default();
    (0..paths).for_each(|i| tracer.trace(i, &mut (), &mut sink));
    welch::moments(sink.0.iter().map(|&y| f64::from(y)))
}

/// A camera that stands exactly on a boundary sees what one a little before or behind it sees, in every direction.
#[test]
fn m2_camera_on_a_boundary() {
    let (mut figure, mut naive) = (0f64, 0f64);
    let ball = || sphere(DVec3::ZERO, 1.0);
    let turn = DAffine3::from_quat(DQuat::from_euler(EulerRot::XYZ, 0.3, 0.5, 0.7));
    let to = DAffine3::from_translation;
    // Rounding of a plane through the origin is not that of the camera there; far away it is more than both have elsewhere.
    let through_origin = turn * to(DVec3::NEG_Z);
    let far = to(DVec3::new(30.0, -70.0, 50.0)) * turn;
    for (kind, to_world, at, inwards) in [
        (ball(), DAffine3::IDENTITY, DVec3::NEG_Z, DVec3::Z),
        (ball(), DAffine3::IDENTITY, DVec3::new(0.36, -0.48, -0.8), DVec3::new(-0.36, 0.48, 0.8)),
        (ball(), DAffine3::IDENTITY, DVec3::new(0.6, 0.0, -0.8), DVec3::new(-0.6, 0.0, 0.8)),
        (ball(), to(DVec3::NEG_Z), DVec3::Z, DVec3::NEG_Z),
        (ball(), far, DVec3::new(0.36, -0.48, -0.8), DVec3::new(-0.36, 0.48, 0.8)),
        (ShapeKind::Cube, DAffine3::IDENTITY, DVec3::new(0.2, 0.1, -1.0), DVec3::Z),
        (ShapeKind::Cube, DAffine3::IDENTITY, DVec3::new(1.0, 0.3, 0.0), DVec3::NEG_X),
        (ShapeKind::Cube, through_origin, DVec3::Z, DVec3::NEG_Z),
        (ShapeKind::Cube, far, DVec3::new(0.2, 0.1, -1.0), DVec3::Z),
    ] {
        for (towards, expected) in [(inwards, (-2f64).exp()), (-inwards, 1.0)] {
            let mut desc = empty();
            let smoke = medium(&mut desc, 1.0, 0.0, PhaseDesc::Isotropic);
            boundary(&mut desc, kind.clone(), to_world, smoke);
            environment(&mut desc);
            desc.camera = look(to_world.transform_point3(at), to_world.transform_vector3(towards), 0.01);
            // What only absorbs makes no noise, so that the rounding of lengths far from the origin would show.
            for method in [Method::Path, Method::Bidirectional, Method::Photon] {
                let (seen, rounding) = (found(&desc, method, PLAN), 1e-4 * expected);
                figure = figure.max(welch::t(seen, (expected, 0.0), rounding, PLAN.seeds.into()).0.abs());
            }
            let camera = Camera::of(&desc).unwrap();
            let scene = Arc::new(prepare(&desc));
            let context = RenderContext::new(scene, camera, &desc.integrator, 1, UvWindow::PICTURE);
            let one_medium = RenderContext { on_boundary: false, ..context };
            naive = naive.max(apart(mean_in(one_medium, 1 << 12), (expected, 0.0)));
        }
    }
    Row {
        case: "M2 camera on a sphere and on a box of smoke, looking in and out",
        measure: STANDARD_ERRORS,
        figure,
        naive: ("one medium around the camera", naive),
        bound: DISTANCE,
    }
    .check();
}

/// Where glass is in [`milk_ball`].
#[derive(Clone, Copy, PartialEq)]
enum Glass {
    None,
    /// The boundary of the milk is of glass.
    Boundary,
    /// A ball of glass lies upon the boundary, before it in the list of shapes or behind it.
    Upon {
        first: bool,
    },
}

/// A ball, `filled` with milk, over a floor; its glass has the index of what is around.
fn milk_ball(glass: Glass, filled: bool) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, -4.0, 1.5), DVec3::new(0.0, 4.0, -0.7), 35.0);
    desc.integrator.max_depth = Some(16);
    add_floor(&mut desc);
    let index = Ior::Constant(1.5);
    let matched = material(
        &mut desc,
        BsdfDesc::Dielectric(DielectricDesc {
            int_ior: index.clone(),
            ext_ior: index,
            specular_reflectance: Spectrum::Constant(1.0).into(),
            specular_transmittance: Spectrum::Constant(1.0).into(),
        }),
    );
    let ball = || sphere(DVec3::new(0.0, 0.0, 0.9), 0.8);
    if glass == (Glass::Upon { first: true }) {
        shape(&mut desc, ball(), DAffine3::IDENTITY, matched, 0.0);
    }
    let milk = medium(&mut desc, 2.0, 0.8, PhaseDesc::HenyeyGreenstein { g: 0.5 });
    boundary(&mut desc, ball(), DAffine3::IDENTITY, milk);
    let last = desc.shapes.last_mut().unwrap();
    last.medium_interface.interior = filled.then_some(milk);
    if glass == Glass::Boundary {
        last.bsdf = matched;
    }
    if glass == (Glass::Upon { first: false }) {
        shape(&mut desc, ball(), DAffine3::IDENTITY, matched, 0.0);
    }
    environment(&mut desc);
    let dark = material(&mut desc, grey(0.0));
    let lamp = DAffine3::from_scale_rotation_translation(
        DVec3::splat(0.8),
        DQuat::from_rotation_x(PI),
        DVec3::new(0.5, 0.0, 3.0),
    );
    shape(&mut desc, ShapeKind::Rectangle, lamp, dark, 8.0);
    desc
}

/// Glass of the index of what is around it is no more than a boundary, and nothing where it lies upon one.
#[test]
fn m3_glass_without_refraction() {
    let plan = Plan { side: 4, paths_per_pixel: 1024, ..PLAN };
    for method in [Method::Path, Method::Bidirectional] {
        let null = found(&milk_ball(Glass::None, true), method, plan);
        let empty = found(&milk_ball(Glass::Boundary, false), method, plan);
        for (what, glass) in [
            ("milk in glass of the index around it", Glass::Boundary),
            ("a ball of such glass upon the boundary of milk", Glass::Upon { first: true }),
            ("a ball of such glass behind the boundary of milk", Glass::Upon { first: false }),
        ] {
            let matched = found(&milk_ball(glass, true), method, plan);
            println!("{method:?}: null {null:?}, glass {matched:?}, empty {empty:?}");
            Row {
                case: &format!("M3 {what}, against a bare boundary, {method:?}"),
                measure: STANDARD_ERRORS,
                figure: apart(matched, null),
                naive: ("glass as a surface without media", apart(empty, null)),
                bound: DISTANCE,
            }
            .check();
        }
    }
}

/// True where a point is not within the box that a scene consists of, by the box itself: nothing lies ahead of a ray outwards.
fn is_beyond(scene: &Scene, center: Vec3, p: Vec3) -> bool {
    let ray = Ray::new(p, (p - center).normalize());
    !scene.first(&ray).is_some_and(|at| ray.direction.dot(at.point.ng) > 0.0)
}

/// A box of optical depth 1e6 that scatters everything, in even light: nothing is lost, and every path ends. It stands as far from the origin as
/// scenes do that are not moved, so that rounding is a fifth of the distances between scatterings.
#[test]
fn m4_optical_depth_of_a_million() {
    let mut desc = empty();
    let center = DVec3::new(2.1, -1.7, 1.9);
    desc.camera = look(center + DVec3::new(0.1, 0.2, -3.0), DVec3::new(0.02, -0.03, 1.0), 10.0);
    // Paths are as long as any may be.
    desc.integrator.rr_depth = 1 << 20;
    let dense = medium(&mut desc, 1e6, 1.0, PhaseDesc::Isotropic);
    let turn = DQuat::from_euler(EulerRot::XYZ, 0.3, 0.5, 0.7);
    let half = DVec3::new(0.9, 0.8, 0.5);
    let to_world = DAffine3::from_scale_rotation_translation(half, turn, center);
    boundary(&mut desc, ShapeKind::Cube, to_world, dense);
    environment(&mut desc);
    let camera = Camera::of(&desc).unwrap();
    let scene = Arc::new(prepare(&desc).recorded());
    let context = RenderContext::new(scene.clone(), camera, &desc.integrator, 1, UvWindow::PICTURE);
    let tracer = PathTracer { context };
    let center = center.as_vec3();
    let (mut vertices, mut beyond, mut longest) = (0u32, 0u32, 0usize);
    let mut sink = Luminances::default();
    for index in 0..1u64 << 10 {
        let events = recorded(|| tracer.trace(index, &mut (), &mut sink));
        let met = events.iter().filter_map(|event| match event {
            PathEvent::Meets(_, at) if at.is_in_medium() => Some(at.point.p),
            _ => None,
        });
        longest = longest.max(met.clone().count());
        vertices += met.clone().count() as u32;
        beyond += met.filter(|p| is_beyond(&scene, center, *p)).count() as u32;
    }
    // The same walk with vertices where the distance leads, in single precision.
    let (mut random, mut walked, mut naive_beyond) = (Random(5), 0u32, 0u32);
    for _ in 0..1 << 10 {
        let aim = center + Vec3::new(random.within(-0.2, 0.2), random.within(-0.2, 0.2), 0.0);
        let from = center + Vec3::new(0.1, 0.2, -3.0);
        let Some(at) = scene.first(&Ray::new(from, (aim - from).normalize())) else { continue };
        let mut ray = at.spawn(-at.wo);
        for _ in 0..1024 {
            let Some(end) = scene.first(&ray) else { break };
            let t = (-(-random.f64()).ln_1p() * 1e-6) as f32;
            if t >= end.hit.t {
                break;
            }
            let p = ray.origin + ray.direction * t;
            (walked, naive_beyond) = (walked + 1, naive_beyond + u32::from(is_beyond(&scene, center, p)));
            ray = Ray::new(p, random.direction().as_vec3());
        }
    }
    println!("{beyond} of {vertices} beyond, {naive_beyond} of {walked}");
    println!("{vertices} vertices, longest path {longest}");
    assert!(longest > 1024, "the walk is long: {longest}");
    assert!(longest < 2048, "roulette ends a path: {longest}");
    Row {
        case: "M4 box of optical depth 1e6, turned",
        measure: "share of vertices beyond its boundary",
        figure: f64::from(beyond) / f64::from(vertices),
        naive: ("vertices where the distance leads", f64::from(naive_beyond) / f64::from(walked)),
        bound: 1e-5,
    }
    .check();
    // The same density on a grid.
    let mut on_grid = desc.clone();
    let unit = to_world
        * DAffine3::from_scale_rotation_translation(DVec3::splat(2.0), DQuat::IDENTITY, DVec3::splat(-1.0));
    on_grid.media[0].sigma_t = grid([2; 3], vec![1e6; 8], unit);
    let plan = Plan { side: 1, paths_per_pixel: 512, ..PLAN };
    let short = IntegratorDesc { max_depth: Some(64), ..desc.integrator.clone() };
    let short = SceneDesc { integrator: short, ..desc.clone() };
    let lost = |desc: &SceneDesc, method: Method| {
        let (mean, variance) = found(desc, method, plan);
        println!("{method:?}: {mean} ± {}", variance.sqrt());
        assert!(mean <= 1.0 + DISTANCE * variance.sqrt(), "{method:?}: {mean} of 1");
        (mean - 1.0).abs()
    };
    let naive = lost(&short, Method::Path);
    for (what, desc) in [("homogeneous", &desc), ("on a grid", &on_grid)] {
        Row {
            case: &format!("M4 box of optical depth 1e6 without loss in even light, {what}"),
            measure: "light that is lost with paths of 1024 segments and roulette",
            figure: lost(desc, Method::Path),
            naive: ("paths of at most 64 segments", naive),
            bound: 0.15,
        }
        .check();
        // Its paths are shorter; that it makes no energy and ends is asserted above.
        lost(desc, Method::Bidirectional);
    }
}
