//! Tests of `math::float`.

use glam::Vec3;
use pointillist::math::float::*;

#[test]
fn gamma_bounds_a_chain_of_roundings() {
    // 100 multiplications by numbers near 1, against f64.
    let (mut single, mut double) = (1.0f32, 1.0f64);
    for i in 0..100 {
        let f = 1.0 + 0.01 * (i as f32 * 0.7).sin();
        single *= f;
        double *= f64::from(f);
    }
    let error = ((f64::from(single) - double) / double).abs();
    assert!(error > 0.0, "the case is too easy");
    assert!(error <= f64::from(gamma(100)));
}

#[test]
fn origins_leave_the_error_box_at_every_scale() {
    for k in -20..=20 {
        let s = 2f32.powi(k);
        let p = Vec3::new(1.3, -0.7, 2.9) * s;
        let n = Vec3::new(0.36, 0.48, 0.8);
        let error = p.abs() * gamma(3);
        for d in [n, -n, Vec3::new(0.8, 0.0, -0.35), Vec3::new(-0.8, 0.0, 0.37)] {
            let o = safe_origin(p, error, n, d);
            let side = d.dot(n).signum();
            let moved = (o.as_dvec3() - p.as_dvec3()).dot(n.as_dvec3()) * f64::from(side);
            let reach = n.abs().dot(error);
            assert!(moved > f64::from(reach) * 0.999, "scale 2^{k}: moved {moved}, error {reach}");
            assert!(moved < f64::from(reach) * 4.0 + 4e-7 * f64::from(s), "moved too far: {moved}");
        }
    }
}
