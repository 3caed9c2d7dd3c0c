//! An immutable binary tree over photons: sorted arrays, and a node of 16 bytes for every split that separates photons.
//!
//! A cell is split in the middle of its longest side ([`MortonGrid`]) until it holds at most [`LEAF`] photons or the depth
//! limit is reached. Splits with all photons on one side are skipped, so there are fewer nodes than leaves, and the depth
//! stays below [`MAX_DEPTH`](super::morton::MAX_DEPTH). Instead of the splitting plane, a node stores how far the photons
//! of each side reach towards it: this is tighter and free of rounding (`forest`).

use glam::Vec3;

use super::morton::MortonGrid;
use super::photon::Photon;

/// Most photons of a leaf, except at the depth limit (paper §3.4: 5 or 6).
pub const LEAF: u32 = 6;

/// A check for cancellation, called about every tenth of a millisecond. It returns false once nobody waits for the result.
pub type Wanted<'a> = &'a dyn Fn() -> bool;

/// Photons that are processed between two checks for cancellation.
const CHECK_INTERVAL: usize = 4096;

/// Photons sorted by Morton code: the input of a tree.
#[derive(Clone, Debug, Default)]
pub struct SortedPhotons {
    codes: Vec<u64>,
    positions: Vec<Vec3>,
    photons: Vec<Photon>,
}

impl SortedPhotons {
    /// Sorts photons. Those with equal codes keep their order. `positions` and `photons` have the same length.
    pub fn sorted(grid: &MortonGrid, positions: &[Vec3], photons: &[Photon]) -> SortedPhotons {
        debug_assert_eq!(positions.len(), photons.len());
        let mut order: Vec<(u64, u32)> =
            positions.iter().zip(0..).map(|(&p, slot)| (grid.code(p), slot)).collect();
        order.sort_unstable();
        SortedPhotons {
            codes: order.iter().map(|o| o.0).collect(),
            positions: order.iter().map(|o| positions[o.1 as usize]).collect(),
            photons: order.iter().map(|o| photons[o.1 as usize]).collect(),
        }
    }

    /// Merges these photons with those of an older tree over the same grid, in linear time. Among equal codes the older
    /// ones come first. `None` once `wanted` returns false.
    pub fn merged(self, grid: &MortonGrid, older: &PhotonTree, wanted: Wanted<'_>) -> Option<SortedPhotons> {
        if older.is_empty() {
            return Some(self);
        }
        let (n, m) = (self.codes.len(), older.len());
        let mut out = SortedPhotons {
            codes: Vec::with_capacity(n + m),
            positions: Vec::with_capacity(n + m),
            photons: Vec::with_capacity(n + m),
        };
        let mut next = 0;
        for (slot, (&position, &photon)) in older.positions.iter().zip(&older.photons).enumerate() {
            if slot % CHECK_INTERVAL == 0 && !wanted() {
                return None;
            }
            // Trees do not store codes: computing one again takes a few nanoseconds and saves eight bytes per photon.
            let code = grid.code(position);
            let end = next + self.codes[next..].iter().take_while(|&&k| k < code).count();
            out.copy(&self, next..end);
            next = end;
            out.codes.push(code);
            out.positions.push(position);
            out.photons.push(photon);
        }
        out.copy(&self, next..n);
        Some(out)
    }

    fn copy(&mut self, from: &SortedPhotons, range: std::ops::Range<usize>) {
        self.codes.extend_from_slice(&from.codes[range.clone()]);
        self.positions.extend_from_slice(&from.positions[range.clone()]);
        self.photons.extend_from_slice(&from.photons[range]);
    }
}

/// A split of the photons `a..b` into `a..mid` and `mid..b`.
///
/// Nodes are in depth-first order: the left child, unless it is a leaf, is the next node.
#[derive(Clone, Copy, Debug)]
pub(super) struct PhotonNode {
    /// Largest coordinate of the left child's photons.
    pub left_max: f32,
    /// Smallest coordinate of the right child's photons.
    pub right_min: f32,
    /// First photon of the right child.
    pub mid: u32,
    /// Axis in the two highest bits (3: no split, all photons lie in one smallest cell), below it the right child's node.
    pub right: u32,
}

