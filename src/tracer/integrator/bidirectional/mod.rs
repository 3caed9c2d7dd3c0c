//! Bidirectional path tracing (Veach and Guibas 1994; Lafortune and Willems 1993; Veach 1997, ch. 10).
//!
//! One index is [`CAMERA_SUBPATHS`] subpaths from the camera and [`LIGHT_SUBPATHS`] from lights. A few indices form a group, whose subpaths
//! have the same wavelengths. Each camera subpath is connected to light subpaths of its whole group ([`light_pool`]);
//! [`connections`] says at which of their vertices. A path of k segments is found by up to k + 1 strategies, with s vertices
//! from the light and t = k + 1 − s from the camera:
//!
//! | s | t | strategy | stream |
//! |---|---|---|---|
//! | 0 | ≥ 2 | the camera subpath hits a light | camera |
//! | 1 | ≥ 2 | next-event estimation, with the numbers of the camera's vertex | camera |
//! | ≥ 2 | ≥ 2 | a vertex of each subpath are connected | camera |
//! | ≥ 2 | 1 | a vertex of the light subpath is connected to the camera | light |
//!
//! A light that the camera sees directly is found by s = 0 alone. [`strategies`] has what each contributes, weighted by the
//! power heuristic over all of them ([`crate::tracer::subpath_mis`]).
//!
//! Of two eyes, [`eyes`] has what is shared.
//!
//! A dispersive delta leaves the hero wavelength only, from there on and in every connection of such a vertex. Other
//! dispersion is weighted over wavelengths ([`crate::tracer::wavelength_mis`]).

mod camera_subpath;
mod connections;
mod eyes;
mod importance;
mod light_pool;
mod strategies;
mod tracer;

use crate::color::Xyz;
use crate::stream::{PathCounts, SampleSink};
use crate::tracer::bsdf::{Bsdf, CreditedBsdf, Diffuse, InMedia, Recorded, Scattering, Smooth, Unmixed};
use crate::tracer::light_groups::{GroupColors, LightCredits};
use crate::tracer::output::send_camera;
use crate::tracer::record::PathEvent;
use crate::tracer::subpath::SubpathVertex;
use crate::tracer::{MaterialClass, Sampler, TracingMode};

use super::pair::{FirstVertex, ForEyes, SamplePair, SharedPath};
use super::{Integrator, RenderContext};
use connections::Candidates;
use light_pool::{LightPool, group_visit};
use strategies::PathContribution;
pub use tracer::{BidirectionalTracer, CAMERA_SUBPATHS, LIGHT_SUBPATHS};

/// Memory that a worker reuses; only the vertices of the scene's [`MaterialClass`] and [`TracingMode`] are used.
#[derive(Debug, Default)]
pub struct Scratch {
    diffuse: Subpaths<Diffuse>,
    specular: Subpaths<Smooth>,
    general: Subpaths<Unmixed>,
    mixed: Subpaths<Bsdf>,
    in_media: Subpaths<InMedia>,
    recorded: Subpaths<Recorded>,
    credited: Subpaths<CreditedBsdf>,
}

/// The subpaths of an index, and the candidates for connections.
#[derive(Debug)]
struct Subpaths<B: Scattering> {
    light: LightPool<B>,
    camera: Vec<SubpathVertex<B>>,
    candidates: Candidates,
}

impl<B: Scattering> Default for Subpaths<B> {
    fn default() -> Self {
        Self { light: LightPool::default(), camera: Vec::new(), candidates: Candidates::default() }
    }
}

