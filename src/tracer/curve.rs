//! Curves with a thickness: hair, fur, strands.
//!
//! A segment of straight lines is the union of all spheres along it, their radius going evenly from one end to the other. A segment of
//! a cubic B-spline is swept by a disk across the curve, and open at its ends. Both are seen from outside only, as by Mitsuba: a ray
//! that starts inside leaves without a hit.

use glam::{DVec3, DVec4, Vec3, Vec4};

use crate::math::float::{UNIT_ROUNDOFF, gamma};

use super::accel::Ray;
use super::shape::{SIDE, SurfacePoint};

/// Deviation of a piece of a curve from a straight one, over its largest radius: bounds the search for hits, not their accuracy.
const BENT: f64 = 0.1;

/// Most pieces of one segment.
const PIECES: f64 = 32.0;

/// Most steps to a hit.
const STEPS: usize = 64;

/// Distance of a hit from the true surface, over the radius.
const ACCURACY: f64 = 1e-6;

/// A piece of a curve.
#[derive(Clone, Copy, Debug)]
pub struct CurvePiece {
    /// Bézier control points: positions in world space, and radii.
    points: [Vec4; 4],
    /// The piece lies within the spheres between its ends when their radii grow by this much. Negative for a straight piece.
    slack: f32,
    /// True if the front is the inside, from which it is never seen.
    inward: bool,
}

/// A hit on a curve as it is found.
struct Found {
    /// Distance of the true surface along the gradient, positive outside.
    distance: f64,
    /// Gradient of the distance: the normal, not of unit length.
    gradient: DVec3,
    /// Parameter of the curve.
    at: f64,
    center: DVec3,
    radius: f64,
}

impl CurvePiece {
    /// A straight piece from one position and radius to another, or `None` if nothing of it can be seen.
    pub fn linear([a, b]: [DVec4; 2], inward: bool) -> Option<Self> {
        let points = [a, a.lerp(b, 1.0 / 3.0), a.lerp(b, 2.0 / 3.0), b].map(DVec4::as_vec4);
        let usable = points.iter().all(|p| p.is_finite()) && a.w.max(b.w) > 0.0;
        usable.then_some(Self { points, slack: -1.0, inward })
    }

    /// The number of pieces that [`CurvePiece::cubic`] makes of a segment.
    pub fn pieces(points: &[DVec4; 4]) -> usize {
        let [a, b, c, d] = bezier(points);
        let bend = (a - 2.0 * b + c).length().max((b - 2.0 * c + d).length());
        let radius = points.iter().map(|p| p.w).fold(0.0, f64::max);
        // From a straight line a cubic deviates by at most ⅛ of its second derivative, which is 6 times the bend.
        (0.75 * bend / (BENT * radius)).sqrt().ceil().clamp(1.0, PIECES) as usize
    }

