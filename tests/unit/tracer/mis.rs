//! Tests of `tracer::mis`.

use pointillist::math::pdf::PdfW;
use pointillist::tracer::mis::*;

#[test]
fn limits() {
    assert_eq!(power(PdfW(0.0), PdfW(0.0)), 0.0);
    assert_eq!(power(PdfW(0.0), PdfW(1.0)), 0.0);
    assert_eq!(power(PdfW(1.0), PdfW(0.0)), 1.0);
    assert_eq!(power(PdfW(f32::INFINITY), PdfW(1.0)), 1.0);
    assert_eq!(power(PdfW(f32::INFINITY), PdfW(f32::INFINITY)), 0.5);
    assert_eq!(power(PdfW(f32::NAN), PdfW(1.0)), 0.0);
}
