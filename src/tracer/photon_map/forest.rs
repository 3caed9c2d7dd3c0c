//! A growing set of photons as a few immutable trees of doubling size, like the digits of a binary number.
//!
//! This is the logarithmic method (Bentley and Saxe, *Decomposable Searching Problems I*, 1980). Adding generation g merges
//! the trees of the digits that carry over when g is incremented: a photon is moved O(log g) times in all, and a query
//! traverses at most log₂ g + 1 trees, of which the largest holds at least half of the photons. Forests share their trees,
//! so an older forest stays valid, at little cost, while somebody reads it.
//!
//! The traversal of a tree keeps, per axis, how far the query point lies outside a subtree. These numbers are the same differences
//! that distances are computed from, and rounding is monotone, so the bound of a subtree never exceeds the rounded
//! distance of any photon in it: results equal those of a loop over all photons, exactly, at every scale.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f32::consts::PI;
use std::sync::Arc;

use glam::Vec3;

use crate::math::slab::clip;

use super::morton::MortonGrid;
use super::photon::Photon;
use super::tree::{LEAF, PhotonNode, PhotonTree, SortedPhotons, Wanted};

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
        let QueryScratch { stack, found, .. } = scratch;
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

    /// Calls `visit` with every photon that is nearer than `radius` (m) to `beam`, with its place along it (m), in an order that depends on the
    /// forest and the beam alone.
    pub fn along(
        &self,
        beam: &Beam,
        radius: f32,
        scratch: &mut QueryScratch,
        mut visit: impl FnMut(&Photon, f32),
    ) {
        self.trees.iter().for_each(|tree| tree.visit_along(beam, radius, &mut scratch.boxes, &mut visit));
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

/// A photon that a query has found: its position in the [`Forest`] that was asked.
#[derive(Clone, Copy, Debug)]
pub struct Neighbour {
    /// Squared distance to the query point, m².
    pub distance2: f32,
    tree: u32,
    slot: u32,
}

impl PartialEq for Neighbour {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Neighbour {}
impl PartialOrd for Neighbour {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Neighbour {
    fn cmp(&self, other: &Self) -> Ordering {
        self.distance2.total_cmp(&other.distance2)
    }
}

/// A part of a ray in a medium.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// Where it begins, m.
    pub origin: Vec3,
    /// Its unit direction.
    pub direction: Vec3,
    /// Its length, m; may be infinite.
    pub length: f32,
}

/// Buffers that a thread reuses from query to query. They grow to the largest `wanted` seen, then nothing is allocated.
#[derive(Debug, Default)]
pub struct QueryScratch {
    stack: Vec<Subtree>,
    boxes: Vec<BoxedSubtree>,
    found: BinaryHeap<Neighbour>,
}

/// A subtree that has still to be visited.
#[derive(Clone, Copy, Debug)]
struct Subtree {
    /// Lower bound of the squared distance of its photons.
    bound: f32,
    node: u32,
    first: u32,
    end: u32,
    /// Distance from the query to the subtree along each axis.
    outside: Vec3,
}

/// A subtree that a beam has still to visit, with a box of its photons.
#[derive(Clone, Copy, Debug)]
struct BoxedSubtree {
    node: u32,
    first: u32,
    end: u32,
    min: Vec3,
    max: Vec3,
}

impl PhotonTree {
    /// Calls `visit(slot, squared distance)` for every photon whose squared distance is below `limit`. `visit` returns the
    /// limit from then on, which may only become smaller.
    #[inline]
    fn traverse(
        &self,
        at: Vec3,
        mut limit: f32,
        stack: &mut Vec<Subtree>,
        mut visit: impl FnMut(u32, f32) -> f32,
    ) {
        stack.clear();
        if self.is_empty() {
            return;
        }
        let outside = (self.min - at).max(at - self.max).max(Vec3::ZERO);
        let bound = outside.length_squared();
        let mut here = Subtree { bound, node: 0, first: 0, end: self.len() as u32, outside };
        loop {
            if here.bound < limit {
                if let Some((near, far)) = self.children(&here, at) {
                    if far.bound < limit {
                        stack.push(far);
                    }
                    here = near;
                    continue;
                }
                let (first, end) = (here.first as usize, here.end as usize);
                for (slot, &p) in (here.first..).zip(&self.positions[first..end]) {
                    let distance2 = (p - at).length_squared();
                    if distance2 < limit {
                        limit = visit(slot, distance2);
                        // Skips the rest of a long leaf whose photons coincide.
                        if here.bound >= limit {
                            break;
                        }
                    }
                }
            }
            let Some(next) = stack.pop() else { return };
            here = next;
        }
    }

    /// Calls `visit(photon, place along the beam)` for every photon nearer than `radius` to it.
    fn visit_along(
        &self,
        beam: &Beam,
        radius: f32,
        stack: &mut Vec<BoxedSubtree>,
        visit: &mut impl FnMut(&Photon, f32),
    ) {
        let Beam { origin, direction, length } = *beam;
        let inverse = direction.recip();
        // Rounding must not part a box from a photon at the rim.
        let around = radius * 1.001 + 1e-6 * self.min.abs().max(self.max.abs()).max_element();
        let meets = |min: Vec3, max: Vec3| {
            let [enter, leave] = clip(origin, inverse, [min - around, max + around], [0.0, length]);
            enter <= leave
        };
        stack.clear();
        if self.is_empty() {
            return;
        }
        stack.push(BoxedSubtree { node: 0, first: 0, end: self.len() as u32, min: self.min, max: self.max });
        while let Some(here) = stack.pop() {
            if !meets(here.min, here.max) {
                continue;
            }
            if let Some(children) = self.boxed_children(&here) {
                stack.extend(children);
                continue;
            }
            let range = here.first as usize..here.end as usize;
            for (p, photon) in self.positions[range.clone()].iter().zip(&self.photons[range]) {
                let offset = *p - origin;
                let t = offset.dot(direction);
                if t > 0.0 && t < length && (offset - t * direction).length_squared() < radius * radius {
                    visit(photon, t);
                }
            }
        }
    }

    /// The two children of a node with their boxes. `None` for a leaf.
    #[inline]
    fn boxed_children(&self, here: &BoxedSubtree) -> Option<[BoxedSubtree; 2]> {
        if here.end - here.first <= LEAF {
            return None;
        }
        let PhotonNode { left_max, right_min, mid, right } = self.nodes[here.node as usize];
        let axis = right >> 30;
        if axis == PhotonNode::LONG_LEAF {
            return None;
        }
        let (mut left, mut right) = (
            BoxedSubtree { node: here.node + 1, end: mid, ..*here },
            BoxedSubtree { node: right & (u32::MAX >> 2), first: mid, ..*here },
        );
        left.max[axis as usize] = left_max;
        right.min[axis as usize] = right_min;
        Some([left, right])
    }

    /// The two children of a node, the nearer first. `None` for a leaf.
    #[inline(always)]
    fn children(&self, here: &Subtree, at: Vec3) -> Option<(Subtree, Subtree)> {
        if here.end - here.first <= LEAF {
            return None;
        }
        let PhotonNode { left_max, right_min, mid, right } = self.nodes[here.node as usize];
        let axis = right >> 30;
        if axis == PhotonNode::LONG_LEAF {
            return None;
        }
        let axis = axis as usize;
        let (to_left, to_right) = (at[axis] - left_max, right_min - at[axis]);
        let side = |node, first, end, reach: f32| {
            let mut outside = here.outside;
            outside[axis] = outside[axis].max(reach);
            Subtree { bound: outside.length_squared(), node, first, end, outside }
        };
        let left = side(here.node + 1, here.first, mid, to_left);
        let right = side(right & (u32::MAX >> 2), mid, here.end, to_right);
        Some(if to_left <= to_right { (left, right) } else { (right, left) })
    }
}

/// The disc of a density estimate: its area, and the photons that count.
///
/// Radiance is `Σ f · flux / (area · light paths)` over `counted`.
///
/// **Fewer than `wanted` photons were found**: all of them count, the area is π r², and the estimate is unbiased where
/// the density is constant.
/// **The k nearest were found** (`wanted` = k): the radius is the distance of the k-th photon, so that photon lies on the
/// rim by construction. Counting it would overestimate by k/(k − 1): for Poisson points of density ρ, π ρ r_k² has a gamma
/// distribution of shape k, so E[1/(π r_k²)] = ρ/(k − 1). So k − 1 photons count, and the k-th gives the radius only.
#[derive(Clone, Copy, Debug)]
pub struct Disc<'a> {
    /// The photons that count.
    pub counted: &'a [Neighbour],
    /// Area, m².
    pub area: f32,
}

impl<'a> Disc<'a> {
    /// The disc for the result of [`Forest::nearest`], asked for `wanted` ≥ 2 photons within
    /// `radius`. `None` if nothing was found.
    ///
    /// The radius is at least `smallest` (m), so that coincident photons, as in the focus of a caustic or in a beam, have a
    /// finite density.
    pub fn new(found: &'a [Neighbour], wanted: usize, radius: f32, smallest: f32) -> Option<Self> {
        let farthest = found.first()?;
        let (counted, r2) = if found.len() < wanted || wanted < 2 {
            (found, radius * radius)
        } else {
            (&found[1..], farthest.distance2)
        };
        // Divided in this order, neither overflows nor becomes 0 before it has to.
        let area = (PI * r2.max(smallest * smallest)).clamp(f32::MIN_POSITIVE, f32::MAX);
        Some(Self { counted, area })
    }
}
