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
    use crate::color::Xyz;
    use crate::scene;
    use crate::stream::UvWindow;
    use crate::tracer::Scene;
    use crate::tracer::integrator::{
        BidirectionalTracer, PathTracer, PhotonScratch, PhotonTracer, VcmTracer,
    };

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

    /// The samples of some paths, those of their own eye first.
    #[derive(Default)]
    struct Samples {
        camera: [Vec<([f32; 2], Xyz, f32)>; 2],
        light: [Vec<([f32; 2], Xyz)>; 2],
    }

    impl SampleSink for Samples {
        fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
            self.camera[0].push((uv, value, weight));
        }

        fn light(&mut self, uv: [f32; 2], value: Xyz) {
            self.light[0].push((uv, value));
        }

        fn camera_of_other_eye(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
            self.camera[1].push((uv, value, weight));
        }

        fn light_of_other_eye(&mut self, uv: [f32; 2], value: Xyz) {
            self.light[1].push((uv, value));
        }
    }

    /// Two eyes in one place see the same by a path that they share, and what one eye alone sees by that path. Rounding may let roulette decide
    /// otherwise, so that a few values may differ from those of one eye.
    #[test]
    fn eyes_in_one_place_share_each_value() {
        fn samples<I: Integrator>(tracer: I) -> Samples {
            let (mut samples, mut scratch) = (Samples::default(), I::Scratch::default());
            (0..256).for_each(|index| tracer.trace(index, &mut scratch, &mut samples));
            samples
        }
        fn check<I: Integrator>(name: &str, context: &RenderContext, make: impl Fn(RenderContext) -> I) {
            let near = |a: Xyz, b: Xyz| {
                [(a.x, b.x), (a.y, b.y), (a.z, b.z)]
                    .iter()
                    .all(|(a, b)| (a - b).abs() <= 1e-3 * (a.abs() + b.abs()) + 1e-6)
            };
            let other_eye = Some(Box::new(context.clone()));
            let both = samples(make(RenderContext { other_eye, ..context.clone() }));
            let alone = samples(make(context.clone()));
            assert_eq!(both.camera[0].len(), alone.camera[0].len(), "{name}");
            let mut of_other = both.camera[1].iter();
            let (mut shared, mut same) = (0, 0);
            for ((uv, value, weight), (uv_alone, value_alone, _)) in
                both.camera[0].iter().zip(&alone.camera[0])
            {
                assert_eq!(uv, uv_alone, "{name}");
                if *weight > 0.9 {
                    continue;
                }
                let (uv_other, value_other, weight_other) = of_other.next().unwrap();
                assert!((weight - 0.5).abs() < 1e-3 && (weight_other - 0.5).abs() < 1e-3, "{name}: {weight}");
                assert!((0..2).all(|i| (uv[i] - uv_other[i]).abs() < 1e-4), "{name}: {uv:?}, {uv_other:?}");
                assert!(near(*value, *value_other), "{name}: {value:?}, {value_other:?}");
                shared += 1;
                same += usize::from(near(*value, *value_alone));
            }
            assert!(of_other.next().is_none(), "{name}");
            let all = alone.camera[0].len();
            // What is seen by path tracing branches at the first vertex, which the first paths of one eye do not.
            let is_comparable = !name.ends_with(", path");
            assert!(4 * shared > all, "{name}: {shared} of {all}");
            assert!(!is_comparable || 50 * same >= 49 * shared, "{name}: {same} of {shared}");
            for eye in &both.light {
                assert_eq!(eye.len(), alone.light[0].len(), "{name}");
                for (light, of_one) in eye.iter().zip(&alone.light[0]) {
                    assert!(light.0 == of_one.0 && near(light.1, of_one.1), "{name}: {light:?}, {of_one:?}");
                }
            }
        }
        for name in ["scenes/cornell.xml", "scenes/cornell_spheres.xml", "scenes/veach_plates.xml"] {
            let desc = scene::load(name.as_ref(), &[]).unwrap().desc;
            let (scene, camera) = (Arc::new(Scene::prepare(&desc).unwrap()), Camera::of(&desc).unwrap());
            let context = RenderContext::new(scene, camera, &desc.integrator, 7, UvWindow::PICTURE);
            check(&format!("{name}, path"), &context, PathTracer::from);
            check(&format!("{name}, bidirectional"), &context, BidirectionalTracer::from);
            check(&format!("{name}, photon"), &context, PhotonTracer::from);
            check(&format!("{name}, vcm"), &context, VcmTracer::from);
        }
    }
}
