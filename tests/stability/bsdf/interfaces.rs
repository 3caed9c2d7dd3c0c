//! Interfaces between media that are nearly the same, at grazing angles and at the edge of total reflection.

use glam::{DAffine3, DVec3, Vec3, Vec4};

use pointillist::scene::desc::{Facets, SceneDesc, ShapeKind};
use pointillist::spectrum::dispersion::Ior;
use pointillist::tracer::bsdf::{ScatteringModel, fresnel};

use super::cases::{rough_glass, smooth_glass};
use super::quadrature::{lattice, number};
use super::{INCIDENCES, direction};
use crate::Row;
use crate::support::scenes::{empty, environment, glass, material, mean, shape};

/// Cosine on the far side times η in double precision, 0 beyond the critical angle.
fn through(cos: f64, eta: f64) -> f64 {
    ((eta - 1.0) * (eta + 1.0) + cos * cos).max(0.0).sqrt()
}

/// Fresnel's reflectance in double precision.
fn reflectance(cos: f64, eta: f64) -> f64 {
    let t = through(cos, eta);
    if eta == 1.0 || t + cos == 0.0 {
        return f64::from(u8::from(eta != 1.0));
    }
    let (s, p) = ((cos - t) / (cos + t), (eta * eta * cos - t) / (eta * eta * cos + t));
    0.5 * (s * s + p * p)
}

/// Density of a rough refraction between two rounded directions by the sum of both and the difference of cosines, over that of the
/// same facet in double precision: GGX seen along the normal but for masking, which is 1 in all that is asked.
fn naive_density(m: DVec3, wo: Vec3, wi: Vec3, alpha: f32, eta: f32) -> f64 {
    let d = |m: DVec3| {
        let q = m.truncate().length_squared() / f64::from(alpha).powi(2) + m.z * m.z;
        1.0 / (q * q)
    };
    let half = wo + wi * eta;
    let found = half.normalize_or_zero() * 1f32.copysign(half.z);
    let along = wo.dot(found) + eta * wi.dot(found);
    let naive = d(found.as_dvec3()) / f64::from(along * along);
    let cos = wo.as_dvec3().dot(m);
    let bend = (f64::from(eta) - 1.0) * (f64::from(eta) + 1.0) / (cos + through(cos, f64::from(eta)));
    naive / (d(m) / (bend * bend))
}

/// Refraction by facets between nearly equal media: half vector and Jacobian are differences of what is nearly equal, and below the
/// resolution of directions there is nothing to evaluate. Bound: with directions rounded by 2⁻²⁵ in each coordinate and lobes of 32 · 2⁻²⁴
/// or more, facets are turned by up to 3 % of α, which changes GGX (s⁻⁴ in slopes) by up to 6 %, twice that with both directions.
#[test]
fn b10_rough_glass_near_index_one() {
    let (mut worst, mut worst_naive, mut spread) = (1f64, 1f64, 0);
    let off = |quotient: f64| if quotient > 0.0 { quotient.max(1.0 / quotient) } else { f64::INFINITY };
    for eta in [1.0001f32, 1.0002, 0.9998, 1.0003, 1.001, 1.01, 0.9] {
        for alpha in [1e-4f32, 1e-3, 1e-2, 0.1] {
            let bsdf = rough_glass(Facets::Ggx, alpha, eta);
            for incidence in [0.0, 30.0, 60.0] {
                let wo = direction(incidence);
                for i in 0..2000 {
                    let [u, v, _] = lattice(i, 2000);
                    let Some(s) = bsdf.sample(wo, [number(u), number(v)], 1.0 - f32::EPSILON) else {
                        continue;
                    };
                    if !s.transmitted {
                        continue;
                    }
                    if !s.delta {
                        let evaluated = bsdf.eval(wo, s.wi).map_or(0.0, |(_, pdf)| f64::from(pdf.0));
                        worst = worst.max(off(evaluated / f64::from(s.pdf.0)));
                        spread += 1;
                    }
                    // The same facets, for a method that evaluates every lobe.
                    let m = super::quadrature::ggx_normal(f64::from(alpha), u.min(0.98), v);
                    let wo64 = wo.as_dvec3().normalize();
                    let (cos, index) = (wo64.dot(m), f64::from(eta));
                    let wi = (m * (cos - through(cos, index)) - wo64) / index;
                    if cos > 0.0 && through(cos, index) > 0.0 {
                        worst_naive = worst_naive.max(off(naive_density(m, wo, wi.as_vec3(), alpha, eta)));
                    }
                }
            }
        }
    }
    assert!(spread > 10_000, "most lobes are to be evaluated: {spread}");
    Row {
        case: "B10 rough glass of index 1.0001 to 1.01, roughness 1e-4 to .1",
        measure: "largest quotient of evaluated and sampled density, less 1",
        figure: worst - 1.0,
        naive: ("half vector by ωₒ + η ωᵢ, Jacobian by cos θₒ − η cos θᵢ", worst_naive - 1.0),
        bound: 0.15,
    }
    .check();
}

