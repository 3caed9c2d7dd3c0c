//! Flat shapes seen from close by, whose points are sampled by the solid angle under which they are seen.

use std::convert::Infallible;

use glam::Vec3;

use crate::math::pdf::PdfW;

/// A shape is close by where the squared distance of its nearest point is below this share of that of its farthest.
pub const NEAR_OVER_FAR_SQUARED: f32 = 0.25;

/// Least height above the plane of a shape, as a share of the distance of its farthest point: below it, heights are mostly rounding.
pub const LEAST_HEIGHT: f32 = 1e-5;

/// A flat shape as seen from a point before it, close by: its points are sampled in proportion to solid angle, exactly or nearly.
pub trait SubtendedShape {
    /// The point of the numbers `u`, and its density.
    fn sample(&self, u: [f32; 2]) -> (Vec3, PdfW);

    /// The density of a point of the shape.
    fn pdf(&self, point: Vec3) -> PdfW;
}

/// Uninhabited stand-in for shapes that are always sampled by area.
impl SubtendedShape for Infallible {
    fn sample(&self, _: [f32; 2]) -> (Vec3, PdfW) {
        match *self {}
    }

    fn pdf(&self, _: Vec3) -> PdfW {
        match *self {}
    }
}
