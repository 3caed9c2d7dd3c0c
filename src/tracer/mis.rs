//! The power heuristic of multiple importance sampling (Veach and Guibas 1995), valid for every pair of densities.

use crate::math::pdf::PdfW;

/// The power heuristic with exponent 2: `a² / (a² + b²)`, without squaring what could overflow.
///
/// The weight is in [0, 1] and adds up to 1 with the arguments exchanged, for all densities from 0 to infinity; it is 0 when
/// `a` is 0 or NaN.
#[inline]
pub fn power(a: PdfW, b: PdfW) -> f32 {
    // Equal infinities share evenly.
    let r = if a.0 == b.0 && a.0 > 0.0 { 1.0 } else { b.0 / a.0 };
    let r = r * r;
    // NaN comes from a = b = 0 or from a NaN: such a sample has no weight.
    if r.is_nan() { 0.0 } else { 1.0 / (1.0 + r) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Densities log-uniform over the whole range of f32.
    #[test]
    fn weights_are_a_partition_of_one_over_the_whole_range() {
        let naive = |a: f32, b: f32| a * a / (a * a + b * b);
        let mut naive_failures = 0;
        for i in -38..=38 {
            for j in -38..=38 {
                let (a, b) = (1.7 * 10f32.powi(i), 1.3 * 10f32.powi(j));
                let (x, y) = (power(PdfW(a), PdfW(b)), power(PdfW(b), PdfW(a)));
                assert!((0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y), "{a} {b}: {x} {y}");
                assert!((x + y - 1.0).abs() < 1e-6, "{a} {b}: {x} + {y}");
                let sum = naive(a, b) + naive(b, a);
                naive_failures += u32::from(sum.is_nan() || (sum - 1.0).abs() > 1e-6);
            }
        }
        assert!(naive_failures > 1000, "the case is too easy: {naive_failures}");
    }

    #[test]
    fn limits() {
        assert_eq!(power(PdfW(0.0), PdfW(0.0)), 0.0);
        assert_eq!(power(PdfW(0.0), PdfW(1.0)), 0.0);
        assert_eq!(power(PdfW(1.0), PdfW(0.0)), 1.0);
        assert_eq!(power(PdfW(f32::INFINITY), PdfW(1.0)), 1.0);
        assert_eq!(power(PdfW(f32::INFINITY), PdfW(f32::INFINITY)), 0.5);
        assert_eq!(power(PdfW(f32::NAN), PdfW(1.0)), 0.0);
    }
}
