//! Watertight intersection of a ray with eight triangles, or eight parallelograms, at a time.
//!
//! The method is that of Woop, Benthin and Wald, *Watertight Ray/Triangle Intersection*, JCGT 2(1), 2013. Vertices are sheared
//! into a space where the ray is the z axis, so that a shared vertex is rounded alike for every triangle around it, and the
//! three edge functions are products and differences with separate rounding. Rounding is monotone: a sign is right or the
//! value is zero, and the reversed edge gives the exact negation. Zero counts as inside on both sides, so no fallback to
//! double precision is needed. A parallelogram has a fourth edge and is otherwise treated alike: boxes and rectangles cost
//! half as much as their triangles would.

use glam::Vec3;

use crate::math::float::UNIT_ROUNDOFF;
use crate::tracer::accel::Ray;
use crate::tracer::accel::layout::{CORNER_ROW, F32x8, SHARED_ROWS, block_rows};

use super::ray::{Corner, ShearedRay};
use super::simd::Simd8;

/// The hits in a block.
pub(super) struct BlockHits<S: Simd8> {
    /// Mask of the lanes that were hit. A lane in `doubtful` counts as a hit only if its exact distance does.
    pub(super) mask: u32,
    pub(super) t: F32x8,
    /// Barycentric weights of the second and third corner. The fourth has none: the first three define the plane.
    u: S::Floats,
    v: S::Floats,
    /// Mask of the lanes whose distance is so small that rounding may decide its sign, as for large polygons, or polygons seen
    /// edge-on, close to the origin of the ray.
    pub(super) doubtful: u32,
}

impl<S: Simd8> BlockHits<S> {
    /// Barycentric weights of the second and third corner in `lane`.
    #[inline(always)]
    pub(super) fn uv(&self, s: S, lane: usize) -> [f32; 2] {
        [s.to_array(self.u)[lane & 7], s.to_array(self.v)[lane & 7]]
    }
}

/// Masks from checking candidates for the effects of rounding.
struct HitCheck {
    /// The bounding box of the corners contains the ray, up to rounding.
    in_box: u32,
    /// Rounding may decide the sign of the distance.
    doubtful: u32,
}

/// Checks candidates, of which there are few, by their corners and `z · determinant`.
///
/// The edge functions of a polygon much smaller than its distance from the ray may all round to zero. So it is hit only if
/// the ray passes through its bounding box, which rounding of the corners moves by less than `u (2 |x| + 5 |z|)`, where u is
/// the unit roundoff. This makes no holes in a mesh: of polygons that share rounded corners one contains the ray.
///
/// A distance is doubtful below `z · u · (108 x y + 30 z (x + y))`, from the largest |x|, |y|, |z| in the sheared space (Pharr
/// et al., *Physically Based Rendering*, 4th ed., §6.8.7, with its γ terms multiplied out).
#[inline(always)]
fn check_hits<S: Simd8, const N: usize>(s: S, corners: [Corner<S>; N], scaled: S::Floats) -> HitCheck {
    let ([mut low_x, mut low_y, _], [mut high_x, mut high_y, _]) = (corners[0], corners[0]);
    let mut z = s.abs(corners[0][2]);
    // A loop, because a closure passed to `fold` would not be compiled with the target features of this function.
    for c in corners {
        (low_x, high_x) = (s.min(low_x, c[0]), s.max(high_x, c[0]));
        (low_y, high_y) = (s.min(low_y, c[1]), s.max(high_y, c[1]));
        z = s.max(z, s.abs(c[2]));
    }
    let (x, y) = (s.max(s.abs(low_x), s.abs(high_x)), s.max(s.abs(low_y), s.abs(high_y)));
    let room = s.splat(16.0 * UNIT_ROUNDOFF);
    let (room_x, room_y) = (s.mul(s.add(x, z), room), s.mul(s.add(y, z), room));
    let zero = s.splat(0.0);
    let in_box = s.le(low_x, room_x)
        & s.le(low_y, room_y)
        & s.le(zero, s.add(high_x, room_x))
        & s.le(zero, s.add(high_y, room_y));
    let (a, b) = (s.splat(108.0 * UNIT_ROUNDOFF), s.splat(30.0 * UNIT_ROUNDOFF));
    let doubt = s.mul(z, s.add(s.mul(s.mul(x, y), a), s.mul(s.mul(z, s.add(x, y)), b)));
    HitCheck { in_box, doubtful: s.lt(s.abs(scaled), doubt) }
}

