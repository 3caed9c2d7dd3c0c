//! The light subpaths of a group of indices, to all of which the camera subpaths of these indices are connected.
//!
//! The more light subpaths a camera vertex can choose from, the less it matters which they happen to be, and one that is traced
//! serves all: this is the cache of light vertices of Davidovič et al. (2014, *Progressive Light Transport Simulation on the GPU*), cut into
//! small ones, so that a path stays a pure function of its index and two pixels next to each other share few of them. All subpaths of a group have
//! the same wavelengths. Wavelengths and light subpaths of all groups that visit a pixel are points of one sequence
//! ([`ScreenCells::visit_of_group`]). A worker traces the subpaths of a group when it comes to its first index; an index alone has those of its whole group
//! traced.

use std::ops::Range;

use crate::color::Xyz;
use crate::spectrum::SampledWavelengths;
use crate::stream::faults::Raised;
use crate::stream::{SampleSink, faults};
use crate::tracer::bsdf::Scattering;
use crate::tracer::integrator::RenderContext;
use crate::tracer::light_groups::LightCredits;
use crate::tracer::medium::FreeFlight;
use crate::tracer::output::send_light;
use crate::tracer::record::PathEvent;
use crate::tracer::sampler::LightSampler;
use crate::tracer::sampler::cells::{ScreenCells, Visit};
use crate::tracer::subpath::SubpathVertex;
use crate::tracer::{Sampler, roulette};

use super::importance::{DiffuseSummary, LightRows};
use super::tracer::{BidirectionalTracer, CAMERA_SUBPATHS, LIGHT_SUBPATHS};

/// Indices of a group: a power of two, so that chunks of indices, which workers claim, are whole groups.
pub(super) const GROUP: u64 = 4;

/// Which subpaths are in a pool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct PoolKey {
    group: u64,
    seed: u32,
    cells: ScreenCells,
}

/// The light subpaths of a group.
#[derive(Debug)]
pub(super) struct LightPool<B: Scattering> {
    key: Option<PoolKey>,
    /// Their wavelengths.
    pub(super) lambda: SampledWavelengths,
    /// The vertices that can be connected, subpath by subpath.
    pub(super) vertices: Vec<SubpathVertex<B>>,
    /// The groups of lights that they come from, where paths tell of them.
    groups: Vec<u8>,
    /// The same for their importances.
    pub(super) rows: LightRows,
    /// Samples of the light stream, subpath by subpath.
    splats: Vec<Splat>,
    /// Faults raised while the subpaths were traced, subpath by subpath.
    faults: Vec<Raised>,
    /// For each index of the group the ends of its vertices, its splats and its faults.
    ends: [PoolEnds; GROUP as usize],
}

/// A sample of the light stream.
#[derive(Clone, Copy, Debug)]
struct Splat {
    uv: [f32; 2],
    value: Xyz,
    /// The group of lights that it comes from, if there are groups.
    group: Option<u8>,
    /// It is one of the other eye.
    other_eye: bool,
}

#[derive(Clone, Copy, Debug, Default)]
struct PoolEnds {
    vertices: usize,
    splats: usize,
    faults: usize,
}

impl<B: Scattering> Default for LightPool<B> {
    fn default() -> Self {
        Self {
            key: None,
            lambda: SampledWavelengths::sample(0.0),
            vertices: Vec::new(),
            groups: Vec::new(),
            rows: LightRows::default(),
            splats: Vec::new(),
            faults: Vec::new(),
            ends: [PoolEnds::default(); GROUP as usize],
        }
    }
}

impl<B: Scattering> LightPool<B> {
    fn part(&self, index: u64, end: impl Fn(&PoolEnds) -> usize) -> Range<usize> {
        let member = (index % GROUP) as usize;
        let start = if member == 0 { 0 } else { end(&self.ends[member - 1]) };
        start..end(&self.ends[member])
    }

    /// Where the vertices of the light subpaths of `index` itself stand.
    pub(super) fn own_vertices(&self, index: u64) -> Range<usize> {
        self.part(index, |ends| ends.vertices)
    }

    /// The group of lights that a vertex comes from; 0 where paths do not tell of groups.
    #[inline]
    pub(super) fn group(&self, vertex: usize) -> u8 {
        self.groups.get(vertex).copied().unwrap_or_default()
    }

    /// Sends the samples of the light subpaths of `index`, and raises their faults.
    pub(super) fn send_splats(&self, index: u64, out: &mut impl SampleSink) {
        faults::raise_again(&self.faults[self.part(index, |ends| ends.faults)]);
        for &Splat { uv, value, group, other_eye } in &self.splats[self.part(index, |ends| ends.splats)] {
            match other_eye {
                false => send_light(out, uv, value, group),
                true => out.light_of_other_eye(uv, value),
            }
        }
    }
}

