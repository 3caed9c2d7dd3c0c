//! Integrators: each turns one point of the sample sequence into samples on the stream.

mod bidirectional;
mod check;
mod context;
mod particle;
mod path;
mod photon;
mod replicated;

pub use bidirectional::{BidirectionalTracer, CAMERA_SUBPATHS, LIGHT_SUBPATHS};
pub use check::{Checked, Special, Tally};
pub use context::RenderContext;
pub use particle::ParticleTracer;
pub use path::PathTracer;
pub use photon::{PhotonScratch, PhotonTracer};
pub use replicated::Replicated;

use crate::stream::{PathCounts, SampleSink};

/// Turns one point of the sample sequence into samples on the stream.
///
/// Owns (or shares by `Arc`) the prepared scene, its settings, the seed and the [`UvWindow`] to cover, so that a
/// path is a pure function of `(self, index)`.
///
/// [`UvWindow`]: crate::stream::UvWindow
pub trait Integrator: Send + Sync + 'static {
    /// What one worker reuses from path to path.
    type Scratch: Default + Send;

    /// Traces path number `index`. Exactly one call per index; every sample goes to `out`.
    fn trace(&self, index: u64, scratch: &mut Self::Scratch, out: &mut impl SampleSink);

    /// Paths started by one call of [`Integrator::trace`]: `{camera: 1, light: 0}` for path tracing.
    fn paths_per_index(&self) -> PathCounts;
}
