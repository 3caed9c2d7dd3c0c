//! Triangles seen from close by: points on them are sampled uniformly by the solid angle under which they are seen.
//!
//! See [`rectangle`](super::rectangle) for why. The triangle is projected onto the unit sphere. A share of the solid angle is cut off by an arc from
//! the second vertex to the opposite side, and the point lies on this arc (Arvo, *Stratified Sampling of Spherical Triangles*, SIGGRAPH 1995).
//!
//! relMSE times processor time, and processor time alone, over those of points that are even by area, 128², luminance: the cove with strips of two triangles
//! each, by paths .36, 1.12, bidirectional .97, 1.04; the Cornell box with a lamp of two triangles, none of them close to what is seen, 1.03, 1.03.

use glam::{DVec3, Vec3};

use crate::math::pdf::PdfW;
use crate::tracer::shape::Triangle;

use super::subtended::{LEAST_HEIGHT, NEAR_OVER_FAR_SQUARED, SubtendedShape};

/// Least solid angle in steradians: below it, needles and triangles that are seen from the side lose too many digits.
const LEAST_SOLID_ANGLE: f64 = 1e-3;

/// A triangle as seen from a point before it. In double precision: where the point is close to the plane, the great circles through the vertices nearly
/// coincide.
#[derive(Debug)]
pub struct SubtendedTriangle {
    /// The point.
    p: DVec3,
    /// The plane of the triangle holds the points `x` with `(x − p) · n = plane`.
    n: DVec3,
    plane: f64,
    /// Unit vectors to the vertices.
    vertices: [DVec3; 3],
    /// Volume that is spanned by these vectors.
    volume: f64,
    solid_angle: f64,
}

impl SubtendedTriangle {
    /// The triangle as seen from `p`, where that is before its front and so close that it matters.
    #[inline]
    pub fn new(triangle: &Triangle, p: Vec3) -> Option<Self> {
        let Triangle { p0, e1, e2, n } = *triangle;
        let to = p0 - p;
        let (height, to) = (-to.dot(n), [to, to + e1, to + e2]);
        let farthest2 = to.iter().map(|to| to.length_squared()).fold(0.0, f32::max);
        let may_be_close =
            height * height < NEAR_OVER_FAR_SQUARED * farthest2 && height > LEAST_HEIGHT * farthest2.sqrt();
        if !may_be_close || nearest2(&to, n, height) >= NEAR_OVER_FAR_SQUARED * farthest2 {
            return None;
        }
        let (p, n, exact) = (p.as_dvec3(), n.as_dvec3(), to.map(Vec3::as_dvec3));
        let vertices = exact.map(DVec3::normalize);
        let [a, b, c] = vertices;
        let volume = a.dot(b.cross(c)).abs();
        // Van Oosterom and Strackee, The Solid Angle of a Plane Triangle (1983).
        let solid_angle = 2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        (solid_angle > LEAST_SOLID_ANGLE).then_some(Self {
            p,
            n,
            plane: exact[0].dot(n),
            vertices,
            volume,
            solid_angle,
        })
    }

    /// The density of all points.
    #[inline]
    fn density(&self) -> PdfW {
        PdfW((1.0 / self.solid_angle) as f32)
    }
}

impl SubtendedShape for SubtendedTriangle {
    #[inline]
    fn sample(&self, u: [f32; 2]) -> (Vec3, PdfW) {
        let [a, b, c] = self.vertices;
        // Cosine and sine of the angle at the first vertex, between the planes of its sides, both times |a × b| |a × c|.
        let (cosine, sine) = (a.cross(b).dot(a.cross(c)), self.volume);
        let scale = 1.0 / cosine.hypot(sine);
        let (cosine, sine) = (cosine * scale, sine * scale);
        // s and t are sine and cosine of the solid angle that is cut off less this angle.
        let (sin, cos) = (f64::from(u[0]) * self.solid_angle).sin_cos();
        let (s, t) = (sin * cosine - cos * sine, cos * cosine + sin * sine);
        let (x, y) = (t - cosine, s + sine * a.dot(b));
        // The cosine of the arc from the first vertex to where the third side is cut.
        let q = ((y * t - x * s) * cosine - y) / ((y * s + x * t) * sine);
        // Rounding may lead beyond ±1.
        let cut = on_arc(a, c, q.clamp(-1.0, 1.0));
        let direction = on_arc(b, cut, 1.0 - f64::from(u[1]) * (1.0 - cut.dot(b)));
        let point = self.p + direction * (self.plane / direction.dot(self.n));
        (point.as_vec3(), self.density())
    }

