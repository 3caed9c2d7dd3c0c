//! A growing set of photons as a few immutable trees of doubling size, like the digits of a binary number.
//!
//! Adding generation g merges the trees that the increment of g carries over: a photon is moved O(log g) times in all,
//! and a query looks at no more than log₂ g + 1 trees, of which the largest holds at least half of everything
//! (the logarithmic method of Bentley and Saxe 1980, *Decomposable Searching Problems I*). Forests share trees, so the
//! one before stays valid, and cheap, while somebody reads it.

use std::sync::Arc;

use glam::Vec3;

use super::photon::Photon;
use super::query::{Near, Nearest, QueryScratch};
use super::space::Space;
use super::tree::{Run, Tree, Wanted};

/// All photons of the first generations. Immutable; cloning copies a few pointers.
#[derive(Clone, Debug, Default)]
pub struct Forest {
    /// Largest first; one for every digit 1 of `generations`.
    trees: Vec<Arc<Tree>>,
    generations: u64,
}

impl Forest {
    /// This forest with one more generation; `None` once `wanted` says that nobody waits for it.
    pub fn grown(&self, space: &Space, generation: Run, wanted: Wanted<'_>) -> Option<Forest> {
        let carried = self.generations.trailing_ones() as usize;
        let mut trees = self.trees.clone();
        let mut run = generation;
        for tree in trees.drain(trees.len() - carried..).rev() {
            run = run.merged(space, &tree, wanted)?;
        }
        trees.push(Arc::new(Tree::new(space, run, wanted)?));
        Some(Forest { trees, generations: self.generations + 1 })
    }

    /// Finds the `wanted` photons nearest to `at` among those that are nearer than `radius` (m) and that `accept` takes.
    ///
    /// The result is a heap: the farthest photon comes first, the others in no useful order. It is the same for every
    /// call with the same forest. Equal distances are chosen between arbitrarily, but always alike.
    pub fn nearest<'s>(
        &self,
        (at, radius): (Vec3, f32),
        wanted: usize,
        scratch: &'s mut QueryScratch,
        accept: impl Fn(&Photon) -> bool,
    ) -> &'s [Near] {
        let QueryScratch { open, found } = scratch;
        found.clear();
        let mut best = Nearest { wanted, found, limit: if wanted > 0 { radius * radius } else { 0.0 } };
        for (number, tree) in (0..).zip(&self.trees) {
            tree.walk(at, best.limit, open, |slot, distance2| {
                if accept(tree.photon(slot)) {
                    best.add(Near { distance2, tree: number, slot })
                } else {
                    best.limit
                }
            });
        }
        scratch.found.as_slice()
    }

    /// Calls `visit(photon, squared distance)` for every photon nearer to `at` than `radius` (m), always in the same
    /// order for the same forest.
    pub fn within(
        &self,
        (at, radius): (Vec3, f32),
        scratch: &mut QueryScratch,
        mut visit: impl FnMut(&Photon, f32),
    ) {
        let limit = radius * radius;
        for tree in &self.trees {
            tree.walk(at, limit, &mut scratch.open, |slot, distance2| {
                visit(tree.photon(slot), distance2);
                limit
            });
        }
    }

    /// A photon that [`Forest::nearest`] of this forest has found.
    #[inline]
    pub fn photon(&self, near: &Near) -> &Photon {
        self.trees[near.tree as usize].photon(near.slot)
    }

    /// Its position, m.
    #[inline]
    pub fn position(&self, near: &Near) -> Vec3 {
        self.trees[near.tree as usize].positions[near.slot as usize]
    }

    /// Number of photons.
    pub fn len(&self) -> usize {
        self.trees.iter().map(|t| t.len()).sum()
    }

    /// True without photons.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        self.trees.iter().map(|t| t.bytes()).sum()
    }

    /// The trees, largest first.
    pub fn trees(&self) -> impl ExactSizeIterator<Item = &Tree> {
        self.trees.iter().map(|t| &**t)
    }
}
