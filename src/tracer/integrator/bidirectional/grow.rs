//! Growing the subpaths: what happens at each of their vertices.

use crate::spectrum::SampledWavelengths;
use crate::stream::SampleSink;
use crate::tracer::Sampler;
use crate::tracer::bsdf::Scattering;
use crate::tracer::integrator::RenderContext;
use crate::tracer::sampler::LightSampler;
use crate::tracer::subpath::{Vertex, Walk};

use super::choose::End;
use super::found::Found;
use super::{BidirectionalTracer, LIGHTS_PER_CAMERA};

impl BidirectionalTracer {
    /// Adds the vertices of the light subpath that can be connected to `vertices`, each shown to the camera.
    pub(super) fn light_subpath<B: Scattering>(
        &self,
        (lambda, numbers): (SampledWavelengths, &LightSampler),
        vertices: &mut Vec<End<B>>,
        out: &mut impl SampleSink,
    ) {
        let RenderContext { scene, rr_depth, .. } = &self.context;
        let Some(emission) = scene.lights.emit(&numbers.emission()) else { return };
        let emitted = scene.lights.spectrum(emission.light, -emission.direction, &lambda);
        let Some(mut walk) = Walk::from_light(lambda, &emission, emitted) else { return };
        let mut ray = emission.ray();
        // One more segment leads to the camera.
        while walk.depth() + 1 < self.context.longest() {
            let Some(hit) = scene.closest(&ray) else { return };
            let mut vertex: Vertex<B> = walk.arrive(scene, hit);
            let u = numbers.vertex(walk.depth() - 1);
            if !vertex.bsdf.is_delta() {
                if vertex.depth == 1 {
                    vertex.chain.link = self.link_to_light(&vertex, &emission);
                }
                self.to_camera((&walk.lambda, u.light), &vertex, out);
                vertices.push(End::new(vertex));
            }
            match walk.scatter(&vertex, &u, *rr_depth) {
                Some(next) => ray = next,
                None => return,
            }
        }
    }

    /// Walks from the camera through `uv`, connects each vertex to lights and leaves those that can be connected in `eyes`.
    pub(super) fn camera_subpath<B: Scattering>(
        &self,
        found: &mut Found,
        uv: [f64; 2],
        sampler: &Sampler,
        eyes: &mut Vec<End<B>>,
    ) {
        let RenderContext { scene, camera, rr_depth, hide_emitters, .. } = &self.context;
        let longest = self.context.longest();
        let lens = sampler.camera().lens;
        let mut ray = camera.ray(uv, lens);
        let pdf = camera.uv_per_steradian(ray.direction) / self.context.window_area();
        let mut walk = Walk::from_camera(found.lambda, camera.lens_point(lens), (pdf, LIGHTS_PER_CAMERA));
        let mut last: Option<Vertex<B>> = None;
        while walk.depth() < longest {
            let hidden = walk.depth() == 0 && *hide_emitters;
            let hit = if hidden { scene.closest_unlit(ray) } else { scene.closest(&ray) };
            let Some(hit) = hit else {
                if !hidden {
                    self.meet_environment(found, &walk, (last.as_ref(), ray.direction));
                }
                return;
            };
            let vertex = walk.arrive(scene, hit);
            self.meet_light(found, last.as_ref(), &vertex);
            if walk.depth() == longest {
                return;
            }
            let numbers = sampler.vertex(walk.depth() - 1);
            if !vertex.bsdf.is_delta() {
                self.direct(found, &vertex, &numbers);
                eyes.push(End::new(vertex));
            }
            match walk.scatter(&vertex, &numbers, *rr_depth) {
                Some(next) => ray = next,
                None => return,
            }
            last = Some(vertex);
        }
    }
}
