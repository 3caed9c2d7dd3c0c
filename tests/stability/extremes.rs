//! Extreme scenes: the result is defined for every method, and the user is told where he must know.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3};

use pointillist::color::Xyz;
use pointillist::scene::desc::{IntegratorDesc, LightDesc, Mesh, MeshId, Place, SceneDesc, ShapeKind};
use pointillist::scene::load_str;
use pointillist::spectrum::Spectrum;
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::Integrator;

use crate::Row;
use crate::support::agreement::{Method, Plan, repeat};
use crate::support::scenes::{
    Random, empty, environment, grey, look, luminances, material, prepare, shape, sphere, tracer,
};
use crate::support::welch;

const METHODS: [Method; 4] = [Method::Path, Method::Particle, Method::Bidirectional, Method::Photon];

const PLAN: Plan = Plan { side: 4, paths_per_pixel: 512, seeds: 16, window: UvWindow::PICTURE };

/// The distance of a mean from what is expected in standard errors, which are those of 16 seeds.
fn distance(found: (f64, f64), expected: f64) -> f64 {
    welch::t(found, (expected, 0.0), 0.0, f64::from(PLAN.seeds)).0.abs()
}

/// Largest distance over the methods between the mean of the picture and what is expected.
fn largest_distance(desc: &SceneDesc, plan: Plan, expected: f64) -> f64 {
    let of = |method| {
        let pictures = repeat(desc, method, plan);
        let means = pictures.iter().map(|p| p.iter().sum::<f64>() / p.len() as f64);
        let found = welch::moments(means);
        println!("{method:?}: {:.6} ± {:.6}, expected {expected:.6}", found.0, found.1.sqrt());
        distance(found, expected)
    };
    METHODS.map(of).into_iter().fold(0.0, f64::max)
}

/// Student's t of 16 seeds exceeds this by chance once in 6000 times.
const DISTANCE: f64 = 5.0;

const STANDARD_ERRORS: &str = "distance of the mean, in standard errors";

/// The largest pixel by any method.
fn brightest(desc: &SceneDesc) -> f64 {
    let all = METHODS.map(|method| repeat(desc, method, PLAN).into_iter().flatten().fold(0.0, f64::max));
    all.into_iter().fold(0.0, f64::max)
}

fn notices(desc: &SceneDesc) -> String {
    prepare(desc).notices().join("\n")
}

fn warnings(xml: &str) -> String {
    let loaded = load_str("t.xml", xml, &[]).unwrap();
    loaded.warnings.iter().map(|w| format!("{w}\n")).collect()
}

fn rectangle(desc: &mut SceneDesc, axes: [DVec3; 2], center: DVec3, albedo: f32, emission: f32) {
    let bsdf = material(desc, grey(albedo));
    let matrix = DMat3::from_cols(axes[0], axes[1], axes[0].cross(axes[1]).normalize());
    let to_world = DAffine3::from_mat3_translation(matrix, center);
    shape(desc, ShapeKind::Rectangle, to_world, bsdf, emission);
}

/// A scene of nothing shows the environment, or black.
#[test]
fn n25_empty_scene() {
    let mut desc = empty();
    desc.camera = look(DVec3::ZERO, DVec3::Z, 90.0);
    assert_eq!(brightest(&desc), 0.0);
    let xml = "<scene version='3.0.0'><sensor type='perspective'/></scene>";
    assert!(warnings(xml).contains("no light"), "{}", warnings(xml));
    environment(&mut desc);
    // The box around nothing goes from +∞ to −∞.
    let (lo, hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    Row {
        case: "N25 empty scene with an environment, all methods",
        measure: STANDARD_ERRORS,
        figure: largest_distance(&desc, PLAN, 1.0),
        naive: ("centre of an empty box", f64::from((0.5 * (lo + hi)).x)),
        bound: DISTANCE,
    }
    .check();
}

/// A room without any light, and one whose light is black, are black, and the user is told.
#[test]
fn n25_no_light() {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, 0.0, 3.0), DVec3::NEG_Z, 60.0);
    rectangle(&mut desc, [DVec3::X, DVec3::Y], DVec3::ZERO, 0.8, 0.0);
    let dark = brightest(&desc);
    desc.shapes[0].emission = Some(Spectrum::Constant(0.0));
    assert!(notices(&desc).contains("black"), "{}", notices(&desc));
    let powers = [0.0f64];
    Row {
        case: "N25 no light, and a black one, all methods",
        measure: "brightest pixel",
        figure: dark.max(brightest(&desc)),
        naive: ("power of a light over that of all", powers[0] / powers.iter().sum::<f64>()),
        bound: 0.0,
    }
    .check();
}

