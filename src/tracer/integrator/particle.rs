//! Particle tracing: paths from lights, each vertex connected to the camera.

use crate::stream::{PathCounts, SampleSink};
use crate::tracer::accel::Ray;
use crate::tracer::bsdf::{Bsdf, Diffuse, Scattering, Smooth};
use crate::tracer::sampler::{CameraNumbers, LightSampler};
use crate::tracer::subpath::{Vertex, Walk};
use crate::tracer::{Finish, Sampler};

use super::{Integrator, Setup, Special};

/// Traces paths from lights. Fills the light stream only: every vertex that the camera sees adds a density over uv.
///
/// What a delta shows (the room in a mirror, a lamp behind glass) it cannot find: no vertex of a light path lies on the
/// camera, and a delta sends nothing towards a given point.
#[derive(Clone, Debug)]
pub struct ParticleTracer {
    /// Scene, view and settings.
    pub setup: Setup,
}

impl Integrator for ParticleTracer {
    type Scratch = ();

    fn trace(&self, index: u64, _: &mut (), out: &mut impl SampleSink) {
        let setup = &self.setup;
        let scene = &setup.scene;
        let sampler = Sampler::at(index, setup.seed);
        let CameraNumbers { lens, wavelength, .. } = sampler.camera();
        let lambda = self.setup.wavelengths(wavelength);
        let numbers = sampler.light();
        let Some(emission) = scene.lights.emit(&numbers.emission()) else { return };
        let emitted = scene.lights.spectrum(emission.light, -emission.direction, &lambda);
        if setup.longest() >= 1
            && !emitted.is_black()
            && let Some((view, scale)) = setup.see_light(&emission, lens)
        {
            out.light(view.uv, lambda.to_xyz(emitted * scale));
        }
        let Some(walk) = Walk::from_light(lambda, &emission, emitted) else { return };
        let ray = emission.ray();
        match scene.finish() {
            Finish::Matt => self.follow::<Diffuse>(walk, ray, &numbers, out),
            Finish::Smooth => self.follow::<Smooth>(walk, ray, &numbers, out),
            Finish::Any => self.follow::<Bsdf>(walk, ray, &numbers, out),
        }
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: 0, light: 1 }
    }
}

impl From<Setup> for ParticleTracer {
    fn from(setup: Setup) -> Self {
        Self { setup }
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
        let setup = &self.setup;
        while walk.depth() + 1 < setup.longest() {
            let Some(hit) = setup.scene.closest(&ray) else { return };
            let vertex: Vertex<B> = walk.arrive(&setup.scene, hit);
            let u = numbers.vertex(walk.depth() - 1);
            if let Some(seen) = setup.see(&vertex, u.light)
                && setup.is_open(&vertex, &seen.view)
            {
                out.light(seen.view.uv, walk.lambda.to_xyz(seen.value));
            }
            let each = |own, ray| self.follow::<B>(own, ray, numbers, out);
            match walk.scatter_each(&vertex, (&u, setup.rr_depth), each) {
                Some(next) => ray = next,
                None => return,
            }
        }
    }
}
