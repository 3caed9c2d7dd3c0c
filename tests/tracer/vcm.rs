//! Vertex connection and merging: what is merged, what is left to connections, and that the samples depend on the index alone.

use std::sync::Arc;

use crate::support::agreement::{Method, PathReference, Plan, measure};
use crate::support::scenes::*;
use pointillist::color::Xyz;
use pointillist::image::compare::{Measured, z_test};
use pointillist::scene::desc::*;
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::integrator::{BidirectionalTracer, RenderContext, VcmTracer};
use pointillist::tracer::{Camera, Integrator, Scene};

const PLAN: Plan = Plan { side: 16, paths_per_pixel: 256, seeds: 16, window: UvWindow::PICTURE };

fn scene(name: &str) -> SceneDesc {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let mut desc = pointillist::scene::load(&path, &[]).expect("the scene can be read").desc;
    (desc.film.width, desc.film.height) = (16, 16);
    desc
}

/// A ball of glass and a mirror: as path tracing shows them within the blur, with less than .7 of the relative variance of bidirectional path tracing.
#[test]
fn caustics_seen_in_a_mirror() {
    let desc = scene("cornell_spheres.xml");
    let test = PathReference::new(&desc, PLAN).compare(Method::Vcm);
    assert!((test.mean_ratio - 1.0).abs() <= 4.0 * test.mean_ratio_error + 0.01, "{test:?}");
    assert!(test.accepted >= 0.95, "{test:?}");
    let of = |method| {
        let Measured { mean, variance, .. } = measure(&desc, method, PLAN);
        mean.iter().zip(&variance).map(|(y, v)| v / (y * y + 0.01)).sum::<f64>()
    };
    let (merged, connected) = (of(Method::Vcm), of(Method::Bidirectional));
    println!("variance {merged:e}, without merging {connected:e}");
    assert!(merged < 0.7 * connected, "{merged:e} {connected:e}");
}

/// A floor under a sheet of glass of index 1 and a lamp that nothing can hit: the picture is that without the sheet. No
/// connection gets through the sheet on either side.
#[test]
fn a_lamp_behind_glass_that_nothing_can_hit() {
    let blind = measure(&lamp_over_floor(true), Method::Bidirectional, Plan { seeds: 4, ..PLAN });
    assert_eq!(blind.mean.iter().sum::<f64>(), 0.0, "connections cannot find it");
    let bare = measure(&lamp_over_floor(false), Method::Bidirectional, PLAN);
    let plan = Plan { paths_per_pixel: 1024, seeds: 8, ..PLAN };
    let test = z_test(&measure(&lamp_over_floor(true), Method::Vcm, plan), &bare, 0.01).expect("equal sizes");
    println!("{test:?}");
    // The first discs are darker at their rim than in the middle by 2 %, on the mean over the growing map by .4 %.
    let bound = 4.0 * test.mean_ratio_error + 0.004;
    assert!(bound < 0.018, "the noise hides what the test is for: {test:?}");
    assert!((test.mean_ratio - 1.0).abs() < bound, "{test:?}");
}

/// The samples of some indices.
#[derive(Default, PartialEq, Debug)]
struct Samples(Vec<([u32; 2], [u32; 3])>);

impl SampleSink for Samples {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, _: f32) {
        self.light(uv, value);
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        self.0.push((uv.map(f32::to_bits), [value.x, value.y, value.z].map(f32::to_bits)));
    }
}

fn context(desc: &SceneDesc) -> RenderContext {
    let scene = Arc::new(Scene::prepare(desc).unwrap());
    RenderContext::new(scene, Camera::of(desc).unwrap(), &desc.integrator, 3, UvWindow::PICTURE)
}

fn samples<I: Integrator>(tracer: &I, indices: impl Iterator<Item = u64>) -> Vec<Samples> {
    let mut scratch = I::Scratch::default();
    let one = |index| {
        let mut samples = Samples::default();
        tracer.trace(index, &mut scratch, &mut samples);
        samples
    };
    indices.map(one).collect()
}

/// Without anything to merge, each sample is that of bidirectional path tracing, bit for bit.
#[test]
fn without_mirrors_nothing_is_merged() {
    let mut off = scene("cornell_spheres.xml");
    off.integrator.photons.caustics = false;
    for desc in [scene("cornell.xml"), scene("cove.xml"), off] {
        let context = context(&desc);
        let merged = samples(&VcmTracer::new(context.clone(), true), 0..256);
        assert_eq!(merged, samples(&BidirectionalTracer { context }, 0..256));
    }
}

/// A sample depends on its index, whatever was traced before it, across the end of a generation of photons.
#[test]
fn a_path_does_not_depend_on_those_before() {
    let context = context(&scene("cornell_spheres.xml"));
    let range = 2000..2200;
    let forward = samples(&VcmTracer::new(context.clone(), true), range.clone());
    let mut backward = samples(&VcmTracer::new(context, true), range.rev());
    backward.reverse();
    assert_eq!(forward, backward);
}
