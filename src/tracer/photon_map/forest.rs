//! A growing set of photons as a few immutable trees of doubling size, like the digits of a binary number.
//!
//! This is the logarithmic method (Bentley and Saxe, *Decomposable Searching Problems I*, 1980). Adding generation g merges
//! the trees of the digits that carry over when g is incremented: a photon is moved O(log g) times in all, and a query
//! traverses at most log₂ g + 1 trees, of which the largest holds at least half of the photons. Forests share their trees,
//! so an older forest stays valid, at little cost, while somebody reads it.

use std::sync::Arc;

use glam::Vec3;

use super::morton::MortonGrid;
use super::photon::Photon;
use super::query::{Neighbour, QueryScratch};
use super::tree::{PhotonTree, SortedPhotons, Wanted};

/// All photons of the first generations. Immutable. Cloning copies a few pointers.
#[derive(Clone, Debug, Default)]
pub struct Forest {
    /// Largest first: one for every digit 1 of the number `generations`.
    trees: Vec<Arc<PhotonTree>>,
    generations: u64,
}

impl Forest {
    /// This forest with one more generation. `None` once `wanted` returns false.
    pub fn grown(&self, grid: &MortonGrid, generation: SortedPhotons, wanted: Wanted<'_>) -> Option<Forest> {
        let carried = self.generations.trailing_ones() as usize;
        let mut trees = self.trees.clone();
        let mut photons = generation;
        for tree in trees.drain(trees.len() - carried..).rev() {
            photons = photons.merged(grid, &tree, wanted)?;
        }
        trees.push(Arc::new(PhotonTree::new(grid, photons, wanted)?));
        Some(Forest { trees, generations: self.generations + 1 })
    }

    /// Finds the `wanted` photons nearest to `at` among those that are nearer than `radius` (m) and that `accept` accepts.
    ///
    /// The result is a heap: the farthest photon comes first, the others in no useful order. Every call on the same forest
    /// gives the same result, also where distances are equal.
    pub fn nearest<'s>(
        &self,
        at: Vec3,
        radius: f32,
        wanted: usize,
        scratch: &'s mut QueryScratch,
        accept: impl Fn(&Photon) -> bool,
    ) -> &'s [Neighbour] {
        let QueryScratch { stack, found } = scratch;
        found.clear();
        // The squared distance below which a photon still counts.
        let mut limit = if wanted > 0 { radius * radius } else { 0.0 };
        for (number, tree) in (0..).zip(&self.trees) {
            tree.traverse(at, limit, stack, |slot, distance2| {
                if accept(&tree.photons[slot as usize]) {
                    let neighbour = Neighbour { distance2, tree: number, slot };
                    if found.len() < wanted {
                        found.push(neighbour);
                    } else if let Some(mut farthest) = found.peek_mut() {
                        *farthest = neighbour;
                    }
                    if found.len() == wanted {
                        limit = found.peek().map_or(limit, |farthest| farthest.distance2);
                    }
                }
                limit
            });
        }
        scratch.found.as_slice()
    }

    /// A photon that [`Forest::nearest`] of this forest has found.
    #[inline]
    pub fn photon(&self, neighbour: &Neighbour) -> &Photon {
        &self.trees[neighbour.tree as usize].photons[neighbour.slot as usize]
    }

    /// The position of such a photon, m.
    #[inline]
    pub fn position(&self, neighbour: &Neighbour) -> Vec3 {
        self.trees[neighbour.tree as usize].positions[neighbour.slot as usize]
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
    pub fn trees(&self) -> impl ExactSizeIterator<Item = &PhotonTree> {
        self.trees.iter().map(|t| &**t)
    }
}
