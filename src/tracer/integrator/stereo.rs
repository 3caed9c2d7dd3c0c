//! Two eyes: an integrator for each, which take turns.

use crate::stream::{PathCounts, SampleSink, eye};
use crate::tracer::Camera;

use super::{Integrator, RenderContext};

/// A picture for each of two eyes, from one sequence of indices: chunks alternate between the eyes ([`eye`]), each of which has a
/// randomisation of its own. Camera paths of either give samples to both where the integrator can share them.
///
/// Samples of the picture are those of the eye whose chunk it is; those of [`SampleSink::camera_of_other_eye`] and
/// [`SampleSink::light_of_other_eye`] are of the other.
#[derive(Clone, Debug)]
pub struct Stereo<I> {
    /// The integrators of the left and of the right eye.
    eyes: [I; 2],
}

impl<I> Stereo<I> {
    /// Integrators that `make` makes of `context`, whose camera is the left eye, and of the camera of the right.
    pub fn new(context: &RenderContext, right: &Camera, mut make: impl FnMut(RenderContext) -> I) -> Self {
        let left = context.clone();
        let right = context.beside(context.seed ^ RIGHT).through(right.clone());
        let beside =
            |own: &RenderContext, other| RenderContext { other_eye: Some(Box::new(other)), ..own.clone() };
        Self { eyes: [make(beside(&left, right.clone())), make(beside(&right, left))] }
    }
}

/// What the seed of the right eye differs by from that of the left. Neither small seeds nor those of
/// [replicates](crate::stream::replicate_seed) differ by as much.
const RIGHT: u32 = 0x4000_0000;

impl<I: Integrator> Integrator for Stereo<I> {
    type Scratch = [I::Scratch; 2];

    #[inline]
    fn trace(&self, index: u64, scratch: &mut Self::Scratch, out: &mut impl SampleSink) {
        let (eye, own) = eye(index);
        self.eyes[eye].trace(own, &mut scratch[eye], out);
    }

    fn paths_per_index(&self) -> PathCounts {
        self.eyes[0].paths_per_index()
    }
}
