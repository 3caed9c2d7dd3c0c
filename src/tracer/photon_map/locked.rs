//! The paper's own variant: one tree that grows photon by photon behind a reader-writer lock (§3.4).
//!
//! Kept to be measured against the published batches (`tools/bench_photons.rs`). Leaves are lists through one array, in the
//! order in which photons came, so that an overfull leaf at the depth limit needs no other shape.

use std::sync::{PoisonError, RwLock, RwLockReadGuard};

use glam::Vec3;

use super::photon::Photon;
use super::query::{Near, Nearest, Open, QueryScratch};
use super::space::MAX_DEPTH;
use super::tree::LEAF;

/// A [`GrownTree`] behind a lock: adding keeps every reader out, reading keeps every writer out.
#[derive(Debug)]
pub struct LockedTree(RwLock<GrownTree>);

impl LockedTree {
    /// An empty tree over the box of the scene.
    pub fn new(min: Vec3, max: Vec3) -> Self {
        Self(RwLock::new(GrownTree::new(min, max)))
    }

    /// Adds photons under one write lock.
    pub fn add(&self, positions: &[Vec3], photons: &[Photon]) {
        let mut tree = self.0.write().unwrap_or_else(PoisonError::into_inner);
        positions.iter().zip(photons).for_each(|(&position, photon)| tree.add(position, *photon));
    }

    /// The tree, to be read.
    pub fn read(&self) -> RwLockReadGuard<'_, GrownTree> {
        self.0.read().unwrap_or_else(PoisonError::into_inner)
    }
}

/// No photon.
const END: u32 = u32::MAX;
/// Axis of a leaf.
const LEAF_AXIS: u32 = 3;

#[derive(Clone, Copy, Debug)]
struct Cell {
    plane: f32,
    /// Below it the right side lies; 3: a leaf.
    axis: u32,
    /// Left child, the right one follows; of a leaf the newest photon.
    first: u32,
    /// Photons of a leaf.
    count: u32,
}

/// A tree over photons that come one by one.
#[derive(Debug)]
pub struct GrownTree {
    min: Vec3,
    max: Vec3,
    cells: Vec<Cell>,
    positions: Vec<Vec3>,
    photons: Vec<Photon>,
    /// The photon before in the same leaf.
    next: Vec<u32>,
}

impl GrownTree {
    /// An empty tree over the box of the scene.
    pub fn new(min: Vec3, max: Vec3) -> Self {
        let root = Cell { plane: 0.0, axis: LEAF_AXIS, first: END, count: 0 };
        Self { min, max, cells: vec![root], positions: Vec::new(), photons: Vec::new(), next: Vec::new() }
    }

    /// Adds a photon and splits its leaf if that is overfull.
    pub fn add(&mut self, position: Vec3, photon: Photon) {
        let (mut lo, mut hi) = (self.min, self.max);
        let (mut here, mut depth) = (0usize, 0);
        while self.cells[here].axis != LEAF_AXIS {
            let Cell { plane, axis, first, .. } = self.cells[here];
            let axis = axis as usize;
            let right = position[axis] >= plane;
            if right {
                lo[axis] = plane
            } else {
                hi[axis] = plane
            }
            here = first as usize + usize::from(right);
            depth += 1;
        }
        let slot = self.positions.len() as u32;
        self.positions.push(position);
        self.photons.push(photon);
        self.next.push(self.cells[here].first);
        self.cells[here].first = slot;
        self.cells[here].count += 1;
        self.split(here, (lo, hi), depth);
    }

    /// Splits a leaf until no more than [`LEAF`] photons share one, the depth limit or the resolution of `f32` is reached.
    fn split(&mut self, mut here: usize, (mut lo, mut hi): (Vec3, Vec3), mut depth: u32) {
        while self.cells[here].count > LEAF && depth < MAX_DEPTH {
            let side = hi - lo;
            let axis = side.max_position();
            let plane = lo[axis] * 0.5 + hi[axis] * 0.5;
            if !(lo[axis] < plane && plane < hi[axis]) {
                return;
            }
            let children = self.cells.len();
            let empty = Cell { plane: 0.0, axis: LEAF_AXIS, first: END, count: 0 };
            self.cells.extend([empty, empty]);
            let mut slot = self.cells[here].first;
            while slot != END {
                let after = self.next[slot as usize];
                let child = children + usize::from(self.positions[slot as usize][axis] >= plane);
                self.next[slot as usize] = self.cells[child].first;
                self.cells[child].first = slot;
                self.cells[child].count += 1;
                slot = after;
            }
            self.cells[here] = Cell { plane, axis: axis as u32, first: children as u32, count: 0 };
            // One photon more than fits was there, so at most one child is overfull.
            let right = self.cells[children + 1].count > LEAF;
            if right {
                lo[axis] = plane
            } else {
                hi[axis] = plane
            }
            here = children + usize::from(right);
            depth += 1;
        }
    }

    /// As [`Forest::nearest`](super::Forest::nearest).
    pub fn nearest<'s>(
        &self,
        (at, radius): (Vec3, f32),
        wanted: usize,
        scratch: &'s mut QueryScratch,
        accept: impl Fn(&Photon) -> bool,
    ) -> &'s [Near] {
        let QueryScratch { open, found } = scratch;
        found.clear();
        open.clear();
        let mut best = Nearest { wanted, found, limit: if wanted > 0 { radius * radius } else { 0.0 } };
        open.push(Open { bound: 0.0, node: 0, first: 0, end: 0, outside: Vec3::ZERO });
        while let Some(mut here) = open.pop() {
            while here.bound < best.limit {
                let cell = self.cells[here.node as usize];
                if cell.axis == LEAF_AXIS {
                    self.look(cell, at, &mut best, &accept);
                    break;
                }
                let (near, far) = sides(&here, cell, at);
                if far.bound < best.limit {
                    open.push(far);
                }
                here = near;
            }
        }
        scratch.found.as_slice()
    }

    fn look(&self, cell: Cell, at: Vec3, best: &mut Nearest<'_>, accept: impl Fn(&Photon) -> bool) {
        let mut slot = cell.first;
        while slot != END {
            let distance2 = (self.positions[slot as usize] - at).length_squared();
            if distance2 < best.limit && accept(&self.photons[slot as usize]) {
                best.add(Near { distance2, tree: 0, slot });
            }
            slot = self.next[slot as usize];
        }
    }

    /// Number of photons.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// True without photons.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Bytes of memory in use.
    pub fn bytes(&self) -> usize {
        self.cells.len() * size_of::<Cell>()
            + self.len() * (size_of::<Vec3>() + size_of::<Photon>() + size_of::<u32>())
    }
}

/// The two halves of a split cell, the nearer first.
#[inline(always)]
fn sides(here: &Open, cell: Cell, at: Vec3) -> (Open, Open) {
    let axis = cell.axis as usize;
    let to_right = cell.plane - at[axis];
    let side = |node, reach: f32| {
        let mut outside = here.outside;
        outside[axis] = outside[axis].max(reach);
        Open { bound: outside.length_squared(), node, outside, ..*here }
    };
    let (left, right) = (side(cell.first, -to_right), side(cell.first + 1, to_right));
    if to_right > 0.0 { (left, right) } else { (right, left) }
}
