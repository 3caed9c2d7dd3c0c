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
