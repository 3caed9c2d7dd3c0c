//! A survey of scene and view, from which the choice of a method begins.

use crate::color::Xyz;
use crate::scene::desc::IntegratorKind;
use crate::spectrum::SampledWavelengths;
use crate::stream::{SampleSink, UvWindow};
use crate::tracer::Sampler;
use crate::tracer::accel::Ray;
use crate::tracer::bsdf::{Bsdf, ScatteringModel};
use crate::tracer::integrator::{Integrator, PathTracer, RenderContext};
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::subpath::{Subpath, SubpathVertex};

/// The seed of survey and trials: not that of any picture, and always the same.
pub(super) const SEED: u32 = 0x6175_746f;

/// Share of the picture that may show deltas before particle tracing is excluded: none, but for a stray ray between two edges.
pub(super) const DELTAS: f64 = 0.0002;

/// Number of walks from either end.
const WALKS: u64 = 2048;

/// Longest walk in segments: lengths are for costs, and the work is bounded.
const LONGEST: u32 = 64;

/// Camera rays along either side of the picture: they hit whatever covers 1/96 of it in both directions.
const RAYS: u32 = 96;

/// Number of paths that estimate direct light.
const DIRECT: u64 = 2048;

/// Mean numbers of vertices of a walk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SubpathLengths {
    /// Number of vertices.
    pub vertices: f64,
    /// Number of vertices that can be connected, which are not delta.
    pub open: f64,
}

/// Measurements of a scene and a view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Survey {
    /// Number of lights; each triangle of a mesh that emits is one.
    pub lights: usize,
    /// Some of them are found by walks from lights only.
    pub beams: bool,
    /// Share of the picture that shows a surface with a delta part: mirror, glass, a smooth coat.
    pub delta_seen: f64,
    /// Mean luminance of what arrives with one bounce or none.
    pub direct: f64,
    /// Lengths of walks from the camera.
    pub camera: SubpathLengths,
    /// Lengths of walks from lights.
    pub light: SubpathLengths,
}

impl Survey {
    /// Measures the scene.
    pub fn of(context: &RenderContext) -> Self {
        let lights = context.scene.lights();
        let mut survey = Self { lights: lights.len(), beams: lights.has_beams(), ..Self::default() };
        survey.find_deltas(context);
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

    /// The methods that are worth a trial: merging finds only light that the picture shows in mirrors and glass.
    pub fn candidates(&self, context: &RenderContext) -> impl Iterator<Item = IntegratorKind> + use<> {
        let merges = context.photons.caustics && self.delta_seen > DELTAS;
        IntegratorKind::candidates().filter(move |kind| kind.traits().extends.is_none() || merges)
    }

    /// Finds the share of the picture whose first hits have a delta part.
    fn find_deltas(&mut self, context: &RenderContext) {
        let RenderContext { scene, camera, .. } = context;
        let lambda = SampledWavelengths::sample(0.5);
        let each = 1.0 / f64::from(RAYS * RAYS);
        for i in 0..RAYS * RAYS {
            let uv = [i % RAYS, i / RAYS].map(|n| (f64::from(n) + 0.5) / f64::from(RAYS));
            let mut ray = camera.ray(uv, [0.5; 2]);
            let Some(hit) = context.closest(&mut ray, 0) else { continue };
            let surface = scene.surface_material(&hit);
            let (bsdf, wo) = (surface.bsdf::<Bsdf>(&lambda), surface.frame.to_local(hit.wo));
            // Lobes are chosen by intervals: both ends and the middle find every lobe of every material.
            let delta = |lobe| bsdf.sample(wo, [0.5; 2], lobe).is_some_and(|s| s.delta);
            self.delta_seen += if [0.0, 0.5, 0.999_999].into_iter().any(delta) { each } else { 0.0 };
        }
    }

    fn walk_from_camera(&mut self, context: &RenderContext, sampler: &Sampler) {
        let numbers = sampler.camera();
        let ray = context.camera.ray(numbers.screen, numbers.lens);
        let lens = context.camera.lens_point(numbers.lens);
        let subpath = Subpath::from_camera(SampledWavelengths::sample(numbers.wavelength), lens, 1.0, 1.0);
        follow(context, subpath, ray, |depth| sampler.vertex(depth), |vertex| self.camera.count(vertex));
    }

    fn walk_from_light(&mut self, context: &RenderContext, sampler: &Sampler) {
        let numbers = sampler.light();
        let lights = context.scene.lights();
        let Some(emission) = lights.emit(&numbers.emission()) else { return };
        let lambda = SampledWavelengths::sample(sampler.camera().wavelength);
        let emitted = lights.emitted(&emission, &lambda);
        let Some(subpath) = Subpath::from_light(lambda, &emission, emitted) else { return };
        let numbers = |depth| numbers.vertex(depth);
        follow(context, subpath, emission.ray(), numbers, |vertex| self.light.count(vertex));
    }
}

impl SubpathLengths {
    fn count(&mut self, vertex: &SubpathVertex) {
        self.vertices += 1.0;
        self.open += if vertex.surface.bsdf.is_delta() { 0.0 } else { 1.0 };
    }
}

/// Follows a subpath to its end and calls `visit` with each vertex.
fn follow<const FROM_LIGHT: bool>(
    context: &RenderContext,
    mut subpath: Subpath<FROM_LIGHT>,
    mut ray: Ray,
    numbers: impl Fn(u32) -> VertexNumbers,
    mut visit: impl FnMut(&SubpathVertex),
) {
    let scene = &context.scene;
    let longest = context.max_depth.unwrap_or(u32::MAX).min(LONGEST);
    while subpath.walk.depth + 1 < longest {
        let Some(hit) = scene.closest(&ray) else { return };
        let vertex = subpath.arrive(scene, hit);
        visit(&vertex);
        let u = numbers(subpath.walk.depth - 1);
        let Some(next) = subpath.scatter(&vertex, &u, context.rr_depth) else { return };
        ray = next;
    }
}

/// Mean luminance of paths of two segments at most, without lights that are seen directly, as in the trials.
fn direct(context: &RenderContext) -> f64 {
    struct Sum(f64);
    impl SampleSink for Sum {
        fn camera(&mut self, _: [f32; 2], value: Xyz, _: f32) {
            self.0 += if value.y.is_finite() { f64::from(value.y) } else { 0.0 };
        }
        fn light(&mut self, _: [f32; 2], _: Xyz) {}
    }
    let max_depth = Some(context.max_depth.map_or(2, |depth| depth.min(2)));
    let (seed, window) = (SEED, UvWindow::PICTURE);
    let context = RenderContext { max_depth, hide_emitters: true, seed, window, ..context.clone() };
    let tracer = PathTracer { context };
    let mut sum = Sum(0.0);
    (0..DIRECT).for_each(|index| tracer.trace(index, &mut (), &mut sum));
    sum.0 / DIRECT as f64
}
