//! Tests of `spectrum::blackbody`.

use std::f64::consts::PI;

use glam::Vec4;
use pointillist::spectrum::Spectrum;
use pointillist::spectrum::blackbody::*;

/// The law of Stefan and Boltzmann: ∫ L dλ = σ T⁴ / π. And Wien's: the brightest wavelength times T is 2.897 772 mm K.
#[test]
fn black_bodies_emit_what_the_laws_say() {
    for kelvin in [300.0f64, 1900.0, 6500.0, 1e6] {
        let (start, ratio) = (2e5 / kelvin, 1.0005f64);
        let nm = |i: i32| start * ratio.powi(i);
        let total: f64 = (0..19_000).map(|i| radiance(nm(i), kelvin) * nm(i) * ratio.ln()).sum();
        let expected = 5.670_374_419e-8 * kelvin.powi(4) / PI;
        // Below a fourteenth of the brightest wavelength and above 900 times that there is nothing that counts.
        assert!((total / expected - 1.0).abs() < 1e-5, "{kelvin} K: {total}, not {expected}");
        let brightest = 2.897_771_955e6 / kelvin;
        let [below, at, above] = [0.99, 1.0, 1.01].map(|share| radiance(brightest * share, kelvin));
        assert!(at > below && at > above, "{kelvin} K: {below} {at} {above}");
    }
}

#[test]
fn four_lanes_are_as_exact_as_one() {
    for kelvin in [500.0f32, 900.0, 1300.0, 1900.0, 2100.5, 5000.0, 1e5, 1e7, 1e9] {
        for lambda in [Vec4::new(380.0, 450.5, 555.0, 780.0), Vec4::new(633.0, 400.25, 500.0, 700.0)] {
            let found = radiance_at(lambda, kelvin).to_array();
            for (nm, found) in lambda.to_array().into_iter().zip(found) {
                let expected = radiance(nm.into(), kelvin.into());
                // An exponent has the rounding of a few operations, and what it is the exponent of has as many times that.
                let exponent = 1.438_776_877e7 / f64::from(nm * kelvin);
                let within = (6.0 + 3.0 * exponent) * f64::from(f32::EPSILON);
                let off = (f64::from(found) / expected - 1.0).abs();
                assert!(off < within, "{kelvin} K at {nm} nm: {found}, not {expected}");
            }
        }
    }
    for dark in [0.0, -0.0, -300.0, 1e-40, 1.0, f32::NAN, f32::NEG_INFINITY] {
        assert_eq!(radiance_at(Vec4::splat(550.0), dark), Vec4::ZERO, "{dark} K");
    }
}

#[test]
fn colors_are_those_of_the_spectra() {
    let color = colors(2500.0);
    for kelvin in [400.0f32, 803.0, 1299.0, 1750.3, 2100.0, 2500.0] {
        let points: Vec<(f32, f32)> =
            (360..=830).map(|nm| (nm as f32, radiance(f64::from(nm), kelvin.into()) as f32)).collect();
        let expected = Spectrum::table(&points).unwrap().emitted_rgb().map(|v| v.max(0.0));
        let most = expected.into_iter().fold(0.0, f32::max);
        let found = color(kelvin);
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() <= 1e-3 * most, "{kelvin} K: {found}, not {expected}");
        }
        assert!(found[0] > 0.0 && found[0] >= found[1] && found[1] >= found[2], "{kelvin} K: {found:?}");
    }
    for dark in [0.0, -1.0, 99.0, f32::NAN] {
        assert_eq!(color(dark), [0.0; 3]);
    }
    // What is above the hottest is as that.
    assert_eq!(color(1e6), color(2500.0));
    // A table up to the hottest of all is finite, and blue at its end.
    let hot = colors(HOTTEST as f32)(HOTTEST as f32);
    assert!(hot[2] > hot[0] && hot.into_iter().all(f32::is_finite), "{hot:?}");
}
