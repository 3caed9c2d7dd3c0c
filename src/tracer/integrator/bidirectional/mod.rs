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

mod connections;
mod eyes;
mod importance;
mod light_pool;
mod strategies;
mod tracer;

use crate::color::Xyz;
use crate::stream::{PathCounts, SampleSink};
use crate::tracer::bsdf::{Bsdf, CreditedBsdf, Diffuse, InMedia, Recorded, Scattering, Smooth, Unmixed};
use crate::tracer::camera::CameraRay;
use crate::tracer::light_groups::{GroupColors, LightCredits};
use crate::tracer::medium::FreeFlight;
use crate::tracer::output::send_camera;
use crate::tracer::record::PathEvent;
use crate::tracer::specular_chain::SpecularChain;
use crate::tracer::subpath::{Subpath, SubpathVertex};
use crate::tracer::walk::Walk;
use crate::tracer::{MaterialClass, Sampler, TracingMode};

use super::direct_lighting::add_emitted_by_medium;
use super::pair::{FirstVertex, ForEyes, SamplePair, SharedPath};
use super::prefix::Prefix;
use super::{Integrator, RenderContext};
use connections::Candidates;
use light_pool::{LightPool, group_visit};
use strategies::{PathContribution, SPLAT_SAMPLES};
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
            let (mut other, mut u, mut first_of_two) =
                (self.context.other_eye.as_deref(), numbers.connection, None);
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

    /// Walks from the camera through `uv`, adds the emission and the direct light that it finds, and leaves the vertices that
    /// can be connected in `vertices`. It is one of the `other` eye, too, if there is such and it sees the first vertex. Lights that merging finds
    /// are left to it, where it is in use. Returns whether the first surface scattered as a delta.
    #[inline(always)]
    fn trace_camera_subpath<B: Scattering>(
        &self,
        path: &mut PathContribution<B::Credits>,
        mut other: Option<&RenderContext>,
        uv: [f64; 2],
        sampler: &Sampler,
        merging: bool,
        vertices: &mut Vec<SubpathVertex<B>>,
    ) -> bool {
        let context = &self.context;
        let RenderContext { scene, camera, rr_depth, .. } = context;
        let longest = context.longest();
        let lens = sampler.camera().lens;
        let Some(CameraRay { mut ray, from, uv_per_steradian }) = camera.start(uv, lens) else {
            // A path of nothing, so that those of an index can be counted.
            let nothing = Subpath::from_camera(path.lambda, None, 1.0, 0.0, context.medium);
            B::record(|| PathEvent::Begins((&nothing.walk).into()));
            return false;
        };
        // A ray that no light path finds is as after a delta.
        let (pdf, splats) = match uv_per_steradian > 0.0 {
            true => (uv_per_steradian / context.window_area(), SPLAT_SAMPLES),
            false => (1.0, 0.0),
        };
        let mut subpath = Subpath::from_camera(path.lambda, from, pdf, splats, context.medium);
        B::record(|| PathEvent::Begins((&subpath.walk).into()));
        // Where next-event estimation would have found the light that is hit next.
        let mut last = None;
        let (mut prefix, mut specular, mut chain) = (Prefix::CAMERA, false, SpecularChain::CAMERA);
        let mut flight = FreeFlight::of::<B>(scene, || sampler.flight(0));
        while subpath.walk.depth < longest {
            let next = context.next_vertex::<B>(&mut subpath.walk, &mut ray, &mut flight, |_, piece| {
                add_emitted_by_medium::<B, _>(&mut path.radiance, &mut path.credits, scene.lights(), &piece);
            });
            let Some(hit) = next else {
                if !(merging && prefix.is_merged())
                    && let Some(light) = context.environment(subpath.walk.depth)
                {
                    self.add_environment(path, light, &subpath, last, ray.direction);
                }
                break;
            };
            if scene.passes(&mut ray, &hit) {
                if !(merging && prefix.is_merged()) {
                    let vertex = subpath.clone().arrive(scene, hit);
                    self.add_emitted::<B>(path, last, &vertex, chain.probability());
                }
                subpath.walk.pass::<B>(scene, &hit, ray.direction);
                continue;
            }
            let mut vertex: SubpathVertex<B> = subpath.arrive(scene, hit);
            if !(merging && prefix.is_merged()) {
                self.add_emitted(path, last, &vertex, chain.probability());
            }
            if subpath.walk.depth == longest {
                break;
            }
            B::record(|| PathEvent::Meets((&subpath.walk).into(), hit));
            let numbers = sampler.vertex(subpath.walk.depth - 1);
            if let Some(other) = other.take() {
                path.meet_first(context, other, &mut vertex, lens);
            }
            if !vertex.surface.bsdf.is_delta() && !self.add_shared_direct(path, &vertex, &numbers) {
                self.add_direct(path, &vertex, &numbers);
            }
            last = Some(vertex.surface.light_context());
            let next = Walk::<false>::sample(&vertex.surface, &numbers).and_then(|s| {
                self.add_light_behind_deltas(path, &mut chain, &vertex, &s);
                let s = path.go_on(&vertex, &s, &mut subpath.walk)?;
                subpath.scatter_into(&vertex, &s, &numbers, *rr_depth)
            });
            let diffuse = vertex.surface.bsdf.has_diffuse_part();
            if !vertex.surface.bsdf.is_delta() {
                vertices.push(vertex);
            }
            // The link is 0 after a delta. Merging has a roulette of its own, so that it does not matter whether this walk goes on.
            prefix = prefix.then(subpath.previous.link == 0.0, diffuse);
            specular |= subpath.walk.depth == 1 && prefix.is_specular();
            let Some(next) = next else { return specular };
            ray = next;
            flight = FreeFlight::of::<B>(scene, || sampler.flight(subpath.walk.depth));
        }
        B::record(|| PathEvent::Leaves((&subpath.walk).into()));
        specular
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
