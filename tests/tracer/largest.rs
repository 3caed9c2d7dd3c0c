//! No pixel of the Cornell scenes is one sample: a short run of what `tools/bench largest` measures at length.

use crate::support::largest::{by_particles, by_pixel, worst};
use pointillist::scene::desc::{IntegratorKind, SceneDesc};

fn scene(name: &str) -> SceneDesc {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    pointillist::scene::load(&path, &[]).expect("the scene can be read").desc
}

/// A 60th of the samples, and none of them a 20th of a pixel: at length it is to be no more than a thousandth or so.
#[test]
fn no_sample_dominates_a_pixel() {
    let (side, paths) = (4, 1 << 14);
    for name in ["cornell.xml", "cornell_spheres.xml"] {
        let desc = scene(name);
        let found = [
            by_pixel(&desc, IntegratorKind::Path, side, paths),
            by_pixel(&desc, IntegratorKind::Bidirectional, side, paths),
            by_pixel(&desc, IntegratorKind::Photon, side, paths),
            by_particles(&desc, side, paths),
        ];
        for (tallies, method) in found.iter().zip(["path", "bidirectional", "photon", "light"]) {
            let (pixel, share) = worst(tallies);
            println!("{name} {method}: {share:.4} in pixel {pixel}");
            assert!(share < 0.05, "{name} {method}: {share} of pixel {pixel} is one sample");
            assert!(tallies.iter().any(|t| t.sum > 0.0));
        }
    }
}
