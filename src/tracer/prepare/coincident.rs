//! Coincident primitives. Of two that lie back to back in the same place, one is stored as the back side of the other. Of several that face the
//! same way only one can be seen.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use crate::tracer::accel::TriangleSource;
use crate::tracer::faces::Faces;

/// Equal for primitives in the same place: the bits of up to four points, sorted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct CoincidenceKey([[u32; 3]; 4]);

fn bits(p: Vec3) -> [u32; 3] {
    // Adding 0 turns −0 into 0.
    (p + 0.0).to_array().map(f32::to_bits)
}

impl CoincidenceKey {
    /// The key of a triangle or parallelogram. It does not depend on the first corner or the orientation.
    pub(super) fn polygon<const N: usize>(corners: [Vec3; N]) -> Self {
        let mut points = [[u32::MAX; 3]; 4];
        for (point, corner) in points.iter_mut().zip(corners) {
            *point = bits(corner);
        }
        points.sort_unstable();
        Self(points)
    }

    /// The key of a disk with its half axes, or of a sphere with its radius.
    pub(super) fn round(center: Vec3, a: Vec3, b: Vec3) -> Self {
        Self([[0, u32::MAX, 0], bits(center), bits(a), bits(b)])
    }

    /// The key of a cylinder, whose axes at the base are perpendicular to each other unless a transform stretches them.
    pub(super) fn tube(base: Vec3, [a, b, axis]: [Vec3; 3]) -> Self {
        Self([[1, u32::MAX, 0], bits(base), bits(axis), bits(a + b)])
    }
}

/// Primitives by their [`CoincidenceKey`], each with its normal.
#[derive(Debug, Default)]
pub(super) struct CoincidentSurfaces {
    /// Never iterated, so its order does not matter.
    known: HashMap<CoincidenceKey, (usize, Vec3)>,
    /// Number of primitives that lie where another faces the same way.
    pub(super) hidden: usize,
}

impl CoincidentSurfaces {
    /// Finds the primitive at the same place that faces the other way, if it has no back yet, and removes it.
    pub(super) fn take(&mut self, key: CoincidenceKey, n: Vec3) -> Option<usize> {
        let &(index, other) = self.known.get(&key)?;
        if other.dot(n) >= 0.0 {
            self.hidden += 1;
            return None;
        }
        self.known.remove(&key);
        Some(index)
    }

    /// The corners of a parallelogram in the order of the one that lies in the same place and faces the same way, if there is one. Rays then
    /// meet both at exactly the same distance, and rounding does not decide which of them is seen where.
    pub(super) fn in_step(&self, faces: &Faces, mut corners: [(Vec3, Vec2); 4]) -> [(Vec3, Vec2); 4] {
        let [a, b, c, d] = corners.map(|corner| corner.0);
        let same_way = |(_, n): &&(usize, Vec3)| n.dot((b - a).cross(d - a)) > 0.0;
        if let Some(&(index, _)) = self.known.get(&CoincidenceKey::polygon([a, b, c, d])).filter(same_way) {
            let first = bits(faces.corners(index)[0]);
            let start = [a, b, c, d].into_iter().position(|corner| bits(corner) == first);
            corners.rotate_left(start.unwrap_or(0));
        }
        corners
    }

    /// Adds primitive `index` of its kind, unless there is one at its place already.
    pub(super) fn add(&mut self, key: CoincidenceKey, n: Vec3, index: usize) {
        self.known.entry(key).or_insert((index, n));
    }
}
