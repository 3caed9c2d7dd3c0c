//! The exact hit of a ray in double precision, and the error that single precision may have.
//!
//! The bound is a displacement: an answer is right when it is exact for corners that were moved by at most `slack` each,
//! along each axis. In single precision, with R the largest distance of a corner from the ray's origin along an axis
//! and u = 2⁻²⁴, the difference of corner and origin is rounded once, the slope of the shear twice (it is at most 1),
//! its product twice more and the last difference, of up to 2 R, once: 7 u R. Products in an edge function move a corner
//! by another u R. The test asks for 10 u R.

use glam::{DVec3, Vec3};

use pointillist::tracer::accel::{Hit, Ray};

use super::{Answer, Primitives};

const U: f64 = 1.0 / (1 << 24) as f64;

/// The exact result for one polygon and one ray.
#[derive(Clone, Copy, Debug)]
pub enum Verdict {
    Miss,
    /// The line passes an edge, or the ray begins or ends at the surface, within the bound; the polygon is seen edge-on; or
    /// numbers underflow.
    Unsure,
    Hit {
        t: f64,
        /// How far `t` may be off.
        off: f64,
        /// Weights of the second and third corner.
        uv: [f64; 2],
        /// How far the weights may be off.
        uv_off: f64,
    },
}

/// The displacement that single precision is granted, 10 u R.
pub fn rounding(corners: &[DVec3], origin: DVec3) -> f64 {
    10.0 * U * corners.iter().map(|&c| (c - origin).abs().max_element()).fold(0.0, f64::max)
}

/// Judges the triangle or parallelogram over `corners`, in order around it, with `slack` for the corners.
pub fn polygon(corners: &[DVec3], ray: &Ray, slack: f64) -> Verdict {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let z = (0..3).max_by(|&i, &j| d[i].abs().total_cmp(&d[j].abs())).unwrap_or(0);
    let (x, y) = ((z + 1) % 3, (z + 2) % 3);
    if d[z] == 0.0 || !(o + d).is_finite() {
        return Verdict::Miss;
    }
    let sheared: Vec<DVec3> = corners
        .iter()
        .map(|&c| {
            let v = c - o;
            DVec3::new(v[x] - d[x] / d[z] * v[z], v[y] - d[y] / d[z] * v[z], v[z])
        })
        .collect();
    let n = sheared.len();
    let edge = |a: DVec3, b: DVec3| a.x * b.y - a.y * b.x;
    // Underflow of single products is rounding too.
    let doubt = |a: DVec3, b: DVec3| {
        slack * (a.x.abs() + a.y.abs() + b.x.abs() + b.y.abs()) + 2.0 * slack * slack + 1e-44
    };
    let around = |i: usize| (sheared[i], sheared[(i + 1) % n]);
    let edges: Vec<f64> = (0..n).map(|i| edge(around(i).0, around(i).1)).collect();
    let doubts: Vec<f64> = (0..n).map(|i| doubt(around(i).0, around(i).1)).collect();
    let sure = |sign: f64| edges.iter().zip(&doubts).filter(|(e, m)| sign * **e > **m).count();
    let (left, right) = (sure(1.0), sure(-1.0));
    // All corners on one side of the ray, also where they are too close together for their edges to tell.
    let beside = |of: fn(&DVec3) -> f64| {
        sheared.iter().all(|v| of(v) > slack) || sheared.iter().all(|v| of(v) < -slack)
    };
    if left > 0 && right > 0 || beside(|v| v.x) || beside(|v| v.y) {
        return Verdict::Miss;
    }
    let (area, sum) = (edges.iter().sum::<f64>().abs(), doubts.iter().sum::<f64>());
    if left.max(right) < n || area < 2.0 * sum {
        return Verdict::Unsure;
    }
    // A distance is made of products of three coordinates: below 1e-12 they underflow.
    let (low, high) = sheared.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v.z), h.max(v.z)));
    if area * low.abs().max(high.abs()) < 1e-36 {
        return Verdict::Unsure;
    }
    // The distance to the plane, in a formula that has no edge functions.
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let t = (corners[0] - o).dot(normal) / d.dot(normal);
    // Weights are edge functions over their sum; a parallelogram's two coordinates are each off by four times that.
    let uv_off = if n == 3 { 1.0 } else { 8.0 } * sum / (area - sum) + 8.0 * U;
    let off = (uv_off * (high - low) + 1.5 * slack) / d[z].abs();
    let t_max = f64::from(ray.t_max);
    if t + off <= 0.0 || t - off >= t_max {
        return Verdict::Miss;
    }
    if t - off <= 0.0 || t + off >= t_max {
        return Verdict::Unsure;
    }
    let half = [edge(sheared[0], sheared[1]), edge(sheared[1], sheared[2]), edge(sheared[2], sheared[0])];
    let whole = half.iter().sum::<f64>();
    Verdict::Hit { t, off, uv: [half[2] / whole, half[0] / whole], uv_off: 2.0 * uv_off }
}

