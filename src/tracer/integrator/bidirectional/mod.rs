//! Bidirectional path tracing (Veach and Guibas 1994; Lafortune and Willems 1993; Veach 1997, ch. 10).
//!
//! One index is one subpath from the camera and one from a light, of the same wavelengths. A path of k segments is found
//! in up to k + 1 ways, with s vertices from the light and t = k + 1 − s from the camera:
//!
//! | s | t | | stream |
//! |---|---|---|---|
//! | 0 | ≥ 2 | the camera subpath meets a light | camera |
//! | 1 | ≥ 2 | next-event estimation, with the numbers of the camera's vertex | camera |
//! | ≥ 2 | ≥ 2 | vertices of the two are connected | camera |
//! | ≥ 2 | 1 | a vertex of the light subpath is connected to the camera | light |
//!
//! A light that the camera sees directly is found by s = 0 alone. The ways are weighted by the power heuristic
//! (`weight`, and [`crate::tracer::chain`]).
//!
//! A dispersive delta leaves the hero wavelength only, from there on and in every connection of such a vertex; other
//! dispersion is weighted over wavelengths ([`crate::tracer::heroes`]).

mod connect;
mod found;
mod weight;

use crate::spectrum::SampledWavelengths;
use crate::stream::{PathCounts, SampleSink, UvWindow};
use crate::tracer::Sampler;
use crate::tracer::sampler::LightSampler;
use crate::tracer::subpath::{Vertex, Walk};

use super::{Integrator, Setup};
use found::Found;

/// Traces a subpath from either end and connects them.
#[derive(Clone, Debug)]
pub struct BidirectionalTracer {
    /// Scene, view and settings.
    pub setup: Setup,
}

impl BidirectionalTracer {
    /// Leaves the vertices of the light subpath that can be connected in `vertices`, each shown to the camera.
    fn light_subpath(
        &self,
        (lambda, numbers): (SampledWavelengths, &LightSampler),
        vertices: &mut Vec<Vertex>,
        out: &mut impl SampleSink,
    ) {
        let Setup { scene, rr_depth, .. } = &self.setup;
        let Some(emission) = scene.lights.emit(&numbers.emission()) else { return };
        let emitted = scene.lights.spectrum(emission.light, -emission.direction, &lambda);
        let Some(mut walk) = Walk::from_light(lambda, &emission, emitted) else { return };
        let mut ray = emission.ray();
        // One more segment leads to the camera.
        while walk.depth() + 1 < self.setup.longest() {
            let Some(hit) = scene.closest(&ray) else { return };
            let mut vertex = walk.arrive(scene, hit);
            if vertex.depth == 1 {
                vertex.chain.link = self.link_to_light(&vertex, &emission);
            }
            let u = numbers.vertex(walk.depth() - 1);
            if !vertex.bsdf.is_delta() {
                self.to_camera((&walk.lambda, u.light), &vertex, out);
                vertices.push(vertex);
            }
            match walk.scatter(&vertex, &u, *rr_depth) {
                Some(next) => ray = next,
                None => return,
            }
        }
    }

    /// Walks from the camera through `uv`, and connects each vertex to lights and `vertices`.
    fn camera_subpath(&self, found: &mut Found, uv: [f64; 2], sampler: &Sampler, vertices: &[Vertex]) {
        let Setup { scene, camera, rr_depth, hide_emitters, .. } = &self.setup;
        let longest = self.setup.longest();
        let lens = sampler.camera().lens;
        let mut ray = camera.ray(uv, lens);
        let pdf = camera.uv_per_steradian(ray.direction) / self.setup.window_area();
        let mut walk = Walk::from_camera(found.lambda, camera.lens_point(lens), pdf);
        let mut last: Option<Vertex> = None;
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
                self.connect_all(found, &vertex, vertices);
            }
            match walk.scatter(&vertex, &numbers, *rr_depth) {
                Some(next) => ray = next,
                None => return,
            }
            last = Some(vertex);
        }
    }
}

impl Integrator for BidirectionalTracer {
    /// The light subpath.
    type Scratch = Vec<Vertex>;

    fn trace(&self, index: u64, vertices: &mut Vec<Vertex>, out: &mut impl SampleSink) {
        let sampler = Sampler::at(index, self.setup.seed);
        let numbers = sampler.camera();
        let UvWindow { min, max } = self.setup.window;
        let uv = [0, 1].map(|i| {
            let (lo, hi) = (f64::from(min[i]), f64::from(max[i]));
            lo + (hi - lo) * numbers.screen[i]
        });
        let mut found = Found::new(SampledWavelengths::sample(numbers.wavelength));
        vertices.clear();
        self.light_subpath((found.lambda, &sampler.light()), vertices, out);
        self.camera_subpath(&mut found, uv, &sampler, vertices);
        out.camera(uv.map(|c| c as f32), found.lambda.to_xyz(found.radiance), 1.0);
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: 1, light: 1 }
    }
}
