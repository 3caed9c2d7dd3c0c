//! Disks, and ellipses as their images under affine maps.

use glam::{DVec3, Vec3};

use crate::math::float::{UNIT_ROUNDOFF, gamma};
use crate::tracer::accel::Ray;

use super::SurfacePoint;

/// The points `center + x·a + y·b`, x² + y² ≤ 1.
#[derive(Clone, Copy, Debug)]
pub struct Disk {
    /// Centre.
    pub center: Vec3,
    /// One half axis, conjugate to `b` and not necessarily perpendicular to it.
    pub a: Vec3,
    /// The other half axis.
    pub b: Vec3,
    /// Unit normal of the front.
    pub n: Vec3,
    /// Maps an offset from the centre to (x, y).
    to_xy: [DVec3; 2],
    plane: DVec3,
}

impl Disk {
    /// The disk, or `None` if it has no area. `front` points to its front side.
    pub fn new(center: Vec3, a: Vec3, b: Vec3, front: DVec3) -> Option<Self> {
        let (da, db) = (a.as_dvec3(), b.as_dvec3());
        let cross = da.cross(db);
        let plane = cross.try_normalize()?;
        // The reciprocal basis in the plane: x·a = 1, x·b = 0.
        let inverse = 1.0 / cross.length_squared();
        let to_xy = [db.cross(cross) * inverse, cross.cross(da) * inverse];
        let finite = to_xy.iter().all(|v| v.is_finite());
        let n = if plane.dot(front) < 0.0 { -plane } else { plane }.as_vec3();
        finite.then_some(Self { center, a, b, n, to_xy, plane })
    }

    /// Corners of the bounding box.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let reach = (self.a * self.a + self.b * self.b).map(f32::sqrt);
        (self.center - reach, self.center + reach)
    }

    /// Area.
    pub fn area(&self) -> f32 {
        (std::f64::consts::PI * self.a.as_dvec3().cross(self.b.as_dvec3()).length()) as f32
    }

    /// The hit with `0 < t < t_max`.
    #[inline]
    pub fn intersect(&self, ray: &Ray, t_max: f32) -> Option<f32> {
        let (o, d) = (ray.origin.as_dvec3() - self.center.as_dvec3(), ray.direction.as_dvec3());
        let t = -o.dot(self.plane) / d.dot(self.plane);
        let p = o + d * t;
        let (x, y) = (p.dot(self.to_xy[0]), p.dot(self.to_xy[1]));
        let t = t as f32;
        (x * x + y * y <= 1.0 && t > 0.0 && t < t_max).then_some(t)
    }

    /// The point at distance `t` of `ray`, moved into the plane.
    #[inline]
    pub fn point(&self, ray: &Ray, t: f32) -> SurfacePoint {
        let p = ray.origin.as_dvec3() - self.center.as_dvec3() + ray.direction.as_dvec3() * f64::from(t);
        self.point_at(p.dot(self.to_xy[0]) as f32, p.dot(self.to_xy[1]) as f32)
    }

    /// The point with coordinates `x`, `y` in units of the half axes.
    #[inline]
    pub fn point_at(&self, x: f32, y: f32) -> SurfacePoint {
        let (a, b) = (self.a * x, self.b * y);
        let p = self.center + (a + b);
        let error = (a.abs() + b.abs()) * gamma(4) + p.abs() * (1.01 * UNIT_ROUNDOFF);
        SurfacePoint { p, error, ng: self.n }
    }
}
