//! Bidirectional path tracing (Veach and Guibas 1994; Lafortune and Willems 1993; Veach 1997, ch. 10).
//!
//! One index is [`CAMERA_SUBPATHS`] subpaths from the camera and [`LIGHT_SUBPATHS`] from lights, all of the same
//! wavelengths; each of the former is connected to all of the latter (`choose` says to which of their vertices). A path of k segments is found
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
//! dispersion is weighted over wavelengths ([`crate::tracer::wavelength_mis`]).

mod choose;
mod connect;
mod found;
mod grow;
mod weight;

use crate::stream::{PathCounts, SampleSink};
use crate::tracer::bsdf::{Bsdf, Diffuse, Scattering, Smooth};
use crate::tracer::{MaterialClass, Sampler};

use super::{Integrator, RenderContext, Special};
use choose::{End, Pool};
use found::Found;

/// Subpaths from the camera in one index.
pub const CAMERA_SUBPATHS: u64 = 8;

/// Subpaths from lights in one index.
pub const LIGHT_SUBPATHS: u64 = 4;

/// What t = 1 has of samples for one of each other way.
const LIGHTS_PER_CAMERA: f32 = LIGHT_SUBPATHS as f32 / CAMERA_SUBPATHS as f32;

/// Traces subpaths from either end and connects them.
#[derive(Clone, Debug)]
pub struct BidirectionalTracer {
    /// Scene, view and settings.
    pub context: RenderContext,
}

/// What a worker reuses: of these, what the scene's surfaces call for.
#[derive(Debug, Default)]
pub struct Scratch {
    matt: Ends<Diffuse>,
    smooth: Ends<Smooth>,
    any: Ends<Bsdf>,
}

/// Vertices of the subpaths of an index.
#[derive(Debug)]
struct Ends<B> {
    lights: Vec<End<B>>,
    eyes: Vec<End<B>>,
    promises: Vec<f32>,
}

impl<B> Default for Ends<B> {
    fn default() -> Self {
        Self { lights: Vec::new(), eyes: Vec::new(), promises: Vec::new() }
    }
}

impl BidirectionalTracer {
    fn trace_as<B: Scattering>(&self, index: u64, ends: &mut Ends<B>, out: &mut impl SampleSink) {
        let seed = self.context.seed;
        let Ends { lights, eyes, promises } = ends;
        let lambda = self.context.wavelengths(Self::wavelength_number(&Sampler::at(index, seed)));
        lights.clear();
        // Beyond 2^61 indices the paths repeat.
        let first = index.wrapping_mul(LIGHT_SUBPATHS);
        for number in 0..LIGHT_SUBPATHS {
            let numbers = Sampler::at(first.wrapping_add(number), seed).light();
            self.light_subpath((lambda, &numbers), lights, out);
        }
        let first = index.wrapping_mul(CAMERA_SUBPATHS);
        for number in 0..CAMERA_SUBPATHS {
            let sampler = Sampler::at(first.wrapping_add(number), seed);
            let numbers = sampler.camera();
            let uv = self.context.place(numbers.screen);
            let mut found = Found::new(lambda);
            eyes.clear();
            self.camera_subpath(&mut found, uv, &sampler, eyes);
            let pool = Pool { eyes, lights, promises, share: 1.0 / LIGHT_SUBPATHS as f32 };
            self.connect_some(&mut found, pool, numbers.connection);
            out.camera(uv.map(|c| c as f32), lambda.to_xyz(found.radiance), 1.0);
        }
    }
}

impl Integrator for BidirectionalTracer {
    type Scratch = Scratch;

    fn trace(&self, index: u64, scratch: &mut Scratch, out: &mut impl SampleSink) {
        match self.context.scene.material_class() {
            MaterialClass::Diffuse => self.trace_as(index, &mut scratch.matt, out),
            MaterialClass::Specular => self.trace_as(index, &mut scratch.smooth, out),
            MaterialClass::General => self.trace_as(index, &mut scratch.any, out),
        }
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: CAMERA_SUBPATHS, light: LIGHT_SUBPATHS }
    }
}

impl From<RenderContext> for BidirectionalTracer {
    fn from(context: RenderContext) -> Self {
        Self { context }
    }
}

impl Special for BidirectionalTracer {
    fn wavelength_number(sampler: &Sampler) -> f32 {
        sampler.group_wavelength()
    }
}
