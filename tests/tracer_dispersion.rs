//! Dispersion: rough and smooth glass at four wavelengths, all methods against each other, and its limits.

#[path = "support/agreement.rs"]
mod agreement;
mod tracer_support;

use std::f64::consts::PI;

use glam::{DAffine3, DVec3, Vec3, Vec4};

use agreement::{Method, Plan, compare};
use pointillist::scene::desc::*;
use pointillist::spectrum::{SampledSpectrum, Spectrum, dispersion::Ior};
use pointillist::stream::UvWindow;
use pointillist::tracer::bsdf::{Bsdf, Microfacet, RoughDielectric};
use tracer_support::*;

const ETA: [f32; 4] = [1.50, 1.53, 1.57, 1.62];

fn glass_at(eta: [f32; 4], alpha: f32) -> Bsdf {
    let one = SampledSpectrum::ONE;
    let microfacet = Microfacet::new(Roughness { facets: Facets::Ggx, alpha: [alpha; 2] });
    let eta = [SampledSpectrum(Vec4::from_array(eta)), one];
    Bsdf::RoughDielectric(RoughDielectric::new(eta, [one, one], microfacet).expect("glass"))
}

fn turned(eta: [f32; 4], by: usize) -> [f32; 4] {
    std::array::from_fn(|i| eta[(i + by) % 4])
}

fn direction(z: f32, phi: f32) -> Vec3 {
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * phi.cos(), r * phi.sin(), z)
}

/// Over the heroes, each lane's value with its weight is the value of glass of that index alone: light that a light
/// source brings is neither lost nor counted twice. The weights are the same from both ends.
#[test]
fn values_over_all_heroes_are_those_of_each_wavelength() {
    for alpha in [0.02, 0.1, 0.5] {
        let mut compared = 0;
        for (z, w) in [(0.8, 0.9), (0.95, 0.6), (-0.85, 0.7), (-0.9, 0.95), (0.3, 0.9)] {
            for phi in [3.0, 3.14, 2.5] {
                let (wo, wi) = (direction(z, 0.0), direction(-w * f32::signum(z), phi));
                let mut sum = [0.0; 4];
                for hero in 0..4 {
                    let bsdf = glass_at(turned(ETA, hero), alpha);
                    let [here, back] = [(wo, wi), (wi, wo)].map(|(a, b)| bsdf.part(a, b).heroes.weight());
                    assert!((here / back - 1.0).abs() < 1e-3, "{here} {back}");
                    let Some((value, _)) = bsdf.eval(wo, wi) else { continue };
                    for lane in 0..4 {
                        sum[(lane + hero) % 4] += 0.25 * value.0[lane] * here;
                    }
                }
                for lane in 0..4 {
                    let alone = glass_at([ETA[lane]; 4], alpha).eval(wo, wi).map_or(0.0, |(v, _)| v.0.x);
                    assert!(
                        (sum[lane] - alone).abs() <= 2e-3 * alone + 1e-6,
                        "{alpha} {z} {w}: {sum:?} {alone}"
                    );
                    compared += usize::from(alone > 1e-3);
                }
            }
        }
        assert!(compared > 12, "{alpha}: {compared}");
    }
}

/// Samples with their weights over densities: weight · density is the value, for all lanes, and no lane of a sample counts
/// more than the four that it stands for.
#[test]
fn samples_are_the_values() {
    let mut random = Random(5);
    for alpha in [1e-4, 0.02, 0.3] {
        let mut parted = 0;
        for i in 0..20_000 {
            let bsdf = glass_at(turned(ETA, i % 4), alpha);
            let wo = direction(random.unit() * 2.0 - 1.0, 0.3);
            let Some(s) = bsdf.sample(wo, [random.unit(), random.unit()], random.unit()) else { continue };
            assert!(!s.hero_only && s.weight.is_finite());
            let counts = bsdf.part(wo, s.wi).heroes.weight();
            assert!((1.0..=4.0).contains(&counts), "{counts}");
            parted += usize::from(s.transmitted && counts > 1.01);
            // Four times what the hero counts alone: 4 at most, where all others are totally reflected.
            assert!((s.weight.0 * counts * s.eta2).max_element() < 16.1, "{:?} {counts}", s.weight);
            if alpha < 0.01 {
                continue;
            }
            let (value, pdf) = bsdf.eval(wo, s.wi).expect("it was sampled");
            let off = (value.0 / pdf.0 - s.weight.0).abs().max_element();
            assert!(off < 0.01 * s.weight.max_element().max(0.1), "{alpha}: {value:?} {pdf:?} {s:?}");
        }
        assert!(parted > 5_000, "{alpha}: {parted}");
    }
}
