//! A hit, ready for shading.

use glam::Vec3;

use crate::math::float::{SHADOW_T_MAX, safe_origin};
use crate::math::frame::Frame;

use super::accel::Ray;
use super::shape::SurfacePoint;

impl SurfacePoint {
    /// A ray that ends just before the world-space point `target`, seen from here in direction `towards`.
    #[inline]
    pub fn spawn_to(&self, target: Vec3, towards: Vec3) -> Ray {
        let origin = safe_origin(self.p, self.error, self.ng, towards);
        Ray { origin, direction: target - origin, t_max: SHADOW_T_MAX }
    }
}

/// A point where a ray met a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceInteraction {
    /// Position, its error bound and geometric normal, world space.
    pub point: SurfacePoint,
    /// Shading frame; `frame.n` lies on the front.
    pub frame: Frame,
    /// Towards where the ray came from, unit length, world space.
    pub wo: Vec3,
    /// Index of the surface in the scene: what materials it shows.
    pub surface: u32,
    /// Light that this primitive is, if any.
    pub light: Option<u32>,
    /// The shading normal is interpolated and may differ from the geometric one.
    pub smooth: bool,
}

impl SurfaceInteraction {
    /// A ray that leaves in direction `d` (world space) and cannot hit this surface at once.
    #[inline]
    pub fn spawn(&self, d: Vec3) -> Ray {
        let SurfacePoint { p, error, ng } = self.point;
        Ray::new(safe_origin(p, error, ng, d), d)
    }

    /// A ray that ends just before the world-space point `target`, seen from here in direction `towards`.
    #[inline]
    pub fn spawn_to(&self, target: Vec3, towards: Vec3) -> Ray {
        self.point.spawn_to(target, towards)
    }

    /// False when a smooth normal sends light through a surface that should reflect it, or the other way:
    /// `wo` and `wi` (world space) must lie on the sides that the shading normal says also by the geometric normal.
    #[inline]
    pub fn sides_agree(&self, wi: Vec3, transmitted: bool) -> bool {
        if !self.smooth {
            return true;
        }
        let same = self.wo.dot(self.point.ng) * wi.dot(self.point.ng) > 0.0;
        same != transmitted
    }
}
