//! A render divided into independent randomisations, whose differences give the error of their mean.

use crate::stream::{PathCounts, REPLICATES, SampleSink, replicate, replicate_seed};
use crate::tracer::Integrator;

use super::RenderContext;

/// One integrator for all indices, or one for each replicate, which take turns chunk by chunk
/// ([`replicate`](crate::stream::replicate())). Each replicate has a photon map of its own.
#[derive(Clone, Debug)]
pub struct Replicated<I> {
    parts: Vec<I>,
}

impl<I> Replicated<I> {
    /// Integrators that `make` makes of `context` with the seed of each replicate, or of `context` alone unless `divided`.
    pub fn new(context: &RenderContext, divided: bool, make: impl FnMut(RenderContext) -> I) -> Self {
        let count = if divided { REPLICATES } else { 1 };
        let context_of = |r| RenderContext { seed: replicate_seed(context.seed, r), ..context.clone() };
        Self { parts: (0..count).map(context_of).map(make).collect() }
    }

    /// The integrators, one per replicate.
    pub fn parts(&self) -> &[I] {
        &self.parts
    }
}

impl<I: Integrator> Integrator for Replicated<I> {
    type Scratch = [I::Scratch; REPLICATES];

    #[inline]
    fn trace(&self, index: u64, scratch: &mut Self::Scratch, out: &mut impl SampleSink) {
        let (r, own) = if self.parts.len() > 1 { replicate(index) } else { (0, index) };
        self.parts[r].trace(own, &mut scratch[r], out);
    }

    fn paths_per_index(&self) -> PathCounts {
        self.parts[0].paths_per_index()
    }
}