/// Twice the signed area between the ray and the edge from a to b.
#[inline(always)]
fn edge<S: Simd8>(s: S, a: Corner<S>, b: Corner<S>) -> S::Floats {
    s.sub(s.mul(b[0], a[1]), s.mul(b[1], a[0]))
}

/// Intersects triangles without shared vertices: hits with `0 < t < t_max`, or `t ≤ t_max` for `CLOSED`.
#[inline(always)]
pub(super) fn triangles<S: Simd8, const CLOSED: bool>(
    s: S,
    rows: &[F32x8; block_rows(3)],
    ray: &ShearedRay,
    t_max: f32,
) -> Option<BlockHits<S>> {
    let corners = [ray.shear(s, rows, 0), ray.shear(s, rows, 1), ray.shear(s, rows, 2)];
    triangle::<S, CLOSED>(s, corners, ray, t_max)
}

/// As [`triangles`], for a block with shared vertices.
#[inline(always)]
pub(super) fn shared<S: Simd8, const CLOSED: bool>(
    s: S,
    rows: &[F32x8; SHARED_ROWS],
    ray: &ShearedRay,
    t_max: f32,
) -> Option<BlockHits<S>> {
    let ([x, y, z], [x2, y2, z2]) = (ray.shear(s, rows, 0), ray.shear(s, rows, 1));
    let [a, b, c, _] = bytemuck::cast_ref::<F32x8, [[u8; 8]; 4]>(&rows[CORNER_ROW]);
    let (a, b, c) = (s.widen(a), s.widen(b), s.widen(c));
    let corners = [
        [s.lookup(x, x2, a), s.lookup(y, y2, a), s.lookup(z, z2, a)],
        [s.lookup(x, x2, b), s.lookup(y, y2, b), s.lookup(z, z2, b)],
        [s.lookup(x, x2, c), s.lookup(y, y2, c), s.lookup(z, z2, c)],
    ];
    triangle::<S, CLOSED>(s, corners, ray, t_max)
}

/// Intersects triangles, given their corners in the sheared space.
#[inline(always)]
fn triangle<S: Simd8, const CLOSED: bool>(
    s: S,
    [a, b, c]: [Corner<S>; 3],
    ray: &ShearedRay,
    t_max: f32,
) -> Option<BlockHits<S>> {
    let (u, v, w) = (edge(s, b, c), edge(s, c, a), edge(s, a, b));
    let zero = s.splat(0.0);
    // Both are true only if all edge functions are zero: for an empty lane, or a triangle in the plane of the ray.
    let inside = s.le(zero, s.min(u, s.min(v, w))) ^ s.le(s.max(u, s.max(v, w)), zero);
    if inside == 0 {
        return None;
    }
    let inverse = s.div(s.splat(1.0), s.add(s.add(u, v), w));
    let scaled = s.add(s.add(s.mul(u, a[2]), s.mul(v, b[2])), s.mul(w, c[2]));
    let t = s.mul(s.mul(scaled, inverse), s.splat(ray.scale_z));
    let HitCheck { in_box, doubtful } = check_hits(s, [a, b, c], scaled);
    let mask = inside & in_box & ahead::<S, CLOSED>(s, t, t_max, doubtful);
    let (u, v) = (s.mul(v, inverse), s.mul(w, inverse));
    (mask != 0).then(|| BlockHits { mask, t: s.to_array(t), u, v, doubtful })
}

