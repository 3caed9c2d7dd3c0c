//! Two eyes: an integrator for each, which take turns.

use crate::color::Xyz;
use crate::stream::{CHUNK, PathCounts, SampleSink};
use crate::tracer::Camera;

use super::{Integrator, RenderContext};

/// A picture for each of two eyes, from one sequence of indices: chunks alternate between the eyes, each of which has a randomisation of its own.
/// Camera paths of either give samples to both where the integrator can share them.
///
/// The samples of the left eye are those of the picture; those of the right are [`SampleSink::camera_of_other_eye`] and
/// [`SampleSink::light_of_other_eye`].
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
        let beside = |own: &RenderContext, other| RenderContext { other_eye: Some(Box::new(other)), ..own.clone() };
        Self { eyes: [make(beside(&left, right.clone())), make(beside(&right, left))] }
    }
}

/// What the seed of the right eye differs by from that of the left: neither a small seed, nor a
/// [replicate](crate::stream::replicate_seed), nor a tracer differs by as much.
const RIGHT: u32 = 0x4000_0000;

impl<I: Integrator> Integrator for Stereo<I> {
    type Scratch = [I::Scratch; 2];

    #[inline]
    fn trace(&self, index: u64, scratch: &mut Self::Scratch, out: &mut impl SampleSink) {
        let (chunk, place) = (index / CHUNK, index % CHUNK);
        let own = chunk / 2 * CHUNK + place;
        match chunk % 2 {
            0 => self.eyes[0].trace(own, &mut scratch[0], out),
            _ => self.eyes[1].trace(own, &mut scratch[1], &mut RightEye(out)),
        }
    }

    fn paths_per_index(&self) -> PathCounts {
        self.eyes[0].paths_per_index()
    }
}

/// Sends what is of the right eye, and of the left as that of the other.
struct RightEye<'a, S>(&'a mut S);

impl<S: SampleSink> SampleSink for RightEye<'_, S> {
    #[inline]
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.0.camera_of_other_eye(uv, value, weight);
    }

    #[inline]
    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        self.0.light_of_other_eye(uv, value);
    }

    #[inline]
    fn camera_of_other_eye(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.0.camera(uv, value, weight);
    }

    #[inline]
    fn light_of_other_eye(&mut self, uv: [f32; 2], value: Xyz) {
        self.0.light(uv, value);
    }

    fn is_wanted(&self) -> bool {
        self.0.is_wanted()
    }
}
