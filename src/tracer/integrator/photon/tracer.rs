//! The tracer as its parts see it, and what a worker keeps from path to path.

use std::sync::Arc;

use glam::Vec3;

use crate::tracer::bsdf::Scattering;
use crate::tracer::integrator::RenderContext;
use crate::tracer::medium::PathMedia;
use crate::tracer::photon_map::{PhotonMap, QueryScratch, Schedule, Snapshot};
use crate::tracer::vertex::SurfaceVertex;

use super::recorded_step::RecordedStep;

/// How far light paths go, and where they leave photons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PhotonPaths {
    /// To their end.
    Whole,
    /// To their end; media scatter as rough mirrors do, and have no photons.
    OnSurfaces,
    /// While they scatter from deltas: their photons are those that merging needs.
    Specular,
}

impl PhotonPaths {
    /// True where `vertex` spreads light: photons lie and are gathered there.
    #[inline(always)]
    pub(super) fn spread_at<B: Scattering>(self, vertex: &SurfaceVertex<B>) -> bool {
        let counts = self != Self::OnSurfaces || !(B::Media::PRESENT && vertex.hit.is_in_medium());
        counts && vertex.bsdf.has_diffuse_part()
    }
}

/// Traces paths from the camera and light paths into a map of photons that both share.
///
/// Clones share the map, and so do tracers of other views ([`PhotonTracer::after`]).
#[derive(Clone, Debug)]
pub struct PhotonTracer {
    pub(super) context: RenderContext,
    /// The photons.
    pub map: Arc<PhotonMap>,
    /// How photons follow samples.
    pub schedule: Schedule,
    /// The box of the photons.
    pub(super) bounds: [Vec3; 2],
    pub(super) photon_paths: PhotonPaths,
    pub(super) deterministic: bool,
    /// The generations that every sample sees, if not those that its index demands.
    pub(super) generations: Option<u64>,
}

/// An integrator whose samples see photons: what it takes to trace one of them again.
pub trait SeesPhotons: Sized {
    /// A tracer with an empty map; `deterministic` as in [`PhotonTracer::new`].
    fn without_photons(context: RenderContext, deterministic: bool) -> Self;

    /// This tracer for samples that have seen so many generations of photons.
    fn seeing(self, generations: u64) -> Self;

    /// The tracer of the light paths.
    fn photons(&self) -> &PhotonTracer;
}

/// Memory that one worker reuses from path to path of one tracer.
#[derive(Debug, Default)]
pub struct PhotonScratch {
    pub(super) snapshot: Option<Arc<Snapshot>>,
    pub(super) query: QueryScratch,
    pub(super) steps: Vec<RecordedStep>,
    /// Samples so far.
    pub(super) samples: u32,
    /// Effective number of the photons that the last path gathered, (Σ x)² / Σ x² of their contributions x (Kish 1965).
    pub(in crate::tracer::integrator) gathered: f32,
}

impl PhotonScratch {
    /// Keeps the snapshot of the last path for the next one.
    pub(in crate::tracer::integrator) fn keep(&mut self, snapshot: Arc<Snapshot>) {
        self.snapshot = Some(snapshot);
    }
}
