//! Eight triangles, or eight parallelograms, at a time, watertight.
//!
//! Woop, Benthin and Wald, *Watertight Ray/Triangle Intersection*, JCGT 2(1), 2013: the vertices are sheared
//! into a space where the ray is the z axis, so that a shared vertex rounds the same for every triangle around
//! it, and the three edge functions are products and differences with separate rounding. Rounding is
//! monotone: a sign is right or zero, and an edge walked the other way gives the exact negation. Zero counts
//! as inside on both sides, so no fallback to double precision is needed to decide. A parallelogram has a fourth
//! edge and is otherwise the same: boxes and rectangles cost half of what their triangles would.

use glam::Vec3;

use crate::math::float::UNIT_ROUNDOFF;
use crate::tracer::accel::Ray;
use crate::tracer::accel::layout::{NUMBERS, Row, SHARED_ROWS, block_rows};

use super::lanes::Lanes;
use super::ray::{Corner, ShearedRay};

/// Lanes that were hit, with what belongs to them.
pub(super) struct Hits<S: Lanes> {
    /// Bit i is set when lane i was hit; where its distance is in doubt, unless a closer look says otherwise.
    pub(super) mask: u32,
    pub(super) t: Row,
    /// Weights of the second and third corner (and none of the fourth: the plane is that of the first three).
    u: S::Floats,
    v: S::Floats,
    /// Bits of the lanes whose distance is so small that its sign may be rounding: of a polygon that is large, or seen
    /// edge-on, from close by.
    pub(super) doubtful: u32,
}

impl<S: Lanes> Hits<S> {
    /// Barycentric weights of the second and third corner in `lane`.
    #[inline(always)]
    pub(super) fn uv(&self, s: S, lane: usize) -> [f32; 2] {
        [s.to_array(self.u)[lane & 7], s.to_array(self.v)[lane & 7]]
    }
}

/// What a closer look at candidates says, each a mask.
struct Look {
    /// The corners lie around the ray, or beside it by no more than their rounding.
    around: u32,
    /// The sign of the distance may be rounding.
    doubtful: u32,
}

/// Looks at candidates, of which there are few, by their corners and `z · determinant`.
///
/// The edge functions of a polygon much smaller than its distance from the ray may all round to zero: it is hit only if
/// the ray passes its box, which rounding of the corners moves by less than `u (2 |x| + 5 |z|)`, u the unit roundoff. A mesh has no
/// holes for it: of polygons that share rounded corners one has the ray within.
///
/// A distance is in doubt below `z · u · (108 x y + 30 z (x + y))`, from the largest |x|, |y|, |z| in the sheared space (Pharr et al.,
/// *Physically Based Rendering*, 4th ed., §6.8.7, its γ's multiplied out).
#[inline(always)]
fn look<S: Lanes, const N: usize>(s: S, corners: [Corner<S>; N], scaled: S::Floats) -> Look {
    let ([mut low_x, mut low_y, _], [mut high_x, mut high_y, _]) = (corners[0], corners[0]);
    let mut z = s.abs(corners[0][2]);
    // A loop: a closure handed to `fold` is not compiled with the instructions of this function.
    for c in corners {
        (low_x, high_x) = (s.min(low_x, c[0]), s.max(high_x, c[0]));
        (low_y, high_y) = (s.min(low_y, c[1]), s.max(high_y, c[1]));
        z = s.max(z, s.abs(c[2]));
    }
    let (x, y) = (s.max(s.abs(low_x), s.abs(high_x)), s.max(s.abs(low_y), s.abs(high_y)));
    let room = s.splat(16.0 * UNIT_ROUNDOFF);
    let (room_x, room_y) = (s.mul(s.add(x, z), room), s.mul(s.add(y, z), room));
    let zero = s.splat(0.0);
    let around = s.le(low_x, room_x)
        & s.le(low_y, room_y)
        & s.le(zero, s.add(high_x, room_x))
        & s.le(zero, s.add(high_y, room_y));
    let (a, b) = (s.splat(108.0 * UNIT_ROUNDOFF), s.splat(30.0 * UNIT_ROUNDOFF));
    let doubt = s.mul(z, s.add(s.mul(s.mul(x, y), a), s.mul(s.mul(z, s.add(x, y)), b)));
    Look { around, doubtful: s.lt(s.abs(scaled), doubt) }
}

/// Twice the signed area between the ray and the edge from a to b.
#[inline(always)]
fn edge<S: Lanes>(s: S, a: Corner<S>, b: Corner<S>) -> S::Floats {
    s.sub(s.mul(b[0], a[1]), s.mul(b[1], a[0]))
}

/// Tests plain triangles for hits with `0 < t < t_max`, or `≤` for `CLOSED`.
#[inline(always)]
pub(super) fn triangles<S: Lanes, const CLOSED: bool>(
    s: S,
    rows: &[Row; block_rows(3)],
    ray: &ShearedRay,
    t_max: f32,
) -> Option<Hits<S>> {
    let corners = [ray.shear(s, rows, 0), ray.shear(s, rows, 1), ray.shear(s, rows, 2)];
    triangle::<S, CLOSED>(s, corners, ray, t_max)
}

