//! All methods agree on the scenes of the repository that have no paths of deltas alone.

use crate::pairs::{PHOTONS, PLAN, assert_all_pairs};
use crate::support::agreement::Plan;

/// Compares all methods in side × side blocks, with this many paths per block and repetition.
///
/// Where path tracing finds light rarely and strongly, blocks are larger: the mean of few such finds has a skewed distribution.
/// `photons` is the bias granted to photon mapping, see [`PHOTONS`].
fn check(name: &str, side: usize, paths_per_pixel: u64, photons: f64) {
    let plan = Plan { side, paths_per_pixel, ..PLAN };
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let mut desc = pointillist::scene::load(&path, &[]).expect("the scene can be read").desc;
    (desc.film.width, desc.film.height) = (plan.side as u32, plan.side as u32);
    assert_all_pairs(name, &desc, plan, photons);
}

#[test]
fn cornell() {
    check("cornell.xml", 8, 256, PHOTONS);
}

#[test]
fn cove() {
    // `photon-bias cove.xml` at 65 536 samples: 4.7 % ± 0.5 % of a pixel and 2.9 % ± 0.3 % of the mean, at 2^20: 2.0 % and 1.4 %. With a
    // quarter of these paths, of 32 repetitions few see what makes a block's mean.
    check("cove.xml", 8, 1024, 0.05);
}

#[test]
fn furnace() {
    check("furnace.xml", 8, 1024, PHOTONS);
}

#[test]
fn rough() {
    // `photon-bias rough.xml` at 65 536 samples: 8.8 % ± 0.7 % of a pixel, at 2^20: 1.8 % ± 0.5 %.
    check("rough.xml", 4, 3072, 0.09);
}

#[test]
fn veach_plates() {
    check("veach_plates.xml", 8, 1024, PHOTONS);
}

#[test]
fn veach_door() {
    // `photon-bias veach_door.xml` at 16 384 samples: 6.5 % ± 1.8 % of a pixel, at 2^20: 2.5 % ± 0.8 %. That is relative to the mean of
    // the picture; 24 576 samples leave the darkest block of 16 too bright by 19 %, and 491 520 by none.
    check("veach_door.xml", 4, 4 * 1536, 0.065);
}
