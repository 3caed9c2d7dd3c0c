//! Multiple importance sampling weights (Veach and Guibas 1995) that no pair of densities can upset.

use crate::math::pdf::PdfW;

/// The balance heuristic: `a / (a + b)`.
///
/// In [0, 1] and adding up to 1 with the arguments exchanged, for all densities from 0 to infinity;
/// 0 when `a` is 0 or NaN.
#[inline]
pub fn balance(a: PdfW, b: PdfW) -> f32 {
    weight(ratio(a, b))
}

/// The power heuristic with exponent 2: `a² / (a² + b²)`, without squaring what could overflow.
///
/// Same range and limits as [`balance`].
#[inline]
pub fn power(a: PdfW, b: PdfW) -> f32 {
    let r = ratio(a, b);
    weight(r * r)
}

/// `b / a`, with the limits that make the weights right: equal infinities (or zeros) share evenly.
#[inline]
fn ratio(a: PdfW, b: PdfW) -> f32 {
    if a.0 == b.0 && a.0 > 0.0 { 1.0 } else { b.0 / a.0 }
}

#[inline]
fn weight(r: f32) -> f32 {
    // NaN comes from a = b = 0 or from a NaN: such a sample has no weight.
    if r.is_nan() { 0.0 } else { 1.0 / (1.0 + r) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Case N13: densities log-uniform over the whole range of f32.
    #[test]
    fn weights_are_a_partition_of_one_over_the_whole_range() {
        let naive = |a: f32, b: f32| a * a / (a * a + b * b);
        let mut naive_failures = 0;
        for i in -38..=38 {
            for j in -38..=38 {
                let (a, b) = (1.7 * 10f32.powi(i), 1.3 * 10f32.powi(j));
                for f in [balance, power] {
                    let (x, y) = (f(PdfW(a), PdfW(b)), f(PdfW(b), PdfW(a)));
                    assert!((0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y), "{a} {b}: {x} {y}");
                    assert!((x + y - 1.0).abs() < 1e-6, "{a} {b}: {x} + {y}");
                }
                let sum = naive(a, b) + naive(b, a);
                naive_failures += u32::from(sum.is_nan() || (sum - 1.0).abs() > 1e-6);
            }
        }
        assert!(naive_failures > 1000, "the case is too easy: {naive_failures}");
    }

    #[test]
    fn limits() {
        for f in [balance, power] {
            assert_eq!(f(PdfW(0.0), PdfW(0.0)), 0.0);
            assert_eq!(f(PdfW(0.0), PdfW(1.0)), 0.0);
            assert_eq!(f(PdfW(1.0), PdfW(0.0)), 1.0);
            assert_eq!(f(PdfW(f32::INFINITY), PdfW(1.0)), 1.0);
            assert_eq!(f(PdfW(f32::INFINITY), PdfW(f32::INFINITY)), 0.5);
            assert_eq!(f(PdfW(f32::NAN), PdfW(1.0)), 0.0);
        }
    }
}
