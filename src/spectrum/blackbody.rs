//! The light of a hot black body.

use super::{LAMBDA_MAX, LAMBDA_MIN, Spectrum};

/// First radiation constant for radiance, 2hc², in W nm⁴ / m² / sr (CODATA 2018, exact), for wavelengths in nm.
const C1: f64 = 1.191_042_972e20;

/// Second radiation constant hc/k, in nm K (CODATA 2018, exact).
const C2: f64 = 1.438_776_877e7;

/// Planck's law: spectral radiance in W / m² / sr / nm of a body at `kelvin`, at `lambda` nm, in vacuum.
pub fn radiance(kelvin: f64, lambda: f64) -> f64 {
    C1 / (lambda.powi(5) * (C2 / (lambda * kelvin)).exp_m1())
}

/// The spectrum of a black body at `kelvin` times `scale`, in the units of [`radiance`] (as Mitsuba's `blackbody`).
/// `None` unless the temperature is positive and finite, the scale not negative, and the product finite.
pub fn spectrum(kelvin: f32, scale: f32) -> Option<Spectrum> {
    let hot = kelvin.is_finite() && kelvin > 0.0;
    // Pieces of 1 nm: below 0.1 % from the curve down to 1000 K.
    let steps = (LAMBDA_MAX - LAMBDA_MIN) as usize;
    let at = |i: usize| LAMBDA_MIN + i as f32;
    let value = |lambda: f32| (radiance(f64::from(kelvin), f64::from(lambda)) * f64::from(scale)) as f32;
    let points: Vec<(f32, f32)> = (0..=steps).map(|i| (at(i), value(at(i)))).collect();
    if hot { Spectrum::table(&points) } else { None }
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;
    use crate::color::cie;

    #[test]
    fn obeys_wien_and_stefan_boltzmann() {
        // Peak at 2897771.955 nm K / T; the integral is σ T⁴ / π with σ = 5.670374419e-8 W / m² / K⁴.
        let kelvin = 5000.0;
        let peak = 2_897_771.955 / kelvin;
        assert!(radiance(kelvin, peak) > radiance(kelvin, peak - 2.0));
        assert!(radiance(kelvin, peak) > radiance(kelvin, peak + 2.0));
        let total: f64 = (20..200_000).map(|i| radiance(kelvin, f64::from(i) + 0.5)).sum();
        let law = 5.670374419e-8 * kelvin.powi(4) / std::f64::consts::PI;
        assert!((total / law - 1.0).abs() < 1e-4, "{total} {law}");
    }

    #[test]
    fn has_the_chromaticity_of_the_cie() {
        // Illuminant A is Planck's law at 2856 K (2855.54 K with today's constants): x = 0.44758, y = 0.40745.
        let light = spectrum(2855.54, 1.0).expect("a temperature");
        let xyz = cie::integrate(|lambda, _| f64::from(light.eval(Vec4::splat(lambda)).x));
        let (x, y) = (xyz.x / xyz.element_sum(), xyz.y / xyz.element_sum());
        assert!((x - 0.44758).abs() < 5e-5 && (y - 0.40745).abs() < 5e-5, "{x} {y}");
    }

    #[test]
    fn table_is_close_to_the_law_and_nonsense_is_none() {
        let light = spectrum(1000.0, 1.0).expect("a temperature");
        for i in 0..4700 {
            let lambda = 360.05 + 0.1 * i as f32;
            let exact = radiance(1000.0, f64::from(lambda)) as f32;
            let got = light.eval(Vec4::splat(lambda)).x;
            assert!((got / exact - 1.0).abs() < 2e-3, "{lambda}: {got} {exact}");
        }
        for (kelvin, scale) in
            [(0.0, 1.0), (-5.0, 1.0), (f32::NAN, 1.0), (f32::INFINITY, 1.0), (5000.0, -1.0)]
        {
            assert_eq!(spectrum(kelvin, scale), None, "{kelvin} {scale}");
        }
        assert!(spectrum(1e-30, 1.0).expect("cold, but not nonsense").is_black());
        assert_eq!(spectrum(1e30, 1e38), None);
    }
}