    /// Pieces of the segment of a uniform cubic B-spline with these control points, as many as [`CurvePiece::pieces`] says; without those of
    /// which nothing can be seen.
    pub fn cubic(points: &[DVec4; 4], inward: bool) -> impl Iterator<Item = Self> {
        let count = Self::pieces(points);
        let whole = bezier(points);
        (0..count).filter_map(move |i| {
            let points = part(&whole, i as f64 / count as f64, (i + 1) as f64 / count as f64);
            let [a, b, c, d] = points;
            let bend = (a - 2.0 * b + c).length().max((b - 2.0 * c + d).length());
            let points = points.map(DVec4::as_vec4);
            let usable = points.iter().all(|p| p.is_finite())
                && points.iter().any(|p| p.w > 0.0)
                && (d - a).truncate().length_squared() > 0.0;
            // Position and radius deviate, each by no more than both together; single precision needs some more room.
            let room = points.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max) * 4.0 * UNIT_ROUNDOFF;
            usable.then_some(Self { points, slack: (1.5 * 0.75 * bend) as f32 + room, inward })
        })
    }

    /// Corners of the bounding box.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let lo = self.points.iter().map(|p| p.truncate() - p.w).fold(Vec3::INFINITY, Vec3::min);
        let hi = self.points.iter().map(|p| p.truncate() + p.w).fold(Vec3::NEG_INFINITY, Vec3::max);
        let room = lo.abs().max(hi.abs()) * (2.0 * UNIT_ROUNDOFF);
        (lo - room, hi + room)
    }

    /// The nearest hit from outside with `0 < t < t_max`.
    pub fn intersect(&self, ray: &Ray, t_max: f32) -> Option<f32> {
        let (t, _) = self.nearest(ray)?;
        let t = t as f32;
        (t > 0.0 && t < t_max).then_some(t)
    }

    /// The nearest hit from outside ahead of the origin of `ray`: its distance and its place.
    fn nearest(&self, ray: &Ray) -> Option<(f64, DVec3)> {
        // In double precision, from near the curve, and with a unit direction.
        let direction = ray.direction.as_dvec3();
        let speed = direction.length();
        let w = direction / speed;
        let origin = ray.origin.as_dvec3();
        let middle = self.points[0].lerp(self.points[3], 0.5).truncate().as_dvec3();
        let ahead = (middle - origin).dot(w);
        let o = origin + w * ahead;
        let [a, b] = [self.points[0], self.points[3]].map(|p| (p + Vec4::W * self.slack.max(0.0)).as_dvec4());
        let [near, far] = within([a, b], o, w)?;
        let t = match self.slack < 0.0 {
            true => Some(near).filter(|t| *t > -ahead)?,
            false => self.approach(o, w, [near.max(-ahead), far])?,
        };
        Some(((t + ahead) / speed, o + w * t))
    }

    /// Goes along a ray of unit direction from the first place, outside the surface, to the surface, but not beyond the last.
    ///
    /// By Newton's method where the ray comes nearer, and by the distance itself where it goes away, as it may on the inner side of a bend.
    /// A step is never much longer than the distance or a share of the radius: it may pass by a sliver of the silhouette, but no more.
    fn approach(&self, o: DVec3, w: DVec3, [from, mut to]: [f64; 2]) -> Option<f64> {
        let (mut t, mut outside, mut entered) = (from, from, false);
        for step in 0..STEPS {
            let found = self.distance(o + w * t);
            let (slope, steepest) = (found.gradient.dot(w), found.gradient.length());
            if step == 0 && found.distance < 0.0 {
                return None;
            }
            if found.distance.abs() <= ACCURACY * found.radius && slope < 0.0 {
                // A little more than the piece, so that no ray passes between two.
                let on_it = (-1e-5..=1.0 + 1e-5).contains(&found.at);
                return on_it.then_some(t - found.distance / slope);
            }
            let safe = found.distance / steepest;
            let next = if found.distance < 0.0 {
                (to, entered) = (t, true);
                t - found.distance / slope
            } else {
                outside = t;
                t + match slope < 0.0 {
                    true => (found.distance / -slope).min((3.0 * safe).max(0.25 * found.radius)),
                    false => safe.max(0.02 * found.radius),
                }
            };
            t = if entered && !(outside < next && next < to) { 0.5 * (outside + to) } else { next };
            if t.is_nan() || t > to {
                return None;
            }
        }
        None
    }

    /// Where a place is seen from a curve that a disk sweeps: the parameter of the disk that it lies in, and the distance beyond its edge.
    fn distance(&self, p: DVec3) -> Found {
        let points = self.points.map(|p| p.as_dvec4());
        let chord = (points[3] - points[0]).truncate();
        let mut at = (p - points[0].truncate()).dot(chord) / chord.length_squared();
        let mut values = bezier_values(&points, at);
        for _ in 0..8 {
            let [c, first, second] = values;
            let away = p - c.truncate();
            let tangent = first.truncate();
            let slope = tangent.length_squared() - away.dot(second.truncate());
            // Near the centre of a bend nothing is seen; the search stays near the piece.
            let step = (away.dot(tangent) / slope.max(0.1 * tangent.length_squared())).clamp(-0.5, 0.5);
            at = (at + step).clamp(-1.0, 2.0);
            values = bezier_values(&points, at);
            if step.abs() < 1e-9 {
                break;
            }
        }
        let [c, first, second] = values;
        let (center, tangent) = (c.truncate(), first.truncate());
        let away = p - center;
        let slope = tangent.length_squared() - away.dot(second.truncate());
        let gradient = away.normalize_or_zero() - tangent * (first.w / slope);
        Found { distance: away.length() - c.w, gradient, at, center, radius: c.w }
    }

    /// The point where `ray` hits, moved onto the surface; `t` is the distance of the hit, which is found again, as that of a sphere.
    pub fn point(&self, ray: &Ray, t: f32) -> SurfacePoint {
        let rounded = || ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(t);
        let near = self.nearest(ray).map_or_else(rounded, |(_, place)| place);
        let (center, radius, n) = if self.slack < 0.0 {
            let [a, b] = [self.points[0], self.points[3]].map(|p| p.as_dvec4());
            let s = sphere_at([a, b], near).clamp(0.0, 1.0);
            let sphere = a.lerp(b, s);
            (sphere.truncate(), sphere.w, near - sphere.truncate())
        } else {
            let found = self.distance(near);
            (found.center, found.radius, found.gradient)
        };
        let outwards = (near - center).normalize_or(DVec3::Z);
        let p = (center + outwards * radius).as_vec3();
        let n = n.normalize_or(DVec3::Z).as_vec3();
        let long = (self.points[3] - self.points[0]).truncate().abs();
        let error = Vec3::splat(radius as f32 * (gamma(4) + 2.0 * ACCURACY as f32))
            + long * gamma(SIDE)
            + p.abs() * (1.01 * UNIT_ROUNDOFF);
        SurfacePoint { p, error, ng: if self.inward { -n } else { n } }
    }
}

