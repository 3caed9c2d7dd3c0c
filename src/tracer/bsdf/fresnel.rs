//! Fresnel reflectance for unpolarised light, per lane.

use glam::Vec4;

/// Between two transparent media, `eta` = index of the far side over that of the near side, `cos` = |cos θ| on
/// the near side. Exactly 0 for `eta` = 1, exactly 1 at and beyond the critical angle and at grazing incidence.
#[inline]
pub fn dielectric(cos: f32, eta: Vec4) -> Vec4 {
    let sin2 = ((1.0 - cos) * (1.0 + cos)).max(0.0);
    let cos2_t = 1.0 - sin2 / (eta * eta);
    let cos_t = cos2_t.max(Vec4::ZERO).map(f32::sqrt);
    let cos = Vec4::splat(cos);
    let s = (cos - eta * cos_t) / (cos + eta * cos_t);
    let p = (eta * cos - cos_t) / (eta * cos + cos_t);
    let r = (s * s + p * p) * 0.5;
    // Total reflection also covers 0/0 at cos = 0 with eta ≥ 1: there 1 is the limit.
    let total = cos2_t.cmple(Vec4::ZERO) | cos.cmple(Vec4::ZERO);
    let r = Vec4::select(total, Vec4::ONE, r.min(Vec4::ONE));
    Vec4::select(eta.cmpeq(Vec4::ONE), Vec4::ZERO, r)
}

/// Reflectance of a metal of complex index `eta + i k` (relative to the near side). 1 at grazing incidence, and 1
/// everywhere for `eta` = 0.
#[inline]
pub fn conductor(cos: f32, eta: Vec4, k: Vec4) -> Vec4 {
    let cos2 = Vec4::splat(cos * cos);
    let sin2 = Vec4::splat(((1.0 - cos) * (1.0 + cos)).max(0.0));
    let (eta2, k2) = (eta * eta, k * k);
    let t0 = eta2 - k2 - sin2;
    let a2_plus_b2 = (t0 * t0 + 4.0 * eta2 * k2).map(f32::sqrt);
    let a = (0.5 * (a2_plus_b2 + t0)).max(Vec4::ZERO).map(f32::sqrt);
    let (t1, t2) = (a2_plus_b2 + cos2, 2.0 * cos * a);
    let s = quotient(t1 - t2, t1 + t2);
    let (t3, t4) = (cos2 * a2_plus_b2 + sin2 * sin2, t2 * sin2);
    let p = s * quotient(t3 - t4, t3 + t4);
    (0.5 * (s + p)).clamp(Vec4::ZERO, Vec4::ONE)
}

/// The share of diffuse light from within a medium of relative index `eta` (medium over outside) that leaves it,
/// 1 − 2 ∫ F(μ) μ dμ: exact, where Mitsuba has a fit (Egan and Hilgeman 1973) within 0.1 % for usual indices.
///
/// The integral is taken from the lighter side, where the integrand is smooth, and carried over by reciprocity,
/// n² (1 − F_within) = 1 − F_outside. So the share keeps its digits where almost nothing leaves. Takes microseconds: for the
/// preparation of a scene.
pub fn diffuse_escape(eta: f32) -> f32 {
    const STEPS: u32 = 1024;
    let n = eta.max(1.0 / eta);
    let sum: f64 = (0..STEPS)
        .map(|i| {
            // Denser towards grazing angles, where the reflectance is steep: μ = t².
            let t = (f64::from(i) + 0.5) / f64::from(STEPS);
            let mu = t * t;
            f64::from(dielectric(mu as f32, Vec4::splat(n)).x) * mu * 2.0 * t
        })
        .sum();
    let outside = 2.0 * sum / f64::from(STEPS);
    let n2 = f64::from(n) * f64::from(n);
    ((1.0 - outside) / if eta >= 1.0 { n2 } else { 1.0 }) as f32
}

/// `a / b`, and 1 where both vanish, as at grazing incidence.
#[inline]
fn quotient(a: Vec4, b: Vec4) -> Vec4 {
    Vec4::select(b.cmpgt(Vec4::ZERO), a / b, Vec4::ONE)
}
