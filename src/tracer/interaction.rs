//! Where paths meet surfaces, or scatter in a medium.

use glam::Vec3;

use crate::math::float::{SHADOW_T_MAX, safe_origin};

use super::accel::{Hit, Ray};
use super::shape::SurfacePoint;

impl SurfacePoint {
    /// A ray that leaves in direction `d` (world space) and cannot hit this surface at once.
    #[inline]
    pub fn spawn(&self, d: Vec3) -> Ray {
        Ray::new(safe_origin(self.p, self.error, self.ng, d), d)
    }

    /// A ray that ends just before the world-space point `target`, seen from here in direction `towards`.
    #[inline]
    pub fn spawn_to(&self, target: Vec3, towards: Vec3) -> Ray {
        let origin = safe_origin(self.p, self.error, self.ng, towards);
        Ray::between(origin, target, SHADOW_T_MAX)
    }
}

/// A point where a ray met a surface, or one at which it is scattered [in a medium](Self::in_medium).
#[derive(Clone, Copy, Debug)]
pub struct SurfaceInteraction {
    /// Position, its error bound and geometric normal, world space; the normal is 0 in a medium.
    pub point: SurfacePoint,
    /// Shading normal, on the front; 0 in a medium.
    pub n: Vec3,
    /// Unit direction back along the ray, world space.
    pub wo: Vec3,
    /// The primitive that was hit, and where; `t` counts from where the ray began behind what it has passed.
    pub hit: Hit,
    /// Index of the surface in the scene, which has the materials of its two sides; [`SurfaceInteraction::NO_SURFACE`] in a medium.
    pub surface: u32,
    /// The light that this primitive belongs to, if it emits.
    pub light: Option<u32>,
    /// The shading normal is interpolated and may differ from the geometric one.
    pub smooth: bool,
}

impl SurfaceInteraction {
    /// The surface of a point in a medium.
    pub const NO_SURFACE: u32 = u32::MAX;

    /// The point `p` in a medium, to which a ray came from the unit direction `wo` over the distance `t`.
    #[inline]
    pub fn in_medium(p: Vec3, wo: Vec3, t: f32) -> Self {
        let point = SurfacePoint { p, error: Vec3::ZERO, ng: Vec3::ZERO };
        let hit = Hit { t, prim: u32::MAX, uv: [0.0; 2], instance: Hit::DIRECT };
        let surface = Self::NO_SURFACE;
        Self { point, n: Vec3::ZERO, wo, hit, surface, light: None, smooth: false }
    }

    /// True for a point in a medium.
    #[inline]
    pub fn is_in_medium(&self) -> bool {
        self.surface == Self::NO_SURFACE
    }

    /// The surface, for the message about a fault; `None` in a medium.
    #[inline]
    pub fn known_surface(&self) -> Option<u32> {
        (!self.is_in_medium()).then_some(self.surface)
    }

    /// The light that this point belongs to, if it emits to where the ray came from.
    #[inline(always)]
    pub fn emitter(&self) -> Option<u32> {
        self.light.filter(|_| self.wo.dot(self.point.ng) > 0.0)
    }

    /// The geometric normal on the side of `wo`.
    #[inline]
    pub fn facing_normal(&self) -> Vec3 {
        let ng = self.point.ng;
        if self.wo.dot(ng) < 0.0 { -ng } else { ng }
    }

    /// A ray that leaves in direction `d` (world space) and cannot hit this surface at once.
    #[inline]
    pub fn spawn(&self, d: Vec3) -> Ray {
        self.point.spawn(d)
    }

    /// A ray that ends just before the world-space point `target`, seen from here in direction `towards`.
    #[inline]
    pub fn spawn_to(&self, target: Vec3, towards: Vec3) -> Ray {
        self.point.spawn_to(target, towards)
    }

    /// False when an interpolated normal lets light through a surface that should reflect it, or the reverse: the geometric
    /// normal must have `wo` and `wi` (world space) on the same sides as the shading normal has them.
    #[inline]
    pub fn sides_agree(&self, wi: Vec3, transmitted: bool) -> bool {
        if !self.smooth {
            return true;
        }
        let same = self.wo.dot(self.point.ng) * wi.dot(self.point.ng) > 0.0;
        same != transmitted
    }
}