impl BidirectionalTracer {
    /// The loops over subpaths inline what they call: vertices are large, and a call would copy them through memory.
    #[inline(never)]
    fn trace_as<B: Scattering>(
        &self,
        index: u64,
        subpaths: &mut Subpaths<B>,
        mut merge: Option<&mut Merge<'_>>,
        out: &mut impl SampleSink,
    ) {
        let Subpaths { light, camera, candidates } = subpaths;
        self.fill(light, index);
        light.send_splats(index, out);
        let lambda = light.lambda;
        candidates.begin(light.own_vertices(index));
        let first = index.wrapping_mul(CAMERA_SUBPATHS);
        for number in 0..CAMERA_SUBPATHS {
            let start = self.context.screen.start(first.wrapping_add(number));
            let mut sampler = self.context.sampler(start.index);
            let numbers = sampler.camera();
            let uv = self.context.place(numbers.screen);
            // Where the other of two eyes does not see the first vertex there are two subpaths, whose mean is sent.
            let (mut other, mut u, mut first_of_two) = (self.context.partner(), numbers.connection, None);
            loop {
                let mut path = PathContribution::new(lambda);
                camera.clear();
                let specular =
                    self.trace_camera_subpath(&mut path, other, uv, &sampler, merge.is_some(), camera);
                self.add_connections(&mut path, camera, light, candidates, u);
                B::record(|| PathEvent::Estimate { lambda, radiance: path.radiance });
                let ForEyes { own: mut value, other: seen_by_other } =
                    path.first.seen(path.radiance, &lambda);
                path.credits.settle(&lambda);
                if specular && let Some(merge) = &mut merge {
                    let mut colors = GroupColors::default();
                    value += merge(&sampler, &mut colors) * path.factor_alone();
                    path.credits.add_colors(&colors);
                }
                match path.first {
                    FirstVertex::Alone => {
                        (first_of_two, other) = (Some(value), None);
                        (sampler, u) = (sampler.branch(1, 1), (u + 0.5).fract());
                        continue;
                    }
                    FirstVertex::Shared(SharedPath { vertex, .. }) => {
                        let values = ForEyes { own: value, other: seen_by_other };
                        SamplePair::shared(uv, &vertex, values).send(start.weight, out);
                    }
                    FirstVertex::OfOne => {
                        let value = first_of_two.map_or(value, |first| (first + value) * 0.5);
                        send_camera(out, self.context.scene.lights(), uv, value, start.weight, &path.credits);
                    }
                }
                break;
            }
        }
    }

    /// Traces path number `index`, and has `merge` add to the camera samples what merging finds, if there is such.
    pub(super) fn trace_merging(
        &self,
        index: u64,
        scratch: &mut Scratch,
        merge: Option<&mut Merge<'_>>,
        out: &mut impl SampleSink,
    ) {
        let scene = &self.context.scene;
        match (scene.tracing_mode(), scene.material_class()) {
            (TracingMode::Plain, MaterialClass::Diffuse) => {
                self.trace_as(index, &mut scratch.diffuse, merge, out)
            }
            (TracingMode::Plain, MaterialClass::Specular) => {
                self.trace_as(index, &mut scratch.specular, merge, out)
            }
            (TracingMode::Plain, MaterialClass::General) => {
                self.trace_as(index, &mut scratch.general, merge, out)
            }
            (TracingMode::Plain, MaterialClass::Mixed) => {
                self.trace_as(index, &mut scratch.mixed, merge, out)
            }
            (TracingMode::Plain, MaterialClass::InMedia) => {
                self.trace_as(index, &mut scratch.in_media, merge, out)
            }
            (TracingMode::Record, _) => self.trace_as(index, &mut scratch.recorded, merge, out),
            (TracingMode::LightGroups, _) => self.trace_as(index, &mut scratch.credited, merge, out),
        }
    }
}

/// Returns the contribution of merging to the camera sample of a sampler, and writes its parts by groups of lights, if there are groups.
pub(super) type Merge<'a> = dyn FnMut(&Sampler, &mut GroupColors) -> Xyz + 'a;

impl Integrator for BidirectionalTracer {
    type Scratch = Scratch;

    fn trace(&self, index: u64, scratch: &mut Scratch, out: &mut impl SampleSink) {
        self.trace_merging(index, scratch, None, out);
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: CAMERA_SUBPATHS, light: LIGHT_SUBPATHS }
    }

    fn wavelength_number(index: u64, context: &RenderContext) -> f32 {
        Sampler::group_wavelength(group_visit(index, context))
    }
}