/// 100 489 point lights low over a plane. What lights a point are the few lights around it: chosen evenly, they are seldom found.
#[test]
fn n25_a_hundred_thousand_lights() {
    const SIDE: i32 = 317;
    let mut desc = empty();
    let (spacing, height, albedo) = (1.0 / 3.0, 0.2, 0.5);
    let half = 0.5 * f64::from(SIDE) * spacing;
    rectangle(&mut desc, [DVec3::X * half, DVec3::Y * half], DVec3::ZERO, albedo, 0.0);
    let places: Vec<DVec3> = (0..SIDE * SIDE)
        .map(|i| {
            let at = |i: i32| (f64::from(i) + 0.5) * spacing - half;
            DVec3::new(at(i % SIDE), at(i / SIDE), height)
        })
        .collect();
    for &position in &places {
        let intensity = Spectrum::Constant(1.0);
        desc.lights.push(LightDesc::Point { position, intensity, place: Place::default() });
    }
    // One spot of the floor, seen straight from above between the lights.
    let seen = DVec3::new(0.05, 0.03, 0.0);
    desc.camera = look(seen + DVec3::Z * 1.5, DVec3::NEG_Z, 0.01);
    let share = |p: &DVec3| f64::from(albedo) / PI * height / (*p - seen).length().powi(3);
    let expected: f64 = places.iter().map(share).sum();
    let square: f64 = places.iter().map(|p| share(p).powi(2)).sum();
    let even = (places.len() as f64 * square / (expected * expected) - 1.0).sqrt();
    let samples = luminances(&desc, 1 << 14);
    let (mean, of_mean) = welch::moments(samples.iter().map(|&y| f64::from(y)));
    let deviation = (of_mean * samples.len() as f64).sqrt() / expected;
    assert!(distance((mean, of_mean), expected) < DISTANCE, "{mean} instead of {expected}");
    Row {
        case: "N25 100 489 point lights over a floor",
        measure: "relative standard deviation of a sample",
        figure: deviation,
        naive: ("lights chosen evenly", even),
        bound: 2.0,
    }
    .check();
    // Others see a part of the floor that light paths find. Particles are spread over the whole floor.
    desc.camera = look(DVec3::Z * 60.0, DVec3::NEG_Z, 60.0);
    let plan = Plan { side: 2, paths_per_pixel: 4096, ..PLAN };
    let reference = welch::moments(repeat(&desc, Method::Path, plan).iter().map(|p| p.iter().sum::<f64>()));
    for method in [Method::Particle, Method::Bidirectional, Method::Photon] {
        let found = welch::moments(repeat(&desc, method, plan).iter().map(|p| p.iter().sum::<f64>()));
        let (t, _) = welch::t(found, reference, 0.0, f64::from(plan.seeds));
        assert!(t.abs() < DISTANCE, "{method:?}: {found:?} instead of {reference:?}");
    }
}

/// A camera in the plane of a black wall does not see it; one on the inside of a ball sees the ball's other side.
#[test]
fn n25_camera_in_a_surface() {
    let mut wall = empty();
    wall.camera = look(DVec3::ZERO, DVec3::Z, 60.0);
    rectangle(&mut wall, [DVec3::X, DVec3::Y], DVec3::ZERO, 0.0, 0.0);
    environment(&mut wall);
    let mut ball = empty();
    let bsdf = material(&mut ball, grey(0.5));
    shape(&mut ball, sphere(DVec3::ZERO, 1.0), DAffine3::IDENTITY, bsdf, 1.0);
    ball.shapes[0].flip_normals = true;
    let mut figure = largest_distance(&wall, PLAN, 1.0);
    for at in [DVec3::NEG_Z, (1.0 - 1e-6) * DVec3::new(0.36, -0.48, -0.8), DVec3::ZERO] {
        ball.camera = look(at, if at == DVec3::ZERO { DVec3::Z } else { -at }, 40.0);
        figure = figure.max(largest_distance(&ball, PLAN, 2.0));
    }
    Row {
        case: "N25 camera in a wall, on the inside of a ball and in its centre, all methods",
        measure: STANDARD_ERRORS,
        figure,
        naive: ("hits at distance 0 count", distance((0.0, 0.0), 1.0)),
        bound: DISTANCE,
    }
    .check();
}

/// Form factor of a rectangle a × b from a point of a plane perpendicular to it, at the distance c before the corner of the sides a and b,
/// the side a lying in the plane.
fn perpendicular(a: f64, b: f64, c: f64) -> f64 {
    let d = (b * b + c * c).sqrt();
    ((a / c).atan() - c / d * (a / d).atan()) / (2.0 * PI)
}

