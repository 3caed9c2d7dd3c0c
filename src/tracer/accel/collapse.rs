//! The plan for collapsing the binary BVH: which of its nodes become children of wide nodes, and which become leaves.
//!
//! Dynamic programming finds the plan with the lowest SAH cost bottom-up (Ylitie, Karras and Laine, *Efficient Incoherent
//! Ray Traversal on GPUs Through Compressed Wide BVHs*, 2017, §3.1), in parallel for several subtrees.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use obvhs::bvh2::Bvh2;

use super::kernels::MAX_DEPTH;
use super::layout::WIDTH;

/// Cost of testing the eight boxes of a node: the unit of cost.
const NODE_COST: f32 = 1.0;
/// Cost of a leaf block of eight polygons.
const BLOCK_COST: f32 = 0.7;
/// Cost of a disk or sphere.
const ANALYTIC_COST: f32 = 0.7;
/// Cost of starting the traversal of an instance.
const INSTANCE_COST: f32 = 4.0;
/// Depth up to which the two children of a node are planned in parallel.
const PARALLEL_LEVELS: usize = 12;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Primitive {
    /// A triangle, by id.
    Triangle(u32),
    /// A parallelogram, by the id of its first triangle.
    Quad(u32),
    /// A disk or sphere, by id.
    Analytic(u32),
    /// An instance, by index.
    Instance(u32),
}

/// The BVH is deeper than the traversal stack allows.
#[derive(Debug)]
pub(super) struct TooDeep;

/// The decision for every node of a binary BVH.
pub(super) struct CollapsePlan {
    /// From bit 0 on, three bits for each number of wide children from 2 on: how many of them the left child provides. From
    /// bit [`USED`] on, four bits for each number from 1 on: how many are best used if that many are allowed. Then the bit
    /// [`LEAF`].
    choices: Vec<AtomicU64>,
}

const USED: usize = 24;
const LEAF: u64 = 1 << 60;

#[derive(Clone, Copy)]
struct SubtreeCosts {
    /// The lowest cost if the subtree becomes 1, 2, … wide children.
    cost: [f32; WIDTH],
    /// Numbers of triangles and of parallelograms in the subtree, both [`MANY`] if it contains anything else.
    triangles: u32,
    quads: u32,
}

/// More than a block can hold.
const MANY: u32 = 1 << 20;

/// Plans the collapse of `bvh`, whose leaves are one of `primitives` each.
pub(super) fn plan(bvh: &Bvh2, primitives: &[Primitive]) -> Result<CollapsePlan, TooDeep> {
    let n = bvh.nodes.len();
    let plan = CollapsePlan { choices: (0..n).map(|_| AtomicU64::new(0)).collect() };
    plan.visit(bvh, primitives, 0, 0)?;
    Ok(plan)
}

impl CollapsePlan {
    /// True if the node becomes a leaf.
    pub(super) fn is_leaf(&self, node: usize) -> bool {
        self.choices[node].load(Relaxed) & LEAF != 0
    }

    /// The children, with their number, of the wide node that `node` becomes.
    pub(super) fn wide_children(&self, bvh: &Bvh2, node: usize) -> ([usize; WIDTH], usize) {
        let (mut children, mut count) = ([0; WIDTH], 0);
        let (mut todo, mut left) = ([(0, 0); WIDTH], 1);
        todo[0] = (node, WIDTH as u64);
        while left > 0 {
            left -= 1;
            let (n, used) = todo[left];
            if used == 1 {
                children[count] = n;
                count += 1;
                continue;
            }
            let given = self.choices[n].load(Relaxed) >> (3 * used) & 7;
            let first = bvh.nodes[n].first_index as usize;
            for (n, may) in [(first + 1, used - given), (first, given)] {
                let used = self.choices[n].load(Relaxed) >> (USED as u64 + 4 * may) & 15;
                todo[left] = (n, used.max(1));
                left += 1;
            }
        }
        (children, count)
    }

