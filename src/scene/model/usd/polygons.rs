//! Polygons of any number of corners, convex or not, as triangles.

use glam::{Vec2, Vec3};

/// Cuts polygons; counts its steps, of which concave polygons need as many as the square of their corners.
pub(super) struct PolygonCutter {
    steps: u64,
    /// Concave polygons that were cut as if they were convex, because the steps were used up.
    pub(super) uncut: usize,
}

impl PolygonCutter {
    pub(super) fn new() -> Self {
        Self { steps: 1 << 28, uncut: 0 }
    }

    /// The triangles of a polygon, as numbers of its corners, in its direction.
    pub(super) fn cut(&mut self, corners: &[Vec3], out: &mut Vec<[u32; 3]>) {
        let count = corners.len() as u32;
        if count < 3 {
            return;
        }
        if count == 3 {
            out.push([0, 1, 2]);
            return;
        }
        let flat = flattened(corners);
        let turns = |a: usize, b: usize, c: usize| (flat[b] - flat[a]).perp_dot(flat[c] - flat[b]);
        let n = corners.len();
        let is_convex = (0..n).all(|i| turns(i, (i + 1) % n, (i + 2) % n) >= 0.0);
        let needed = u64::from(count) * u64::from(count);
        if is_convex || needed > self.steps {
            self.uncut += usize::from(!is_convex);
            out.extend((1..count - 1).map(|i| [0, i, i + 1]));
            return;
        }
        if !ears(&flat, out, &mut self.steps) {
            self.uncut += 1;
        }
    }
}

/// The corners in the plane of the polygon (Newell), so that it goes around against the clock.
fn flattened(corners: &[Vec3]) -> Vec<Vec2> {
    let next = corners.iter().cycle().skip(1);
    let normal: Vec3 = corners.iter().zip(next).map(|(a, b)| (*a - corners[0]).cross(*b - corners[0])).sum();
    let (right, up) = normal.try_normalize().unwrap_or(Vec3::Z).any_orthonormal_pair();
    corners.iter().map(|p| Vec2::new((*p - corners[0]).dot(right), (*p - corners[0]).dot(up))).collect()
}

/// Cuts off corner after corner that has no other one in its triangle; false where the steps did not do.
fn ears(flat: &[Vec2], out: &mut Vec<[u32; 3]>, steps: &mut u64) -> bool {
    let mut left: Vec<u32> = (0..flat.len() as u32).collect();
    let at = |i: u32| flat[i as usize];
    let (mut i, mut failed) = (0, 0);
    // Each turn around the polygon cuts an ear, or the polygon crosses itself.
    while left.len() > 3 {
        let n = left.len();
        let Some(fewer) = steps.checked_sub(n as u64) else {
            out.extend((1..n - 1).map(|i| [left[0], left[i], left[i + 1]]));
            return false;
        };
        *steps = fewer;
        let [a, b, c] = [left[(i + n - 1) % n], left[i % n], left[(i + 1) % n]];
        let turn = (at(b) - at(a)).perp_dot(at(c) - at(b));
        let is_ear = turn > 0.0
            && !left.iter().any(|p| ![a, b, c].contains(p) && contains([at(a), at(b), at(c)], at(*p)));
        if is_ear || turn == 0.0 && failed > n / 2 || failed > n {
            if turn != 0.0 {
                out.push([a, b, c]);
            }
            left.remove(i % n);
            failed = 0;
            i = i.saturating_sub(1);
        } else {
            failed += 1;
            i = (i + 1) % n;
        }
        if i >= left.len() {
            i = 0;
        }
    }
    out.push([left[0], left[1], left[2]]);
    true
}

/// Whether a triangle, which goes around against the clock, has a point in it or on its edge.
fn contains([a, b, c]: [Vec2; 3], p: Vec2) -> bool {
    // A corner at the same place, as keyholes have, is no other corner.
    if p == a || p == b || p == c {
        return false;
    }
    [(a, b), (b, c), (c, a)].iter().all(|(from, to)| (*to - *from).perp_dot(p - *from) >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
        let at = |i: u32| corners[i as usize];
        triangles.iter().map(|[a, b, c]| 0.5 * (at(*b) - at(*a)).cross(at(*c) - at(*a)).z).sum()
    }

    /// The signed areas of the triangles add up to that of the polygon, and none is turned around.
    #[test]
    fn concave_polygons_are_covered_once() {
        let star: Vec<Vec3> = (0..20)
            .map(|i| {
                let (radius, angle) = ([1.0, 0.3][i % 2], i as f32 * std::f32::consts::TAU / 20.0);
                Vec3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
            })
            .collect();
        let comb: Vec<Vec3> = [
            [0., 0.],
            [7., 0.],
            [7., 3.],
            [6., 3.],
            [6., 1.],
            [4., 1.],
            [4., 3.],
            [3., 3.],
            [3., 1.],
            [1., 1.],
            [1., 3.],
            [0., 3.],
        ]
        .iter()
        .map(|[x, y]| Vec3::new(*x, *y, 0.0))
        .collect();
        let arrow = [[0., 0.], [2., 1.], [0., 2.], [0.5, 1.]].map(|[x, y]| Vec3::new(x, y, 0.0));
        let shoelace = |p: &[Vec3]| -> f32 {
            0.5 * (0..p.len()).map(|i| p[i].cross(p[(i + 1) % p.len()]).z).sum::<f32>()
        };
        for polygon in [&star[..], &comb, &arrow] {
            let mut triangles = Vec::new();
            PolygonCutter::new().cut(polygon, &mut triangles);
            let all = area(polygon, &triangles);
            assert!((all - shoelace(polygon)).abs() < 1e-4, "{all} {}", shoelace(polygon));
            assert!(triangles.iter().all(|t| area(polygon, &[*t]) >= 0.0), "{triangles:?}");
        }
    }
}
