//! Tests of `color::oklab`.

use glam::Vec3;
use pointillist::color::oklab::*;

/// Ottosson's figures for the corners of sRGB, as CSS Color 4 repeats them.
#[test]
fn corners_are_the_published_ones() {
    for (rgb, lab) in [
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ([1.0, 1.0, 1.0], [1.0, 0.0, 0.0]),
        ([1.0, 0.0, 0.0], [0.627_96, 0.224_86, 0.125_85]),
        ([0.0, 1.0, 0.0], [0.866_44, -0.233_89, 0.179_50]),
        ([0.0, 0.0, 1.0], [0.452_01, -0.032_47, -0.311_53]),
    ] {
        let got = from_linear_srgb(Vec3::from(rgb));
        assert!(got.abs_diff_eq(Vec3::from(lab), 2e-5), "{rgb:?}: {got}");
    }
}

#[test]
fn there_and_back() {
    for i in 0..125 {
        let rgb = Vec3::new((i % 5) as f32, (i / 5 % 5) as f32, (i / 25) as f32) / 4.0;
        let back = to_linear_srgb(from_linear_srgb(rgb));
        assert!(back.abs_diff_eq(rgb, 1e-5), "{rgb} {back}");
    }
}
