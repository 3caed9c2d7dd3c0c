//! Particle tracing: paths from lights, each vertex connected to the camera.

use crate::spectrum::SampledWavelengths;
use crate::stream::{PathCounts, SampleSink};
use crate::tracer::Sampler;
use crate::tracer::sampler::CameraNumbers;
use crate::tracer::subpath::Walk;

use super::{Integrator, Setup};

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
        let (scene, longest) = (&setup.scene, setup.longest());
        let sampler = Sampler::at(index, setup.seed);
        let CameraNumbers { lens, wavelength, .. } = sampler.camera();
        let lambda = SampledWavelengths::sample(wavelength);
        let numbers = sampler.light();
        let Some(emission) = scene.lights.emit(&numbers.emission()) else { return };
        let emitted = scene.lights.spectrum(emission.light, -emission.direction, &lambda);
        if longest >= 1
            && !emitted.is_black()
            && let Some((view, scale)) = setup.see_light(&emission, lens)
        {
            out.light(view.uv, lambda.to_xyz(emitted * scale));
        }
        let Some(mut walk) = Walk::from_light(lambda, &emission, emitted) else { return };
        let mut ray = emission.ray();
        while walk.depth() + 1 < longest {
            let Some(hit) = scene.closest(&ray) else { return };
            let vertex = walk.arrive(scene, hit);
            let u = numbers.vertex(walk.depth() - 1);
            if let Some(seen) = setup.see(&vertex, u.light)
                && setup.is_open(&vertex, &seen.view)
            {
                out.light(seen.view.uv, walk.lambda.to_xyz(seen.value));
            }
            match walk.scatter(&vertex, &u, setup.rr_depth) {
                Some(next) => ray = next,
                None => return,
            }
        }
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: 0, light: 1 }
    }
}
