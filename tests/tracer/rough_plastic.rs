//! Rough plastic: values of Mitsuba 3.9.1, its tables, energy, and what a smooth coat is the limit of.

use glam::Vec3;

use pointillist::scene::desc::{Facets, Roughness};
use pointillist::spectrum::SampledSpectrum;
use pointillist::tracer::bsdf::{
    Base, Bsdf, Coat, Microfacet, Plastic, RoughPlastic, ScatteringModel, Transmittance, fresnel,
    internal_reflectance,
};

fn splat(v: f32) -> SampledSpectrum {
    SampledSpectrum::splat(v)
}

fn microfacet(facets: Facets, alpha: f32) -> Microfacet {
    Microfacet::new(Roughness { facets, alpha: [alpha; 2] })
}

/// `colors` = [base, coat].
fn rough_plastic(microfacet: Microfacet, eta: f32, nonlinear: bool, colors: [f32; 2]) -> Bsdf {
    let coat = Coat { eta, microfacet, transmittance: Transmittance::of(&microfacet, eta) };
    let escape = splat(1.0 - internal_reflectance(&microfacet, eta));
    let base = Base { albedo: splat(colors[0]), escape, nonlinear };
    Bsdf::RoughPlastic(RoughPlastic::new(&coat, splat(colors[1]), base, false))
}

fn direction(z: f32, phi: f32) -> Vec3 {
    let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    Vec3::new(r * phi.cos(), r * phi.sin(), z)
}

type Row = (Facets, f32, f32, bool, [f32; 3], f32, f32);

