//! Tests of `color::profile`.

use glam::{DMat3, Mat3};
use pointillist::color::cie;
use pointillist::color::profile::*;

#[test]
fn white_is_d65_on_every_display() {
    let white = cie::d65_white().as_vec3();
    for name in Profile::names() {
        let profile = Profile::named(name).expect("a listed name");
        assert_eq!(profile.name, name);
        let rgb = profile.from_xyz * white;
        assert!((rgb - 1.0).abs().max_element() < 2e-6, "{name} {rgb}");
    }
    assert_eq!(Profile::named("srgb"), Some(Profile::srgb()));
    assert_eq!(Profile::named("nonsense"), None);
}

#[test]
fn matrices_are_the_published_ones() {
    // IEC 61966-2-1 Annex F and ITU-R BT.2020-2 (both with the rounded white, hence 1e-3), rows of XYZ to RGB.
    let srgb =
        Mat3::from_cols_array(&[3.2406, -1.5372, -0.4986, -0.9689, 1.8758, 0.0415, 0.0557, -0.2040, 1.0570])
            .transpose();
    assert!(Profile::srgb().from_xyz.abs_diff_eq(srgb, 2e-3), "{}", Profile::srgb().from_xyz);
    let rec2020 =
        Mat3::from_cols_array(&[1.7167, -0.3557, -0.2534, -0.6667, 1.6165, 0.0158, 0.0176, -0.0428, 0.9421])
            .transpose();
    let ours = Profile::named("rec2020").expect("a listed name").from_xyz;
    assert!(ours.abs_diff_eq(rec2020, 2e-3), "{ours}");
}

#[test]
fn rec709_goes_both_ways() {
    let there_and_back = rec709_from_xyz().as_dmat3() * xyz_from_rec709();
    assert!(there_and_back.abs_diff_eq(DMat3::IDENTITY, 1e-6), "{there_and_back}");
    assert_eq!(rec709_from_xyz(), Profile::srgb().from_xyz);
}
