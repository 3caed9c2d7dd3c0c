//! What a scene holds, as far as the choice of a method depends on it.

use crate::color::Xyz;
use crate::spectrum::SampledWavelengths;
use crate::stream::{SampleSink, UvWindow};
use crate::tracer::integrator::{Integrator, PathTracer, RenderContext};
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::subpath::{Vertex, Walk};
use crate::tracer::{Sampler, Scene};

use super::trial::SEED;

/// Walks from either end.
const WALKS: u64 = 2048;

/// A walk is followed no further than this: lengths are for costs, and work is to be bounded.
const LONGEST: u32 = 64;

/// Camera rays along either side of the picture: what covers 1/96 of it in both directions is met.
const RAYS: u32 = 96;

/// Paths that tell direct light.
const DIRECT: u64 = 2048;

/// Mean numbers of vertices of a walk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lengths {
    /// Surface points.
    pub vertices: f64,
    /// Those that can be connected: not delta.
    pub open: f64,
}

/// What a scene and a view hold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Survey {
    /// Lights, triangles of emitting meshes one by one.
    pub lights: usize,
    /// Share of the picture that shows a surface with a delta part: mirror, glass, a smooth coat.
    pub delta_seen: f64,
    /// Mean luminance of what arrives with one bounce or none.
    pub direct: f64,
    /// Walks from the camera.
    pub camera: Lengths,
    /// Walks from lights.
    pub light: Lengths,
}

impl Survey {
    /// Looks at the scene.
    pub fn of(context: &RenderContext) -> Self {
        let mut survey = Self { lights: context.scene.lights().len(), ..Self::default() };
        survey.look(context);
        survey.direct = direct(context);
        for index in 0..WALKS {
            let sampler = Sampler::at(index, SEED);
            survey.walk_from_camera(context, &sampler);
            survey.walk_from_light(context, &sampler);
        }
        for lengths in [&mut survey.camera, &mut survey.light] {
            lengths.vertices /= WALKS as f64;
            lengths.open /= WALKS as f64;
        }
        survey
    }

    /// What camera rays meet first.
    fn look(&mut self, context: &RenderContext) {
        let RenderContext { scene, camera, .. } = context;
        let lambda = SampledWavelengths::sample(0.5);
        let each = 1.0 / f64::from(RAYS * RAYS);
        for i in 0..RAYS * RAYS {
            let uv = [i % RAYS, i / RAYS].map(|n| (f64::from(n) + 0.5) / f64::from(RAYS));
            let ray = camera.ray(uv, [0.5; 2]);
            let hidden = context.hide_emitters;
            let hit = if hidden { scene.closest_unlit(ray) } else { scene.closest(&ray) };
            let Some(hit) = hit else { continue };
            let (material, frame) = scene.material(&hit);
            let (bsdf, wo) = (material.bsdf(&lambda), frame.to_local(hit.wo));
            // Lobes are chosen by intervals: both ends and the middle meet every material's.
            let delta = |lobe| bsdf.sample(wo, [0.5; 2], lobe).is_some_and(|s| s.delta);
            self.delta_seen += if [0.0, 0.5, 0.999_999].into_iter().any(delta) { each } else { 0.0 };
        }
    }

    fn walk_from_camera(&mut self, context: &RenderContext, sampler: &Sampler) {
        let numbers = sampler.camera();
        let ray = context.camera.ray(numbers.screen, numbers.lens);
        let lens = context.camera.lens_point(numbers.lens);
        let walk = Walk::from_camera(SampledWavelengths::sample(numbers.wavelength), lens, (1.0, 1.0));
        follow(context, (walk, ray), |depth| sampler.vertex(depth), |vertex| self.camera.count(vertex));
    }

    fn walk_from_light(&mut self, context: &RenderContext, sampler: &Sampler) {
        let numbers = sampler.light();
        let lights = context.scene.lights();
        let Some(emission) = lights.emit(&numbers.emission()) else { return };
        let lambda = SampledWavelengths::sample(sampler.camera().wavelength);
        let emitted = lights.spectrum(emission.light, -emission.direction, &lambda);
        let Some(walk) = Walk::from_light(lambda, &emission, emitted) else { return };
        let numbers = |depth| numbers.vertex(depth);
        follow(context, (walk, emission.ray()), numbers, |vertex| self.light.count(vertex));
    }
}

impl Lengths {
    fn count(&mut self, vertex: &Vertex) {
        self.vertices += 1.0;
        self.open += if vertex.bsdf.is_delta() { 0.0 } else { 1.0 };
    }
}

/// Shows `visit` each vertex of a walk.
fn follow<const FROM_LIGHT: bool>(
    context: &RenderContext,
    (mut walk, mut ray): (Walk<FROM_LIGHT>, crate::tracer::accel::Ray),
    numbers: impl Fn(u32) -> VertexNumbers,
    mut visit: impl FnMut(&Vertex),
) {
    let scene: &Scene = &context.scene;
    let longest = context.max_depth.unwrap_or(u32::MAX).min(LONGEST);
    while walk.depth() + 1 < longest {
        let Some(hit) = scene.closest(&ray) else { return };
        let vertex = walk.arrive(scene, hit);
        visit(&vertex);
        match walk.scatter(&vertex, &numbers(walk.depth() - 1), context.rr_depth) {
            Some(next) => ray = next,
            None => return,
        }
    }
}

/// Mean luminance of paths of two segments at most, without lights that are seen straight on, as in the trials.
fn direct(context: &RenderContext) -> f64 {
    struct Sum(f64);
    impl SampleSink for Sum {
        fn camera(&mut self, _: [f32; 2], value: Xyz, _: f32) {
            self.0 += if value.y.is_finite() { f64::from(value.y) } else { 0.0 };
        }
        fn light(&mut self, _: [f32; 2], _: Xyz) {}
    }
    let max_depth = Some(context.max_depth.map_or(2, |depth| depth.min(2)));
    let tracer = path_tracer(&RenderContext { max_depth, hide_emitters: true, ..context.clone() });
    let mut sum = Sum(0.0);
    (0..DIRECT).for_each(|index| tracer.trace(index, &mut (), &mut sum));
    sum.0 / DIRECT as f64
}

/// The path tracer of a context, over the picture, with the numbers of trials.
fn path_tracer(context: &RenderContext) -> PathTracer {
    PathTracer { context: RenderContext { seed: SEED, window: UvWindow::PICTURE, ..context.clone() } }
}