/// Facets, roughness, index, nonlinear, [cos θₒ, cos θᵢ, φ], value and density of Mitsuba 3.9.1's `roughplastic` (scalar_rgb,
/// base 0.6, coat 0.9): `bsdf.eval` and `bsdf.pdf`.
#[rustfmt::skip]
#[allow(clippy::approx_constant, reason = "an angle next to the mirror's")]
const MITSUBA: &[Row] = &[
    (Facets::Beckmann, 0.05, 1.49, true, [0.9, 0.8, 3.0], 0.112415, 0.264349),
    (Facets::Beckmann, 0.05, 1.49, true, [0.4, 0.7, 2.0], 0.0762482, 0.181675),
    (Facets::Beckmann, 0.05, 1.49, true, [0.15, 0.3, 0.5], 0.0180282, 0.0451279),
    (Facets::Beckmann, 0.05, 1.49, true, [0.5, 0.52, 3.141], 4.63836, 7.77333),
    (Facets::Beckmann, 0.05, 1.9, false, [0.9, 0.8, 3.0], 0.1758, 0.277867),
    (Facets::Beckmann, 0.05, 1.9, false, [0.4, 0.7, 2.0], 0.10767, 0.164709),
    (Facets::Beckmann, 0.05, 1.9, false, [0.15, 0.3, 0.5], 0.0255355, 0.0418423),
    (Facets::Beckmann, 0.05, 1.9, false, [0.5, 0.52, 3.141], 7.96177, 12.6554),
    (Facets::Beckmann, 0.1, 1.49, true, [0.9, 0.8, 3.0], 0.204901, 0.413133),
    (Facets::Beckmann, 0.1, 1.49, true, [0.4, 0.7, 2.0], 0.0757564, 0.181356),
    (Facets::Beckmann, 0.1, 1.49, true, [0.15, 0.3, 0.5], 0.0190159, 0.0483903),
    (Facets::Beckmann, 0.1, 1.49, true, [0.5, 0.52, 3.141], 1.24974, 2.15819),
    (Facets::Beckmann, 0.1, 1.9, false, [0.9, 0.8, 3.0], 0.399405, 0.633361),
    (Facets::Beckmann, 0.1, 1.9, false, [0.4, 0.7, 2.0], 0.105643, 0.164508),
    (Facets::Beckmann, 0.1, 1.9, false, [0.15, 0.3, 0.5], 0.0265427, 0.0447009),
    (Facets::Beckmann, 0.1, 1.9, false, [0.5, 0.52, 3.141], 2.13125, 3.41324),
    (Facets::Beckmann, 0.4, 1.49, true, [0.9, 0.8, 3.0], 0.107291, 0.271829),
    (Facets::Beckmann, 0.4, 1.49, true, [0.4, 0.7, 2.0], 0.0722353, 0.193702),
    (Facets::Beckmann, 0.4, 1.49, true, [0.15, 0.3, 0.5], 0.0248393, 0.0698435),
    (Facets::Beckmann, 0.4, 1.49, true, [0.5, 0.52, 3.141], 0.12697, 0.280769),
    (Facets::Beckmann, 0.4, 1.9, false, [0.9, 0.8, 3.0], 0.148712, 0.293991),
    (Facets::Beckmann, 0.4, 1.9, false, [0.4, 0.7, 2.0], 0.085654, 0.181105),
    (Facets::Beckmann, 0.4, 1.9, false, [0.15, 0.3, 0.5], 0.0285193, 0.0637917),
    (Facets::Beckmann, 0.4, 1.9, false, [0.5, 0.52, 3.141], 0.189053, 0.344638),
    (Facets::Ggx, 0.05, 1.49, true, [0.9, 0.8, 3.0], 0.140442, 0.310954),
    (Facets::Ggx, 0.05, 1.49, true, [0.4, 0.7, 2.0], 0.0756318, 0.182248),
    (Facets::Ggx, 0.05, 1.49, true, [0.15, 0.3, 0.5], 0.018958, 0.0488478),
    (Facets::Ggx, 0.05, 1.49, true, [0.5, 0.52, 3.141], 4.39304, 7.45792),
    (Facets::Ggx, 0.05, 1.9, false, [0.9, 0.8, 3.0], 0.241258, 0.388907),
    (Facets::Ggx, 0.05, 1.9, false, [0.4, 0.7, 2.0], 0.104134, 0.165635),
    (Facets::Ggx, 0.05, 1.9, false, [0.15, 0.3, 0.5], 0.0261809, 0.0452984),
    (Facets::Ggx, 0.05, 1.9, false, [0.5, 0.52, 3.141], 7.53785, 12.0552),
    (Facets::Ggx, 0.1, 1.49, true, [0.9, 0.8, 3.0], 0.167449, 0.360802),
    (Facets::Ggx, 0.1, 1.49, true, [0.4, 0.7, 2.0], 0.074168, 0.183821),
    (Facets::Ggx, 0.1, 1.49, true, [0.15, 0.3, 0.5], 0.0207269, 0.0565552),
    (Facets::Ggx, 0.1, 1.49, true, [0.5, 0.52, 3.141], 1.21562, 2.17082),
    (Facets::Ggx, 0.1, 1.9, false, [0.9, 0.8, 3.0], 0.301554, 0.504097),
    (Facets::Ggx, 0.1, 1.9, false, [0.4, 0.7, 2.0], 0.0965087, 0.168169),
    (Facets::Ggx, 0.1, 1.9, false, [0.15, 0.3, 0.5], 0.0270814, 0.0525792),
    (Facets::Ggx, 0.1, 1.9, false, [0.5, 0.52, 3.141], 2.06768, 3.37553),
    (Facets::Ggx, 0.4, 1.49, true, [0.9, 0.8, 3.0], 0.0932377, 0.274797),
    (Facets::Ggx, 0.4, 1.49, true, [0.4, 0.7, 2.0], 0.0625275, 0.197138),
    (Facets::Ggx, 0.4, 1.49, true, [0.15, 0.3, 0.5], 0.0197164, 0.0778874),
    (Facets::Ggx, 0.4, 1.49, true, [0.5, 0.52, 3.141], 0.104687, 0.30113),
    (Facets::Ggx, 0.4, 1.9, false, [0.9, 0.8, 3.0], 0.108749, 0.293723),
    (Facets::Ggx, 0.4, 1.9, false, [0.4, 0.7, 2.0], 0.0613366, 0.190623),
    (Facets::Ggx, 0.4, 1.9, false, [0.15, 0.3, 0.5], 0.02013, 0.0767752),
    (Facets::Ggx, 0.4, 1.9, false, [0.5, 0.52, 3.141], 0.144262, 0.34883),
];