impl PhotonNode {
    /// Marks a leaf of more than [`LEAF`] photons.
    pub const LONG_LEAF: u32 = 3;
}

/// Photons of some generations, sorted, with the nodes over them.
#[derive(Debug, Default)]
pub struct PhotonTree {
    pub(super) min: Vec3,
    pub(super) max: Vec3,
    pub(super) nodes: Vec<PhotonNode>,
    pub(super) positions: Vec<Vec3>,
    pub(super) photons: Vec<Photon>,
}

impl PhotonTree {
    /// Builds the nodes over sorted photons, in linear time. `None` once `wanted` returns false.
    ///
    /// # Panics
    /// With 2^30 photons or more (40 GB), which 30-bit node numbers cannot address.
    pub fn new(grid: &MortonGrid, sorted: SortedPhotons, wanted: Wanted<'_>) -> Option<PhotonTree> {
        assert!(sorted.codes.len() < 1 << 30, "a photon tree holds less than 2^30 photons");
        let SortedPhotons { codes, positions, photons } = sorted;
        let mut builder = Builder { grid, codes: &codes, positions: &positions, nodes: Vec::new(), wanted };
        let (min, max) = builder.add(0, codes.len())?;
        let mut nodes = builder.nodes;
        nodes.shrink_to_fit();
        Some(PhotonTree { min, max, nodes, positions, photons })
    }

    /// Number of photons.
    #[inline]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// True without photons.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<PhotonNode>()
            + self.positions.capacity() * size_of::<Vec3>()
            + self.photons.capacity() * size_of::<Photon>()
    }

    /// Number of splits on the longest path from the root to a leaf.
    pub fn depth(&self) -> u32 {
        let mut deepest = 0;
        let mut open = vec![(0u32, 0, self.len() as u32, 0u32)];
        while let Some((node, a, b, depth)) = open.pop() {
            deepest = deepest.max(depth);
            if b - a > LEAF {
                let n = self.nodes[node as usize];
                if n.right >> 30 != PhotonNode::LONG_LEAF {
                    open.push((node + 1, a, n.mid, depth + 1));
                    open.push((n.right & (u32::MAX >> 2), n.mid, b, depth + 1));
                }
            }
        }
        deepest
    }
}

struct Builder<'a> {
    grid: &'a MortonGrid,
    codes: &'a [u64],
    positions: &'a [Vec3],
    nodes: Vec<PhotonNode>,
    wanted: Wanted<'a>,
}

impl Builder<'_> {
    /// Adds the nodes over the photons `a..b` and returns their bounds. Recurses at most once per bit of a code.
    fn add(&mut self, a: usize, b: usize) -> Option<(Vec3, Vec3)> {
        if b - a > CHECK_INTERVAL && !(self.wanted)() {
            return None;
        }
        let differing = if b - a > LEAF as usize { self.codes[a] ^ self.codes[b - 1] } else { 0 };
        if differing == 0 {
            if b - a > LEAF as usize {
                self.nodes.push(PhotonNode {
                    left_max: 0.0,
                    right_min: 0.0,
                    mid: b as u32,
                    right: PhotonNode::LONG_LEAF << 30,
                });
            }
            let inside = self.positions[a..b].iter();
            let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            return Some(inside.fold(none, |(lo, hi), &p| (lo.min(p), hi.max(p))));
        }
        let bit = differing.ilog2();
        let mid = a + self.codes[a..b].partition_point(|k| k >> bit & 1 == 0);
        let here = self.nodes.len();
        self.nodes.push(PhotonNode { left_max: 0.0, right_min: 0.0, mid: mid as u32, right: 0 });
        let left = self.add(a, mid)?;
        let right_node = self.nodes.len() as u32;
        let right = self.add(mid, b)?;
        let axis = self.grid.axis(bit);
        let node = &mut self.nodes[here];
        node.left_max = left.1[usize::from(axis)];
        node.right_min = right.0[usize::from(axis)];
        node.right = u32::from(axis) << 30 | right_node;
        Some((left.0.min(right.0), left.1.max(right.1)))
    }
}
