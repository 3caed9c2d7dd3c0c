//! A survey of scene and view, from which the choice of a method begins.

use crate::color::Xyz;
use crate::scene::desc::IntegratorKind;
use crate::spectrum::SampledWavelengths;
use crate::stream::{SampleSink, UvWindow};
use crate::tracer::bsdf::{Bsdf, ScatteringModel};
use crate::tracer::integrator::{Integrator, PathTracer, RenderContext};
use crate::tracer::medium::Media;

/// The seed of survey and trials: not that of any picture, and always the same.
pub(super) const SEED: u32 = 0x6175_746f;

/// Share of the picture that may show deltas before particle tracing is excluded: none, but for a stray ray between two edges.
pub(super) const DELTAS: f64 = 0.0002;

/// Camera rays along either side of the picture: they hit whatever covers 1/96 of it in both directions.
const RAYS: u32 = 96;

/// Number of paths that estimate direct light.
const DIRECT: u64 = 2048;

/// Measurements of a scene and a view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Survey {
    /// Number of lights; each triangle of a mesh that emits is one.
    pub lights: usize,
    /// Some of them are found by walks from lights only.
    pub beams: bool,
    /// Some medium emits light.
    pub emissive_media: bool,
    /// Share of the picture that shows a surface with a delta part: mirror, glass, a smooth coat.
    pub delta_seen: f64,
    /// Mean luminance of what arrives with one bounce or none.
    pub direct: f64,
}

impl Survey {
    /// Measures the scene.
    pub fn of(context: &RenderContext) -> Self {
        let lights = context.scene.lights();
        let emissive_media = context.scene.media().is_some_and(Media::shine);
        let (lights, beams) = (lights.len(), lights.has_beams());
        let mut survey = Self { lights, beams, emissive_media, ..Self::default() };
        survey.find_deltas(context);
        survey.direct = direct(context);
        survey
    }

    /// The methods that are worth a trial: merging finds only light that the picture shows in mirrors and glass, and particles no single ray.
    pub fn candidates(&self, context: &RenderContext) -> impl Iterator<Item = IntegratorKind> + use<> {
        let merges = context.photons.caustics && self.delta_seen > DELTAS;
        let is_found = context.camera.is_found_by_light();
        IntegratorKind::candidates().filter(move |kind| {
            (kind.traits().extends.is_none() || merges) && (kind.streams()[0] || is_found)
        })
    }

    /// Finds the share of the picture whose first hits have a delta part.
    fn find_deltas(&mut self, context: &RenderContext) {
        let RenderContext { scene, camera, .. } = context;
        let lambda = SampledWavelengths::sample(0.5);
        let each = 1.0 / f64::from(RAYS * RAYS);
        for i in 0..RAYS * RAYS {
            let uv = [i % RAYS, i / RAYS].map(|n| (f64::from(n) + 0.5) / f64::from(RAYS));
            let Some(mut ray) = camera.ray(uv, [0.5; 2]) else { continue };
            let Some(hit) = context.closest(&mut ray, 0) else { continue };
            let surface = scene.surface_material(&hit);
            let (bsdf, wo) = (surface.bsdf::<Bsdf>(&lambda), surface.frame.to_local(hit.wo));
            // Lobes are chosen by intervals: both ends and the middle find every lobe of every material.
            let delta = |lobe| bsdf.sample(wo, [0.5; 2], lobe).is_some_and(|s| s.delta);
            self.delta_seen += if [0.0, 0.5, 0.999_999].into_iter().any(delta) { each } else { 0.0 };
        }
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
