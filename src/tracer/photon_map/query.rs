//! Questions to photons: the nearest few within a radius, and all within a radius.
//!
//! A walk keeps, per axis, how far the query lies outside a subtree. All of it is differences of the very numbers
//! that distances are made of, and rounding is monotone, so a bound never exceeds the rounded distance of any photon
//! below it: answers equal those of a loop over all photons, exactly, at every scale.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::Vec3;

use super::photon::Photon;
use super::tree::{LEAF, Node, Tree};

/// A photon that was found: a place in the forest or tree that was asked.
#[derive(Clone, Copy, Debug)]
pub struct Near {
    /// Squared distance, m².
    pub distance2: f32,
    pub(super) tree: u32,
    pub(super) slot: u32,
}

impl PartialEq for Near {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Near {}
impl PartialOrd for Near {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Near {
    fn cmp(&self, other: &Self) -> Ordering {
        self.distance2.total_cmp(&other.distance2)
    }
}

/// What a thread reuses from query to query; allocates only while it grows to the largest `wanted` seen.
#[derive(Debug, Default)]
pub struct QueryScratch {
    pub(super) open: Vec<Open>,
    pub(super) found: BinaryHeap<Near>,
}

/// A subtree still to be looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Open {
    /// Squared distance below which it holds nothing.
    pub bound: f32,
    pub node: u32,
    pub first: u32,
    pub end: u32,
    /// Distance from the query to the subtree along each axis.
    pub outside: Vec3,
}

/// The `wanted` best of what a walk comes across.
pub(super) struct Nearest<'a> {
    pub wanted: usize,
    pub found: &'a mut BinaryHeap<Near>,
    /// Only what is nearer counts.
    pub limit: f32,
}

impl Nearest<'_> {
    /// Takes in a photon nearer than the limit; returns the new limit.
    #[inline]
    pub fn add(&mut self, near: Near) -> f32 {
        if self.found.len() < self.wanted {
            self.found.push(near);
        } else if let Some(mut farthest) = self.found.peek_mut() {
            *farthest = near;
        }
        if self.found.len() == self.wanted {
            self.limit = self.found.peek().map_or(self.limit, |farthest| farthest.distance2);
        }
        self.limit
    }
}

impl Tree {
    /// Calls `visit(slot, squared distance)` for photons nearer than the square root of `limit`, which `visit`
    /// returns anew each time and may only make smaller.
    #[inline]
    pub(super) fn walk(
        &self,
        at: Vec3,
        mut limit: f32,
        open: &mut Vec<Open>,
        mut visit: impl FnMut(u32, f32) -> f32,
    ) {
        open.clear();
        if self.is_empty() {
            return;
        }
        let outside = (self.min - at).max(at - self.max).max(Vec3::ZERO);
        let bound = outside.length_squared();
        let mut here = Open { bound, node: 0, first: 0, end: self.len() as u32, outside };
        loop {
            if here.bound < limit {
                if let Some((near, far)) = self.children(&here, at) {
                    if far.bound < limit {
                        open.push(far);
                    }
                    here = near;
                    continue;
                }
                let (first, end) = (here.first as usize, here.end as usize);
                for (slot, &p) in (here.first..).zip(&self.positions[first..end]) {
                    let distance2 = (p - at).length_squared();
                    if distance2 < limit {
                        limit = visit(slot, distance2);
                        // Spares the rest of a long leaf whose photons all lie in one point.
                        if here.bound >= limit {
                            break;
                        }
                    }
                }
            }
            let Some(next) = open.pop() else { return };
            here = next;
        }
    }

    /// The two sides of a split, the nearer first; `None` for a leaf.
    #[inline(always)]
    fn children(&self, here: &Open, at: Vec3) -> Option<(Open, Open)> {
        if here.end - here.first <= LEAF {
            return None;
        }
        let Node { left_max, right_min, mid, right } = self.nodes[here.node as usize];
        let axis = right >> 30;
        if axis == Node::LONG_LEAF {
            return None;
        }
        let axis = axis as usize;
        let (to_left, to_right) = (at[axis] - left_max, right_min - at[axis]);
        let side = |node, first, end, reach: f32| {
            let mut outside = here.outside;
            outside[axis] = outside[axis].max(reach);
            Open { bound: outside.length_squared(), node, first, end, outside }
        };
        let left = side(here.node + 1, here.first, mid, to_left);
        let right = side(right & (u32::MAX >> 2), mid, here.end, to_right);
        Some(if to_left <= to_right { (left, right) } else { (right, left) })
    }

    /// Photon of a slot.
    #[inline]
    pub(super) fn photon(&self, slot: u32) -> &Photon {
        &self.photons[slot as usize]
    }
}
