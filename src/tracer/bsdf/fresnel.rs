//! Fresnel reflectance for unpolarised light, per lane.

use glam::Vec4;

/// Between two transparent media, `eta` = index of the far side over that of the near side, `cos` = |cos θ| on
/// the near side. Exactly 0 for `eta` = 1, exactly 1 at and beyond the critical angle and at grazing incidence.
#[inline]
pub fn dielectric(cos: f32, eta: Vec4) -> Vec4 {
    let through2 = through2(cos, eta);
    let through = through2.max(Vec4::ZERO).map(f32::sqrt);
    let cos = Vec4::splat(cos);
    let s = (cos - through) / (cos + through);
    let p = (eta * eta * cos - through) / (eta * eta * cos + through);
    let r = (s * s + p * p) * 0.5;
    let total = through2.cmple(Vec4::ZERO) | cos.cmple(Vec4::ZERO);
    let r = Vec4::select(total, Vec4::ONE, r.min(Vec4::ONE));
    Vec4::select(eta.cmpeq(Vec4::ONE), Vec4::ZERO, r)
}

/// (η cos θₜ)² = η² − sin² = cos² + (η − 1)(η + 1) by Snell's law. The first keeps its digits near the normal, where η may be small; the
/// second where light grazes and η is near 1.
#[inline]
fn through2(cos: f32, eta: Vec4) -> Vec4 {
    if cos > 0.5 { eta * eta - (1.0 - cos) * (1.0 + cos) } else { (eta - 1.0) * (eta + 1.0) + cos * cos }
}

/// Snell's law: `eta` times the cosine on the far side, for one index. `None` where [`dielectric`] reflects all.
#[inline]
pub fn through(cos: f32, eta: f32) -> Option<f32> {
    let through2 = through2(cos, Vec4::splat(eta)).x;
    (through2 > 0.0).then(|| through2.sqrt())
}

/// Reflectance of a metal of complex index `eta + i k` (relative to the near side). 1 at grazing incidence, and 1
/// everywhere for `eta` = 0.
#[inline]
pub fn conductor(cos: f32, eta: Vec4, k: Vec4) -> Vec4 {
    let cos2 = Vec4::splat(cos * cos);
    let sin2 = Vec4::splat(((1.0 - cos) * (1.0 + cos)).max(0.0));
    // a² − b² and a b of the cosine on the far side times the complex index, a + i b; η² − sin² as in `through2`.
    let (t0, ab) = (through2(cos, eta) - k * k, eta * k);
    let a2_plus_b2 = (t0 * t0 + 4.0 * ab * ab).map(f32::sqrt);
    // The larger of a² and b²; the other follows from their product, because as a difference it cancels where k is small.
    let larger = 0.5 * (a2_plus_b2 + t0.abs());
    let smaller = Vec4::select(larger.cmpgt(Vec4::ZERO), ab * ab / larger, Vec4::ZERO);
    let a = Vec4::select(t0.cmpgt(Vec4::ZERO), larger, smaller).map(f32::sqrt);
    let b2 = Vec4::select(t0.cmpgt(Vec4::ZERO), smaller, larger);
    let squared = |v: Vec4| v * v;
    let s = quotient(squared(a - cos) + b2, squared(a + cos) + b2);
    let (ac, b2c2) = (a * cos, b2 * cos2);
    let p = s * quotient(squared(ac - sin2) + b2c2, squared(ac + sin2) + b2c2);
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