/// How often the exact result was certain.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// Rays that hit something for certain, and rays that hit nothing for certain.
    pub hits: u32,
    pub misses: u32,
    /// Rays for which only some misses are certain.
    pub unsure: u32,
}

/// Asserts that `answer` is right for a scene of triangles and parallelograms.
pub fn check(polygons: &[(u32, Vec<Vec3>)], ray: &Ray, answer: Answer, tally: &mut Tally) {
    let verdicts = polygons.iter().map(|(id, corners)| {
        let corners: Vec<DVec3> = corners.iter().map(|c| c.as_dvec3()).collect();
        (*id, Hit::DIRECT, polygon(&corners, ray, rounding(&corners, ray.origin.as_dvec3())))
    });
    check_verdicts(verdicts, ray, answer, tally);
}

/// Asserts that `answer` is right, given a verdict on every primitive and instance.
pub fn check_verdicts(
    verdicts: impl Iterator<Item = (u32, u32, Verdict)>,
    ray: &Ray,
    (hit, occluded): Answer,
    tally: &mut Tally,
) {
    let (mut farthest, mut unsure) = (f64::MAX, false);
    let mut own = None;
    for (id, instance, verdict) in verdicts {
        match verdict {
            Verdict::Hit { t, off, .. } => farthest = farthest.min(t + off),
            Verdict::Unsure => unsure = true,
            Verdict::Miss => {}
        }
        if hit.is_some_and(|h| h.prim == id && h.instance == instance) {
            own = Some(verdict);
        }
    }
    if farthest < f64::MAX {
        tally.hits += 1;
        assert!(occluded, "not occluded: {ray:?}");
        let h = hit.unwrap_or_else(|| panic!("missed: {ray:?}"));
        assert!(f64::from(h.t) <= farthest, "a nearer one was missed, {farthest}: {h:?} {ray:?}");
    } else if unsure {
        tally.unsure += 1;
    } else {
        tally.misses += 1;
        assert!(hit.is_none() && !occluded, "nothing is there: {hit:?} {ray:?}");
    }
    let Some(h) = hit else { return };
    assert!(h.t > 0.0 && h.t < ray.t_max, "{h:?} {ray:?}");
    match own.unwrap_or_else(|| panic!("no such primitive: {h:?}")) {
        Verdict::Miss => panic!("this one is not there: {h:?} {ray:?}"),
        Verdict::Unsure => {}
        Verdict::Hit { t, off, uv, uv_off } => {
            assert!((f64::from(h.t) - t).abs() <= off, "{t} ± {off}: {h:?} {ray:?}");
            let near = |i: usize| (f64::from(h.uv[i]) - uv[i]).abs() <= uv_off;
            assert!(near(0) && near(1), "{uv:?} ± {uv_off}: {h:?} {ray:?}");
        }
    }
}
