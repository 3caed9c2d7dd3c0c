//! Particle tracing: paths from lights, each vertex connected to the camera.

use crate::stream::{PathCounts, SampleSink};
use crate::tracer::accel::Ray;
use crate::tracer::bsdf::{Bsdf, Diffuse, Scattering, Smooth};
use crate::tracer::sampler::{CameraNumbers, LightSampler};
use crate::tracer::subpath::{Vertex, Walk};
use crate::tracer::{MaterialClass, Sampler};

use super::{Integrator, RenderContext, Special};

/// Traces paths from lights. Fills the light stream only: every vertex that the camera sees adds a density over uv.
///
/// What a delta shows (the room in a mirror, a lamp behind glass) it cannot find: no vertex of a light path lies on the
/// camera, and a delta sends nothing towards a given point.
#[derive(Clone, Debug)]
pub struct ParticleTracer {
    /// Scene, view and settings.
    pub context: RenderContext,
}

impl Integrator for ParticleTracer {
    type Scratch = ();

    fn trace(&self, index: u64, _: &mut (), out: &mut impl SampleSink) {
        let context = &self.context;
        let scene = &context.scene;
        let sampler = Sampler::at(index, context.seed);
        let CameraNumbers { lens, wavelength, .. } = sampler.camera();
        let lambda = self.context.wavelengths(wavelength);
        let numbers = sampler.light();
        let Some(emission) = scene.lights.emit(&numbers.emission()) else { return };
        let emitted = scene.lights.spectrum(emission.light, -emission.direction, &lambda);
        if context.longest() >= 1
            && !emitted.is_black()
            && let Some((view, scale)) = context.see_light(&emission, lens)
        {
            out.light(view.uv, lambda.to_xyz(emitted * scale));
        }
        let Some(walk) = Walk::from_light(lambda, &emission, emitted) else { return };
        let ray = emission.ray();
        match scene.material_class() {
            MaterialClass::Diffuse => self.follow::<Diffuse>(walk, ray, &numbers, out),
            MaterialClass::Specular => self.follow::<Smooth>(walk, ray, &numbers, out),
            MaterialClass::General => self.follow::<Bsdf>(walk, ray, &numbers, out),
        }
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: 0, light: 1 }
    }
}

impl From<RenderContext> for ParticleTracer {
    fn from(context: RenderContext) -> Self {
        Self { context }
    }
}

impl Special for ParticleTracer {}

impl ParticleTracer {
    /// Shows the vertices of a walk, from the one at the end of `ray` on, to the camera.
    fn follow<B: Scattering>(
        &self,
        mut walk: Walk<true>,
        mut ray: Ray,
        numbers: &LightSampler,
        out: &mut impl SampleSink,
    ) {
        let context = &self.context;
        while walk.depth() + 1 < context.longest() {
            let Some(hit) = context.scene.closest(&ray) else { return };
            let vertex: Vertex<B> = walk.arrive(&context.scene, hit);
            let u = numbers.vertex(walk.depth() - 1);
            if let Some(seen) = context.see(&vertex, u.light)
                && context.is_open(&vertex, &seen.view)
            {
                out.light(seen.view.uv, walk.lambda.to_xyz(seen.value));
            }
            let each = |own, ray| self.follow::<B>(own, ray, numbers, out);
            match walk.scatter_each(&vertex, (&u, context.rr_depth), each) {
                Some(next) => ray = next,
                None => return,
            }
        }
    }
}
