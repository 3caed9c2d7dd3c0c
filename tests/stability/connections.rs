//! Connections of two subpaths where they are short: lights close to walls, and vertices in one place.

use glam::{DAffine3, DMat3, DVec3};

use pointillist::color::Xyz;
use pointillist::scene::desc::{LightDesc, Place, SceneDesc, ShapeKind};
use pointillist::spectrum::Spectrum;
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::integrator::{BidirectionalTracer, RenderContext};
use pointillist::tracer::{Camera, Integrator, PathTracer};

use crate::Row;
use crate::support::agreement::{Method, Plan, repeat};
use crate::support::scenes::{Random, empty, environment, grey, look, material, prepare, shape};
use crate::support::welch;

const PLAN: Plan = Plan { side: 4, paths_per_pixel: 2048, seeds: 24, window: UvWindow::PICTURE };

fn rectangle(desc: &mut SceneDesc, axes: [DVec3; 2], center: DVec3, albedo: f32) {
    let bsdf = material(desc, grey(albedo));
    let matrix = DMat3::from_cols(axes[0], axes[1], axes[0].cross(axes[1]).normalize());
    shape(desc, ShapeKind::Rectangle, DAffine3::from_mat3_translation(matrix, center), bsdf, 0.0);
}

/// Sum and largest luminance of the camera samples.
#[derive(Default)]
struct SampleTally {
    sum: f64,
    largest: f64,
}

impl SampleSink for SampleTally {
    fn camera(&mut self, _: [f32; 2], value: Xyz, weight: f32) {
        assert!(value.is_finite() && weight == 1.0);
        self.sum += f64::from(value.y);
        self.largest = self.largest.max(f64::from(value.y));
    }

    fn light(&mut self, _: [f32; 2], value: Xyz) {
        assert!(value.is_finite());
    }
}

/// The largest camera sample over their mean.
fn largest<I: Integrator + From<RenderContext>>(desc: &SceneDesc, samples: u64) -> f64 {
    let camera = Camera::of(desc).unwrap();
    let scene = prepare(desc).into();
    let tracer: I = RenderContext::new(scene, camera, &desc.integrator, 1, UvWindow::PICTURE).into();
    let (mut scratch, mut tally) = (I::Scratch::default(), SampleTally::default());
    let indices = samples / tracer.paths_per_index().camera;
    (0..indices).for_each(|index| tracer.trace(index, &mut scratch, &mut tally));
    tally.largest / (tally.sum / samples as f64)
}

/// Distance of the means by path tracing and bidirectional path tracing in standard errors.
fn distance(desc: &SceneDesc, plan: Plan) -> f64 {
    let of = |method| {
        welch::moments(repeat(desc, method, plan).iter().map(|p| p.iter().sum::<f64>() / p.len() as f64))
    };
    let (path, both) = (of(Method::Path), of(Method::Bidirectional));
    println!("path {path:?}, bidirectional {both:?}");
    welch::t(path, both, 0.0, f64::from(plan.seeds)).0.abs()
}

/// A point light 1/1000 in front of a wall. What is seen of the floor gets its light from one small bright spot of the wall: a camera path finds
/// it seldom and then has a sample of 1/d², while a connection to where light paths arrive does not. Also seen: the spot's surroundings,
/// where connections are as short as can be.
#[test]
fn n14_point_light_at_a_wall() {
    let mut desc = empty();
    rectangle(&mut desc, [DVec3::X * 2.0, DVec3::Y * 2.0], DVec3::X * 2.0, 0.8);
    rectangle(&mut desc, [DVec3::Y * 2.0, DVec3::Z], DVec3::Z, 0.8);
    let (position, intensity) = (DVec3::new(1e-3, 0.0, 0.5), Spectrum::Constant(1.0));
    desc.lights.push(LightDesc::Point { position, intensity, place: Place::default() });
    desc.camera = look(DVec3::new(1.0, 0.0, 3.0), DVec3::NEG_Z, 20.0);
    let samples = 1 << 19;
    Row {
        case: "N14 point light at a wall, bidirectional, floor before the wall",
        measure: "largest sample over the mean",
        figure: largest::<BidirectionalTracer>(&desc, samples),
        naive: ("next-event estimation alone", largest::<PathTracer>(&desc, samples)),
        bound: 100.0,
    }
    .check();
    for (what, from, towards, fov) in [
        ("floor", DVec3::new(1.0, 0.0, 3.0), DVec3::NEG_Z, 20.0),
        ("corner", DVec3::new(1.5, 0.2, 1.5), DVec3::new(-1.0, -0.1, -1.0), 20.0),
    ] {
        desc.camera = look(from, towards, fov);
        let z = distance(&desc, PLAN);
        assert!(z < 4.0, "{what}: {z} standard errors between path tracing and bidirectional");
    }
}

/// A corner of 70 steps of `f32` at its place: vertices of both subpaths coincide. The result is that of path tracing, which connects
/// nothing, but for the few steps by which rays begin off their surfaces.
#[test]
fn n14_coincident_vertices() {
    let mut desc = empty();
    // Something large keeps the origin of rendering space away from the corner.
    rectangle(&mut desc, [DVec3::X, DVec3::Y], DVec3::new(0.0, 0.0, -4.0), 0.5);
    let (corner, size) = (DVec3::new(1.1, 1.3, 1.7), 4e-6);
    rectangle(&mut desc, [DVec3::X * size, DVec3::Y * size], corner + DVec3::X * size, 0.8);
    rectangle(&mut desc, [DVec3::Y * size, DVec3::Z * size], corner + DVec3::Z * size, 0.8);
    environment(&mut desc);
    let direction = DVec3::new(1.0, 0.0, 1.0).normalize();
    desc.camera = look(corner + direction * 3e-4, -direction, 2.0);
    let mean = |method| repeat(&desc, method, PLAN).into_iter().flatten().sum::<f64>();
    let [path, both] = [Method::Path, Method::Bidirectional].map(mean);
    println!("coincident: path {path}, bidirectional {both}");
    // Points of the corner as `f32` has them.
    let mut random = Random(2);
    let geometry = |_| {
        let mut at = || size * 2.0 * random.f64().powi(2);
        let on_floor = (corner + DVec3::new(at(), at(), 0.0)).as_vec3();
        let on_wall = (corner + DVec3::new(0.0, at(), at())).as_vec3();
        f64::from(1.0 / on_floor.distance_squared(on_wall))
    };
    Row {
        case: "N14 corner of 70 steps of f32, path against bidirectional",
        measure: "relative difference of the means",
        figure: (both / path - 1.0).abs(),
        naive: ("mean of 1/d² over connections", (0..1_000_000).map(geometry).sum::<f64>()),
        bound: 0.05,
    }
    .check();
}
