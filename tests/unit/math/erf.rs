//! Tests of `math::erf`.

use pointillist::math::erf::*;

/// The formula against the integral, summed in double precision by Simpson's rule, within what it promises; and its
/// evaluation against the formula, within its roundings. Horner's steps have two each, of partial sums that add up to
/// 4.23 at t = 1: 8.5 roundings; t has two, and counts by the slope of the polynomial there, 3.44: 7; one of the
/// exponential, and one of its product.
#[test]
fn erf_is_the_integral() {
    const A: [f64; 5] = [1.061_405_429, -1.453_152_027, 1.421_413_741, -0.284_496_736, 0.254_829_592];
    let formula = |z: f64| {
        let t = 1.0 / (1.0 + 0.327_591_1 * z);
        1.0 - A.iter().fold(0.0, |sum, a| (sum + a) * t) * (-z * z).exp()
    };
    let rounding = 17.5 * 2f64.powi(-24);
    let (mut sum, h) = (0f64, 1e-3f64);
    let f = |x: f64| (-x * x).exp() * 2.0 / std::f64::consts::PI.sqrt();
    for i in 0..5000 {
        let a = f64::from(i) * h;
        assert!((formula(a) - sum).abs() <= 1.5e-7, "erf({a}) = {sum}, not {}", formula(a));
        let a32 = a as f32;
        let off = f64::from(erf(a32)) - formula(f64::from(a32));
        assert!(off.abs() <= rounding, "erf({a32}) is {off} from the formula");
        assert_eq!(erf(-a32).abs(), erf(a32));
        sum += h / 6.0 * (f(a) + 4.0 * f(a + h / 2.0) + f(a + h));
    }
    assert_eq!((erf(f32::INFINITY), erf(f32::NEG_INFINITY)), (1.0, -1.0));
}

#[test]
fn inverse_and_back() {
    for i in -9999..=9999 {
        let y = i as f32 / 10_000.0;
        assert!((erf(erf_inv(y)) - y).abs() < 2e-6, "{y}");
    }
    let edge = 1.0 - 1.0 / 16_777_216.0;
    assert!(erf_inv(edge) > 3.8 && erf_inv(edge) < 3.9 && erf_inv(-edge) == -erf_inv(edge));
    assert_eq!((erf_inv(1.0), erf_inv(-1.0)), (f32::INFINITY, f32::NEG_INFINITY));
}
