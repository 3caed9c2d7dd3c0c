//! Tests of `study::replicates`.

use pointillist::color::Xyz;
use pointillist::stream::CHUNK;
use pointillist::stream::{PathCounts, Sample};
use pointillist::study::replicates::*;

fn grey(uv: [f32; 2], y: f32, w: f32) -> Sample {
    Sample { uv, xyz: Xyz::new(0.950_46 * y, y, 1.089_06 * y), w }
}

#[test]
fn mean_and_difference_of_both_streams() {
    let mut sums = Replicates::new([2, 1], 1.0);
    assert!(sums.pixels().is_none());
    let paths = PathCounts { camera: 2, light: 4 };
    sums.add(
        0,
        paths,
        &[grey([0.25, 0.5], 1.0, 1.0), grey([0.25, 0.5], 3.0, 1.0), grey([0.75, 0.5], 8.0, -1.0)],
    );
    assert!(sums.pixels().is_none());
    sums.add(
        CHUNK,
        paths,
        &[grey([0.25, 0.5], 4.0, 1.0), grey([2.0, 0.5], 9.0, 1.0), grey([f32::NAN, 0.5], 9.0, 1.0)],
    );
    let pixels = sums.pixels().expect("both have paths");
    // (1 + 3) / 2 against 4, weighted 2 : 1.
    assert!((pixels[0].mean[1] - 8.0 / 3.0).abs() < 1e-3 && (pixels[0].difference[1] + 2.0).abs() < 1e-3);
    assert!((pixels[0].factor - 2.0 / 9.0).abs() < 1e-6 && pixels[0].seen);
    // The light stream alone: 8 · 2 texels / 4 paths against nothing; no camera sample was seen there.
    assert!((pixels[1].difference[1] - 4.0).abs() < 1e-2 && !pixels[1].seen);
    assert_eq!(sums.paths(), 8);
}
