//! Tests of `tracer::bsdf::fresnel`.

use glam::Vec4;
use pointillist::tracer::bsdf::fresnel::*;

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
            assert!(d == 1.0 || cos > 0.0, "dielectric {eta} along the surface: {d}");
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
        let (d, c) = (dielectric(cos, Vec4::splat(1.5)).x, conductor(cos, Vec4::splat(1.5), Vec4::ZERO).x);
        assert!((d - c).abs() < 2e-6, "a metal with k = 0 is a dielectric: {cos}: {d} {c}");
        assert_eq!(conductor(cos, Vec4::ZERO, Vec4::ONE).x, 1.0);
    }
}

/// Walsh's closed form (1926) for the outside of n = 1.5 is 0.0918; from within it is 0.5964.
#[test]
fn diffuse_light_within_a_medium() {
    assert!((diffuse_escape(1.5) - 0.4036).abs() < 2e-4, "{}", diffuse_escape(1.5));
    assert!((diffuse_escape(1.0 / 1.5) - 0.9082).abs() < 2e-4, "{}", diffuse_escape(1.0 / 1.5));
    assert_eq!(diffuse_escape(1.0), 1.0);
    assert!(diffuse_escape(1.0001) > 1.0 - 1e-3 && diffuse_escape(1e3) > 0.0);
}

#[test]
fn total_reflection_begins_at_the_critical_angle() {
    let eta = 1.0f32 / 1.5;
    let critical = (1.0 - eta * eta).sqrt();
    assert_eq!(dielectric(critical * 0.999, Vec4::splat(eta)).x, 1.0);
    assert!(dielectric(critical * 1.01, Vec4::splat(eta)).x < 0.9);
}