/// Largest of the camera samples.
struct Largest(f64);

impl SampleSink for Largest {
    fn camera(&mut self, _: [f32; 2], value: Xyz, _: f32) {
        self.0 = self.0.max(f64::from(value.y));
    }

    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// A light that stands on the floor it lights: distances go to zero along the edge. Against the integral of the form factor, and by
/// the largest sample: a point of the light chosen evenly is weighted by 1/d².
#[test]
fn n25_light_touches_a_wall() {
    let mut desc = empty();
    let albedo = 0.5;
    rectangle(&mut desc, [DVec3::X, DVec3::Y], DVec3::ZERO, albedo, 0.0);
    rectangle(&mut desc, [DVec3::Y, 0.5 * DVec3::Z], DVec3::new(0.0, 0.0, 0.5), 0.0, 1.0);
    desc.integrator = IntegratorDesc { max_depth: Some(2), ..IntegratorDesc::default() };
    // 0 < x < 0.2 and −0.1 < y < 0.1 of the floor.
    desc.camera = look(DVec3::new(0.1, 0.0, 2.0), DVec3::NEG_Z, 2.0 * 0.05f64.atan().to_degrees());
    let radiance = |x: f64, y: f64| {
        f64::from(albedo) * (perpendicular(1.0 - y, 1.0, x) + perpendicular(1.0 + y, 1.0, x))
    };
    let steps = 400;
    let at = |i: i32| (f64::from(i) + 0.5) / f64::from(steps);
    let cells = (0..steps * steps).map(|i| radiance(0.2 * at(i % steps), 0.2 * at(i / steps) - 0.1));
    let expected = cells.sum::<f64>() / f64::from(steps * steps);
    let figure = largest_distance(&desc, PLAN, expected);
    assert!(figure < DISTANCE, "{figure} standard errors");
    let tracer = tracer(&desc);
    let mut largest = Largest(0.0);
    (0..1 << 17).for_each(|index| tracer.trace(index, &mut (), &mut largest));
    let mut random = Random(3);
    let mut by_area = || {
        let p = DVec3::new(0.2 * random.f64(), 0.2 * random.f64() - 0.1, 0.0);
        let d = DVec3::new(0.0, 2.0 * random.f64() - 1.0, random.f64()) - p;
        f64::from(albedo) / PI * 2.0 * (d.z * -d.x) / d.length_squared().powi(2)
    };
    let by_area = (0..1 << 17).map(|_| by_area()).fold(0.0, f64::max);
    Row {
        case: "N25 light that stands on the floor",
        measure: "largest sample over the mean",
        figure: largest.0 / expected,
        naive: ("points of the light chosen by area", by_area / expected),
        bound: 10.0,
    }
    .check();
}

/// The share of rays that see the second of two rectangles in one place, of which it alone is white.
fn share_of_second(turned: bool) -> (f64, String) {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.3, 0.2, 3.0), DVec3::new(-0.1, 0.02, -1.0), 25.0);
    let axes = [DVec3::new(1.0, 0.1, 0.3), DVec3::new(-0.1, 1.0, 0.0)];
    let center = DVec3::new(0.1, 0.2, 0.3);
    rectangle(&mut desc, axes, center, 0.0, 0.0);
    let axes = if turned { [axes[1], -axes[0]] } else { axes };
    rectangle(&mut desc, axes, center, 1.0, 0.0);
    environment(&mut desc);
    let seen = luminances(&desc, 1 << 14);
    let white = seen.iter().filter(|&&y| y > 0.0).count();
    (white as f64 / seen.len() as f64, notices(&desc))
}

