//! Which primitives lie in one place: what is back to back with another is met as its other side.

use std::collections::HashMap;

use glam::Vec3;

/// The exact place of a primitive: up to four points, sorted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct PlaceKey([[u32; 3]; 4]);

fn bits(p: Vec3) -> [u32; 3] {
    // Adding 0 turns −0 into 0.
    (p + 0.0).to_array().map(f32::to_bits)
}

impl PlaceKey {
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

/// Primitives by place, each with its normal. The map is never iterated, so its order does not matter.
#[derive(Debug, Default)]
pub(super) struct Places(HashMap<PlaceKey, (usize, Vec3)>);

impl Places {
    /// Finds the primitive at the same place that faces the other way, if it has no back yet, and removes it.
    pub(super) fn take(&mut self, key: PlaceKey, n: Vec3) -> Option<usize> {
        let &(index, other) = self.0.get(&key)?;
        if other.dot(n) >= 0.0 {
            return None;
        }
        self.0.remove(&key);
        Some(index)
    }

    /// Adds primitive `index` of its kind, unless there is one at its place already.
    pub(super) fn add(&mut self, key: PlaceKey, n: Vec3, index: usize) {
        self.0.entry(key).or_insert((index, n));
    }
}
