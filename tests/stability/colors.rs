//! Colours: from RGB to spectra and back, and paths of four wavelengths where colours hardly part.

use glam::{DVec3, Vec4};

use pointillist::color::{cie, profile};
use pointillist::scene::desc::{Facets, Roughness};
use pointillist::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};
use pointillist::tracer::bsdf::{Bsdf, Dielectric, Microfacet, RoughDielectric, ScatteringModel};

use crate::Row;

/// CIELAB of XYZ relative to white; written independently of the program's fit.
fn lab(xyz: DVec3) -> DVec3 {
    let f = |v: f64| if v > 216.0 / 24389.0 { v.cbrt() } else { (24389.0 / 27.0 * v + 16.0) / 116.0 };
    DVec3::new(116.0 * f(xyz.y) - 16.0, 500.0 * (f(xyz.x) - f(xyz.y)), 200.0 * (f(xyz.y) - f(xyz.z)))
}

/// sRGB decoding (IEC 61966-2-1), so that a grid is even to the eye.
fn linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// ΔE*ab under D65 between linear Rec.709 and a reflectance made of it; infinite where the reflectance leaves [0, 1].
fn round_trip(rgb: DVec3, reflectance: impl Fn(f32) -> f32) -> f64 {
    let bounded = (0..=470).map(|i| reflectance(360.0 + i as f32)).all(|v| (0.0..=1.0).contains(&v));
    let seen = cie::integrate(|lambda, row| f64::from(reflectance(lambda) * row.w)) / cie::d65_white();
    let asked = profile::xyz_from_rec709() * rgb / cie::d65_white();
    if bounded { (lab(seen) - lab(asked)).length() } else { f64::INFINITY }
}

/// The whole cube of sRGB, its faces and corners, white and next to black: a surface looks as its colour says, and reflects no more than
/// arrives. ΔE*ab = .01 is a hundredth of what anybody sees; the fit stops at 1e-4, and the rest is single precision.
#[test]
fn n20_rgb_to_spectrum_and_back() {
    let even: Vec<f64> = (0..=10).map(|i| linear(f64::from(i) / 10.0)).collect();
    let edges = vec![0.0, 1e-7, 1e-4, 0.01, 0.5, 0.99, 0.9999, 1.0];
    for (case, levels) in [("the cube of sRGB, 11³ colours", even), ("its faces and corners", edges)] {
        let (mut worst, mut worst_naive) = (0f64, 0f64);
        for &r in &levels {
            for (&g, &b) in levels.iter().flat_map(|g| levels.iter().map(move |b| (g, b))) {
                let rgb = DVec3::new(r, g, b);
                let spectrum = Spectrum::reflectance_rgb(rgb.as_vec3().to_array());
                worst = worst.max(round_trip(rgb, |lambda| spectrum.eval(Vec4::splat(lambda)).x));
                let bands = |lambda: f32| match lambda {
                    ..490.0 => b as f32,
                    490.0..580.0 => g as f32,
                    _ => r as f32,
                };
                worst_naive = worst_naive.max(round_trip(rgb, bands));
            }
        }
        Row {
            case: &format!("N20 RGB to spectrum and back, {case}"),
            measure: "largest ΔE*ab",
            figure: worst,
            naive: ("a band for each of red, green and blue", worst_naive),
            bound: 0.01,
        }
        .check();
    }
}

/// Glass whose index grows by `dispersion` over the visible wavelengths, and its index.
fn glass(lambda: &SampledWavelengths, dispersion: f32, alpha: Option<f32>) -> (Bsdf, Vec4) {
    let eta = Vec4::splat(1.5) + (lambda.lambda() - 580.0) * (dispersion / 400.0);
    let one = SampledSpectrum::ONE;
    let smooth = Dielectric::new([SampledSpectrum(eta), one], [one, one]);
    let rough = |alpha: f32| {
        let facets = Microfacet::new(Roughness { facets: Facets::Ggx, alpha: [alpha; 2] });
        RoughDielectric::new(smooth, &facets).map(Bsdf::RoughDielectric)
    };
    (alpha.and_then(rough).unwrap_or(smooth.into()), eta)
}

/// XYZ of what goes through glass with white all around, over that of white: all that is not reflected. With `keep` what a delta leaves of
/// the hero wavelength counts four times, as it must.
fn through(dispersion: f32, alpha: Option<f32>, keep: bool) -> DVec3 {
    const PATHS: u32 = 1 << 16;
    let white = cie::integrate(|_, _| 1.0);
    let wo = super::bsdf::direction(50.0);
    let mut sum = DVec3::ZERO;
    for i in 0..PATHS {
        let [u, v, wavelength] = super::bsdf::lattice(i, PATHS);
        let lobe = (f64::from(i) * std::f64::consts::SQRT_2).fract();
        let mut lambda = SampledWavelengths::sample(wavelength as f32);
        let (bsdf, eta) = glass(&lambda, dispersion, alpha);
        let Some(s) = bsdf.sample(wo, [u as f32, v as f32], lobe as f32).filter(|s| s.transmitted) else {
            continue;
        };
        let mut value = SampledSpectrum(s.weight.0 * eta * eta);
        if s.hero_only {
            match keep {
                true => lambda.terminate_companions(),
                false => value = SampledSpectrum(value.0 * Vec4::X),
            }
        } else if bsdf.is_dispersive() {
            value *= bsdf.dispersion(wo, s.wi).wavelength_mis.weight();
        }
        let xyz = lambda.to_xyz(value);
        sum += DVec3::new(xyz.x.into(), xyz.y.into(), xyz.z.into());
    }
    sum / f64::from(PATHS) / white
}

/// As dispersion goes to nothing glass stays as neutral as glass that has none, smooth (where the hero goes on alone from the first
/// difference in the last place) and rough (where wavelengths share their directions). ΔE*ab below .1 cannot be seen; what is
/// left is the lattice's.
#[test]
fn n19_neutral_glass() {
    let off = |alpha: Option<f32>, keep: bool| {
        let neutral = lab(through(0.0, alpha, true));
        let dispersions = [1e-8, 3e-7, 5e-7, 1e-6, 1e-5, 1e-4, 1e-3];
        dispersions.map(|d| (lab(through(d, alpha, keep)) - neutral).length()).into_iter().fold(0.0, f64::max)
    };
    let all = [None, Some(0.1), Some(1e-3)];
    Row {
        case: "N19 glass as dispersion goes to 0, smooth and of roughness .1 and .001",
        measure: "largest ΔE*ab to glass without",
        figure: all.map(|alpha| off(alpha, true)).into_iter().fold(0.0, f64::max),
        naive: ("smooth, companions dropped, densities kept", off(None, false)),
        bound: 0.1,
    }
    .check();
}