    #[inline]
    fn pdf(&self, _: Vec3) -> PdfW {
        self.density()
    }
}

/// The point of the great circle from `from` through `through` that lies at this cosine from `from`.
#[inline]
fn on_arc(from: DVec3, through: DVec3, cosine: f64) -> DVec3 {
    let perpendicular = (through - from * through.dot(from)).normalize_or_zero();
    from * cosine + perpendicular * (1.0 - cosine * cosine).max(0.0).sqrt()
}

/// The squared distance of the nearest point of a triangle, whose vertices are at `to`, over whose plane with unit normal `n` we are by `height`.
#[inline]
fn nearest2(to: &[Vec3; 3], n: Vec3, height: f32) -> f32 {
    let edge = |i: usize| (to[i], to[(i + 1) % 3]);
    // On which side of each edge the foot of the perpendicular lies.
    let side = |i: usize| n.dot(edge(i).0.cross(edge(i).1));
    let sides = [0, 1, 2].map(side);
    if sides.iter().all(|side| *side >= 0.0) || sides.iter().all(|side| *side <= 0.0) {
        return height * height;
    }
    let to_edge = |i: usize| {
        let (start, along) = (edge(i).0, edge(i).1 - edge(i).0);
        let at = (-start.dot(along) / along.length_squared()).clamp(0.0, 1.0);
        (start + along * at).length_squared()
    };
    [0, 1, 2].map(to_edge).into_iter().fold(f32::INFINITY, f32::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of all proportions, and points from which they are seen: weights of the vertices, and height over the longest side.
    fn seen() -> Vec<(Triangle, SubtendedTriangle)> {
        let corner = Vec3::new(3.0, -1.0, 0.5);
        let triangles = [
            [Vec3::new(1.0, 0.2, 0.0), Vec3::new(0.3, 0.9, 0.4)],
            [Vec3::new(0.0, 0.04, 0.0), Vec3::new(5.0, 0.04, 0.0)],
            [Vec3::new(-0.5, 2.0, 1.0), Vec3::new(-1.5, -1.9, -1.0)],
        ];
        let mut cases = vec![];
        for [e1, e2] in triangles {
            let triangle = Triangle::new([corner, corner + e1, corner + e2]).expect("a triangle");
            for [a, b, z] in [
                [0.3, 0.3, 0.05],
                [0.1, 0.8, 0.01],
                [-0.1, 0.5, 0.1],
                [0.6, 0.6, 0.02],
                [1.0, 0.0, 0.001],
                [0.3, 0.4, 3e-5],
            ] {
                let p = corner + e1 * a + e2 * b + triangle.n * (z * e1.length().max(e2.length()));
                let seen = SubtendedTriangle::new(&triangle, p);
                cases.push((triangle, seen.unwrap_or_else(|| panic!("{triangle:?} from {p}"))));
            }
        }
        cases
    }

    fn grid(n: u32) -> impl Iterator<Item = [f32; 2]> {
        let at = move |i: u32| (i as f32 + 0.5) / n as f32;
        (0..n).flat_map(move |i| (0..n).map(move |j| [at(i), at(j)]))
    }

    /// The weights of the second and the third vertex.
    fn place(triangle: &Triangle, point: DVec3) -> [f64; 2] {
        let [e1, e2, n] = [triangle.e1, triangle.e2, triangle.n].map(Vec3::as_dvec3);
        let (to, area) = (point - triangle.p0.as_dvec3(), e1.cross(e2).dot(n));
        [to.cross(e2).dot(n) / area, e1.cross(to).dot(n) / area]
    }

    /// The solid angle of a triangle of these vertices as seen from the origin, as half of what its sides turn by (the angles of a spherical triangle).
    fn solid_angle(vertices: [DVec3; 3]) -> f64 {
        let angle = |i: usize| {
            let [a, b, c] = [0, 1, 2].map(|k| vertices[(i + k) % 3]);
            a.cross(b).angle_between(a.cross(c))
        };
        (0..3).map(angle).sum::<f64>() - std::f64::consts::PI
    }

    /// Of the four parts into which the middles of its sides divide a triangle each is met as often as its solid angle says, and all points lie in
    /// the triangle.
    #[test]
    fn points_are_uniform_by_solid_angle() {
        for (triangle, seen) in seen() {
            let corners = [Vec3::ZERO, triangle.e1, triangle.e2];
            let at = |weights: [f32; 3]| {
                let sum: Vec3 = (0..3).map(|i| corners[i] * weights[i]).sum();
                (triangle.p0 + sum).as_dvec3() - seen.p
            };
            let whole = solid_angle([at([1.0, 0.0, 0.0]), at([0.0, 1.0, 0.0]), at([0.0, 0.0, 1.0])]);
            assert!((seen.solid_angle / whole - 1.0).abs() < 1e-2, "{seen:?}");
            let [ab, bc, ca] = [at([0.5, 0.5, 0.0]), at([0.0, 0.5, 0.5]), at([0.5, 0.0, 0.5])];
            let parts = [
                [at([1.0, 0.0, 0.0]), ab, ca],
                [ab, at([0.0, 1.0, 0.0]), bc],
                [ca, bc, at([0.0, 0.0, 1.0])],
                [ab, bc, ca],
            ];
            let (n, mut counts) = (256, [0.0; 4]);
            for u in grid(n) {
                let (point, pdf) = seen.sample(u);
                let density = f64::from(pdf.0) * solid_angle(seen.vertices);
                assert!(pdf == seen.pdf(point) && (density - 1.0).abs() < 1e-6, "{density}");
                let [b, c] = place(&triangle, point.as_dvec3());
                let inside = b > -1e-5 && c > -1e-5 && b + c < 1.0 + 1e-5;
                assert!(inside, "{seen:?}, {u:?}: {b} {c}");
                let part = [b + c < 0.5, b > 0.5, c > 0.5].iter().position(|here| *here).unwrap_or(3);
                counts[part] += 1.0 / f64::from(n * n);
            }
            for (count, part) in counts.iter().zip(parts) {
                let wanted = solid_angle(part) / whole;
                assert!((count - wanted).abs() < 4e-3, "{seen:?}: {count}, not {wanted}");
            }
        }
    }

    /// Far away, from behind and seen from the side nothing changes. Close to the plane, an edge or a vertex all is finite.
    #[test]
    fn whatever_is_seen_is_finite() {
        let triangle = Triangle::new([Vec3::ZERO, 3.0 * Vec3::X, Vec3::Y]).expect("a triangle");
        let from = |x: f32, y: f32, z: f32| SubtendedTriangle::new(&triangle, Vec3::new(x, y, z));
        assert!(from(1.0, 0.5, 4.0).is_none() && from(1.0, 0.3, -0.1).is_none());
        assert!(from(5.0, 0.0, 0.01).is_none() && from(f32::NAN, 0.0, 1.0).is_none());
        let places = [-0.5, 0.0, 1e-6, 0.3, 0.5, 1.0, 3.0, 3.1];
        let heights = [0.0, 1e-30, 1e-7, 4e-5, 1e-3, 0.1, 1.0];
        let mut count = 0;
        for (x, y) in places.into_iter().flat_map(|x| places.map(|y| (x, y))) {
            for seen in heights.into_iter().filter_map(|z| from(x, y, z)) {
                for u in [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0], [0.3, 0.999_999_9], [0.5, 0.5]] {
                    let (point, pdf) = seen.sample(u);
                    let [b, c] = place(&triangle, point.as_dvec3());
                    let inside = b > -1e-4 && c > -1e-4 && b + c < 1.0001 && point.z.abs() < 1e-5;
                    assert!(inside && pdf.0 > 0.0 && pdf.0.is_finite(), "{seen:?} {u:?}: {point}, {pdf:?}");
                    count += 1;
                }
            }
        }
        assert!(count > 500, "{count}");
    }
}
