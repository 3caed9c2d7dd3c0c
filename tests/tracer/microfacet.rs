//! Distributions of facet normals: normalisation, masking, sampling against density, hard cases.

use glam::Vec3;

use crate::support::scenes::{Random, assert_counts};
use pointillist::scene::desc::{Facets, Roughness};
use pointillist::tracer::bsdf::Microfacet;

const FACETS: [Facets; 2] = [Facets::Beckmann, Facets::Ggx];
const ALPHAS: [[f32; 2]; 7] =
    [[1e-4, 1e-4], [1e-3, 1e-3], [0.05, 0.05], [0.4, 0.4], [1.0, 1.0], [3.0, 3.0], [1e-3, 1.0]];

/// Directions from above to grazing.
fn views() -> Vec<Vec3> {
    let at = |z: f32, phi: f32| {
        let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    };
    [1.0, 0.999, 0.8, 0.3, 0.05, 1e-3, 1e-6, 1e-20].iter().flat_map(|&z| [at(z, 0.3), at(z, 2.9)]).collect()
}

/// A normal with slopes `(x, y)` in units of the roughness, and its Jacobian dm / d(x, y).
fn normal(alpha: [f32; 2], x: f64, y: f64) -> (Vec3, f64) {
    let (sx, sy) = (x * f64::from(alpha[0]), y * f64::from(alpha[1]));
    let z = 1.0 / (1.0 + sx * sx + sy * sy).sqrt();
    let m = Vec3::new((-sx * z) as f32, (-sy * z) as f32, z as f32);
    (m, z.powi(3) * f64::from(alpha[0]) * f64::from(alpha[1]))
}

const RADII: usize = 12;
const TURNS: usize = 16;

/// The cells of the plane of slopes: rings of t = r²/(1 + r²), and turns. Calls `f` with points in each cell and
/// their area.
fn for_each_point(mut f: impl FnMut(usize, f64, f64, f64)) {
    const FINE: usize = 24;
    for i in 0..RADII * FINE {
        let t = (i as f64 + 0.5) / (RADII * FINE) as f64;
        let r = (t / (1.0 - t)).sqrt();
        // r dr = dt / (2 (1 − t)²)
        let area = std::f64::consts::TAU / (TURNS * FINE * RADII * FINE) as f64 / (2.0 * (1.0 - t).powi(2));
        for j in 0..TURNS * FINE {
            let phi = std::f64::consts::TAU * (j as f64 + 0.5) / (TURNS * FINE) as f64;
            f(i / FINE * TURNS + j / FINE, r * phi.cos(), r * phi.sin(), area);
        }
    }
}

fn cell(alpha: [f32; 2], m: Vec3) -> usize {
    let slope = |v: f32, a: f32| f64::from(-v) / (f64::from(m.z) * f64::from(a));
    let (x, y) = (slope(m.x, alpha[0]), slope(m.y, alpha[1]));
    let r2 = x * x + y * y;
    let ring = ((r2 / (1.0 + r2) * RADII as f64) as usize).min(RADII - 1);
    let turn = (y.atan2(x) / std::f64::consts::TAU).rem_euclid(1.0);
    ring * TURNS + ((turn * TURNS as f64) as usize).min(TURNS - 1)
}

/// Integral over the plane of slopes of `f`, times D: in polar coordinates with r = tan ψ, where what the long tail of GGX makes
/// of a slope, r / (1 + r²)² r dr, is the smooth 2 sin² ψ dψ up to the horizon. Midpoints: the error is that of the kink where
/// facets turn away, of the order of the cells' squared size, 3e-5.
fn over_facets(microfacet: &Microfacet, alpha: [f32; 2], f: impl Fn(Vec3) -> f64) -> f64 {
    const ROWS: usize = 288;
    const COLUMNS: usize = 384;
    let mut sum = 0.0;
    for i in 0..ROWS {
        let psi = std::f64::consts::FRAC_PI_2 * (i as f64 + 0.5) / ROWS as f64;
        let r = psi.tan();
        let area = r / psi.cos().powi(2) * std::f64::consts::FRAC_PI_2 / ROWS as f64 * std::f64::consts::TAU
            / COLUMNS as f64;
        for j in 0..COLUMNS {
            let phi = std::f64::consts::TAU * (j as f64 + 0.5) / COLUMNS as f64;
            let (m, jacobian) = normal(alpha, r * phi.cos(), r * phi.sin());
            sum += f64::from(microfacet.d(m)) * f(m) * jacobian * area;
        }
    }
    sum
}

