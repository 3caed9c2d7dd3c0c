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

/// Mean reflectance for diffuse light that comes from within a medium of relative index `eta` (medium over outside),
/// 2 ∫ F(μ) μ dμ: exact, where Mitsuba has a fit (Egan and Hilgeman 1973) within 0.1 % for usual indices.
///
/// The integral is taken from the lighter side, where the integrand is smooth, and carried over by reciprocity,
/// n² (1 − F_within) = 1 − F_outside. Takes microseconds: for the preparation of a scene.
pub fn diffuse_within(eta: f32) -> f32 {
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
    let within = 1.0 - (1.0 - outside) / f64::from(n * n);
    (if eta >= 1.0 { within } else { outside }) as f32
}

/// `a / b`, and 1 where both vanish, as at grazing incidence.
#[inline]
fn quotient(a: Vec4, b: Vec4) -> Vec4 {
    Vec4::select(b.cmpgt(Vec4::ZERO), a / b, Vec4::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At eta = 1 the textbook form leaves a residue; ours must be exactly zero.
    #[test]
    fn equal_media_do_not_reflect() {
        for cos in [1.0, 0.5, 1e-3, 1e-8, 0.0] {
            assert_eq!(dielectric(cos, Vec4::ONE), Vec4::ZERO, "cos {cos}");
            let near = dielectric(cos.max(0.1), Vec4::new(1.0 + 1e-7, 1.0 - 1e-7, 1.0 + 1e-6, 1.0 - 1e-6));
            assert!(near.max_element() < 1e-6 && near.min_element() >= 0.0);
        }
    }

    #[test]
    fn known_values() {
        // Normal incidence: ((n − 1) / (n + 1))², from both sides.
        let r = dielectric(1.0, Vec4::new(1.5, 1.0 / 1.5, 2.0, 0.5));
        assert!((r - Vec4::new(0.04, 0.04, 1.0 / 9.0, 1.0 / 9.0)).abs().max_element() < 1e-6);
        // Brewster's angle of 1.5 reflects s-polarised light only: half of ((1 − n²)/(1 + n²))².
        let cos = (1.0f32 / (1.0 + 2.25)).sqrt();
        assert!((dielectric(cos, Vec4::splat(1.5)).x - 0.5 * (1.25f32 / 3.25).powi(2)).abs() < 1e-6);
        // A metal at normal incidence: ((n − 1)² + k²) / ((n + 1)² + k²).
        let r = conductor(1.0, Vec4::splat(0.2), Vec4::splat(3.4)).x;
        assert!((r - (0.64 + 11.56) / (1.44 + 11.56)).abs() < 1e-6);
    }

    /// Grazing incidence, k = 0, a perfect mirror.
    #[test]
    fn grazing_incidence_reflects_all_and_nothing_is_nan() {
        for cos in [0.0, 1e-30, 1e-8, 1e-4] {
            for eta in [0.3, 0.999_999_9, 1.000_000_1, 1.5, 1e3] {
                let d = dielectric(cos, Vec4::splat(eta)).x;
                assert!((0.0..=1.0).contains(&d), "dielectric {cos} {eta}: {d}");
                for k in [0.0, 1e-20, 1.0, 1e3] {
                    let c = conductor(cos, Vec4::splat(eta), Vec4::splat(k)).x;
                    assert!((0.0..=1.0).contains(&c), "conductor {cos} {eta} {k}: {c}");
                }
            }
            assert_eq!(conductor(cos, Vec4::ZERO, Vec4::ONE), Vec4::ONE);
            assert!(dielectric(cos, Vec4::splat(1.5)).x > 0.999);
        }
        for i in 0..=1000 {
            let cos = i as f32 / 1000.0;
            let (d, c) =
                (dielectric(cos, Vec4::splat(1.5)).x, conductor(cos, Vec4::splat(1.5), Vec4::ZERO).x);
            assert!((d - c).abs() < 2e-6, "a metal with k = 0 is a dielectric: {cos}: {d} {c}");
            assert_eq!(conductor(cos, Vec4::ZERO, Vec4::ONE).x, 1.0);
        }
    }

    /// Walsh's closed form (1926) for the outside of n = 1.5 is 0.0918; from within it is 0.5964.
    #[test]
    fn diffuse_light_within_a_medium() {
        assert!((diffuse_within(1.5) - 0.5964).abs() < 2e-4, "{}", diffuse_within(1.5));
        assert!((diffuse_within(1.0 / 1.5) - 0.0918).abs() < 2e-4, "{}", diffuse_within(1.0 / 1.5));
        assert_eq!(diffuse_within(1.0), 0.0);
        assert!(diffuse_within(1.0001) < 1e-3 && diffuse_within(1e3) <= 1.0);
    }

    #[test]
    fn total_reflection_begins_at_the_critical_angle() {
        let eta = 1.0f32 / 1.5;
        let critical = (1.0 - eta * eta).sqrt();
        assert_eq!(dielectric(critical * 0.999, Vec4::splat(eta)).x, 1.0);
        assert!(dielectric(critical * 1.01, Vec4::splat(eta)).x < 0.9);
    }
}