/// Reflectance and direction by sin² θ in single precision, which has no digits left where light grazes.
fn by_sine(cos: f32, eta: f32) -> [f32; 2] {
    let through = eta * (1.0 - (1.0 - cos * cos) / (eta * eta)).max(0.0).sqrt();
    let (s, p) =
        ((cos - through) / (cos + through), (eta * eta * cos - through) / (eta * eta * cos + through));
    [0.5 * (s * s + p * p), through / eta]
}

/// Media that are the same or next to it: nothing is reflected, light goes on straight, R + T = 1; and Snell's law at grazing angles.
/// Bounds: some roundings.
#[test]
fn n17_nearly_equal_media() {
    for eta in [1.0f32, 1.0 + f32::EPSILON, 1.0 - f32::EPSILON, 1.0001, 0.9999] {
        let glass = smooth_glass(eta);
        let (mut bent, mut bent_naive, mut reflected, mut reflected_naive) = (0f64, 0f64, 0f64, 0f64);
        for incidence in INCIDENCES.into_iter().chain([89.0, 89.95, 89.97]) {
            let wo = direction(incidence);
            let (cos, index) = (f64::from(wo.z), f64::from(eta));
            let exact = reflectance(cos, index);
            let [naive_reflected, naive_z] = by_sine(wo.z, eta);
            reflected =
                reflected.max((f64::from(fresnel::dielectric(wo.z, Vec4::splat(eta)).x) - exact).abs());
            reflected_naive = reflected_naive.max((f64::from(naive_reflected) - exact).abs());
            let Some(s) = glass.sample(wo, [0.5; 2], 1.0 - f32::EPSILON).filter(|s| s.transmitted) else {
                assert!(exact == 1.0, "{eta}, {incidence}°: only total reflection lets nothing through");
                continue;
            };
            if eta == 1.0 {
                assert_eq!((s.wi, s.weight.0.x), (-wo, 1.0), "nothing happens, to the bit");
            }
            let z = through(cos, index) / index;
            bent = bent.max((f64::from(-s.wi.z) - z).abs());
            bent_naive = bent_naive.max((f64::from(naive_z) - z).abs());
        }
        for (measure, figure, naive) in [
            ("largest error of the reflectance", reflected, reflected_naive),
            ("largest error of the refracted cosine", bent, bent_naive),
        ] {
            Row {
                case: &format!("N17 dielectric of index 1 {:+.0e}, 0° to 89.9999°", f64::from(eta) - 1.0),
                measure,
                figure,
                naive: ("by sin² θ", naive),
                bound: 3e-7,
            }
            .check();
        }
    }
}

/// At the edge of total reflection every path goes somewhere: R + T = 1, and R rises to 1 without a step back. The naive method takes the
/// root of what rounding makes negative.
#[test]
fn n17_edge_of_total_reflection() {
    let (mut lost, mut lost_naive, mut count) = (0, 0, 0);
    for index in [1.0003f32, 1.33, 1.5, 2.4] {
        let eta = 1.0 / index;
        let critical = (1.0 - f64::from(eta).powi(2)).sqrt() as f32;
        let mut before = 1f32;
        for step in -2000i32..=2000 {
            let cos = f32::from_bits(critical.to_bits().wrapping_add_signed(step));
            let sin = (1.0 - cos * cos).sqrt();
            let r = fresnel::dielectric(cos, Vec4::splat(eta)).x;
            let s = smooth_glass(eta).sample(Vec3::new(sin, 0.0, cos), [0.5; 2], 1.0 - f32::EPSILON / 2.0);
            // The last lobe is a refraction unless all is reflected.
            let whole = s.is_some_and(|s| s.transmitted != (r == 1.0) && s.wi.is_finite());
            lost += u32::from(!whole || (r > before || r.is_nan()));
            before = r + 1e-6;
            let naive = (1.0 - (sin * index).powi(2)).sqrt();
            lost_naive += u32::from(naive.is_nan());
            count += 1;
        }
    }
    Row {
        case: "N17 edge of total reflection, 2000 numbers to both sides",
        measure: "share of paths lost",
        figure: f64::from(lost) / f64::from(count),
        naive: ("√(1 − (η sin θ)²)", f64::from(lost_naive) / f64::from(count)),
        bound: 0.0,
    }
    .check();
}

/// Reflectance of a conductor in double precision.
fn metal(cos: f64, eta: f64, k: f64) -> f64 {
    let t0 = (eta - 1.0) * (eta + 1.0) + cos * cos - k * k;
    let h = (t0 * t0 + 4.0 * (eta * k).powi(2)).sqrt();
    let (a2, b2) = if t0 > 0.0 {
        let a2 = 0.5 * (h + t0);
        (a2, (eta * k).powi(2) / a2)
    } else {
        let b2 = 0.5 * (h - t0);
        (if b2 > 0.0 { (eta * k).powi(2) / b2 } else { 0.0 }, b2)
    };
    let (a, sin2) = (a2.sqrt(), (1.0 - cos) * (1.0 + cos));
    let quotient = |x: f64, y: f64| if y > 0.0 { x / y } else { 1.0 };
    let s = quotient((a - cos).powi(2) + b2, (a + cos).powi(2) + b2);
    let tan = if cos > 0.0 { sin2 / cos } else { f64::INFINITY };
    let p = if cos > 0.0 { quotient((a - tan).powi(2) + b2, (a + tan).powi(2) + b2) } else { 1.0 };
    0.5 * s * (1.0 + p)
}

