//! Triangles as shading needs them. The intersection test is in `accel::kernels::polygon`.

use glam::{DVec3, Vec3};

use crate::math::float::{UNIT_ROUNDOFF, gamma};

use super::SurfacePoint;

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
        let cross: DVec3 = (b - a).cross(c - a);
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
