//! From obvhs's binary tree to nodes of four children and leaves of whole triangle blocks.
//!
//! Which binary nodes survive is found bottom up by dynamic programming over the surface area heuristic
//! (Ylitie, Karras and Laine, *Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*, 2017, §3.1).

use glam::{Vec3, Vec4};
use obvhs::bvh2::Bvh2;

use super::block::{QuadBlock, TriBlock};

/// Price of four box tests; the unit.
const NODE_COST: f32 = 1.0;
/// Price of one block of four triangles, in box tests.
const BLOCK_COST: f32 = 1.0;
/// Price of a disk or sphere.
const ANALYTIC_COST: f32 = 1.0;
/// Most triangles or parallelograms in a leaf.
const MAX_LEAF: u32 = 8;
const WIDTH: usize = 4;

/// A primitive as the tree sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Item {
    /// A triangle, by id.
    Triangle(u32),
    /// A parallelogram, by the id of its first triangle.
    Quad(u32),
    /// A disk or sphere, by id.
    Analytic(u32),
}

/// A node or leaf: bit 31 marks a leaf, bits 30 and 29 its kind. A disk or sphere has its id in the rest, a leaf of
/// blocks its first block in the bits above the lowest, and in the lowest whether there is a second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(pub(super) u32);

const LEAF: u32 = 1 << 31;
const ANALYTIC: u32 = 1 << 30;
const QUADS: u32 = 1 << 29;

/// What a leaf holds.
pub(super) enum Leaf {
    /// Blocks of triangles.
    Triangles(std::ops::Range<usize>),
    /// Blocks of parallelograms.
    Quads(std::ops::Range<usize>),
    /// One disk or sphere.
    Analytic(u32),
}

impl Child {
    #[inline(always)]
    pub(super) fn node(self) -> Option<usize> {
        (self.0 & LEAF == 0).then_some(self.0 as usize)
    }

    #[inline(always)]
    pub(super) fn leaf(self) -> Leaf {
        let rest = self.0 & !(LEAF | ANALYTIC | QUADS);
        let first = (rest >> 1) as usize;
        let blocks = first..first + 1 + (rest & 1) as usize;
        if self.0 & QUADS != 0 {
            Leaf::Quads(blocks)
        } else if self.0 & ANALYTIC == 0 {
            Leaf::Triangles(blocks)
        } else {
            Leaf::Analytic(rest)
        }
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
    /// How many primitives there are below, and of these triangles and parallelograms.
    primitives: u32,
    triangles: u32,
    quads: u32,
}

/// The finished tree.
pub(super) struct Wide {
    pub(super) nodes: Vec<WideNode>,
    pub(super) blocks: Vec<TriBlock>,
    pub(super) quads: Vec<QuadBlock>,
    pub(super) root: Child,
    pub(super) depth: usize,
}

/// Collapses `bvh` (one of `items` per leaf) over `triangles`.
pub(super) fn collapse(bvh: &Bvh2, items: &[Item], triangles: &[[Vec3; 3]]) -> Wide {
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
        plans[n] = plan(bvh, &plans, n, items);
    }
    let (nodes, blocks, quads) = (Vec::new(), Vec::new(), Vec::new());
    let mut out = Emitter { bvh, items, triangles, plans, nodes, blocks, quads };
    let (root, depth) = out.emit();
    Wide { nodes: out.nodes, blocks: out.blocks, quads: out.quads, root, depth }
}

fn plan(bvh: &Bvh2, plans: &[Plan], n: usize, items: &[Item]) -> Plan {
    let node = &bvh.nodes[n];
    let area = node.aabb().half_area();
    let mut p = Plan::default();
    if node.is_leaf() {
        (p.primitives, p.leaf) = (1, true);
        let cost = match items[bvh.primitive_indices[node.first_index as usize] as usize] {
            Item::Triangle(_) => {
                p.triangles = 1;
                BLOCK_COST
            }
            Item::Quad(_) => {
                p.quads = 1;
                BLOCK_COST
            }
            Item::Analytic(_) => ANALYTIC_COST,
        };
        p.cost = [area * cost; WIDTH];
        p.used = [1; WIDTH];
        return p;
    }
    let (left, right) = (&plans[node.first_index as usize], &plans[node.first_index as usize + 1]);
    p.primitives = left.primitives + right.primitives;
    p.triangles = left.triangles + right.triangles;
    p.quads = left.quads + right.quads;
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
    let fits = p.triangles.max(p.quads) == p.primitives && p.primitives <= MAX_LEAF;
    let leaf = if fits { area * BLOCK_COST * p.primitives.div_ceil(4) as f32 } else { f32::INFINITY };
    p.leaf = leaf <= inner;
    (p.cost[0], p.used[0]) = (leaf.min(inner), 1);
    for (i, &apart) in spread.iter().enumerate().skip(1) {
        (p.cost[i], p.used[i]) =
            if apart < p.cost[i - 1] { (apart, i as u8 + 1) } else { (p.cost[i - 1], p.used[i - 1]) };
    }
    p
}

struct Emitter<'a> {
    bvh: &'a Bvh2,
    items: &'a [Item],
    triangles: &'a [[Vec3; 3]],
    plans: Vec<Plan>,
    nodes: Vec<WideNode>,
    blocks: Vec<TriBlock>,
    quads: Vec<QuadBlock>,
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
        let (mut triangles, mut quads) = (Vec::new(), Vec::new());
        let mut todo = vec![n];
        while let Some(n) = todo.pop() {
            let node = &self.bvh.nodes[n];
            if !node.is_leaf() {
                todo.extend([node.first_index as usize + 1, node.first_index as usize]);
                continue;
            }
            match self.items[self.bvh.primitive_indices[node.first_index as usize] as usize] {
                Item::Triangle(id) => triangles.push((self.triangles[id as usize], id)),
                Item::Quad(id) => {
                    let ([a, b, c], [_, _, d]) =
                        (self.triangles[id as usize], self.triangles[id as usize + 1]);
                    quads.push(([a, b, c, d], id));
                }
                // Always alone.
                Item::Analytic(id) => return Child(LEAF | ANALYTIC | id),
            }
        }
        let two = u32::from(triangles.len().max(quads.len()) > 4);
        if quads.is_empty() {
            let first = self.blocks.len() as u32;
            self.blocks.extend(triangles.chunks(4).map(TriBlock::new));
            Child(LEAF | first << 1 | two)
        } else {
            let first = self.quads.len() as u32;
            self.quads.extend(quads.chunks(4).map(QuadBlock::new));
            Child(LEAF | QUADS | first << 1 | two)
        }
    }
}
