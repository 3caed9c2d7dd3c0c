//! An immutable tree of photons: sorted arrays, and 16 bytes for every split that separates photons.
//!
//! Splits stand where the paper puts them, in the middle of the longest side ([`Space`]), until a cell holds at most
//! [`LEAF`] photons or the depth limit is reached. Splits with all photons on one side are skipped, so there are fewer
//! nodes than leaves; the depth stays below [`MAX_DEPTH`](super::space::MAX_DEPTH). A node keeps, instead of the
//! splitting plane, how far the photons of each side reach towards it: tighter, and free of rounding (`walk`).

use glam::Vec3;

use super::photon::Photon;
use super::space::Space;

/// Photons of a leaf, unless the depth limit forces more together (paper §3.4: 5 or 6).
pub const LEAF: u32 = 6;

/// Asked now and then by what takes long: false when nobody waits for it any more.
pub type Wanted<'a> = &'a dyn Fn() -> bool;

/// Photons between two such questions: a tenth of a millisecond.
const PATIENCE: usize = 4096;

/// Photons sorted by their keys, on the way into a tree.
#[derive(Clone, Debug, Default)]
pub struct Run {
    keys: Vec<u64>,
    positions: Vec<Vec3>,
    photons: Vec<Photon>,
}

impl Run {
    /// Sorts photons; those with equal keys keep their order. Positions and photons have the same length.
    pub fn sorted(space: &Space, positions: &[Vec3], photons: &[Photon]) -> Run {
        debug_assert_eq!(positions.len(), photons.len());
        let mut order: Vec<(u64, u32)> =
            positions.iter().zip(0..).map(|(&p, slot)| (space.key(p), slot)).collect();
        order.sort_unstable();
        Run {
            keys: order.iter().map(|o| o.0).collect(),
            positions: order.iter().map(|o| positions[o.1 as usize]).collect(),
            photons: order.iter().map(|o| photons[o.1 as usize]).collect(),
        }
    }

    /// This run and the photons of an older tree over the same space; the older ones first among equal keys. Linear.
    /// `None` once `wanted` says that it is not.
    pub fn merged(self, space: &Space, older: &Tree, wanted: Wanted<'_>) -> Option<Run> {
        if older.is_empty() {
            return Some(self);
        }
        let (n, m) = (self.keys.len(), older.len());
        let mut out = Run {
            keys: Vec::with_capacity(n + m),
            positions: Vec::with_capacity(n + m),
            photons: Vec::with_capacity(n + m),
        };
        let mut next = 0;
        for (slot, (&position, &photon)) in older.positions.iter().zip(&older.photons).enumerate() {
            if slot % PATIENCE == 0 && !wanted() {
                return None;
            }
            // Eight bytes per photon less to keep, for a few nanoseconds here.
            let key = space.key(position);
            let end = next + self.keys[next..].iter().take_while(|&&k| k < key).count();
            out.copy(&self, next..end);
            next = end;
            out.keys.push(key);
            out.positions.push(position);
            out.photons.push(photon);
        }
        out.copy(&self, next..n);
        Some(out)
    }

    fn copy(&mut self, from: &Run, range: std::ops::Range<usize>) {
        self.keys.extend_from_slice(&from.keys[range.clone()]);
        self.positions.extend_from_slice(&from.positions[range.clone()]);
        self.photons.extend_from_slice(&from.photons[range]);
    }
}

/// A split of the photons `a..b` into `a..mid` and `mid..b`.
///
/// Nodes stand depth first: the left child, where it is no leaf, is the next node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// Largest coordinate on the left.
    pub left_max: f32,
    /// Smallest coordinate on the right.
    pub right_min: f32,
    /// First photon of the right child.
    pub mid: u32,
    /// Axis in the highest two bits (3: no split, all photons lie in a smallest cell); below it the right child's node.
    pub right: u32,
}

impl Node {
    /// Marks a leaf of more than [`LEAF`] photons.
    pub const LONG_LEAF: u32 = 3;
}

/// Photons of some generations, sorted, with their splits.
#[derive(Debug, Default)]
pub struct Tree {
    pub(super) min: Vec3,
    pub(super) max: Vec3,
    pub(super) nodes: Vec<Node>,
    pub(super) positions: Vec<Vec3>,
    pub(super) photons: Vec<Photon>,
}

impl Tree {
    /// Builds the splits over a sorted run, in linear time. `None` once `wanted` says that it is not.
    ///
    /// # Panics
    /// With 2^30 photons or more (40 GB), which 30-bit node numbers cannot address.
    pub fn new(space: &Space, run: Run, wanted: Wanted<'_>) -> Option<Tree> {
        assert!(run.keys.len() < 1 << 30, "a photon tree holds less than 2^30 photons");
        let Run { keys, positions, photons } = run;
        let mut splits = Splits { space, keys: &keys, positions: &positions, nodes: Vec::new(), wanted };
        let (min, max) = splits.add(0, keys.len())?;
        let mut nodes = splits.nodes;
        nodes.shrink_to_fit();
        Some(Tree { min, max, nodes, positions, photons })
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
        self.nodes.capacity() * size_of::<Node>()
            + self.positions.capacity() * size_of::<Vec3>()
            + self.photons.capacity() * size_of::<Photon>()
    }

    /// Splits on the longest way down.
    pub fn depth(&self) -> u32 {
        let mut deepest = 0;
        let mut open = vec![(0u32, 0, self.len() as u32, 0u32)];
        while let Some((node, a, b, depth)) = open.pop() {
            deepest = deepest.max(depth);
            if b - a > LEAF {
                let n = self.nodes[node as usize];
                if n.right >> 30 != Node::LONG_LEAF {
                    open.push((node + 1, a, n.mid, depth + 1));
                    open.push((n.right & (u32::MAX >> 2), n.mid, b, depth + 1));
                }
            }
        }
        deepest
    }
}

struct Splits<'a> {
    space: &'a Space,
    keys: &'a [u64],
    positions: &'a [Vec3],
    nodes: Vec<Node>,
    wanted: Wanted<'a>,
}

impl Splits<'_> {
    /// Adds the nodes below the photons `a..b` and returns their bounds. As deep as keys have bits.
    fn add(&mut self, a: usize, b: usize) -> Option<(Vec3, Vec3)> {
        if b - a > PATIENCE && !(self.wanted)() {
            return None;
        }
        let differing = if b - a > LEAF as usize { self.keys[a] ^ self.keys[b - 1] } else { 0 };
        if differing == 0 {
            if b - a > LEAF as usize {
                self.nodes.push(Node {
                    left_max: 0.0,
                    right_min: 0.0,
                    mid: b as u32,
                    right: Node::LONG_LEAF << 30,
                });
            }
            let inside = self.positions[a..b].iter();
            let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            return Some(inside.fold(none, |(lo, hi), &p| (lo.min(p), hi.max(p))));
        }
        let bit = differing.ilog2();
        let mid = a + self.keys[a..b].partition_point(|k| k >> bit & 1 == 0);
        let here = self.nodes.len();
        self.nodes.push(Node { left_max: 0.0, right_min: 0.0, mid: mid as u32, right: 0 });
        let left = self.add(a, mid)?;
        let right_node = self.nodes.len() as u32;
        let right = self.add(mid, b)?;
        let axis = self.space.axis(bit);
        let node = &mut self.nodes[here];
        node.left_max = left.1[usize::from(axis)];
        node.right_min = right.0[usize::from(axis)];
        node.right = u32::from(axis) << 30 | right_node;
        Some((left.0.min(right.0), left.1.max(right.1)))
    }
}
