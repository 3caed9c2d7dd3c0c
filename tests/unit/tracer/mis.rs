//! Tests of `tracer::mis`.

use pointillist::math::pdf::PdfW;
use pointillist::tracer::mis::*;

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