/// Two faces in one place: everywhere the same one is seen, and the user is told.
#[test]
fn n25_coincident_faces() {
    let mixed = |(share, _): &(f64, String)| share.min(1.0 - share);
    let (same, turned) = (share_of_second(false), share_of_second(true));
    println!("share of the second face: {} in the same place, {} turned by 90°", same.0, turned.0);
    for (_, notices) in [&same, &turned] {
        assert!(notices.contains("same place"), "{notices:?}");
    }
    // Distances to the plane by three corners and by three others.
    let mut random = Random(5);
    let n = 10_000;
    let corners = [[-1.0f32, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| {
        Vec3::new(1.0, 0.1, 0.3) * x + Vec3::new(-0.1, 1.0, 0.0) * y + Vec3::new(0.1, 0.2, 0.3)
    });
    let t = |d: Vec3, [a, b, c]: [Vec3; 3]| {
        let normal = (b - a).cross(c - a);
        (a - Vec3::new(0.3, 0.2, 3.0)).dot(normal) / d.dot(normal)
    };
    let second = (0..n).filter(|_| {
        let d = Vec3::new(random.within(-0.3, 0.1), random.within(-0.2, 0.2), -1.0).normalize();
        t(d, [corners[1], corners[2], corners[3]]) < t(d, [corners[0], corners[1], corners[2]])
    });
    let share = second.count() as f64 / f64::from(n);
    Row {
        case: "N25 two faces in one place, also turned by 90°",
        measure: "share of rays that see the one that is seen less",
        figure: mixed(&same).max(mixed(&turned)),
        naive: ("the nearer one by rounding", share.min(1.0 - share)),
        bound: 0.0,
    }
    .check();
}

/// A floor that reflects nothing, or more than it gets, under an even sky: nothing is cut off unasked, and the file's reader says so.
#[test]
fn n25_albedo() {
    let floor = |albedo: f32| {
        let mut desc = empty();
        desc.camera = look(DVec3::new(0.0, 0.0, 3.0), DVec3::NEG_Z, 20.0);
        rectangle(&mut desc, [DVec3::X, DVec3::Y], DVec3::ZERO, albedo, 0.0);
        environment(&mut desc);
        desc
    };
    assert_eq!(brightest(&floor(0.0)), 0.0, "a black floor is black");
    let xml = "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/><shape type='rectangle'>
        <bsdf type='diffuse'><spectrum name='reflectance' value='1.5'/></bsdf></shape></scene>";
    assert!(warnings(xml).contains("makes energy"), "{}", warnings(xml));
    Row {
        case: "N25 albedo 1.5, all methods",
        measure: STANDARD_ERRORS,
        figure: largest_distance(&floor(1.5), PLAN, 1.5),
        naive: ("albedo cut to 1", distance((1.0, 0.0), 1.5)),
        bound: DISTANCE,
    }
    .check();
    // In a closed room such light grows from bounce to bounce and its mean is infinite: every path ends all the same.
    let mut ball = empty();
    ball.camera = look(DVec3::ZERO, DVec3::Z, 90.0);
    let bsdf = material(&mut ball, grey(1.25));
    shape(&mut ball, sphere(DVec3::ZERO, 1.0), DAffine3::IDENTITY, bsdf, 1.0);
    ball.shapes[0].flip_normals = true;
    for method in METHODS {
        let plan = Plan { side: 2, paths_per_pixel: 64, ..PLAN };
        assert!(
            repeat(&ball, method, plan).iter().flatten().all(|y| y.is_finite() && *y > 1.0),
            "{method:?}"
        );
    }
}

/// A sheet whose vertex normals lie beyond the horizon of its face, lit from below only, seen from above.
fn sheet(normals: [Vec3; 4]) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, 0.0, 3.0), DVec3::NEG_Z, 20.0);
    desc.meshes.push(Arc::new(Mesh {
        positions: [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, y]| Vec3::new(x, y, 0.0))
            .to_vec(),
        normals: normals.to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }));
    let bsdf = material(&mut desc, grey(0.8));
    shape(&mut desc, ShapeKind::Mesh(MeshId(0)), DAffine3::IDENTITY, bsdf, 0.0);
    let (x, y) = (DVec3::X * 5.0, DVec3::Y * 5.0);
    rectangle(&mut desc, [x, y], DVec3::new(0.0, 0.0, -2.0), 0.0, 1.0);
    desc
}

/// Normals that disagree with their faces, some by more than a right angle, let no light through a sheet.
#[test]
fn n25_normals_against_geometry() {
    let slanted = [(0.9, 0.1), (-0.9, -0.05), (0.2, 0.3), (-0.5, -0.2)];
    let normals = slanted.map(|(x, z): (f32, f32)| Vec3::new(x, 0.3, z).normalize());
    let figure = brightest(&sheet(normals)).max(brightest(&sheet(normals.map(|n| -n))));
    // The light of the lower half that a normal of 80° to the face lets in: it sees the lamp in half of its hemisphere.
    let mut random = Random(8);
    let n = Vec3::new(10f32.to_radians().cos(), 0.0, 10f32.to_radians().sin());
    let directions = (0..4096).map(|_| random.direction().as_vec3());
    let through: f32 = directions.filter(|d| d.z < 0.0).map(|d| d.dot(n).max(0.0)).sum();
    Row {
        case: "N25 normals beyond the horizon of their face, all methods",
        measure: "light that goes through an opaque sheet",
        figure,
        naive: ("the shading normal alone", 0.8 / PI * 4.0 * PI * f64::from(through) / 4096.0),
        bound: 0.0,
    }
    .check();
}
