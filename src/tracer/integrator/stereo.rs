//! Two eyes: an integrator for each, which take turns.

use crate::stream::{PathCounts, SampleSink, eye};
use crate::tracer::Camera;

use super::{Integrator, RenderContext};

/// A picture for each of two eyes, from one sequence of indices: chunks alternate between the eyes ([`eye`]), each of which has a
/// randomisation of its own. Camera paths of either give samples to both where these share their first vertex, light paths of either are
/// connected to both cameras, and both see the same photons, as many as one eye alone sees by so many indices.
///
/// Samples of the picture are those of the eye whose chunk it is; those of [`SampleSink::camera_of_other_eye`] and
/// [`SampleSink::light_of_other_eye`] are of the other.
#[derive(Clone, Debug)]
pub struct Stereo<I> {
    /// The integrators of the left and of the right eye.
    eyes: [I; 2],
}

impl<I: Integrator> Stereo<I> {
    /// Integrators that `make` makes of `context`, whose camera is the left eye, and of the camera of the right.
    pub fn new(context: &RenderContext, right: &Camera, mut make: impl FnMut(RenderContext) -> I) -> Self {
        let left = context.clone();
        let right = context.beside(context.seed ^ RIGHT).through(right.clone());
        let beside =
            |own: &RenderContext, other| RenderContext { other_eye: Some(Box::new(other)), ..own.clone() };
        let first = make(beside(&left, right.clone()));
        let second = make(beside(&right, left)).with_photons_of(&first);
        Self { eyes: [first, second] }
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

    use std::sync::Arc;

    use super::*;
    use crate::scene;
    use crate::stream::UvWindow;
    use crate::tracer::Scene;
    use crate::tracer::integrator::{PhotonScratch, PhotonTracer};

    #[test]
    fn both_eyes_see_one_photon_map_that_grows_with_the_samples_of_both() {
        let desc = scene::load("scenes/cornell.xml".as_ref(), &[]).unwrap().desc;
        let (scene, camera) = (Arc::new(Scene::prepare(&desc).unwrap()), Camera::of(&desc).unwrap());
        let context = RenderContext::new(scene, camera.clone(), &desc.integrator, 7, UvWindow::PICTURE);
        let mut seeds = Vec::new();
        let stereo = Stereo::new(&context, &camera, |eye| {
            seeds.push(eye.photon_seed());
            PhotonTracer::new(eye, true)
        });
        assert_eq!(seeds[0], seeds[1], "light paths are the same, whichever eye has them traced");
        let [left, right] = &stereo.eyes;
        let alone = PhotonTracer::new(context, true);
        let [of_left, of_right, of_one] = [(left, 9000), (right, 9000), (&alone, 18_000)]
            .map(|(tracer, index)| tracer.snapshot(index, &mut PhotonScratch::default(), &|| true).unwrap());
        assert!(Arc::ptr_eq(&of_left, &of_right));
        assert_eq!((of_left.generations, of_left.light_paths), (of_one.generations, of_one.light_paths));
        assert_eq!(of_left.generations, 2);
    }
}