/// Mitsuba's tables are linear between 64 cosines, its quadrature has 32² points, and its masking of Beckmann is a fit within
/// 0.35 %; a base is seen and lit through the coat, so that either counts twice.
#[test]
fn values_of_mitsuba() {
    for &(facets, alpha, eta, nonlinear, [z_o, z_i, phi], value, density) in MITSUBA {
        let bsdf = rough_plastic(microfacet(facets, alpha), eta, nonlinear, [0.6, 0.9]);
        let (f, pdf) = bsdf.eval(direction(z_o, 0.0), direction(z_i, phi)).expect("both above");
        let off = [f.0.x / value - 1.0, pdf.0 / density - 1.0];
        let what = format!("{facets:?} {alpha} {eta} {nonlinear} {z_o} {z_i} {phi}: off by {off:?}");
        let within = [5e-3, 3e-3];
        assert!(off[0].abs() < within[0] && off[1].abs() < within[1], "{what}");
    }
}

/// The table of what a coat lets through is the mean over many more of its visible normals.
#[test]
fn transmittance_is_the_integral() {
    for facets in [Facets::Beckmann, Facets::Ggx] {
        for alpha in [1e-3, 0.01, 0.1, 0.4, 1.0] {
            for eta in [1.3, 2.0] {
                let microfacet = microfacet(facets, alpha);
                let table = Transmittance::of(&microfacet, eta);
                for cos in [1.0, 0.83, 0.5, 0.31, 0.12, 0.03] {
                    let wo = direction(cos, 0.0);
                    let (n, mut sum) = (256, 0.0);
                    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                        let m = microfacet.sample_visible(wo, [i, j].map(|k| (k as f32 + 0.5) / n as f32));
                        let c = wo.dot(m).clamp(0.0, 1.0);
                        let through = (1.0 - (1.0 - c * c) / (eta * eta)).max(0.0).sqrt();
                        let wi = (m * (c / eta - through) - wo / eta).normalize();
                        let f = fresnel::dielectric(c, glam::Vec4::splat(eta)).x;
                        sum += if wi.z < 0.0 { f64::from((1.0 - f) * microfacet.g1(wi)) } else { 0.0 };
                    }
                    let off = f64::from(table.at(cos)) - sum / f64::from(n * n);
                    let within = if cos < 0.1 { 6e-3 } else { 2e-3 };
                    assert!(off.abs() < within, "{facets:?} {alpha} {eta} {cos}: {off}");
                }
            }
        }
    }
}

/// The smoother the coat, the more it is that of `plastic`, whose base is seen in full: within what Mitsuba's sum of the
/// light within the coat differs from the integral.
#[test]
fn smooth_limit() {
    for eta in [1.3, 1.49, 1.9] {
        let rough = rough_plastic(microfacet(Facets::Ggx, 1e-4), eta, true, [0.6, 0.0]);
        let base = Base { albedo: splat(0.6), escape: splat(fresnel::diffuse_escape(eta)), nonlinear: true };
        let smooth = Bsdf::Plastic(Plastic::new([splat(eta), splat(1.0)], splat(0.0), base, false));
        for (z_o, z_i) in [(1.0, 1.0), (0.8, 0.4), (0.5, 0.9), (0.3, 0.3)] {
            let [a, b] = [rough, smooth].map(|b| b.eval(direction(z_o, 0.0), direction(z_i, 2.0)));
            let (a, b) = (a.expect("above").0.0.x, b.expect("above").0.0.x);
            assert!((a / b - 1.0).abs() < 0.02, "{eta} {z_o} {z_i}: {a} {b}");
        }
    }
}
