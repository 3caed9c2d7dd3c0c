//! Shapes that lie back to back in exactly the same place, as scenes say that something emits on both sides.
//!
//! Two such primitives are one to the tree: which of them a ray met would be left to rounding, and half of the
//! light would be lost. The second is kept as the back of the first, and whoever looks from there sees it.

use std::collections::HashMap;

use glam::Vec3;

/// What primitive shows on its back, where another one lies.
#[derive(Clone, Copy, Debug)]
pub(in crate::tracer) struct Back {
    /// Index into the surfaces.
    pub(in crate::tracer) surface: u32,
    /// Index into the lights, or `NONE`.
    pub(in crate::tracer) light: u32,
}

/// The place of a primitive, to the bit: up to four points, in an order of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Key([[u32; 3]; 4]);

fn bits(p: Vec3) -> [u32; 3] {
    // Both zeros are one.
    (p + 0.0).to_array().map(f32::to_bits)
}

impl Key {
    /// A triangle or parallelogram, wherever its corners start and whichever way around they go.
    pub(super) fn polygon<const N: usize>(corners: [Vec3; N]) -> Self {
        let mut points = [[u32::MAX; 3]; 4];
        for (point, corner) in points.iter_mut().zip(corners) {
            *point = bits(corner);
        }
        points.sort_unstable();
        Self(points)
    }

    /// A disk with its radii, or a sphere with its radius.
    pub(super) fn round(center: Vec3, a: Vec3, b: Vec3) -> Self {
        Self([[0, u32::MAX, 0], bits(center), bits(a), bits(b)])
    }
}

/// Primitives by place, each with its normal; only asked by key, so that its order does not matter.
#[derive(Debug, Default)]
pub(super) struct Places(HashMap<Key, (usize, Vec3)>);

impl Places {
    /// The primitive at the same place that faces the other way, if it has no back yet.
    pub(super) fn take(&mut self, key: Key, n: Vec3) -> Option<usize> {
        let &(index, other) = self.0.get(&key)?;
        if other.dot(n) >= 0.0 {
            return None;
        }
        self.0.remove(&key);
        Some(index)
    }

    /// Remembers primitive `index` of its kind, unless something lies there already.
    pub(super) fn add(&mut self, key: Key, n: Vec3, index: usize) {
        self.0.entry(key).or_insert((index, n));
    }
}
