//! The direction of the first texture coordinate on brushed (anisotropic) surfaces.

use glam::Vec3;

use crate::math::frame::Frame;

use super::shape::SurfacePoint;

/// ∂p/∂u of one shape, up to a factor of either sign: the microfacet distribution is symmetric.
#[derive(Debug)]
pub(super) enum Tangents {
    /// Undefined: the shape is not brushed, or has no texture coordinates.
    Any,
    /// Constant.
    Fixed(Vec3),
    /// Radial from a point.
    From(Vec3),
    /// Around an axis.
    Around(Vec3),
    /// By triangle. Zero where it is undefined.
    Each {
        /// The first triangle of the shape.
        first: u32,
        /// ∂p/∂u of this triangle and of those that follow.
        along: Vec<Vec3>,
    },
}

impl Tangents {
    /// The shading frame with normal `n` at a point of primitive `prim`. Its s axis is the part of ∂p/∂u perpendicular to `n`.
    pub(super) fn frame(&self, prim: u32, point: &SurfacePoint, n: Vec3) -> Frame {
        self.along(prim, point).map_or_else(|| Frame::new(n), |along| Frame::along(n, along))
    }

    /// ∂p/∂u at a point of primitive `prim`, up to a factor. `None` if any direction will do.
    pub(super) fn along(&self, prim: u32, point: &SurfacePoint) -> Option<Vec3> {
        let along = match self {
            Tangents::Any => return None,
            Tangents::Fixed(along) => *along,
            Tangents::From(center) => point.p - *center,
            Tangents::Around(axis) => axis.cross(point.ng),
            Tangents::Each { first, along } => {
                let i = prim.checked_sub(*first).map_or(usize::MAX, |i| i as usize);
                along.get(i).copied().unwrap_or(Vec3::ZERO)
            }
        };
        // Where it is undefined, use the s axis of the geometric normal's frame.
        Some(if along == Vec3::ZERO { Frame::new(point.ng).s } else { along })
    }
}
