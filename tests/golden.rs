//! Pictures agree with golden pictures of our own making, in every pixel and on average.
//!
//! A golden file holds the mean of many independent renderings and the variance of that mean. It is made by
//! `tools/golden` once the scene agrees with Mitsuba (`tools/compare_mitsuba`), never by a failing test. Both
//! variances enter the test, so a change of the sampler that moves noise about does not fail it, a bias does.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use std::path::Path;

use pointillist::image::compare::{Measured, ZTest, z_test};

#[path = "support/replicates.rs"]
mod replicates;

/// Seeds that the golden pictures do not use.
const SEEDS: std::ops::Range<u32> = 1000..1032;

/// Paths of one replicate, over the whole picture.
const SAMPLES: u32 = 1 << 17;

fn compare(name: &str) -> (Measured, Measured, ZTest) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let golden = Measured::read(&root.join(format!("tests/golden/{name}.exr"))).unwrap();
    let side = golden.width as u32;
    let samples_per_pixel = u64::from(SAMPLES / (side * side));
    let plan = replicates::Plan { side, samples_per_pixel, seeds: SEEDS };
    let now = replicates::measure(&root.join(format!("scenes/{name}.xml")), &plan);
    let test = z_test(&now, &golden, 0.01).unwrap();
    println!("{name}: {test:?}");
    (now, golden, test)
}

#[track_caller]
fn agrees(name: &str) {
    let (mut now, golden, test) = compare(name);
    assert_eq!(test.skipped, 0);
    assert!(test.accepted >= 0.9975, "{test:?}");
    let off = (test.mean_ratio - 1.0).abs();
    assert!(off <= 4.0 * test.mean_ratio_error, "{test:?}");
    // The means are known well enough for the test to mean something: 2 % more light must be noticed.
    now.mean.iter_mut().for_each(|y| *y *= 1.02);
    let brighter = z_test(&now, &golden, 0.01).unwrap();
    assert!((brighter.mean_ratio - 1.0).abs() > 4.0 * brighter.mean_ratio_error, "{brighter:?}");
}

#[test]
fn cornell_box() {
    agrees("cornell");
}

#[test]
fn cornell_box_with_spheres() {
    agrees("cornell_spheres");
}

#[test]
fn furnace() {
    agrees("furnace");
}