/// A conductor by sin² θ and tan θ, as formulas have it.
fn metal_by_tangent(cos: f32, eta: f32, k: f32) -> f32 {
    let sin2 = 1.0 - cos * cos;
    let t0 = eta * eta - k * k - sin2;
    let h = (t0 * t0 + 4.0 * eta * eta * k * k).sqrt();
    let a = (0.5 * (h + t0)).sqrt();
    let (tan2, sin_tan) = (sin2 / (cos * cos), sin2.sqrt() * sin2.sqrt() / cos);
    let s = (h - 2.0 * a * cos + cos * cos) / (h + 2.0 * a * cos + cos * cos);
    s * 0.5 * (1.0 + (h - 2.0 * a * sin_tan + sin2 * tan2) / (h + 2.0 * a * sin_tan + sin2 * tan2))
}

/// Fresnel's formulas at grazing incidence, and of metals without absorption: finite, within [0, 1], near double precision and rising to 1.
#[test]
fn n18_fresnel_at_its_ends() {
    let cosines = [0.0f32, 1e-8, 1e-6, 1.7e-4, 1e-2, 0.3, 0.8, 1.0];
    let indices =
        [1e-3f32, 0.2, 0.7, 1.0 - f32::EPSILON, 1.0, 1.0 + f32::EPSILON, 1.0003, 1.5, 4.0, 200.0, 1e4];
    let (mut glass, mut glass_naive, mut conductor, mut conductor_naive) = (0f64, 0f64, 0f64, 0f64);
    // A NaN is the worst error.
    let off = |found: f32, exact: f64| {
        let off = (f64::from(found) - exact).abs();
        if off.is_nan() || !(0.0..=1.0).contains(&found) { 1.0 } else { off }
    };
    for eta in indices {
        let mut before = 1f32;
        for cos in cosines {
            let r = fresnel::dielectric(cos, Vec4::splat(eta)).x;
            let exact = reflectance(f64::from(cos), f64::from(eta));
            (glass, glass_naive) =
                (glass.max(off(r, exact)), glass_naive.max(off(by_sine(cos, eta)[0], exact)));
            if cos < 0.01 {
                assert!(r <= before, "index {eta}: {r} at cosine {cos} after {before}");
                before = r;
            }
            for k in [0.0f32, 1e-6, 1e-3, 3.0] {
                let exact = metal(f64::from(cos), f64::from(eta), f64::from(k));
                conductor =
                    conductor.max(off(fresnel::conductor(cos, Vec4::splat(eta), Vec4::splat(k)).x, exact));
                conductor_naive = conductor_naive.max(off(metal_by_tangent(cos, eta, k), exact));
            }
        }
    }
    for (case, figure, naive, method) in [
        ("N18 Fresnel of dielectrics, cosine 0 to 1, index 1e-3 to 1e4", glass, glass_naive, "by sin² θ"),
        ("N18 Fresnel of conductors, k = 0 to 3", conductor, conductor_naive, "by sin² θ and tan θ"),
    ] {
        Row {
            case,
            measure: "largest error of the reflectance",
            figure,
            naive: (method, naive),
            bound: 2e-6,
        }
        .check();
    }
}

/// A pane of glass whose faces are this far apart, seen straight on under a white sky.
fn slab(thickness: f64) -> SceneDesc {
    let mut desc = empty();
    environment(&mut desc);
    let m = material(&mut desc, glass(Ior::Constant(1.5)));
    let near = DAffine3::from_translation(DVec3::Z) * DAffine3::from_rotation_x(std::f64::consts::PI);
    let far = DAffine3::from_translation(DVec3::Z * (1.0 + thickness));
    for at in [near, far] {
        shape(
            &mut desc,
            ShapeKind::Rectangle,
            at * DAffine3::from_scale(DVec3::new(10.0, 10.0, 1.0)),
            m,
            0.0,
        );
    }
    desc
}

/// A slab 84 units in the last place thick and a thicker one: both of its faces are met, and all light comes out again. A ray that is moved on by 1e-4
/// after each face misses the second one, and the light that it brings is that within the glass, 1/η² of it. Roulette ends one path in some
/// thousand: the bound is three standard errors of that.
#[test]
fn n17_thin_slab() {
    const PATHS: u64 = 1 << 18;
    let mut sky = empty();
    environment(&mut sky);
    let white = mean(&sky, PATHS).0;
    let r = reflectance(1.0, 1.5);
    for thickness in [5e-5, 1e-5] {
        Row {
            case: &format!("N17 slab of glass, thickness {thickness:e} of its distance, white furnace"),
            measure: "error of the mean",
            figure: (mean(&slab(thickness), PATHS).0 / white - 1.0).abs(),
            naive: ("rays that begin 1e-4 farther", (r + (1.0 - r) / 2.25 - 1.0).abs()),
            bound: 1e-4,
        }
        .check();
    }
}
