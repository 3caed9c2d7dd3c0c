//! All methods agree on the scenes of the repository that have no paths of deltas alone.

#[path = "support/pairs.rs"]
mod pairs;

use pairs::agreement::Plan;
use pairs::{PLAN, assert_all_pairs};

/// With this many paths per block and repetition: more for what is noisy or cheap.
fn check(name: &str, paths_per_pixel: u64) {
    let plan = Plan { paths_per_pixel, ..PLAN };
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let mut desc = pointillist::scene::load(&path, &[]).expect("the scene can be read").desc;
    (desc.film.width, desc.film.height) = (plan.side as u32, plan.side as u32);
    assert_all_pairs(name, &desc, plan);
}

#[test]
fn cornell() {
    check("cornell.xml", 256);
}

#[test]
fn cove() {
    check("cove.xml", 256);
}

#[test]
fn furnace() {
    check("furnace.xml", 1024);
}

#[test]
fn rough() {
    check("rough.xml", 768);
}

#[test]
fn veach_plates() {
    check("veach_plates.xml", 1024);
}

#[test]
fn veach_door() {
    check("veach_door.xml", 384);
}
