//! From obvhs's binary tree to nodes of four children and leaves of whole triangle blocks.
//!
//! Which binary nodes survive is found bottom up by dynamic programming over the surface area heuristic
//! (Ylitie, Karras and Laine, *Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*, 2017, §3.1).

use glam::{Vec3, Vec4};
use obvhs::bvh2::Bvh2;

use super::block::TriBlock;

/// Price of four box tests; the unit.
const NODE_COST: f32 = 1.0;
/// Price of one block of four triangles, in box tests.
const BLOCK_COST: f32 = 1.0;
/// Price of a disk or sphere.
const ANALYTIC_COST: f32 = 1.0;
/// Most triangles in a leaf.
const MAX_LEAF: u32 = 8;
const WIDTH: usize = 4;

/// A node or leaf: bit 31 marks a leaf, bit 30 a leaf with one disk or sphere (its id in the rest); a leaf of
/// triangles holds its first block in the bits above the lowest, and in the lowest whether there is a second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(pub(super) u32);

const LEAF: u32 = 1 << 31;
const ANALYTIC: u32 = 1 << 30;

impl Child {
    #[inline(always)]
    pub(super) fn node(self) -> Option<usize> {
        (self.0 & LEAF == 0).then_some(self.0 as usize)
    }

    /// Blocks of a triangle leaf, `None` for a disk or sphere.
    #[inline(always)]
    pub(super) fn blocks(self) -> Option<std::ops::Range<usize>> {
        let first = ((self.0 & !LEAF) >> 1) as usize;
        (self.0 & ANALYTIC == 0).then_some(first..first + 1 + (self.0 & 1) as usize)
    }

    #[inline(always)]
    pub(super) fn analytic(self) -> u32 {
        self.0 & !(LEAF | ANALYTIC)
    }
}

/// Four boxes: rows `x_lo x_hi y_lo y_hi z_lo z_hi`, then the children as bits, then nothing: two cache lines,
/// and a row number can be masked instead of checked. An unused lane has its box inside out.
#[derive(Clone, Copy, Debug)]
#[repr(align(128))]
pub(super) struct WideNode {
    rows: [Vec4; 8],
}

impl WideNode {
    #[inline(always)]
    pub(super) fn row(&self, i: usize) -> Vec4 {
        self.rows[i & 7]
    }

    #[inline(always)]
    pub(super) fn child(&self, lane: usize) -> Child {
        Child(self.rows[6].to_array()[lane & 3].to_bits())
    }

    fn new(children: &[(Vec3, Vec3, Child)]) -> Self {
        let mut rows = [[0f32; 4]; 8];
        for axis in 0..3 {
            rows[2 * axis] = [f32::INFINITY; 4];
            rows[2 * axis + 1] = [f32::NEG_INFINITY; 4];
        }
        for (lane, (lo, hi, child)) in children.iter().enumerate() {
            for axis in 0..3 {
                rows[2 * axis][lane] = lo[axis];
                rows[2 * axis + 1][lane] = hi[axis];
            }
            rows[6][lane] = f32::from_bits(child.0);
        }
        Self { rows: rows.map(Vec4::from_array) }
    }
}

/// What the dynamic programming knows of one binary node.
#[derive(Clone, Copy, Default)]
struct Plan {
    /// `cost[i]`: cheapest way to make the subtree into at most i + 1 children.
    cost: [f32; WIDTH],
    /// Children given to the left side when it is split over i + 1.
    split: [u8; WIDTH],
    /// Children really used when i + 1 are allowed.
    used: [u8; WIDTH],
    leaf: bool,
    triangles: u32,
    primitives: u32,
}

/// The finished tree.
pub(super) struct Wide {
    pub(super) nodes: Vec<WideNode>,
    pub(super) blocks: Vec<TriBlock>,
    pub(super) root: Child,
    pub(super) depth: usize,
}

/// Collapses `bvh` (one primitive per leaf) over `triangles`; ids from `triangles.len()` on are disks and spheres.
pub(super) fn collapse(bvh: &Bvh2, triangles: &[[Vec3; 3]]) -> Wide {
    let mut order = Vec::with_capacity(bvh.nodes.len());
    let mut stack = vec![0usize];
    while let Some(n) = stack.pop() {
        order.push(n);
        if !bvh.nodes[n].is_leaf() {
            stack.extend([bvh.nodes[n].first_index as usize, bvh.nodes[n].first_index as usize + 1]);
        }
    }
    let mut plans = vec![Plan::default(); bvh.nodes.len()];
    for &n in order.iter().rev() {
        plans[n] = plan(bvh, &plans, n, triangles.len());
    }
    let mut out = Emitter { bvh, triangles, plans, nodes: Vec::new(), blocks: Vec::new() };
    let (root, depth) = out.emit();
    Wide { nodes: out.nodes, blocks: out.blocks, root, depth }
}

