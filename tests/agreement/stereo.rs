//! Each eye of a pair has the picture of its camera alone, by every method.

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

/// Compares each eye of a pair with a render of its camera alone, in every block and on the mean.
fn check(name: &str, interocular: f64, methods: &[Method]) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let mut desc = pointillist::scene::load(&path, &[]).expect("the scene can be read").desc;
    (desc.film.width, desc.film.height) = (PLAN.side as u32, PLAN.side as u32);
    let cameras = eyes(&desc, interocular);
    let blocks = PLAN.side * PLAN.side;
    for &method in methods {
        let pair = repeat_pair(&desc, &cameras, method, PLAN);
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
    check("cornell.xml", 0.3, &METHODS);
}

/// Mirror and glass are not shared; the eyes are far apart, so that each sees much that the other does not.
#[test]
fn mirror_and_glass() {
    check("cornell_spheres.xml", 1.5, &[Method::Path, Method::Bidirectional, Method::Vcm]);
}

/// Highlights move with the eye.
#[test]
fn glossy() {
    check("veach_plates.xml", 2.0, &[Method::Path, Method::Bidirectional]);
    check("rough.xml", 0.5, &[Method::Path, Method::Bidirectional]);
}

/// Holes, layers of plastic, bumps.
#[test]
fn materials() {
    for name in [
        "plugins/bsdf_mask.xml",
        "plugins/bsdf_plastic.xml",
        "plugins/bsdf_bumpmap.xml",
        "plugins/bsdf_principled.xml",
    ] {
        check(name, 0.5, &[Method::Path]);
    }
}

/// Where there are media nothing is shared.
#[test]
fn fog() {
    check("fog.xml", 0.5, &[Method::Particle, Method::Bidirectional]);
}
