//! Spheres.

use glam::Vec3;

use crate::math::float::{UNIT_ROUNDOFF, gamma};
use crate::tracer::accel::Ray;

use super::SurfacePoint;

/// A sphere in world space.
#[derive(Clone, Copy, Debug)]
pub struct Sphere {
    /// Centre.
    pub center: Vec3,
    /// Radius, positive.
    pub radius: f32,
    /// True if the front is the inside.
    pub inward: bool,
}

impl Sphere {
    /// Corners of the bounding box.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        (self.center - self.radius, self.center + self.radius)
    }

    /// Surface area.
    pub fn area(&self) -> f32 {
        4.0 * std::f32::consts::PI * self.radius * self.radius
    }

    /// The nearest hit with `0 < t < t_max`.
    ///
    /// Computed in double precision, with the discriminant from the distance of the line to the centre. So neither a small
    /// sphere far away nor an origin one ulp above the surface loses precision (Haines, Günther and Akenine-Möller, *Precision
    /// Improvements for Ray/Sphere Intersection*, Ray Tracing Gems, ch. 7).
    #[inline]
    pub fn intersect(&self, ray: &Ray, t_max: f32) -> Option<f32> {
        let d = ray.direction.as_dvec3();
        let f = ray.origin.as_dvec3() - self.center.as_dvec3();
        let r = f64::from(self.radius);
        let a = d.length_squared();
        let b = -f.dot(d);
        let nearest = f + d * (b / a);
        let discriminant = r * r - nearest.length_squared();
        if discriminant.is_nan() || discriminant < 0.0 {
            return None;
        }
        let c = f.length_squared() - r * r;
        let q = b + (a * discriminant).sqrt().copysign(b);
        let (t0, t1) = (c / q, q / a);
        let (t0, t1) = if t0 <= t1 { (t0, t1) } else { (t1, t0) };
        let t = if t0 > 0.0 { t0 } else { t1 } as f32;
        (t > 0.0 && t < t_max).then_some(t)
    }

    /// The point at distance `t` of `ray`, moved onto the sphere.
    #[inline]
    pub fn point(&self, ray: &Ray, t: f32) -> SurfacePoint {
        // In double precision, because a far origin would swamp a small sphere.
        let from_center =
            ray.origin.as_dvec3() - self.center.as_dvec3() + ray.direction.as_dvec3() * f64::from(t);
        let n = from_center.normalize_or(glam::DVec3::Z).as_vec3();
        self.point_towards(n)
    }

    /// The point in direction `n` (unit) from the centre.
    #[inline]
    pub fn point_towards(&self, n: Vec3) -> SurfacePoint {
        let offset = n * self.radius;
        let p = self.center + offset;
        let error = Vec3::splat(self.radius * gamma(4)) + p.abs() * (1.01 * UNIT_ROUNDOFF);
        SurfacePoint { p, error, ng: if self.inward { -n } else { n } }
    }
}
