//! Tests of `spectrum::spectrum`.

use glam::Vec4;
use pointillist::spectrum::*;

#[test]
fn greys_are_exact() {
    for v in [0.0, 1e-6, 0.18, 0.5, 1.0] {
        assert_eq!(Spectrum::reflectance_rgb([v; 3]), Spectrum::Constant(v));
        assert_eq!(Spectrum::emission_rgb([v * 40.0; 3]), Spectrum::D65(v * 40.0));
    }
    assert!(Spectrum::emission_rgb([0.0; 3]).is_black());
}

#[test]
fn nonsense_is_clamped() {
    assert_eq!(Spectrum::reflectance_rgb([f32::NAN, -1.0, -0.0]), Spectrum::Constant(0.0));
    assert_eq!(Spectrum::reflectance_rgb([2.0, f32::INFINITY, 1.0]), Spectrum::Constant(1.0));
    for rgb in [[f32::INFINITY, 0.0, f32::NAN], [f32::MIN_POSITIVE, 0.0, 0.0], [1e-44, 0.0, 1e-45]] {
        let s = Spectrum::emission_rgb(rgb);
        assert!(s.eval(Vec4::new(400.0, 500.0, 600.0, 700.0)).is_finite(), "{rgb:?} {s:?}");
        assert!(s.max().is_finite() && s.luminance().is_finite(), "{rgb:?} {s:?}");
    }
}

#[test]
fn scaling_and_the_colour_of_a_surface() {
    let table = Spectrum::table(&[(400.0, 1.0), (600.0, 3.0), (700.0, 0.5)]).expect("valid points");
    let all = [
        Spectrum::Constant(0.5),
        Spectrum::d65(2.0),
        Spectrum::emission_rgb([3.0, 1.0, 0.5]),
        Spectrum::unbounded_rgb([3.0, 1.0, 0.5]),
        Spectrum::reflectance_rgb([0.9, 0.2, 0.1]),
        table,
    ];
    let at = Vec4::new(400.0, 500.0, 600.0, 700.0);
    for s in all {
        let (before, after) = (s.eval(at), s.scaled(3.0).eval(at));
        assert!((after - before * 3.0).abs().max_element() < 1e-5 * after.max_element(), "{s:?}");
        assert!(s.scaled(0.0).is_black() && s.scaled(f32::NAN).is_black(), "{s:?}");
        assert!(s.scaled(f32::INFINITY).scaled(1e30).eval(at).is_finite(), "{s:?}");
    }
    for rgb in [[0.8, 0.2, 0.1], [0.1, 0.4, 0.9], [0.3, 0.3, 0.3]] {
        let found = Spectrum::reflectance_rgb(rgb).reflected_rgb();
        assert!(rgb.iter().zip(found).all(|(a, b)| (a - b).abs() < 3e-3), "{rgb:?} {found:?}");
    }
}

#[test]
fn max_bounds_and_luminance_is_y() {
    let table = Spectrum::table(&[(400.0, 1.0), (600.0, 3.0), (700.0, 0.5)]).expect("valid points");
    let orange = [0.9, 0.3, 0.05];
    for s in [Spectrum::reflectance_rgb(orange), Spectrum::emission_rgb(orange), Spectrum::d65(2.0), table] {
        let bound = s.max() * (1.0 + 1e-6);
        for l in 360..=830 {
            assert!(s.eval(Vec4::splat(l as f32)).x <= bound, "{l} {s:?}");
        }
    }
    // Rec.709 luminance of the light's colour.
    let y = Spectrum::emission_rgb(orange).luminance();
    assert!((y - (0.2126 * 0.9 + 0.7152 * 0.3 + 0.0722 * 0.05)).abs() < 1e-3, "{y}");
    assert!((Spectrum::d65(3.0).luminance() - 3.0).abs() < 1e-6);
}
