//! The paper's own variant: one tree that grows photon by photon behind a reader-writer lock (§3.4).
//!
//! Kept to be measured against the published batches (`tools/bench_photons.rs`). A leaf's positions stand together in a
//! block, and an overfull leaf at the depth limit is a list of blocks.

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

/// No block.
const END: u32 = u32::MAX;
/// Axis of a leaf.
const LEAF_AXIS: u32 = 3;

#[derive(Clone, Copy, Debug)]
struct Cell {
    plane: f32,
    /// Below `plane` along this axis lies the left side; 3: a leaf.
    axis: u32,
    /// Left child, the right one follows; of a leaf the newest block.
    first: u32,
    /// Photons of a leaf.
    count: u32,
}

/// Up to [`LEAF`] photons; only the newest block of a leaf may have room.
#[derive(Clone, Copy, Debug)]
struct Block {
    positions: [Vec3; LEAF as usize],
    slots: [u32; LEAF as usize],
    count: u32,
    /// The block before in the same leaf.
    next: u32,
}

impl Block {
    const EMPTY: Block =
        Block { positions: [Vec3::ZERO; LEAF as usize], slots: [0; LEAF as usize], count: 0, next: END };
}

/// A tree over photons that come one by one.
#[derive(Debug)]
pub struct GrownTree {
    min: Vec3,
    max: Vec3,
    cells: Vec<Cell>,
    blocks: Vec<Block>,
    /// Blocks that a split has emptied.
    free: Vec<u32>,
    photons: Vec<Photon>,
}

impl GrownTree {
    /// An empty tree over the box of the scene.
    pub fn new(min: Vec3, max: Vec3) -> Self {
        let root = Cell { plane: 0.0, axis: LEAF_AXIS, first: END, count: 0 };
        Self { min, max, cells: vec![root], blocks: Vec::new(), free: Vec::new(), photons: Vec::new() }
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
        let slot = self.photons.len() as u32;
        self.photons.push(photon);
        self.put(here, position, slot);
        self.split(here, (lo, hi), depth);
    }

    /// Adds a photon to a leaf.
    fn put(&mut self, leaf: usize, position: Vec3, slot: u32) {
        let newest = self.cells[leaf].first;
        let full = newest == END || self.blocks[newest as usize].count == LEAF;
        if full {
            let empty = Block { next: newest, ..Block::EMPTY };
            let place = self.free.pop().unwrap_or(self.blocks.len() as u32);
            if place as usize == self.blocks.len() {
                self.blocks.push(empty);
            } else {
                self.blocks[place as usize] = empty;
            }
            self.cells[leaf].first = place;
        }
        let block = &mut self.blocks[self.cells[leaf].first as usize];
        block.positions[block.count as usize] = position;
        block.slots[block.count as usize] = slot;
        block.count += 1;
        self.cells[leaf].count += 1;
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
            let mut place = self.cells[here].first;
            while place != END {
                let block = self.blocks[place as usize];
                self.free.push(place);
                for (&position, &slot) in block.positions.iter().zip(&block.slots).take(block.count as usize)
                {
                    self.put(children + usize::from(position[axis] >= plane), position, slot);
                }
                place = block.next;
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
        let mut place = cell.first;
        while place != END {
            let block = &self.blocks[place as usize];
            for (&position, &slot) in block.positions.iter().zip(&block.slots).take(block.count as usize) {
                let distance2 = (position - at).length_squared();
                if distance2 < best.limit && accept(&self.photons[slot as usize]) {
                    best.add(Near { distance2, tree: 0, slot });
                }
            }
            place = block.next;
        }
    }

    /// Number of photons.
    pub fn len(&self) -> usize {
        self.photons.len()
    }

    /// True without photons.
    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// Bytes of memory in use.
    pub fn bytes(&self) -> usize {
        self.cells.len() * size_of::<Cell>()
            + self.blocks.len() * size_of::<Block>()
            + self.photons.len() * size_of::<Photon>()
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
