//! All methods agree on the scenes of the repository that have no paths of deltas alone.

#[path = "support/pairs.rs"]
mod pairs;

use pairs::agreement::Plan;
use pairs::{PLAN, assert_all_pairs};

/// In side × side blocks, with this many paths per block and repetition. Where path tracing finds light seldom and strongly,
/// blocks are larger: the mean of few such finds is skewed, and below what it will be.
fn check(name: &str, side: usize, paths_per_pixel: u64) {
    let plan = Plan { side, paths_per_pixel, ..PLAN };
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let mut desc = pointillist::scene::load(&path, &[]).expect("the scene can be read").desc;
    (desc.film.width, desc.film.height) = (plan.side as u32, plan.side as u32);
    assert_all_pairs(name, &desc, plan);
}

#[test]
fn cornell() {
    check("cornell.xml", 8, 256);
}

#[test]
fn cove() {
    check("cove.xml", 8, 256);
}

#[test]
fn furnace() {
    check("furnace.xml", 8, 1024);
}

#[test]
fn rough() {
    check("rough.xml", 4, 3072);
}

#[test]
fn veach_plates() {
    check("veach_plates.xml", 8, 1024);
}

#[test]
fn veach_door() {
    check("veach_door.xml", 4, 1536);
}