/// The error of single precision and of the quadrature; measured: 6e-6.
const EXACT: f64 = 3e-5;

#[test]
fn projected_area_of_the_facets_is_that_of_the_surface() {
    for facets in FACETS {
        for alpha in ALPHAS {
            let microfacet = Microfacet::new(Roughness { facets, alpha });
            let sum = over_facets(&microfacet, alpha, |m| f64::from(m.z));
            assert!((sum - 1.0).abs() < EXACT, "{facets:?} {alpha:?}: {sum}");
        }
    }
}

/// σ(v) is the integral that defines it.
#[test]
fn cross_section_is_what_is_seen_of_the_facets() {
    for facets in FACETS {
        for alpha in ALPHAS {
            let microfacet = Microfacet::new(Roughness { facets, alpha });
            for v in views() {
                let sum = over_facets(&microfacet, alpha, |m| m.as_dvec3().dot(v.as_dvec3()).max(0.0));
                let sigma = f64::from(microfacet.cross_section(v));
                assert!((sum / sigma - 1.0).abs() < EXACT, "{facets:?} {alpha:?} {v}: {sum} {sigma}");
                assert!(microfacet.g1(v) >= 0.0 && microfacet.g1(v) <= 1.0 + 1e-6);
            }
        }
    }
}

/// Pearson's χ² in the plane of slopes, where every roughness is equally hard.
#[test]
fn visible_normals_are_chosen_by_their_density() {
    let n = 40_000u32;
    for facets in FACETS {
        for alpha in ALPHAS {
            let microfacet = Microfacet::new(Roughness { facets, alpha });
            for (seed, wo) in views().into_iter().enumerate() {
                let mut expected = vec![0.0; RADII * TURNS];
                for_each_point(|cell, x, y, area| {
                    let (m, jacobian) = normal(alpha, x, y);
                    let seen = m.as_dvec3().dot(wo.as_dvec3()).max(0.0);
                    let density = f64::from(microfacet.d(m)) / f64::from(microfacet.cross_section(wo)) * seen;
                    expected[cell] += f64::from(n) * density * jacobian * area;
                });
                let mut random = Random(seed as u64 + 1);
                let mut counts = vec![0; RADII * TURNS];
                for _ in 0..n {
                    let m = microfacet.sample_visible(wo, [random.f32(), random.f32()]);
                    assert!((m.length() - 1.0).abs() < 1e-5 && m.z >= 0.0, "{facets:?} {alpha:?} {wo}: {m}");
                    counts[cell(alpha, m)] += 1;
                }
                assert_counts(&counts, &expected, 0.01, &format!("{facets:?} {alpha:?} {wo}"));
            }
        }
    }
}

/// Corners of the unit square and everything at its extreme: finite, unit length, facing the view.
#[test]
fn extremes_stay_finite() {
    let edge = 1.0 - 1.0 / 16_777_216.0;
    let numbers = [0.0, 1.0 / 16_777_216.0, 1e-3, 0.5, 0.999, edge];
    for facets in FACETS {
        for alpha in [1e-12f32, 1e-4, 1e-2, 1.0, 10.0, 1e4] {
            for alpha in [[alpha, alpha], [alpha, 1.0]] {
                let microfacet = Microfacet::new(Roughness { facets, alpha });
                for wo in views() {
                    let sigma = microfacet.cross_section(wo);
                    assert!(sigma > 0.0 && sigma.is_finite(), "{facets:?} {alpha:?} {wo}: σ = {sigma}");
                    for u in numbers.iter().flat_map(|&a| numbers.map(|b| [a, b])) {
                        let m = microfacet.sample_visible(wo, u);
                        let d = microfacet.d(m) / sigma;
                        assert!(
                            m.is_finite() && (m.length() - 1.0).abs() < 1e-5,
                            "{facets:?} {alpha:?} {wo}: {m}"
                        );
                        assert!(
                            d == 0.0 || m.dot(wo) > -1e-4,
                            "{facets:?} {alpha:?} {wo} {u:?}: {m} faces away"
                        );
                        assert!(d.is_finite() && d >= 0.0, "{facets:?} {alpha:?} {wo}: D/σ = {d}");
                    }
                }
                for z in [0.0, 1e-30, 1e-10, 1e-3, -0.5] {
                    let d = microfacet.d(Vec3::new(1.0, 0.0, z).normalize());
                    assert!(d.is_finite() && d >= 0.0 && (z > 0.0 || d == 0.0), "{facets:?} {alpha:?}: {d}");
                }
            }
        }
    }
}
