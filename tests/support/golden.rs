//! Reference pictures in `tests/golden/`: luminance with the variance of its mean, compared by z-test.
//!
//! Use from a test file: `#[path = "support/golden.rs"] mod golden;`. New references are written by an
//! explicit command only, never by a test that found none.

use std::path::{Path, PathBuf};

use pointillist::client::{FilmData, develop};
use pointillist::image::compare::{Measured, ZTest, luminance, z_test};

/// Share of pixels that must be accepted at the corrected level of 1 %.
pub const ACCEPTED: f64 = 0.997_5;

/// Largest relative difference of the means beyond three standard errors.
pub const MEAN_TOLERANCE: f64 = 0.002;

/// Path of a reference.
pub fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)
}

/// What a film measured, in the terms of a reference; `rgb` is [`develop::linear_rgb`] of Rec.709.
pub fn measured(data: &FilmData, rgb: &[[f32; 3]], energy: f32) -> Measured {
    Measured {
        width: data.width as usize,
        height: data.height as usize,
        mean: rgb.iter().map(|&c| luminance(c)).collect(),
        variance: develop::mean_variance(data, energy).into_iter().map(f64::from).collect(),
    }
}

/// Compares with a reference, and fails with all figures unless both have the same expectation.
///
/// Half of the pixels at least must be comparable: a reference of too few samples would accept anything.
pub fn assert_same(found: &Measured, reference: &Measured, what: &str) -> ZTest {
    let result = z_test(found, reference, 0.01).expect("both pictures have the same size");
    assert!(result.pixels >= result.skipped, "{what}: too few samples to compare, {result:?}");
    assert!(result.accepted >= ACCEPTED, "{what}: pixels differ, {result:?}");
    let off = (result.mean_ratio - 1.0).abs() - 3.0 * result.mean_ratio_error;
    assert!(off < MEAN_TOLERANCE, "{what}: means differ, {result:?}");
    result
}