fn plan(bvh: &Bvh2, plans: &[Plan], n: usize, triangle_count: usize) -> Plan {
    let node = &bvh.nodes[n];
    let area = node.aabb().half_area();
    let mut p = Plan::default();
    if node.is_leaf() {
        let is_triangle = (bvh.primitive_indices[node.first_index as usize] as usize) < triangle_count;
        (p.primitives, p.triangles, p.leaf) = (1, u32::from(is_triangle), true);
        p.cost = [area * if is_triangle { BLOCK_COST } else { ANALYTIC_COST }; WIDTH];
        p.used = [1; WIDTH];
        return p;
    }
    let (left, right) = (&plans[node.first_index as usize], &plans[node.first_index as usize + 1]);
    p.primitives = left.primitives + right.primitives;
    p.triangles = left.triangles + right.triangles;
    let mut spread = [f32::INFINITY; WIDTH];
    for j in 2..=WIDTH {
        for k in 1..j {
            let cost = left.cost[k - 1] + right.cost[j - k - 1];
            if cost < spread[j - 1] {
                (spread[j - 1], p.split[j - 1]) = (cost, k as u8);
            }
        }
    }
    let inner = area * NODE_COST + spread[WIDTH - 1];
    let fits = p.triangles == p.primitives && p.triangles <= MAX_LEAF;
    let leaf = if fits { area * BLOCK_COST * p.triangles.div_ceil(4) as f32 } else { f32::INFINITY };
    p.leaf = leaf <= inner;
    (p.cost[0], p.used[0]) = (leaf.min(inner), 1);
    for i in 1..WIDTH {
        (p.cost[i], p.used[i]) =
            if spread[i] < p.cost[i - 1] { (spread[i], i as u8 + 1) } else { (p.cost[i - 1], p.used[i - 1]) };
    }
    p
}

struct Emitter<'a> {
    bvh: &'a Bvh2,
    triangles: &'a [[Vec3; 3]],
    plans: Vec<Plan>,
    nodes: Vec<WideNode>,
    blocks: Vec<TriBlock>,
}

impl Emitter<'_> {
    /// Writes the tree depth first, without recursion: the binary tree may be deep. Returns root and depth.
    fn emit(&mut self) -> (Child, usize) {
        if self.plans[0].leaf {
            return (self.leaf(0), 1);
        }
        self.nodes.push(WideNode::new(&[]));
        let (mut todo, mut depth) = (vec![(0usize, 0usize, 1usize)], 1);
        while let Some((binary, slot, level)) = todo.pop() {
            depth = depth.max(level);
            let mut lanes = Vec::with_capacity(WIDTH);
            for member in self.members(binary) {
                let child = if self.plans[member].leaf {
                    self.leaf(member)
                } else {
                    self.nodes.push(WideNode::new(&[]));
                    let index = self.nodes.len() - 1;
                    todo.push((member, index, level + 1));
                    Child(index as u32)
                };
                let aabb = self.bvh.nodes[member].aabb();
                lanes.push((Vec3::from(aabb.min), Vec3::from(aabb.max), child));
            }
            self.nodes[slot] = WideNode::new(&lanes);
        }
        (Child(0), depth)
    }

    /// The binary nodes that become the children of `n`.
    fn members(&self, n: usize) -> Vec<usize> {
        let mut members = Vec::with_capacity(WIDTH);
        let mut todo = vec![(n, WIDTH, true)];
        while let Some((n, allowed, open)) = todo.pop() {
            let plan = &self.plans[n];
            let j = if open { allowed } else { plan.used[allowed - 1] as usize };
            if j == 1 {
                members.push(n);
                continue;
            }
            let (first, k) = (self.bvh.nodes[n].first_index as usize, plan.split[j - 1] as usize);
            todo.push((first + 1, j - k, false));
            todo.push((first, k, false));
        }
        members
    }

    fn leaf(&mut self, n: usize) -> Child {
        let mut ids = Vec::new();
        let mut todo = vec![n];
        while let Some(n) = todo.pop() {
            let node = &self.bvh.nodes[n];
            if node.is_leaf() {
                ids.push(self.bvh.primitive_indices[node.first_index as usize]);
            } else {
                todo.extend([node.first_index as usize + 1, node.first_index as usize]);
            }
        }
        if ids[0] as usize >= self.triangles.len() {
            return Child(LEAF | ANALYTIC | ids[0]);
        }
        let first = self.blocks.len() as u32;
        for four in ids.chunks(4) {
            let lanes: Vec<_> = four.iter().map(|&id| (self.triangles[id as usize], id)).collect();
            self.blocks.push(TriBlock::new(&lanes));
        }
        Child(LEAF | first << 1 | u32::from(ids.len() > 4))
    }
}
