//! Tests of `spectrum::white`.

use glam::{DVec3, Vec4};
use pointillist::color::cie;
use pointillist::spectrum::Spectrum;
use pointillist::spectrum::*;

#[test]
fn whites_are_exact() {
    for white in [White::Equal, White::D65] {
        let whole = cie::integrate(|lambda, _| f64::from(white.spectrum().eval(Vec4::splat(lambda)).x));
        let lambda = white.wavelengths();
        assert!(lambda.pdf().min_element() > 0.0 && !lambda.is_hero_only(), "{lambda:?}");
        for value in [1.0, 0.25, 3e-20, 7e20] {
            let found = lambda.to_xyz(white.spectrum().sample(&lambda) * value);
            let found = DVec3::new(found.x.into(), found.y.into(), found.z.into());
            let expected = whole * f64::from(value);
            assert!(((found - expected) / expected).abs().max_element() < 1e-6, "{found} {expected}");
        }
        assert_eq!(White::of(&white.spectrum()), Some(white));
    }
    assert_eq!(White::of(&Spectrum::emission_rgb([1.0, 0.5, 0.2])), None);
}
