//! Pictures agree with golden pictures of our own making, in every pixel and on average.
//!
//! A golden file holds the mean of many independent renderings and the variance of that mean. It is made by
//! `tools/golden` once the scene agrees with Mitsuba (`tools/compare_mitsuba`), never by a failing test. Both
//! variances enter the test, so a change of the sampler that moves noise about does not fail it, a bias does.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use std::path::Path;

use pointillist::image::compare::{Measured, ZTest, z_test};
use pointillist::image::exr;

#[path = "support/replicates.rs"]
mod replicates;

/// Seeds that the golden pictures do not use.
const SEEDS: std::ops::Range<u32> = 1000..1032;

/// Paths of one replicate, over the whole picture.
const SAMPLES: u32 = 1 << 17;

/// The smallest error of brightness that must be noticed, as allowed against Mitsuba; a multiple of it where four
/// standard errors of the mean would take minutes to come down to it.
const NOTICED: f64 = 0.002;

/// Mean and variance of each channel, as the file has them.
fn golden(path: &Path) -> [Measured; 3] {
    let layers = exr::read(path).unwrap();
    let wide = |name: &str| layers.channel(name).unwrap().iter().map(|&v| f64::from(v)).collect::<Vec<_>>();
    replicates::CHANNELS.map(|(mean, variance)| Measured {
        width: layers.width,
        height: layers.height,
        mean: wide(mean),
        variance: wide(variance),
    })
}

fn off(test: &ZTest) -> f64 {
    (test.mean_ratio - 1.0).abs()
}

/// `noticed` is the relative error of brightness that the test must be able to see.
#[track_caller]
fn agrees(name: &str, noticed: f64) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let golden = golden(&root.join(format!("tests/golden/{name}.exr")));
    let side = golden[0].width as u32;
    let samples_per_pixel = u64::from(SAMPLES / (side * side));
    let plan = replicates::Plan { side, samples_per_pixel, seeds: SEEDS };
    let now = replicates::measure(&root.join(format!("scenes/{name}.xml")), &plan);
    for (mut now, golden) in now.into_iter().zip(golden) {
        let test = z_test(&now, &golden, 0.01).unwrap();
        println!("{name}: {test:?}");
        assert_eq!(test.skipped, 0);
        assert!(test.accepted >= 0.9975, "{test:?}");
        assert!(off(&test) <= 4.0 * test.mean_ratio_error, "{test:?}");
        now.mean.iter_mut().for_each(|v| *v *= 1.0 + noticed + off(&test));
        let brighter = z_test(&now, &golden, 0.01).unwrap();
        assert!(
            off(&brighter) > 4.0 * brighter.mean_ratio_error,
            "too noisy to prove anything: {brighter:?}"
        );
    }
}

#[test]
fn cornell_box() {
    agrees("cornell", 2.0 * NOTICED);
}

#[test]
fn cornell_box_with_spheres() {
    agrees("cornell_spheres", 3.0 * NOTICED);
}

#[test]
fn furnace() {
    agrees("furnace", NOTICED);
}
