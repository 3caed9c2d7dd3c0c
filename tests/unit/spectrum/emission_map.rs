//! Tests of `spectrum::emission_map`.

use pointillist::spectrum::emission_map::*;
use pointillist::spectrum::{SampledWavelengths, Spectrum};

#[test]
fn texels_are_the_spectra_of_their_colours() {
    let colours = [[1.0, 1.0, 1.0], [7.0, 2.0, 0.5], [0.0, 0.0, 3.0], [0.0; 3], [0.2, 40.0, 39.0]];
    let map = EmissionMap::new(5, &colours).expect("radiance");
    let lambda = SampledWavelengths::sample(0.3);
    for (x, rgb) in colours.into_iter().enumerate() {
        let expected = Spectrum::emission_rgb(rgb).sample(&lambda).0;
        for (y, t) in [(0, 0.0), (0, 0.4), (0, 1.0)] {
            let found = map.bilinear([x, y], [0.0, t], &lambda).0;
            let off = (found - expected).abs().max_element();
            assert!(off <= 2e-3 * Spectrum::emission_rgb(rgb).max(), "{rgb:?}: {found} {expected}");
        }
    }
    // Between the last column and the first.
    let middle = map.bilinear([4, 0], [0.25, 0.0], &lambda).0;
    let ends = [4, 0].map(|x| map.bilinear([x, 0], [0.0, 0.0], &lambda).0);
    assert!((middle - ends[0] * 0.75 - ends[1] * 0.25).abs().max_element() < 1e-4 * middle.max_element());
    assert!((map.luminance(1, 1) - (0.2126 * 7.0 + 0.7152 * 2.0 + 0.0722 * 0.5)).abs() < 1e-5);
    assert!(!map.is_black() && EmissionMap::new(1, &[[0.0; 3]]).expect("black").is_black());
}

#[test]
fn what_is_no_radiance_is_refused_with_its_place() {
    for wrong in [f32::NAN, f32::INFINITY, -1e-6] {
        let mut rgb = [[1.0; 3]; 6];
        rgb[4][2] = wrong;
        let error = EmissionMap::new(3, &rgb).expect_err("no radiance");
        assert_eq!((error.x, error.y), (1, 1));
        assert!(error.to_string().starts_with("texel (1, 1) is 1, 1, "), "{error}");
    }
    let bright = EmissionMap::new(1, &[[f32::MAX, 0.0, 1e-40]]).expect("finite");
    assert!(bright.bilinear([0, 0], [0.0, 0.5], &SampledWavelengths::sample(0.9)).is_finite());
}
