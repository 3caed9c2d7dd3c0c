//! Tests of `client::reference::curves`.

use glam::Vec3;
use pointillist::client::reference::curves::*;

/// Compression begins without a step, in the brightest channel and in the others, for any ceiling.
#[test]
fn neutral_compression_begins_gently() {
    for ceiling in [1.0, 4.9] {
        let start = 0.76 * ceiling + 0.04;
        for hue in [Vec3::ONE, Vec3::new(1.0, 0.5, 0.2), Vec3::new(0.3, 0.3, 1.0)] {
            let at = |peak: f32| pbr_neutral(hue * peak - (hue - 1.0).min(Vec3::ZERO) * 0.04, ceiling);
            let step = (at(start * 1.0005) - at(start * 0.9995)).abs().max_element();
            assert!(step < 0.004 * ceiling, "{hue} below {ceiling}: {step}");
        }
    }
}
