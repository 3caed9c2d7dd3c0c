//! Four triangles at a time, watertight.
//!
//! Woop, Benthin and Wald, *Watertight Ray/Triangle Intersection*, JCGT 2(1), 2013: the vertices are sheared
//! into a space where the ray is the z axis, so that a shared vertex rounds the same for every triangle around
//! it, and the three edge functions are products and differences with separate rounding. Rounding is
//! monotone: a sign is right or zero, and an edge walked the other way gives the exact negation. Zero counts
//! as inside on both sides, so no fallback to double precision is needed to decide.

use glam::{BVec4A, DVec3, Vec3, Vec4};

/// Marks a lane without a triangle.
pub(super) const NO_TRIANGLE: u32 = u32::MAX;

/// Four triangles, coordinates by vertex and axis. The fourth "axis" of the first vertex holds the ids, so
/// that the block is three cache lines and an axis can be masked instead of checked.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct TriBlock {
    v: [[Vec4; 4]; 3],
}

/// A ray in the terms of the triangle test.
#[derive(Clone, Copy)]
pub(super) struct ShearedRay {
    /// Axes x, y, z of the sheared space; z is the longest of the direction.
    k: [usize; 3],
    origin: [Vec4; 3],
    shear: [Vec4; 2],
    scale_z: f32,
}

impl ShearedRay {
    #[inline]
    pub(super) fn new(origin: Vec3, d: Vec3) -> Self {
        let a = d.abs();
        let kz = if a.x > a.y {
            if a.x > a.z { 0 } else { 2 }
        } else if a.y > a.z {
            1
        } else {
            2
        };
        let kx = if kz == 2 { 0 } else { kz + 1 };
        let ky = if kx == 2 { 0 } else { kx + 1 };
        let (o, d) = (origin.to_array(), d.to_array());
        let scale_z = 1.0 / d[kz];
        Self {
            k: [kx, ky, kz],
            origin: [Vec4::splat(o[kx]), Vec4::splat(o[ky]), Vec4::splat(o[kz])],
            shear: [Vec4::splat(d[kx] * scale_z), Vec4::splat(d[ky] * scale_z)],
            scale_z,
        }
    }
}

/// Lanes that were hit, with what belongs to them.
pub(super) struct BlockHits {
    /// Bit i is set when lane i was hit.
    pub(super) mask: u32,
    pub(super) t: Vec4,
    /// Edge functions opposite the second and third vertex, over their sum.
    v: Vec4,
    w: Vec4,
    inverse_det: Vec4,
    /// Distance along z of the farthest vertex and of the hit: a hit much nearer than the triangle is large
    /// has to be looked at again.
    reach: Vec4,
    tz: Vec4,
}

impl BlockHits {
    /// Barycentric weights of the second and third vertex in `lane`.
    #[inline]
    pub(super) fn uv(&self, lane: usize) -> [f32; 2] {
        [(self.v * self.inverse_det).to_array()[lane & 3], (self.w * self.inverse_det).to_array()[lane & 3]]
    }

    /// True when the distance in `lane` is so small beside the triangle that its sign may be rounding.
    #[inline]
    pub(super) fn is_doubtful(&self, lane: usize) -> bool {
        self.tz.to_array()[lane & 3].abs() < self.reach.to_array()[lane & 3] * (1.0 / 4096.0)
    }
}

impl TriBlock {
    /// A block of up to four triangles and their ids; the other lanes are never hit.
    pub(super) fn new(triangles: &[([Vec3; 3], u32)]) -> Self {
        let mut lanes = [[[0f32; 4]; 4]; 3];
        lanes[0][3] = [f32::from_bits(NO_TRIANGLE); 4];
        for (lane, (corners, id)) in triangles.iter().take(4).enumerate() {
            for (vertex, corner) in corners.iter().enumerate() {
                for axis in 0..3 {
                    lanes[vertex][axis][lane] = corner[axis];
                }
            }
            lanes[0][3][lane] = f32::from_bits(*id);
        }
        Self { v: lanes.map(|axes| axes.map(Vec4::from_array)) }
    }

    /// The id in `lane`.
    #[inline]
    pub(super) fn id(&self, lane: usize) -> u32 {
        self.v[0][3].to_array()[lane & 3].to_bits()
    }

    /// Tests all four triangles for hits with `0 < t < t_max`. An empty lane is a point, its determinant is zero.
    #[inline(always)]
    pub(super) fn intersect(&self, ray: &ShearedRay, t_max: f32) -> BlockHits {
        let [kx, ky, kz] = ray.k;
        let shear = |vertex: &[Vec4; 4]| {
            let z = vertex[kz & 3] - ray.origin[2];
            let x = (vertex[kx & 3] - ray.origin[0]) - ray.shear[0] * z;
            let y = (vertex[ky & 3] - ray.origin[1]) - ray.shear[1] * z;
            (x, y, z)
        };
        let (ax, ay, az) = shear(&self.v[0]);
        let (bx, by, bz) = shear(&self.v[1]);
        let (cx, cy, cz) = shear(&self.v[2]);
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        let inside = u.min(v).min(w).cmpge(Vec4::ZERO) | u.max(v).max(w).cmple(Vec4::ZERO);
        let det = u + v + w;
        let inverse_det = 1.0 / det;
        let tz = (u * az + v * bz + w * cz) * inverse_det;
        let t = tz * ray.scale_z;
        // NaN (a determinant of zero) fails both comparisons.
        let hit: BVec4A = inside & t.cmpgt(Vec4::ZERO) & t.cmplt(Vec4::splat(t_max));
        let reach = az.abs().max(bz.abs()).max(cz.abs());
        BlockHits { mask: hit.bitmask(), t, v, w, inverse_det, reach, tz }
    }

    /// The sign question again in double precision: is the plane of `lane` truly in front of the origin?
    ///
    /// A spawned ray starts outside the error box of its surface, so this says no for that surface and for
    /// whatever lies in the same plane, and yes for a second surface a few ulps on.
    #[cold]
    pub(super) fn is_in_front(&self, lane: usize, ray: (Vec3, Vec3)) -> bool {
        let corner = |i: usize| {
            let [x, y, z, _] = self.v[i].map(|axis| axis.to_array()[lane & 3]);
            DVec3::new(f64::from(x), f64::from(y), f64::from(z))
        };
        let (a, o, d) = (corner(0), ray.0.as_dvec3(), ray.1.as_dvec3());
        let n = (corner(1) - a).cross(corner(2) - a);
        (a - o).dot(n) * d.dot(n) > 0.0
    }
}
