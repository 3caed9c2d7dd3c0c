//! The directions in which the first texture coordinate runs over a brushed surface.

use glam::Vec3;

use crate::math::frame::Frame;

use super::shape::SurfacePoint;

/// ∂p/∂u of one shape, up to a positive factor or a turn around: facets are the same both ways.
#[derive(Debug)]
pub(super) enum Tangents {
    /// Nowhere in particular: the shape is not brushed, or it does not say.
    Any,
    /// The same everywhere.
    Fixed(Vec3),
    /// Away from a point.
    From(Vec3),
    /// Around an axis.
    Around(Vec3),
    /// By triangle; zero for any.
    Each {
        /// The first triangle of the shape.
        first: u32,
        /// Of it and those that follow.
        along: Vec<Vec3>,
    },
}

impl Tangents {
    /// The shading frame with normal `n` at a point of primitive `prim`: s is what of ∂p/∂u lies at right angles to `n`.
    pub(super) fn frame(&self, prim: u32, point: &SurfacePoint, n: Vec3) -> Frame {
        self.along(prim, point).map_or_else(|| Frame::new(n), |along| Frame::along(n, along))
    }

    /// ∂p/∂u at a point of primitive `prim`, up to a factor; `None` where any direction will do.
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
        // Without a direction, the one that the geometric normal's frame has.
        Some(if along == Vec3::ZERO { Frame::new(point.ng).s } else { along })
    }
}
