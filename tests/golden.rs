//! Pictures agree with golden pictures of our own making, in every pixel and on average.
//!
//! A golden file holds the mean of many independent renderings and the variance of that mean. It is made by
//! `tools/golden` once the scene agrees with Mitsuba (`tools/compare_mitsuba`), never by a failing test. Both
//! variances enter the test, so a change of the sampler that moves noise about does not fail it, a bias does.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use std::collections::BTreeSet;
use std::path::Path;

use pointillist::image::compare::{Measured, ZTest, z_test};
use pointillist::image::exr;

#[path = "support/place.rs"]
mod place;
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
    let root = place::root();
    let golden = golden(&root.join(format!("tests/golden/{name}.exr")));
    let side = golden[0].width as u32;
    let samples_per_pixel = u64::from(SAMPLES / (side * side));
    let plan = replicates::Plan { size: [side; 2], samples_per_pixel, seeds: SEEDS };
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

/// Samples per pixel of one replicate of a scene for one plugin.
const PLUGIN_SAMPLES: u64 = 16;

/// The smallest error of brightness that must be noticed in a scene for one plugin.
const PLUGIN_NOTICED: f64 = 0.01;

/// Largest mean of z² over a picture. Normally distributed pixels have 1.03 (62 degrees of freedom) with a standard deviation of .05,
/// ours up to 1.18: a tenth of the picture that is off by twice its noise is found, though each of its pixels is within chance.
const LARGEST_MEAN_Z2: f64 = 1.35;

/// What is wrong with the picture of a scene, if anything.
fn faults(scene: &Path, picture: &Path, name: &str) -> Vec<String> {
    if !picture.exists() {
        return vec![format!(
            "{} is missing: when tools/compare_mitsuba agrees on {}, call tools/golden {name}",
            picture.display(),
            scene.display()
        )];
    }
    let size = replicates::plugin_size(scene);
    let plan = replicates::Plan { size, samples_per_pixel: PLUGIN_SAMPLES, seeds: SEEDS };
    let mut faults = Vec::new();
    for (mut now, golden) in replicates::measure(scene, &plan).into_iter().zip(golden(picture)) {
        let test = match z_test(&now, &golden, 0.01) {
            Ok(test) => test,
            Err(e) => return vec![format!("{name}: {e}")],
        };
        println!("{name}: {test:?}");
        let rejected = (1.0 - test.accepted) * test.pixels as f64;
        let fine = test.skipped == 0
            && rejected.round() <= (0.0025 * test.pixels as f64).ceil()
            && test.mean_z2 <= LARGEST_MEAN_Z2
            && off(&test) <= 4.0 * test.mean_ratio_error;
        if !fine {
            faults.push(format!("{name} differs: {test:?}"));
        }
        now.mean.iter_mut().for_each(|v| *v *= 1.0 + PLUGIN_NOTICED + off(&test));
        let brighter = z_test(&now, &golden, 0.01).unwrap();
        if off(&brighter) <= 4.0 * brighter.mean_ratio_error && golden.mean.iter().any(|v| *v > 0.0) {
            faults.push(format!("{name} is too noisy to prove anything: {brighter:?}"));
        }
    }
    faults
}

#[test]
fn scenes_for_one_plugin_each() {
    let root = place::root();
    let folder = root.join("tests/golden/plugins");
    let mut stale: BTreeSet<_> =
        std::fs::read_dir(&folder).unwrap().map(|file| file.unwrap().path()).collect();
    let mut all = Vec::new();
    for scene in replicates::plugin_scenes(&root) {
        let name = scene.file_stem().unwrap().to_str().unwrap();
        let picture = folder.join(format!("{name}.exr"));
        all.extend(faults(&scene, &picture, name));
        stale.remove(&picture);
    }
    all.extend(stale.iter().map(|file| format!("{} has no scene", file.display())));
    assert!(all.is_empty(), "{}", all.join("\n"));
}