/// As [`triangles`], for triangles that share vertices.
#[inline(always)]
pub(super) fn shared<S: Lanes, const CLOSED: bool>(
    s: S,
    rows: &[Row; SHARED_ROWS],
    ray: &ShearedRay,
    t_max: f32,
) -> Option<Hits<S>> {
    let ([x, y, z], [x2, y2, z2]) = (ray.shear(s, rows, 0), ray.shear(s, rows, 1));
    let [a, b, c, _] = bytemuck::cast_ref::<Row, [[u8; 8]; 4]>(&rows[NUMBERS]);
    let (a, b, c) = (s.numbers(a), s.numbers(b), s.numbers(c));
    let corners = [
        [s.pick(x, x2, a), s.pick(y, y2, a), s.pick(z, z2, a)],
        [s.pick(x, x2, b), s.pick(y, y2, b), s.pick(z, z2, b)],
        [s.pick(x, x2, c), s.pick(y, y2, c), s.pick(z, z2, c)],
    ];
    triangle::<S, CLOSED>(s, corners, ray, t_max)
}

/// Tests triangles by their corners in the sheared space.
#[inline(always)]
fn triangle<S: Lanes, const CLOSED: bool>(
    s: S,
    [a, b, c]: [Corner<S>; 3],
    ray: &ShearedRay,
    t_max: f32,
) -> Option<Hits<S>> {
    let (u, v, w) = (edge(s, b, c), edge(s, c, a), edge(s, a, b));
    let zero = s.splat(0.0);
    // Both only where all are zero: of an empty lane, which is a point, and in the plane of the ray.
    let inside = s.le(zero, s.min(u, s.min(v, w))) ^ s.le(s.max(u, s.max(v, w)), zero);
    if inside == 0 {
        return None;
    }
    let inverse = s.div(s.splat(1.0), s.add(s.add(u, v), w));
    let scaled = s.add(s.add(s.mul(u, a[2]), s.mul(v, b[2])), s.mul(w, c[2]));
    let t = s.mul(s.mul(scaled, inverse), s.splat(ray.scale_z));
    let Look { around, doubtful } = look(s, [a, b, c], scaled);
    let mask = inside & around & ahead::<S, CLOSED>(s, t, t_max, doubtful);
    let (u, v) = (s.mul(v, inverse), s.mul(w, inverse));
    (mask != 0).then(|| Hits { mask, t: s.to_array(t), u, v, doubtful })
}

/// As [`triangles`], for parallelograms.
#[inline(always)]
pub(super) fn quads<S: Lanes, const CLOSED: bool>(
    s: S,
    rows: &[Row; block_rows(4)],
    ray: &ShearedRay,
    t_max: f32,
) -> Option<Hits<S>> {
    let (a, b) = (ray.shear(s, rows, 0), ray.shear(s, rows, 1));
    let (c, d) = (ray.shear(s, rows, 2), ray.shear(s, rows, 3));
    let (ab, bc, cd, da) = (edge(s, a, b), edge(s, b, c), edge(s, c, d), edge(s, d, a));
    let zero = s.splat(0.0);
    let inside =
        s.le(zero, s.min(s.min(ab, bc), s.min(cd, da))) ^ s.le(s.max(s.max(ab, bc), s.max(cd, da)), zero);
    if inside == 0 {
        return None;
    }
    // Opposite edge functions add up to the area: x along ab, y along ad, both in [0, 1].
    let (x, y) = (s.div(da, s.add(da, bc)), s.div(ab, s.add(ab, cd)));
    // Seen edge-on one of them may be 0/0: any place between does.
    let (x, y) = (s.max(x, zero), s.max(y, zero));
    let tz = s.add(a[2], s.add(s.mul(x, s.sub(b[2], a[2])), s.mul(y, s.sub(d[2], a[2]))));
    let t = s.mul(tz, s.splat(ray.scale_z));
    let Look { around, doubtful } = look(s, [a, b, c, d], s.mul(tz, s.add(ab, cd)));
    let mask = inside & around & ahead::<S, CLOSED>(s, t, t_max, doubtful);
    // a + x·ab + y·ad, in terms of the triangle abc: ad = ac − ab.
    let u = s.sub(x, y);
    (mask != 0).then(|| Hits { mask, t: s.to_array(t), u, v: y, doubtful })
}

/// Lanes with `0 < t < t_max`, or `≤` for `CLOSED`; of doubtful ones also those beyond, which a closer look may bring before
/// it: what is found must not depend on what was found earlier.
#[inline(always)]
fn ahead<S: Lanes, const CLOSED: bool>(s: S, t: S::Floats, t_max: f32, doubtful: u32) -> u32 {
    let t_max = s.splat(t_max);
    let before = if CLOSED { s.le(t, t_max) } else { s.lt(t, t_max) };
    s.lt(s.splat(0.0), t) & (before | doubtful)
}

/// The distance to the plane of a polygon again, from its first three corners, in double precision.
///
/// A spawned ray starts outside the error box of its surface, so this is negative for that surface and for
/// whatever lies in the same plane. Only a distance that came out positive is looked at again: one that rounds to zero or below is none.
#[cold]
pub(super) fn plane_t(corners: [Vec3; 3], ray: &Ray) -> f32 {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let n = (b - a).cross(c - a);
    ((a - o).dot(n) / d.dot(n)) as f32
}

/// The first three corners of a polygon of a plain block.
#[cold]
pub(super) fn corners(rows: &[Row], lane: usize) -> [Vec3; 3] {
    [0, 1, 2].map(|corner| Vec3::from_array([0, 1, 2].map(|axis| rows[3 * corner + axis][lane & 7])))
}

/// The corners of a triangle of a block over shared vertices.
#[cold]
pub(super) fn shared_corners(rows: &[Row], lane: usize) -> [Vec3; 3] {
    let numbers: &[u8] = bytemuck::cast_slice(&rows[NUMBERS]);
    [0, 1, 2].map(|corner| {
        let n = usize::from(numbers[8 * corner + (lane & 7)]);
        Vec3::from_array([0, 1, 2].map(|axis| rows[n / 8 * 3 + axis][n % 8]))
    })
}
