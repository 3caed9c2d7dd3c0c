//! Triangles, disks, spheres and cylinders as the tracer stores them: checked, in single precision.
//!
//! Each has its bounds, its intersection with a ray, and the surface point at a hit, with a bound on its error. The intersection with
//! triangles is in `accel::kernels::polygon`.

use std::f32::consts::PI;

use glam::{DMat3, DVec2, DVec3, Vec3};

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

/// Roundings by which a ray may leave a flat surface to the wrong side: one of each component of the normal and of the direction, in world
/// space and in that of an instance, and three of their dot product. Such a ray meets the surface again unless it starts as far above it as
/// these are of its extent, so that errors of points hold that much.
pub(super) const SIDE: u32 = 7;

/// True for an area that the density of points on it can be the inverse of.
pub(super) fn has_area(area: f32) -> bool {
    area > 0.0 && (1.0 / area).is_finite()
}

/// A unit normal in single precision. Components below 2⁻⁶¹, products of rounded sines, become 0: no product with one of them shall be denormal,
/// nor an offset along the normal ([`safe_origin`](crate::math::float::safe_origin)).
fn rounded_normal(n: DVec3) -> Vec3 {
    const LEAST: f64 = 1.0 / (1u64 << 61) as f64;
    n.map(|x| if x.abs() < LEAST { 0.0 } else { x }).as_vec3()
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
        let n = rounded_normal(cross.try_normalize()?);
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
        // Edge, product and sum of weights of at most 1 are rounded once each, and the result once more.
        let error = (self.e1.abs() + self.e2.abs()) * gamma(4 + SIDE) + p.abs() * (1.01 * UNIT_ROUNDOFF);
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
        let n = rounded_normal(if plane.dot(front) < 0.0 { -plane } else { plane });
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
        let (t, [x, y]) = self.crossing(ray);
        let t = t as f32;
        (x * x + y * y <= 1.0 && t > 0.0 && t < t_max).then_some(t)
    }

    /// Where the line of `ray` crosses the plane: the distance, and the coordinates in units of the half axes.
    #[inline]
    fn crossing(&self, ray: &Ray) -> (f64, [f64; 2]) {
        let (o, d) = (ray.origin.as_dvec3() - self.center.as_dvec3(), ray.direction.as_dvec3());
        let t = -o.dot(self.plane) / d.dot(self.plane);
        let p = o + d * t;
        (t, self.to_xy.map(|axis| p.dot(axis)))
    }

    /// The point where `ray` hits. It is found again, because from far away the rounding of a distance moves a point along the surface.
    #[inline]
    pub fn point(&self, ray: &Ray) -> SurfacePoint {
        let (_, [x, y]) = self.crossing(ray);
        self.point_at(x as f32, y as f32)
    }

    /// The coordinates of a point in units of the half axes.
    #[inline]
    pub fn coordinates(&self, p: Vec3) -> [f32; 2] {
        let offset = p.as_dvec3() - self.center.as_dvec3();
        self.to_xy.map(|axis| offset.dot(axis) as f32)
    }

    /// The point with coordinates `x`, `y` in units of the half axes.
    #[inline]
    pub fn point_at(&self, x: f32, y: f32) -> SurfacePoint {
        let (a, b) = (self.a * x, self.b * y);
        let p = self.center + (a + b);
        // Half axes: the extent is twice that.
        let error = (self.a.abs() + self.b.abs()) * gamma(4 + 2 * SIDE) + p.abs() * (1.01 * UNIT_ROUNDOFF);
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
    #[inline]
    pub fn intersect(&self, ray: &Ray, t_max: f32) -> Option<f32> {
        let t = self.nearest(ray)? as f32;
        (t > 0.0 && t < t_max).then_some(t)
    }

    /// The distance at which the line of `ray` meets the sphere first ahead of its origin, or last where that is behind.
    ///
    /// Computed in double precision, with the discriminant from the distance of the line to the centre. So neither a small
    /// sphere far away nor an origin one ulp above the surface loses precision (Haines, Günther and Akenine-Möller, *Precision
    /// Improvements for Ray/Sphere Intersection*, Ray Tracing Gems, ch. 7).
    #[inline]
    fn nearest(&self, ray: &Ray) -> Option<f64> {
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
        Some(if t0 > 0.0 { t0 } else { t1 })
    }

    /// The point where `ray` hits.
    ///
    /// It is found from the middle of the chord, not from the distance of the hit, whose rounding would turn the normal by 5·10⁻⁴ at 10⁴
    /// radii and by 0.03 at 10⁶.
    #[inline]
    pub fn point(&self, ray: &Ray) -> SurfacePoint {
        let d = ray.direction.as_dvec3();
        let f = ray.origin.as_dvec3() - self.center.as_dvec3();
        let r = f64::from(self.radius);
        let (a, b) = (d.length_squared(), -f.dot(d));
        let middle = f + d * (b / a);
        let half_chord2 = (r * r - middle.length_squared()) / a;
        if half_chord2 < 0.0 {
            return self.point_towards(middle.normalize_or(DVec3::Z).as_vec3());
        }
        // The same end as in `nearest`.
        let enters = b > 0.0 && f.length_squared() > r * r;
        let half_chord = half_chord2.sqrt();
        let from_center = middle + d * if enters { -half_chord } else { half_chord };
        self.point_towards((from_center * (1.0 / r)).as_vec3())
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

/// The round side of a cylinder, or its image under an affine map: the points `base + x·a + y·b + z·axis`, x² + y² = 1, 0 ≤ z ≤ 1.
#[derive(Clone, Copy, Debug)]
pub struct Cylinder {
    /// The centre of one end.
    pub base: Vec3,
    /// One half axis of the ends, conjugate to `b`.
    pub a: Vec3,
    /// The other half axis.
    pub b: Vec3,
    /// From the base to the centre of the other end.
    pub axis: Vec3,
    /// True if the front is the inside.
    pub inward: bool,
    /// Maps an offset from the base to (x, y, z).
    to_local: DMat3,
}

impl Cylinder {
    /// The cylinder, or `None` if it has no volume.
    pub fn new(base: Vec3, [a, b, axis]: [Vec3; 3], inward: bool) -> Option<Self> {
        let to_local = DMat3::from_cols(a.as_dvec3(), b.as_dvec3(), axis.as_dvec3()).inverse();
        let cylinder = Self { base, a, b, axis, inward, to_local };
        to_local.is_finite().then_some(cylinder)
    }

    /// Corners of the bounding box.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let reach = (self.a * self.a + self.b * self.b).map(f32::sqrt);
        let other = self.base + self.axis;
        (self.base.min(other) - reach, self.base.max(other) + reach)
    }

    /// Surface area: exact for a round cylinder, a sum of 256 stripes for one whose ends are ellipses.
    pub fn area(&self) -> f32 {
        let stripe = |i: u32| {
            let (y, x) = (f64::from(i) * (std::f64::consts::TAU / 256.0)).sin_cos();
            f64::from(self.stretch([x as f32, y as f32]))
        };
        ((0..256).map(stripe).sum::<f64>() * (std::f64::consts::TAU / 256.0)) as f32
    }

    /// The area on the surface at (x, y) per unit of angle and of z.
    #[inline]
    pub fn stretch(&self, [x, y]: [f32; 2]) -> f32 {
        (self.b * x - self.a * y).cross(self.axis).length()
    }

    /// The nearest hit with `0 < t < t_max`.
    #[inline]
    pub fn intersect(&self, ray: &Ray, t_max: f32) -> Option<f32> {
        let (t, _) = self.nearest(ray)?;
        let t = t as f32;
        (t > 0.0 && t < t_max).then_some(t)
    }

    /// The distance of the nearest hit, and where that is in the space in which the ends are unit circles. Computed there, as that of a
    /// sphere.
    #[inline]
    fn nearest(&self, ray: &Ray) -> Option<(f64, DVec3)> {
        let o = self.to_local * (ray.origin.as_dvec3() - self.base.as_dvec3());
        let d = self.to_local * ray.direction.as_dvec3();
        let (o2, d2) = (o.truncate(), d.truncate());
        let a = d2.length_squared();
        let b = -o2.dot(d2);
        let nearest = o2 + d2 * (b / a);
        let discriminant = 1.0 - nearest.length_squared();
        if discriminant.is_nan() || discriminant < 0.0 {
            return None;
        }
        let c = o2.length_squared() - 1.0;
        let q = b + (a * discriminant).sqrt().copysign(b);
        let (t0, t1) = (c / q, q / a);
        let roots = if t0 <= t1 { [t0, t1] } else { [t1, t0] };
        let on_it = |t: &f64| *t > 0.0 && (0.0..=1.0).contains(&(o.z + d.z * t));
        let t = roots.into_iter().find(on_it)?;
        Some((t, o + d * t))
    }

    /// (x, y) of a point on the surface, or of one near it.
    #[inline]
    pub fn around(&self, p: Vec3) -> [f32; 2] {
        self.on_circle(self.to_local * (p.as_dvec3() - self.base.as_dvec3()))
    }

    /// The share of the axis at the height of a point.
    #[inline]
    pub fn height(&self, p: Vec3) -> f32 {
        (self.to_local * (p.as_dvec3() - self.base.as_dvec3())).z as f32
    }

    /// True if the segment from `from` to a point on the surface enters the cylinder through its side.
    #[inline]
    pub fn hides_inside(&self, from: Vec3, to: Vec3) -> bool {
        /// How far outside a point that lies on the surface may be by rounding, in squared radii.
        const SLACK: f64 = 1e-5;
        let o = self.to_local * (from.as_dvec3() - self.base.as_dvec3());
        let d = self.to_local * (to.as_dvec3() - from.as_dvec3());
        let outside = o.truncate().length_squared() - 1.0;
        // One root of the quadratic equation is 1, so that the other is the product of both.
        let entry = outside / d.truncate().length_squared();
        outside > SLACK && entry < 1.0 && (0.0..=1.0).contains(&(o.z + d.z * entry))
    }

    #[inline]
    fn on_circle(&self, local: DVec3) -> [f32; 2] {
        local.truncate().normalize_or(DVec2::X).as_vec2().to_array()
    }

    /// The point where `ray` hits, moved onto the surface; `t` is the distance of the hit, which is found again, as that of a sphere.
    #[inline]
    pub fn point(&self, ray: &Ray, t: f32) -> SurfacePoint {
        let local = self.nearest(ray).map_or_else(
            || {
                let p = ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(t);
                self.to_local * (p - self.base.as_dvec3())
            },
            |(_, local)| local,
        );
        self.point_at(self.on_circle(local), local.z.clamp(0.0, 1.0) as f32)
    }

    /// The point with the coordinates (x, y), on the unit circle, and z.
    #[inline]
    pub fn point_at(&self, [x, y]: [f32; 2], z: f32) -> SurfacePoint {
        let (a, b, c) = (self.a * x, self.b * y, self.axis * z);
        let p = self.base + (a + b + c);
        let error = (a.abs() + b.abs()) * gamma(5)
            + self.axis.abs() * gamma(5 + SIDE)
            + p.abs() * (1.01 * UNIT_ROUNDOFF);
        // The gradient of x² + y².
        let outward = self.to_local.transpose() * DVec3::new(f64::from(x), f64::from(y), 0.0);
        let n = outward.normalize_or(DVec3::Z).as_vec3();
        SurfacePoint { p, error, ng: if self.inward { -n } else { n } }
    }
}
