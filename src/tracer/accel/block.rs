//! Four triangles, or four parallelograms, at a time, watertight.
//!
//! Woop, Benthin and Wald, *Watertight Ray/Triangle Intersection*, JCGT 2(1), 2013: the vertices are sheared
//! into a space where the ray is the z axis, so that a shared vertex rounds the same for every triangle around
//! it, and the three edge functions are products and differences with separate rounding. Rounding is
//! monotone: a sign is right or zero, and an edge walked the other way gives the exact negation. Zero counts
//! as inside on both sides, so no fallback to double precision is needed to decide. A parallelogram has a fourth
//! edge and is otherwise the same: boxes and rectangles cost half of what their triangles would.

use glam::{BVec4A, DVec3, Vec3, Vec4};

use crate::math::float::UNIT_ROUNDOFF;

/// Four polygons of `N` corners, coordinates by vertex and axis. The fourth "axis" of the first vertex holds the
/// ids, so that an axis can be masked instead of checked.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Block<const N: usize> {
    v: [[Vec4; 4]; N],
}

/// Four triangles.
pub(super) type TriBlock = Block<3>;

/// Four parallelograms, corners in order around them.
pub(super) type QuadBlock = Block<4>;

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
    /// Weights of the second and third corner (and none of the fourth: the plane is that of the first three).
    u: Vec4,
    v: Vec4,
    /// Bits of the lanes whose distance is so small that its sign may be rounding.
    doubtful: u32,
}

/// A bound on the rounding of `z · determinant`, from the largest |x|, |y|, |z| in the sheared space:
/// `z · u · (108 x y + 30 z (x + y))`, u the unit roundoff (Pharr et al., *Physically Based Rendering*, 4th ed.,
/// §6.8.7, its γ's multiplied out).
#[inline(always)]
fn doubt<const N: usize>(corners: [(Vec4, Vec4, Vec4); N]) -> Vec4 {
    let largest =
        |of: fn(&(Vec4, Vec4, Vec4)) -> Vec4| corners.iter().fold(Vec4::ZERO, |m, c| m.max(of(c).abs()));
    let (x, y, z) = (largest(|c| c.0), largest(|c| c.1), largest(|c| c.2));
    z * (x * y * (108.0 * UNIT_ROUNDOFF) + z * (x + y) * (30.0 * UNIT_ROUNDOFF))
}

impl BlockHits {
    /// Barycentric weights of the second and third vertex in `lane`.
    #[inline]
    pub(super) fn uv(&self, lane: usize) -> [f32; 2] {
        [self.u.to_array()[lane & 3], self.v.to_array()[lane & 3]]
    }

    /// True when the distance in `lane` is so small that its sign may be rounding: for a polygon that is large, or
    /// seen edge-on, from close by.
    #[inline]
    pub(super) fn is_doubtful(&self, lane: usize) -> bool {
        self.doubtful >> lane & 1 == 1
    }
}

/// What the walk asks of a block.
pub(super) trait Polygons {
    /// Tests all four for hits with `0 < t < t_max`. An empty lane is a point, its determinant is zero.
    fn intersect(&self, ray: &ShearedRay, t_max: f32) -> BlockHits;

    /// The id in `lane`.
    fn id(&self, lane: usize) -> u32;

    /// The distance to the plane of `lane` again, in double precision.
    ///
    /// A spawned ray starts outside the error box of its surface, so this is negative for that surface and for
    /// whatever lies in the same plane, and positive for a second surface a few ulps on.
    fn exact_t(&self, lane: usize, ray: (Vec3, Vec3)) -> f32;
}

impl<const N: usize> Block<N> {
    /// A block of up to four polygons and their ids; the other lanes are never hit.
    pub(super) fn new(polygons: &[([Vec3; N], u32)]) -> Self {
        let mut lanes = [[[0f32; 4]; 4]; N];
        lanes[0][3] = [f32::from_bits(u32::MAX); 4];
        for (lane, (corners, id)) in polygons.iter().take(4).enumerate() {
            for (vertex, corner) in corners.iter().enumerate() {
                for axis in 0..3 {
                    lanes[vertex][axis][lane] = corner[axis];
                }
            }
            lanes[0][3][lane] = f32::from_bits(*id);
        }
        Self { v: lanes.map(|axes| axes.map(Vec4::from_array)) }
    }

    #[inline(always)]
    fn lane_id(&self, lane: usize) -> u32 {
        self.v[0][3].to_array()[lane & 3].to_bits()
    }

