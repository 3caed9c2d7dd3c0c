//! What a path of a method costs, by the events that are recorded on some of its paths.
//!
//! Time is no measure, since the choice must be the same on every machine. The costs of events are fitted to the times of paths of
//! path tracing, particle tracing and bidirectional tracing in 20 scenes (`benchmarks trial-costs`): the quotient of bidirectional and path
//! tracing is that of times within 10 % (root mean square of its logarithm; 31 % by the lengths of walks, which were counted before).

use std::sync::Arc;

use crate::color::Xyz;
use crate::scene::desc::{IntegratorKind, IntegratorTraits, PhotonUse};
use crate::stream::{PathCounts, SampleSink, UvWindow};
use crate::tracer::integrator::{Integrator, IntegratorVisitor, RenderContext, visit};
use crate::tracer::record::{PathEvent, recorded};

use super::each::each;
use super::survey::SEED;

/// Most indices whose paths are recorded, and the number of events from which on there are no more.
const INDICES: u64 = 512;
const EVENTS: f64 = 200_000.0;

// Costs in units of beginning a path: numbers, wavelengths, a ray, and what becomes of its sample.

/// Cost of a vertex: the ray to it and its material.
const VERTEX: f64 = 0.65;
/// Cost of a vertex of bidirectional tracing beyond that: densities for MIS, and its place among the vertices to connect.
const VERTEX_OF_BOTH: f64 = 0.75;
/// Cost of sampling a material.
const SAMPLED: f64 = 0.8;
/// Cost of evaluating a material.
const EVALUATED: f64 = 0.2;
/// Cost of a light sample with its shadow ray.
const LIGHT_SAMPLE: f64 = 0.95;
/// Cost of a connection to the camera with its shadow ray and its sample.
const TO_CAMERA: f64 = 0.8;
/// Cost of a connection of two subpaths with its shadow ray.
const CONNECTION: f64 = 0.95;
/// Cost of a path that gathers photons, with its share of light paths, over that of a path.
const GATHERING: f64 = 2.0;
/// Cost of merging, with the light paths that leave photons, over that of the connections of the same paths.
pub(super) const MERGING: f64 = 1.1;

/// Mean costs of one path of each method: from the camera, if there are any, with its share of light paths.
pub(super) struct Costs {
    path: f64,
    light: f64,
    bidirectional: f64,
}

impl Costs {
    /// Records paths, with several `threads` those of all methods at once.
    pub(super) fn of(context: &RenderContext, threads: usize) -> Self {
        let kinds = [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Bidirectional];
        let cost = |kind| EventCounts::of(context, kind).cost();
        let costs = each(kinds.into(), threads, cost);
        // A path that panics has no cost, and will panic again in the trial.
        let [path, light, bidirectional] = costs.try_into().unwrap_or([1.0; 3]);
        Self { path, light, bidirectional }
    }

    /// The cost of a path of `kind`.
    pub(super) fn of_kind(&self, kind: IntegratorKind) -> f64 {
        let IntegratorTraits { photons, paths_per_index: [camera, light], .. } = kind.traits();
        match (photons, camera, light) {
            (PhotonUse::Gathered, ..) => GATHERING * self.path,
            (PhotonUse::Merged, ..) => MERGING * self.bidirectional,
            (PhotonUse::None, 0, _) => self.light,
            (PhotonUse::None, _, 0) => self.path,
            (PhotonUse::None, ..) => self.bidirectional,
        }
    }
}

/// Mean numbers of events on a path of a method: from the camera, with its share of light paths, or from a light if those are all.
#[derive(Clone, Copy, Debug, Default)]
pub struct EventCounts {
    /// Subpaths that began.
    pub begun: f64,
    /// Vertices.
    pub vertices: f64,
    /// Vertices of methods that connect subpaths.
    pub vertices_of_both: f64,
    /// Materials that were sampled.
    pub sampled: f64,
    /// Materials that were evaluated.
    pub evaluated: f64,
    /// Light samples.
    pub light_samples: f64,
    /// Connections to the camera.
    pub to_camera: f64,
    /// Connections of subpaths.
    pub connections: f64,
}

impl EventCounts {
    /// Records paths of `kind`.
    pub fn of(context: &RenderContext, kind: IntegratorKind) -> Self {
        let scene = Arc::new((*context.scene).clone().recorded());
        // Where there are places, paths split from the first one on.
        let (seed, window, places) = (SEED, UvWindow::PICTURE, Some(1 << 10));
        visit(kind, RecordedPaths(RenderContext { scene, seed, window, places, ..context.clone() }))
    }

    /// The cost of such a path. A path of a light that sends no ray is not recorded, but costs what it costs to begin it.
    fn cost(&self) -> f64 {
        self.begun.max(1.0)
            + VERTEX * self.vertices
            + VERTEX_OF_BOTH * self.vertices_of_both
            + SAMPLED * self.sampled
            + EVALUATED * self.evaluated
            + LIGHT_SAMPLE * self.light_samples
            + TO_CAMERA * self.to_camera
            + CONNECTION * self.connections
    }

    /// These sums over a number of paths.
    fn over(self, paths: f64) -> Self {
        Self {
            begun: self.begun / paths,
            vertices: self.vertices / paths,
            vertices_of_both: self.vertices_of_both / paths,
            sampled: self.sampled / paths,
            evaluated: self.evaluated / paths,
            light_samples: self.light_samples / paths,
            to_camera: self.to_camera / paths,
            connections: self.connections / paths,
        }
    }
}

/// Records the paths of a method.
struct RecordedPaths(RenderContext);

impl IntegratorVisitor for RecordedPaths {
    type Output = EventCounts;

    fn visit<I: Integrator + From<RenderContext>>(self) -> EventCounts {
        let integrator = I::from(self.0);
        let PathCounts { camera, light } = integrator.paths_per_index();
        let both = f64::from(u8::from(camera > 0 && light > 0));
        let (mut scratch, mut sums) = (I::Scratch::default(), EventCounts::default());
        let (mut indices, mut events) = (0, 0.0);
        while indices < INDICES && events < EVENTS {
            for event in recorded(|| integrator.trace(indices, &mut scratch, &mut Unheard)) {
                events += 1.0;
                match event {
                    PathEvent::Begins(_) => sums.begun += 1.0,
                    PathEvent::Meets(..) => {
                        sums.vertices += 1.0;
                        sums.vertices_of_both += both;
                    }
                    PathEvent::Sampled { .. } => sums.sampled += 1.0,
                    PathEvent::Evaluated { .. } => sums.evaluated += 1.0,
                    PathEvent::Light { .. } => sums.light_samples += 1.0,
                    PathEvent::ToCamera { .. } => sums.to_camera += 1.0,
                    PathEvent::Connection { .. } => sums.connections += 1.0,
                    _ => {}
                }
            }
            indices += 1;
        }
        sums.over((indices * if camera > 0 { camera } else { light }) as f64)
    }
}

/// Takes samples that nobody needs.
struct Unheard;

impl SampleSink for Unheard {
    fn camera(&mut self, _: [f32; 2], _: Xyz, _: f32) {}
    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}