/// Bézier control points of a segment of a uniform cubic B-spline.
fn bezier(&[a, b, c, d]: &[DVec4; 4]) -> [DVec4; 4] {
    [(a + 4.0 * b + c) / 6.0, (2.0 * b + c) / 3.0, (b + 2.0 * c) / 3.0, (b + 4.0 * c + d) / 6.0]
}

/// Control points of the part of a Bézier curve between two parameters, by its polar form.
fn part(points: &[DVec4; 4], from: f64, to: f64) -> [DVec4; 4] {
    let blossom = |u: f64, v: f64, w: f64| {
        let [a, b, c, d] = *points;
        let (ab, bc, cd) = (a.lerp(b, u), b.lerp(c, u), c.lerp(d, u));
        ab.lerp(bc, v).lerp(bc.lerp(cd, v), w)
    };
    [blossom(from, from, from), blossom(from, from, to), blossom(from, to, to), blossom(to, to, to)]
}

/// Value, first and second derivative of a Bézier curve.
fn bezier_values(&[a, b, c, d]: &[DVec4; 4], t: f64) -> [DVec4; 3] {
    let (ab, bc, cd) = (a.lerp(b, t), b.lerp(c, t), c.lerp(d, t));
    let (abc, bcd) = (ab.lerp(bc, t), bc.lerp(cd, t));
    [abc.lerp(bcd, t), 3.0 * (bcd - abc), 6.0 * (cd - 2.0 * bc + ab)]
}

/// Which of the spheres from one to another, 0 to 1, touches the surface of their union at a place on it.
fn sphere_at([a, b]: [DVec4; 2], p: DVec3) -> f64 {
    let (axis, shrink) = ((b - a).truncate(), a.w - b.w);
    let spread = axis.length_squared() - shrink * shrink;
    if spread <= 0.0 {
        // One holds the other.
        return if shrink > 0.0 { 0.0 } else { 1.0 };
    }
    ((p - a.truncate()).dot(axis) - a.w * shrink) / spread
}

/// Where a line of unit direction enters and leaves the union of all spheres from one to another.
///
/// Between the spheres the union is a cone that touches both: |p − a|² − r² = g² / d, with d = |b − a|² − (ra − rb)² and g the numerator
/// of [`sphere_at`].
fn within([a, b]: [DVec4; 2], o: DVec3, w: DVec3) -> Option<[f64; 2]> {
    let (axis, shrink) = ((b - a).truncate(), a.w - b.w);
    let spread = axis.length_squared() - shrink * shrink;
    let sphere = |s: DVec4| {
        let from = o - s.truncate();
        let b = from.dot(w);
        let nearest = from - w * b;
        let root = (s.w * s.w - nearest.length_squared()).sqrt();
        [-b - root, -b + root]
    };
    let (mut first, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut add = |t: f64, at: bool| {
        if t.is_finite() && at {
            (first, last) = (first.min(t), last.max(t));
        }
    };
    let at = |t: f64| sphere_at([a, b], o + w * t);
    for t in sphere(a) {
        add(t, at(t) <= 0.0);
    }
    for t in sphere(b) {
        add(t, at(t) >= 1.0);
    }
    if spread > 0.0 {
        let from = o - a.truncate();
        let (along, g) = (w.dot(axis), from.dot(axis) - a.w * shrink);
        let qa = spread - along * along;
        let qb = spread * from.dot(w) - g * along;
        let qc = spread * (from.length_squared() - a.w * a.w) - g * g;
        let root = (qb * qb - qa * qc).sqrt();
        let q = -qb - root.copysign(qb);
        for t in [q / qa, qc / q] {
            add(t, (0.0..=1.0).contains(&at(t)));
        }
    }
    (first <= last).then_some([first, last])
}
