//! Triangles, disks and spheres as the tracer stores them: checked, in single precision.
//!
//! Each has its bounds, its intersection with a ray, and the surface point at a hit, with a bound on its error. The intersection with
//! triangles is in `accel::kernels::polygon`.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

use crate::math::float::{UNIT_ROUNDOFF, gamma};

use super::accel::Ray;

/// A point on a shape.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position, world space.
    pub p: Vec3,
    /// Bound on the distance of `p` from the true surface, along each axis.
    pub error: Vec3,
    /// Unit geometric normal on the front, as materials and emission define it.
    pub ng: Vec3,
}

/// A triangle in world space.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// First vertex.
    pub p0: Vec3,
    /// From the first to the second vertex.
    pub e1: Vec3,
    /// From the first to the third vertex.
    pub e2: Vec3,
    /// Unit normal, along e1 × e2.
    pub n: Vec3,
}

impl Triangle {
    /// The triangle of three vertices, or `None` if it has no area or is not finite. The normal is computed in double precision,
    /// so that needles and triangles of size 1e-15 have one.
    pub fn new(v: [Vec3; 3]) -> Option<Self> {
        let [a, b, c] = v.map(|p| p.as_dvec3());
        let cross = (b - a).cross(c - a);
        let n = cross.try_normalize()?.as_vec3();
        Some(Self { p0: v[0], e1: v[1] - v[0], e2: v[2] - v[0], n })
    }

    /// Area, world units squared.
    pub fn area(&self) -> f32 {
        (0.5 * self.e1.as_dvec3().cross(self.e2.as_dvec3()).length()) as f32
    }

    /// The point with barycentric weights `uv` of the second and third vertex.
    #[inline]
    pub fn point(&self, uv: [f32; 2]) -> SurfacePoint {
        let (a, b) = (self.e1 * uv[0], self.e2 * uv[1]);
        let p = self.p0 + (a + b);
        // Edge, product and sum are rounded once each, and the result once more.
        let error = (a.abs() + b.abs()) * gamma(4) + p.abs() * (1.01 * UNIT_ROUNDOFF);
        SurfacePoint { p, error, ng: self.n }
    }
}

/// A disk, or an ellipse as its image under an affine map: the points `center + x·a + y·b`, x² + y² ≤ 1.
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
        4.0 * PI * self.radius * self.radius
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
        let n = from_center.normalize_or(DVec3::Z).as_vec3();
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
