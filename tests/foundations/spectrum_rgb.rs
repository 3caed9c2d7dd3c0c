//! RGB to spectrum and back: what a colour of the scene file looks like after it has become a spectrum.

use glam::{DVec3, Vec4};
use pointillist::color::{cie, profile};
use pointillist::spectrum::Spectrum;

/// CIELAB under D65 of linear Rec.709; written independently of the program's fit.
fn lab(rgb: DVec3) -> DVec3 {
    let xyz = profile::xyz_from_rec709() * rgb / cie::d65_white();
    let f = |v: f64| if v > 216.0 / 24389.0 { v.cbrt() } else { (24389.0 / 27.0 * v + 16.0) / 116.0 };
    DVec3::new(116.0 * f(xyz.y) - 16.0, 500.0 * (f(xyz.x) - f(xyz.y)), 200.0 * (f(xyz.y) - f(xyz.z)))
}

/// Linear Rec.709 of a surface with `reflectance` under D65, by the tables.
fn seen(reflectance: &Spectrum) -> DVec3 {
    let xyz = cie::integrate(|lambda, row| f64::from(reflectance.eval(Vec4::splat(lambda)).x * row.w));
    profile::xyz_from_rec709().inverse() * xyz
}

fn assert_in_unit_range(s: &Spectrum) {
    for i in 0..=470 {
        let v = s.eval(Vec4::splat(360.0 + i as f32)).x;
        assert!((0.0..=1.0).contains(&v), "{s:?} at step {i}: {v}");
    }
}

/// sRGB decoding (IEC 61966-2-1), so that the grid is even to the eye.
fn linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Worst difference after the round trip, over all triples of `levels`.
fn worst_round_trip(levels: &[f64]) -> (f64, DVec3) {
    let mut worst = (0.0, DVec3::ZERO);
    for &r in levels {
        for &g in levels {
            for &b in levels {
                let rgb = DVec3::new(r, g, b);
                let spectrum = Spectrum::reflectance_rgb(rgb.as_vec3().to_array());
                assert_in_unit_range(&spectrum);
                let delta = (lab(seen(&spectrum)) - lab(rgb)).length();
                if delta > worst.0 {
                    worst = (delta, rgb);
                }
            }
        }
    }
    worst
}

#[test]
fn reflectances_of_the_whole_gamut_come_back() {
    let even: Vec<f64> = (0..=10).map(|i| linear(f64::from(i) / 10.0)).collect();
    let worst = worst_round_trip(&even);
    println!("worst round trip: delta E*ab = {:.5} at {}", worst.0, worst.1);
    assert!(worst.0 < 0.01, "{worst:?}");
}

#[test]
fn the_faces_and_corners_of_the_cube_come_back() {
    let worst = worst_round_trip(&[0.0, 1e-7, 1e-4, 0.01, 0.5, 0.99, 0.9999, 1.0]);
    println!("worst round trip: delta E*ab = {:.5} at {}", worst.0, worst.1);
    assert!(worst.0 < 0.01, "{worst:?}");
}

#[test]
fn a_constant_spectrum_of_the_green_component_would_not_do() {
    // What a renderer with one number per colour would return: the test above can fail.
    let rgb = DVec3::new(0.6, 0.2, 0.1);
    let delta = (lab(seen(&Spectrum::Constant(0.2))) - lab(rgb)).length();
    assert!(delta > 30.0, "{delta}");
}

#[test]
fn emission_has_the_colour_asked_for() {
    for rgb in [
        [1.0, 1.0, 1.0],
        [17.0, 12.0, 4.0],
        [0.2, 3.0, 0.5],
        [1.0, 0.0, 0.0],
        [0.0, 0.0, 1e-3],
        [5e4, 4e4, 0.0],
    ] {
        let light = Spectrum::emission_rgb(rgb);
        let xyz = cie::integrate(|lambda, _| f64::from(light.eval(Vec4::splat(lambda)).x));
        let got = profile::xyz_from_rec709().inverse() * xyz;
        let asked = DVec3::from_array(rgb.map(f64::from));
        assert!((got - asked).abs().max_element() < 1e-4 * asked.max_element(), "{asked} {got}");
    }
}