    #[cold]
    fn plane_t(&self, lane: usize, ray: (Vec3, Vec3)) -> f32 {
        let corner = |i: usize| {
            let [x, y, z, _] = self.v[i].map(|axis| axis.to_array()[lane & 3]);
            DVec3::new(f64::from(x), f64::from(y), f64::from(z))
        };
        let (a, o, d) = (corner(0), ray.0.as_dvec3(), ray.1.as_dvec3());
        let n = (corner(1) - a).cross(corner(2) - a);
        ((a - o).dot(n) / d.dot(n)) as f32
    }
}

impl ShearedRay {
    /// A vertex in the sheared space.
    #[inline(always)]
    fn shear(&self, vertex: &[Vec4; 4]) -> (Vec4, Vec4, Vec4) {
        let [kx, ky, kz] = self.k;
        let z = vertex[kz & 3] - self.origin[2];
        let x = (vertex[kx & 3] - self.origin[0]) - self.shear[0] * z;
        let y = (vertex[ky & 3] - self.origin[1]) - self.shear[1] * z;
        (x, y, z)
    }
}

/// Twice the signed area between the ray and the edge from a to b.
#[inline(always)]
fn edge(a: (Vec4, Vec4, Vec4), b: (Vec4, Vec4, Vec4)) -> Vec4 {
    b.0 * a.1 - b.1 * a.0
}

impl Polygons for TriBlock {
    #[inline(always)]
    fn intersect(&self, ray: &ShearedRay, t_max: f32) -> BlockHits {
        let [a, b, c] = [ray.shear(&self.v[0]), ray.shear(&self.v[1]), ray.shear(&self.v[2])];
        let (u, v, w) = (edge(b, c), edge(c, a), edge(a, b));
        let inside = u.min(v).min(w).cmpge(Vec4::ZERO) | u.max(v).max(w).cmple(Vec4::ZERO);
        let inverse = 1.0 / (u + v + w);
        let scaled = u * a.2 + v * b.2 + w * c.2;
        let t = scaled * inverse * ray.scale_z;
        // NaN (a determinant of zero) fails both comparisons.
        let hit: BVec4A = inside & t.cmpgt(Vec4::ZERO) & t.cmplt(Vec4::splat(t_max));
        let mask = hit.bitmask();
        // Most blocks are missed; only a hit can be doubtful.
        let doubtful = if mask == 0 { 0 } else { scaled.abs().cmplt(doubt([a, b, c])).bitmask() };
        BlockHits { mask, t, u: v * inverse, v: w * inverse, doubtful }
    }

    #[inline(always)]
    fn id(&self, lane: usize) -> u32 {
        self.lane_id(lane)
    }

    fn exact_t(&self, lane: usize, ray: (Vec3, Vec3)) -> f32 {
        self.plane_t(lane, ray)
    }
}

impl Polygons for QuadBlock {
    #[inline(always)]
    fn intersect(&self, ray: &ShearedRay, t_max: f32) -> BlockHits {
        let (a, b) = (ray.shear(&self.v[0]), ray.shear(&self.v[1]));
        let (c, d) = (ray.shear(&self.v[2]), ray.shear(&self.v[3]));
        let (ab, bc, cd, da) = (edge(a, b), edge(b, c), edge(c, d), edge(d, a));
        let inside =
            ab.min(bc).min(cd.min(da)).cmpge(Vec4::ZERO) | ab.max(bc).max(cd.max(da)).cmple(Vec4::ZERO);
        // Opposite edge functions add up to the area: x along ab, y along ad, both in [0, 1].
        let (x, y) = (da / (da + bc), ab / (ab + cd));
        let tz = a.2 + (x * (b.2 - a.2) + y * (d.2 - a.2));
        let t = tz * ray.scale_z;
        let hit: BVec4A = inside & t.cmpgt(Vec4::ZERO) & t.cmplt(Vec4::splat(t_max));
        let mask = hit.bitmask();
        let doubtful =
            if mask == 0 { 0 } else { (tz * (ab + cd)).abs().cmplt(doubt([a, b, c, d])).bitmask() };
        // a + x·ab + y·ad, in terms of the triangle abc: ad = ac − ab.
        BlockHits { mask, t, u: x - y, v: y, doubtful }
    }

    #[inline(always)]
    fn id(&self, lane: usize) -> u32 {
        self.lane_id(lane)
    }

    fn exact_t(&self, lane: usize, ray: (Vec3, Vec3)) -> f32 {
        self.plane_t(lane, ray)
    }
}
