//! Sine, cosine and arc tangent without calls into the system's library: they are faster, and give the same bits on every machine.
//!
//! The polynomials are those of the Cephes library (Moshier, *Methods and Programs for Mathematical Functions*, 1989).

use std::f32::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, PI};

/// π/2 as a sum whose first two terms have few digits, so that their products with small integers are exact.
const HALF_PI: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];

/// Sine and cosine of an angle between −8 and 8; error below 2e-7.
#[inline(always)]
pub fn sin_cos(x: f32) -> (f32, f32) {
    // The nearest multiple of π/2: conversion rounds to zero.
    let quarter = (x * FRAC_2_PI + 8.5) as i32 - 8;
    let turns = quarter as f32;
    let r = ((x - turns * HALF_PI[0]) - turns * HALF_PI[1]) - turns * HALF_PI[2];
    let z = r * r;
    let sin = ((-1.951_529_6e-4 * z + 8.332_161e-3) * z - 1.666_665_5e-1) * z * r + r;
    let cos = ((2.443_315_7e-5 * z - 1.388_731_6e-3) * z + 4.166_664_6e-2) * z * z - 0.5 * z + 1.0;
    let (s, c) = if quarter & 1 == 0 { (sin, cos) } else { (cos, sin) };
    (if quarter & 2 == 0 { s } else { -s }, if (quarter + 1) & 2 == 0 { c } else { -c })
}

/// The angle of the point (x, y) from the x axis, in [−π, π], of finite numbers; error below 5e-7.
#[inline(always)]
pub fn atan2(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let (small, large) = if ay > ax { (ax, ay) } else { (ay, ax) };
    let angle = atan_octant(if large > 0.0 { small / large } else { 0.0 });
    let angle = if ay > ax { FRAC_PI_2 - angle } else { angle };
    (if x.is_sign_negative() { PI - angle } else { angle }).copysign(y)
}

/// The arc tangent of a number in [0, 1].
#[inline(always)]
fn atan_octant(t: f32) -> f32 {
    /// tan(π/8), from which on the angle is measured from π/4.
    const TAN_PI_8: f32 = 0.414_213_57;
    let (from, t) = if t > TAN_PI_8 { (FRAC_PI_4, (t - 1.0) / (t + 1.0)) } else { (0.0, t) };
    let z = t * t;
    from + ((((8.053_744_5e-2 * z - 1.387_768_6e-1) * z + 1.997_771_1e-1) * z - 3.333_295e-1) * z * t + t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_are_those_of_the_library() {
        for i in -80_000..=80_000 {
            let x = i as f32 * 1e-4;
            let ((s, c), (sin, cos)) = (sin_cos(x), f64::from(x).sin_cos());
            let errors = [f64::from(s) - sin, f64::from(c) - cos];
            assert!(errors.iter().all(|e| e.abs() < 2e-7), "{x}: {errors:?}");
        }
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }

    #[test]
    fn angles_are_those_of_the_library() {
        let values = [0.0f32, 1e-38, 1e-20, 1e-4, 0.3, 0.414, 0.415, 0.999, 1.0, 1.001, 7.0, 1e5, 1e20, 3e38];
        let signed = || values.iter().flat_map(|v| [*v, -*v]);
        for (y, x) in signed().flat_map(|y| signed().map(move |x| (y, x))) {
            let (angle, exact) = (atan2(y, x), f64::from(y).atan2(f64::from(x)));
            assert!((f64::from(angle) - exact).abs() < 5e-7, "{y} {x}: {angle} {exact}");
            assert_eq!(angle.is_sign_negative(), y.is_sign_negative(), "{y} {x}");
        }
        for i in 0..=100_000 {
            let exact = (f64::from(i) - 50_000.0) * 6.28e-5;
            let (y, x) = (exact.sin() as f32, exact.cos() as f32);
            let exact = f64::from(y).atan2(f64::from(x));
            assert!((f64::from(atan2(y, x)) - exact).abs() < 5e-7, "{y} {x}");
        }
    }
}