/// As [`triangles`], for parallelograms.
#[inline(always)]
pub(super) fn quads<S: Simd8, const CLOSED: bool>(
    s: S,
    rows: &[F32x8; block_rows(4)],
    ray: &ShearedRay,
    t_max: f32,
) -> Option<BlockHits<S>> {
    let (a, b) = (ray.shear(s, rows, 0), ray.shear(s, rows, 1));
    let (c, d) = (ray.shear(s, rows, 2), ray.shear(s, rows, 3));
    let (ab, bc, cd, da) = (edge(s, a, b), edge(s, b, c), edge(s, c, d), edge(s, d, a));
    let zero = s.splat(0.0);
    let inside =
        s.le(zero, s.min(s.min(ab, bc), s.min(cd, da))) ^ s.le(s.max(s.max(ab, bc), s.max(cd, da)), zero);
    if inside == 0 {
        return None;
    }
    // Opposite edge functions add up to the area: the coordinates x along ab and y along ad are in [0, 1].
    let (x, y) = (s.div(da, s.add(da, bc)), s.div(ab, s.add(ab, cd)));
    // For a parallelogram seen edge-on one of them may be 0/0. Any value in [0, 1] is right then.
    let (x, y) = (s.max(x, zero), s.max(y, zero));
    let tz = s.add(a[2], s.add(s.mul(x, s.sub(b[2], a[2])), s.mul(y, s.sub(d[2], a[2]))));
    let t = s.mul(tz, s.splat(ray.scale_z));
    let HitCheck { in_box, doubtful } = check_hits(s, [a, b, c, d], s.mul(tz, s.add(ab, cd)));
    let mask = inside & in_box & ahead::<S, CLOSED>(s, t, t_max, doubtful);
    // The point is a + x·ab + y·ad, and ad = ac − ab gives the weights in the triangle abc.
    let u = s.sub(x, y);
    (mask != 0).then(|| BlockHits { mask, t: s.to_array(t), u, v: y, doubtful })
}

/// The mask of lanes with `0 < t < t_max`, or `t ≤ t_max` for `CLOSED`. It includes doubtful lanes beyond `t_max`, whose exact
/// distance may be smaller: the result must not depend on the hits found so far.
#[inline(always)]
fn ahead<S: Simd8, const CLOSED: bool>(s: S, t: S::Floats, t_max: f32, doubtful: u32) -> u32 {
    let t_max = s.splat(t_max);
    let before = if CLOSED { s.le(t, t_max) } else { s.lt(t, t_max) };
    s.lt(s.splat(0.0), t) & (before | doubtful)
}

/// The distance to a polygon in double precision, from its plane through the first three corners; NaN where that is crossed beyond all corners,
/// so that the polygon is not.
///
/// A spawned ray starts outside the error box of its surface, so this distance is negative for that surface and for anything
/// in the same plane. It is computed only for distances that came out positive in single precision.
///
/// Of a polygon that is seen edge-on all edge functions consist of rounding, and may say that it is hit. Its plane is then met anywhere.
#[cold]
pub(super) fn exact_distance(corners: [Vec3; 4], ray: &Ray) -> f32 {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let [a, b, c, e] = corners.map(|p| p.as_dvec3());
    let n = (b - a).cross(c - a);
    let t = (a - o).dot(n) / d.dot(n);
    // Along the ray, in units of the squared length of its direction.
    let along = [a, b, c, e].map(|p| (p - o).dot(d));
    let range = along.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let room = 16.0 * f64::from(UNIT_ROUNDOFF) * range.0.abs().max(range.1.abs());
    let at = t * d.length_squared();
    if range.0 - room <= at && at <= range.1 + room { t as f32 } else { f32::NAN }
}

/// The corners of a polygon in a block without shared vertices. A triangle has its third one twice.
#[cold]
pub(super) fn corners(rows: &[F32x8], lane: usize) -> [Vec3; 4] {
    let last = if rows.len() == block_rows(4) { 3 } else { 2 };
    [0, 1, 2, last].map(|corner| Vec3::from_array([0, 1, 2].map(|axis| rows[3 * corner + axis][lane & 7])))
}

/// The corners of a triangle in a block with shared vertices, the third one twice.
#[cold]
pub(super) fn shared_corners(rows: &[F32x8], lane: usize) -> [Vec3; 4] {
    let vertices: &[u8] = bytemuck::cast_slice(&rows[CORNER_ROW]);
    [0, 1, 2, 2].map(|corner| {
        let n = usize::from(vertices[8 * corner + (lane & 7)]);
        Vec3::from_array([0, 1, 2].map(|axis| rows[n / 8 * 3 + axis][n % 8]))
    })
}
