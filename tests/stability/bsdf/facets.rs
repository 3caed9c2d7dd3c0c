//! Distributions of facets at extreme roughness, anisotropy, angles and random numbers.

use std::f32::consts::TAU;

use glam::Vec3;

use pointillist::math::random::Random;
use pointillist::scene::desc::{Facets, Roughness};
use pointillist::tracer::bsdf::Microfacet;

use crate::Row;

const ALPHAS: [[f32; 2]; 8] = [
    [1e-6, 1e-6],
    [1e-4, 1e-4],
    [1e-2, 1e-2],
    [1.0, 1.0],
    [1e-3, 1.0],
    [1.0, 1e-3],
    [1e-4, 10.0],
    [100.0, 100.0],
];

/// A facet is a unit normal on the side of the view, and the weight of a mirror of such facets is finite and at most 1.
fn is_good(m: Vec3, wo: Vec3, weight: f32) -> bool {
    let unit = (m.length() - 1.0).abs() < 1e-5 && m.z >= 0.0 && wo.dot(m) > -1e-6;
    unit && (0.0..=1.0 + 1e-6).contains(&weight)
}

/// Normals chosen by D·cos θ, weighted by ⟨wo, m⟩ G / (cos θₒ cos θₘ) with Smith's G₁ in tan θ (Walter et al. 2007, equations 33 to 36, 41).
fn by_normals(alpha: [f32; 2], wo: Vec3, u: [f32; 2]) -> (Vec3, f32) {
    let tan = (u[0] / (1.0 - u[0])).sqrt();
    let (sin, cos) = (TAU * u[1]).sin_cos();
    let m = Vec3::new(alpha[0] * tan * cos, alpha[1] * tan * sin, 1.0).normalize();
    let g1 = |v: Vec3| {
        let across = (alpha[0] * v.x / v.z).powi(2) + (alpha[1] * v.y / v.z).powi(2);
        2.0 / (1.0 + (1.0 + across).sqrt())
    };
    let wi = m * (2.0 * wo.dot(m)) - wo;
    let lit = wo.dot(m) > 0.0 && wi.z > 0.0;
    (m, if lit || m.is_nan() { wo.dot(m) * g1(wo) * g1(wi) / (wo.z * m.z) } else { 0.0 })
}

/// Views from above to 1e-20 over the horizon × all corners of the random numbers and 200 numbers within: no sample is lost to rounding,
/// none counts more than once.
#[test]
fn n9_facets_at_their_ends() {
    let last = 1.0 - f32::EPSILON / 2.0;
    let mut random = Random(9);
    let (mut bad, mut bad_naive, mut count) = (0u32, 0u32, 0u32);
    for alpha in ALPHAS {
        for z in [1.0f32, 0.999, 0.8, 0.3, 0.05, 1e-3, 1e-6, 1e-20] {
            let r = ((1.0 - z) * (1.0 + z)).sqrt();
            let wo = Vec3::new(r * 0.3f32.cos(), r * 0.3f32.sin(), z);
            let corners = [[0.0, 0.0], [0.0, last], [last, 0.0], [last, last], [0.5, last], [last, 0.5]];
            let within: Vec<_> = (0..200).map(|_| [random.f32(), random.f32()]).collect();
            for u in corners.into_iter().chain(within) {
                for facets in [Facets::Ggx, Facets::Beckmann] {
                    let microfacet = Microfacet::new(Roughness { facets, alpha });
                    let m = microfacet.sample_visible(wo, u);
                    let wi = m * (2.0 * wo.dot(m)) - wo;
                    let weight = if wi.z > 0.0 { microfacet.g1(wi) } else { 0.0 };
                    let density = microfacet.d(m) / microfacet.cross_section(wo);
                    bad += u32::from(!is_good(m, wo, weight) || !density.is_finite());
                }
                let (m, weight) = by_normals(alpha, wo, u);
                // A normal that faces away is no mistake of this method; it only wastes the sample.
                bad_naive += u32::from(
                    !is_good(if wo.dot(m) < 0.0 { -m.with_z(-m.z) } else { m }, wo, weight)
                        && (wo.dot(m) >= 0.0 || wo.dot(m).is_nan()),
                );
                count += 1;
            }
        }
    }
    Row {
        case: "N9 GGX and Beckmann, α 1e-6 to 100, anisotropy to 1e5, cosines to 1e-20, numbers to 1 − 2⁻²⁴",
        measure: "share of facets that are not on the side of the view, or weigh more than 1",
        figure: f64::from(bad) / f64::from(2 * count),
        naive: ("GGX by D cos θ, G₁ by tan θ", f64::from(bad_naive) / f64::from(count)),
        bound: 0.0,
    }
    .check();
}

/// Smirnov's distance of slopes over α from the distribution that they have seen along the normal: x / (2√(1 + x²)) + ½ of GGX, (1 + erf
/// x) / 2 of Beckmann, along the smooth axis and the rough one. The bound is the 1 − 1e-5 quantile of Kolmogorov's distribution for four
/// tests, 2.65 / √n.
#[test]
fn n9_slopes_of_brushed_facets() {
    const SAMPLES: usize = 100_000;
    let mut random = Random(99);
    let (mut worst, mut worst_naive) = (0f64, 0f64);
    for facets in [Facets::Ggx, Facets::Beckmann] {
        let cdf = |x: f64| match facets {
            Facets::Ggx => 0.5 + 0.5 * x / (1.0 + x * x).sqrt(),
            Facets::Beckmann => 0.5 + 0.5 * f64::from(pointillist::math::erf::erf(x as f32)),
        };
        let distance = |mut slopes: Vec<f64>| {
            slopes.sort_by(f64::total_cmp);
            let n = slopes.len() as f64;
            let off = |(i, x): (usize, &f64)| {
                (cdf(*x) - i as f64 / n).abs().max((cdf(*x) - (i + 1) as f64 / n).abs())
            };
            slopes.iter().enumerate().map(off).fold(0.0, f64::max) * n.sqrt()
        };
        let alpha = [1e-3f32, 1.0];
        let microfacet = Microfacet::new(Roughness { facets, alpha });
        // Normals of a distribution of one α, the mean, stretched afterwards as vectors.
        let round = Microfacet::new(Roughness { facets, alpha: [(alpha[0] * alpha[1]).sqrt(); 2] });
        let (mut slopes, mut naive) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
        for _ in 0..SAMPLES {
            let u = [random.f32(), random.f32()];
            let (m, n) = (microfacet.sample_visible(Vec3::Z, u), round.sample_visible(Vec3::Z, u));
            for axis in 0..2 {
                slopes[axis].push(f64::from(m[axis] / m.z) / f64::from(alpha[axis]));
                naive[axis].push(f64::from(n[axis] / n.z) / f64::from(alpha[axis]));
            }
        }
        worst = slopes.map(distance).into_iter().fold(worst, f64::max);
        worst_naive = naive.map(distance).into_iter().fold(worst_naive, f64::max);
    }
    Row {
        case: "N9 GGX and Beckmann, roughness 1e-3 and 1 along the two tangents",
        measure: "Smirnov's statistic of the slopes, the largest of four",
        figure: worst,
        naive: ("one α, the geometric mean", worst_naive),
        bound: 2.65,
    }
    .check();
}
