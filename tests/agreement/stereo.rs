//! Each eye of a pair has the picture of its camera alone, by every method.

use std::ops::RangeInclusive;

use glam::{DAffine3, DVec3};
use pointillist::scene::desc::SceneDesc;
use pointillist::stream::UvWindow;
use pointillist::tracer::Camera;

use crate::pairs::METHODS;
use crate::support::agreement::{Method, Plan, repeat_pair, repeat_through};
use crate::support::welch;

/// 64 blocks, 24 repetitions, of more paths than those at the beginning, which do not split.
const PLAN: Plan = Plan { side: 8, paths_per_pixel: 512, seeds: 24, window: UvWindow::PICTURE };

/// The probability of a false alarm of one test of a scene, of the tests of blocks together.
const LEVEL: f64 = 1e-3;

/// The methods that have camera paths.
const WITH_CAMERA_PATHS: [Method; 4] = [Method::Path, Method::Bidirectional, Method::Photon, Method::Vcm];

/// A tenth of the camera paths at least, where materials and distance leave few to share.
const SOME: RangeInclusive<f64> = 0.1..=1.0;

/// The cameras of two eyes this far apart.
fn eyes(desc: &SceneDesc, interocular: f64) -> [Camera; 2] {
    // +x of a camera is to the left.
    [0.5, -0.5].map(|side| {
        let mut desc = desc.clone();
        let right = DVec3::new(side * interocular, 0.0, 0.0);
        desc.camera.to_world *= DAffine3::from_translation(right);
        Camera::of(&desc).expect("the camera is valid")
    })
}

/// Compares each eye of a pair with a render of its camera alone, in every block and on the mean, and the share of camera paths that gave both
/// a sample with what it must be.
fn check(name: &str, interocular: f64, methods: &[Method], must_share: RangeInclusive<f64>) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let mut desc = pointillist::scene::load(&path, &[]).expect("the scene can be read").desc;
    (desc.film.width, desc.film.height) = (PLAN.side as u32, PLAN.side as u32);
    let cameras = eyes(&desc, interocular);
    let blocks = PLAN.side * PLAN.side;
    for &method in methods {
        let (pair, shared): (Vec<_>, Vec<_>) =
            repeat_pair(&desc, &cameras, method, PLAN).into_iter().map(|p| (p.eyes, p.shared)).unzip();
        let shared = shared.iter().sum::<f64>() / shared.len() as f64;
        println!("{name} {method:?}: {shared:.3} of the camera paths are shared");
        // Particle tracing has no camera paths.
        assert!(must_share.contains(&shared) || method == Method::Particle, "{name} {method:?}: {shared}");
        for (eye, camera) in cameras.iter().enumerate() {
            let alone = repeat_through(camera, &desc, method, PLAN);
            let of_pair = |i: usize| pair.iter().map(move |picture| picture[eye * blocks + i]);
            let of_alone = |i: usize| alone.iter().map(move |picture| picture[i]);
            let n = f64::from(PLAN.seeds);
            let (mut least, mut variances) = (1.0f64, [0.0; 2]);
            for i in 0..blocks {
                let (a, b) = (welch::moments(of_pair(i)), welch::moments(of_alone(i)));
                variances = [variances[0] + a.1, variances[1] + b.1];
                let (t, freedom) = welch::t(a, b, 0.0, n);
                least = least.min(welch::p_value(t, freedom) * blocks as f64);
            }
            let mean = |of: &dyn Fn(usize) -> f64| (0..blocks).map(of).sum::<f64>() / blocks as f64;
            let means_pair =
                (0..pair.len()).map(|k| mean(&|i| pair[k][eye * blocks + i])).collect::<Vec<_>>();
            let means_alone = (0..alone.len()).map(|k| mean(&|i| alone[k][i])).collect::<Vec<_>>();
            let (a, b) = (welch::moments(means_pair.into_iter()), welch::moments(means_alone.into_iter()));
            let (t, freedom) = welch::t(a, b, 0.0, n);
            let of_mean = welch::p_value(t, freedom);
            println!(
                "{name} {method:?} eye {eye}: means {:.5} {:.5}, p {of_mean:.4}, blocks {least:.4}; variance of the pair over that alone {:.3}",
                a.0,
                b.0,
                variances[0] / variances[1]
            );
            assert!(of_mean >= LEVEL && least >= LEVEL, "{name} {method:?}, eye {eye}: p {of_mean}, {least}");
        }
    }
}

#[test]
fn diffuse() {
    check("cornell.xml", 0.3, &METHODS, 0.5..=1.0);
}

/// The eyes are so far apart that each sees walls of the boxes that the other does not.
#[test]
fn far_apart() {
    check("cornell.xml", 1.5, &[Method::Bidirectional, Method::Photon, Method::Vcm], SOME);
}

/// Mirror and glass are not shared; the eyes are far apart, so that each sees much that the other does not.
#[test]
fn mirror_and_glass() {
    check("cornell_spheres.xml", 1.5, &WITH_CAMERA_PATHS, SOME);
}

/// Highlights move with the eye.
#[test]
fn glossy() {
    check("veach_plates.xml", 2.0, &WITH_CAMERA_PATHS, SOME);
    check("rough.xml", 0.5, &WITH_CAMERA_PATHS, SOME);
}

/// Holes, coats and layers of plastic, whose mirrors each eye sees alone, bumps.
#[test]
fn materials() {
    for name in [
        "plugins/bsdf_mask.xml",
        "plugins/bsdf_plastic.xml",
        "plugins/bsdf_bumpmap.xml",
        "plugins/bsdf_principled.xml",
    ] {
        check(name, 0.5, &[Method::Path, Method::Bidirectional, Method::Photon], SOME);
    }
}

/// Where there are media nothing is shared.
#[test]
fn fog() {
    check("fog.xml", 0.5, &[Method::Particle, Method::Bidirectional], 0.0..=0.0);
}
