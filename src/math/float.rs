//! Bounds on rounding errors, and origins of spawned rays that cannot hit the surface they leave.
//!
//! Nothing here depends on the size of a scene: every bound is relative to the numbers that were rounded.

use glam::Vec3;

/// Unit roundoff of `f32`, 2⁻²⁴: the largest relative error of one rounded operation.
pub const UNIT_ROUNDOFF: f32 = f32::EPSILON * 0.5;

/// The bound γₙ on the relative error of `n` rounded operations in sequence, `n·u / (1 − n·u)`
/// (Higham, *Accuracy and Stability of Numerical Algorithms*, lemma 3.1).
pub const fn gamma(n: u32) -> f32 {
    let nu = n as f32 * UNIT_ROUNDOFF;
    nu / (1.0 - nu)
}

/// `t_max` of a shadow ray to a point at parameter 1. Direction and distance are rounded, so that a surface through the target
/// may be hit this much before it.
pub const SHADOW_T_MAX: f32 = 1.0 - gamma(16);

/// Offsets are at least this long, 2⁻⁶⁴ at coordinates around 1. Planes through zero have smaller error boxes, and where such a plane leans by the
/// rounding of a sine, 2⁻⁵⁴, components of the offset would be denormal: a processor takes ten times as long for each operation on them.
const LEAST_REACH: f32 = 1.0 / (1u128 << 64) as f32;

/// An origin outside the error box of the surface point `p`, for a ray that leaves it in direction `d`.
///
/// `error` bounds the distance of `p` from the true surface along each axis, and `n` is the unit geometric normal of either
/// side. The origin is offset along the normal, to the side of `d`, until the whole error box lies behind it. Then every
/// coordinate is rounded away from the surface (Pharr, Jakob, Humphreys, *Physically Based Rendering*, 4th ed., §6.8.6).
#[inline]
pub fn safe_origin(p: Vec3, error: Vec3, n: Vec3, d: Vec3) -> Vec3 {
    let reach = n.abs().dot(error).max(LEAST_REACH);
    let offset = if d.dot(n) < 0.0 { n * -reach } else { n * reach };
    let o = p + offset;
    Vec3::new(step_along(o.x, offset.x), step_along(o.y, offset.y), step_along(o.z, offset.z))
}

/// The next float after `x` in the direction of the sign of `by`, or `x` if `by` is zero.
fn step_along(x: f32, by: f32) -> f32 {
    // One ulp of |x|, or the smallest normal number near zero: cheaper than the exact next float, and never less.
    let ulp = (x.abs() * f32::EPSILON).max(f32::MIN_POSITIVE);
    if by > 0.0 {
        x + ulp
    } else if by < 0.0 {
        x - ulp
    } else {
        x
    }
}