impl BidirectionalTracer {
    /// Has the light subpaths of the group of `index` in `pool`.
    #[inline(always)]
    pub(super) fn fill<B: Scattering>(&self, pool: &mut LightPool<B>, index: u64) {
        let RenderContext { seed, cells, .. } = self.context;
        let key = PoolKey { group: index / GROUP, seed, cells };
        if pool.key == Some(key) {
            return;
        }
        // Set at the end: a panic leaves a pool that is filled anew.
        pool.key = None;
        let visit = group_visit(index, &self.context);
        pool.lambda = self.context.wavelengths(Sampler::group_wavelength(visit));
        pool.vertices.clear();
        pool.groups.clear();
        pool.rows.clear();
        pool.splats.clear();
        pool.faults.clear();
        let before = faults::take();
        for member in 0..GROUP {
            for number in member * LIGHT_SUBPATHS..(member + 1) * LIGHT_SUBPATHS {
                let bits = (GROUP * LIGHT_SUBPATHS).trailing_zeros();
                let numbers = LightSampler::of_group(visit, bits, number);
                self.trace_light_subpath(&numbers, pool);
            }
            pool.faults.append(&mut faults::take());
            let (vertices, splats) = (pool.vertices.len(), pool.splats.len());
            pool.ends[member as usize] = PoolEnds { vertices, splats, faults: pool.faults.len() };
        }
        faults::raise_again(&before);
        for vertex in &pool.vertices {
            pool.rows.push(&DiffuseSummary::new(vertex));
        }
        pool.key = Some(key);
    }

    /// Walks from a light, connects each vertex to the camera and adds those that can be connected to the pool.
    #[inline(always)]
    fn trace_light_subpath<B: Scattering>(&self, numbers: &LightSampler, pool: &mut LightPool<B>) {
        let (scene, rr_depth) = (&self.context.scene, self.context.rr_depth);
        let LightPool { lambda, vertices, groups, splats, .. } = pool;
        let Some(emission) = scene.lights.emit_aimed(&numbers.emission()) else { return };
        let emitted = scene.lights.emitted(&emission, lambda);
        let group = scene.lights.group(emission.light);
        let Some(mut subpath) = scene.light_subpath(*lambda, &emission, emitted) else { return };
        subpath.policy = roulette::CONNECTED_FROM_LIGHT;
        B::record(|| PathEvent::Begins((&subpath.walk).into()));
        let mut ray = emission.ray();
        // One more segment leads to the camera.
        while subpath.walk.depth + 1 < self.context.longest() {
            let mut flight = FreeFlight::of::<B>(scene, || numbers.flight(subpath.walk.depth));
            let next = scene.next_light_vertex::<B>(&mut subpath.walk, &mut ray, &mut flight);
            let Some(hit) = next else { break };
            let mut vertex: SubpathVertex<B> = subpath.arrive(scene, hit);
            B::record(|| PathEvent::Meets((&subpath.walk).into(), hit));
            let u = numbers.vertex(subpath.walk.depth - 1);
            if !vertex.surface.bsdf.is_delta() {
                if vertex.depth == 1 {
                    vertex.mis.link = self.link_to_light(&vertex, &emission);
                }
                let lambda = &subpath.walk.lambda;
                let [own, other] = match self.context.partner() {
                    None => [self.to_camera(lambda, u.light, &vertex), None],
                    Some(other) => self.to_both_cameras(other, lambda, u.light, &vertex),
                };
                for (splat, other_eye) in [(own, false), (other, true)] {
                    let scaled = |value: Xyz| value * self.context.light_share();
                    splats.extend(splat.map(|(uv, value)| Splat {
                        uv,
                        value: scaled(value),
                        group,
                        other_eye,
                    }));
                }
            }
            let next = subpath.scatter(&vertex, &u, rr_depth);
            if !vertex.surface.bsdf.is_delta() {
                vertices.push(vertex);
                if B::Credits::KEPT {
                    groups.push(group.unwrap_or_default());
                }
            }
            let Some(next) = next else { return };
            ray = next;
        }
        B::record(|| PathEvent::Leaves((&subpath.walk).into()));
    }
}

/// The visit that enumerates the wavelengths and light subpaths of the group of `index`. Where paths are not in the order of the sequence, as on an
/// adaptive screen, groups do not visit the same cells again and are enumerated one by one.
pub(super) fn group_visit(index: u64, context: &RenderContext) -> Visit {
    if let Some(number) = context.screen.out_of_turn(index.wrapping_mul(CAMERA_SUBPATHS)) {
        return Visit { number: number / (GROUP * CAMERA_SUBPATHS), seed: context.seed };
    }
    let bits = (GROUP * CAMERA_SUBPATHS).trailing_zeros();
    context.cells.visit_of_group(index / GROUP, bits, context.seed)
}