    fn visit(
        &self,
        bvh: &Bvh2,
        primitives: &[Primitive],
        n: usize,
        level: usize,
    ) -> Result<SubtreeCosts, TooDeep> {
        let node = &bvh.nodes[n];
        if node.is_leaf() {
            let primitive = primitives[bvh.primitive_indices[node.first_index as usize] as usize];
            return Ok(self.leaf(n, node.aabb().half_area(), primitive));
        }
        if level >= MAX_DEPTH {
            return Err(TooDeep);
        }
        let first = node.first_index as usize;
        let visit = |n| self.visit(bvh, primitives, n, level + 1);
        let (left, right) = if level < PARALLEL_LEVELS {
            rayon::join(|| visit(first), || visit(first + 1))
        } else {
            (visit(first), visit(first + 1))
        };
        Ok(self.inner(n, node.aabb().half_area(), &left?, &right?))
    }

    fn leaf(&self, n: usize, area: f32, primitive: Primitive) -> SubtreeCosts {
        let (cost, triangles, quads) = match primitive {
            Primitive::Triangle(_) => (BLOCK_COST, 1, 0),
            Primitive::Quad(_) => (BLOCK_COST, 0, 1),
            Primitive::Analytic(_) => (ANALYTIC_COST, MANY, MANY),
            Primitive::Instance(_) => (INSTANCE_COST, MANY, MANY),
        };
        let used = (1..=WIDTH).fold(0, |bits, i| bits | 1 << (USED + 4 * i));
        self.choices[n].store(used | LEAF, Relaxed);
        SubtreeCosts { cost: [area * cost; WIDTH], triangles, quads }
    }

    fn inner(&self, n: usize, area: f32, left: &SubtreeCosts, right: &SubtreeCosts) -> SubtreeCosts {
        let triangles = (left.triangles + right.triangles).min(MANY);
        let quads = (left.quads + right.quads).min(MANY);
        let mut choices = 0;
        let mut cost = [f32::INFINITY; WIDTH];
        for j in 2..=WIDTH {
            let mut given = 1;
            for k in 1..j {
                let apart = left.cost[k - 1] + right.cost[j - k - 1];
                if apart < cost[j - 1] {
                    (cost[j - 1], given) = (apart, k);
                }
            }
            choices |= (given as u64) << (3 * j);
        }
        let inner = area * NODE_COST + cost[WIDTH - 1];
        let fits = triangles.min(quads) == 0 && triangles.max(quads) <= WIDTH as u32;
        let block = if fits { area * BLOCK_COST } else { f32::INFINITY };
        if fits && block <= inner {
            choices |= LEAF;
        }
        cost[0] = block.min(inner);
        choices |= 1 << (USED + 4);
        let mut used = 1;
        for i in 1..WIDTH {
            if cost[i] < cost[i - 1] {
                used = i as u64 + 1;
            } else {
                cost[i] = cost[i - 1];
            }
            choices |= used << (USED + 4 * (i + 1));
        }
        self.choices[n].store(choices, Relaxed);
        SubtreeCosts { cost, triangles, quads }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;
    use obvhs::aabb::Aabb;
    use obvhs::bvh2::node::Bvh2Node;

    use super::*;

    /// A BVH with one large leaf at each of `levels` levels: collapsing it keeps every level.
    fn chain(levels: usize) -> (Bvh2, Vec<Primitive>) {
        let aabb = |size: f32| Aabb { min: Vec3A::ZERO, max: Vec3A::splat(size) };
        let mut nodes = vec![Bvh2Node::default()];
        for level in 0..levels {
            let (parent, first) = (if level == 0 { 0 } else { 2 * level - 1 }, nodes.len() as u32);
            nodes[parent] = Bvh2Node::new(aabb(1.0), 0, first);
            nodes.extend([Bvh2Node::new(aabb(1.0), 1, 0), Bvh2Node::new(aabb(1.0), 1, level as u32)]);
        }
        (
            Bvh2 { nodes, primitive_indices: vec![0; levels + 1], ..Bvh2::default() },
            vec![Primitive::Triangle(0)],
        )
    }

    #[test]
    fn a_bvh_too_deep_for_the_stack_is_refused() {
        let refused = |levels: usize| {
            let (bvh, primitives) = chain(levels);
            plan(&bvh, &primitives).is_err()
        };
        assert!(!refused(MAX_DEPTH));
        assert!(refused(MAX_DEPTH + 1));
    }
}
