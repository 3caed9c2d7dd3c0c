//! Writing the collapsed BVH to memory in depth-first order: a node, the blocks of its leaves, then its inner children.

use glam::Vec3;
use obvhs::bvh2::Bvh2;
use rayon::prelude::*;

use crate::memory::advise_huge_pages;

use super::collapse::{CollapsePlan, Primitive};
use super::layout::{
    CHILD_ROW, CORNER_ROW, CacheLine, F32x8, Leaf, MAX_SHARED, NODE_LINES, NodeRef, SHARED_ROWS, WIDTH,
    block_rows,
};
use super::shapes::TriangleSource;

/// Levels of nodes that are written first. The subtrees below them are written in parallel.
const UPPER_LEVELS: usize = 3;

pub(super) struct BvhWriter<'a> {
    pub(super) bvh: &'a Bvh2,
    pub(super) plan: &'a CollapsePlan,
    /// The primitives of the leaves of `bvh`.
    pub(super) primitives: &'a [Primitive],
    /// All triangles.
    pub(super) triangles: &'a dyn TriangleSource,
}

/// A subtree that is written later: its node in the binary BVH, and the line and lane where its reference goes.
struct DeferredChild {
    node: usize,
    line: usize,
    lane: usize,
}

impl BvhWriter<'_> {
    /// Writes the whole BVH and returns its root.
    pub(super) fn write(&self, arena: &mut ArenaBuilder) -> NodeRef {
        let mut deferred = Vec::new();
        let root = self.child(0, arena, UPPER_LEVELS, &mut deferred);
        let write = |child: &DeferredChild| {
            let mut arena = ArenaBuilder::default();
            let root = self.child(child.node, &mut arena, usize::MAX, &mut Vec::new());
            (arena, root)
        };
        let roots = arena.append(deferred.par_iter().map(write).collect());
        for (child, root) in deferred.iter().zip(roots) {
            arena.set_child(child.line, child.lane, root);
        }
        root
    }

    /// Writes node `n` of the binary BVH and `levels` levels of nodes. Subtrees below them are added to `deferred`.
    fn child(
        &self,
        n: usize,
        arena: &mut ArenaBuilder,
        levels: usize,
        deferred: &mut Vec<DeferredChild>,
    ) -> NodeRef {
        if self.plan.is_leaf(n) {
            return self.leaf(n, arena);
        }
        let (mut children, count) = self.plan.wide_children(self.bvh, n);
        let children = &mut children[..count];
        // A shadow ray visits the last child first: this should be a leaf, and among leaves the largest.
        children.sort_by(|&a, &b| {
            let area = |n: usize| self.bvh.nodes[n].aabb().half_area();
            (self.plan.is_leaf(a).cmp(&self.plan.is_leaf(b))).then(area(a).total_cmp(&area(b)))
        });
        let line = arena.node();
        let mut lanes = [(Vec3::ZERO, Vec3::ZERO, NodeRef::END); WIDTH];
        for (lane, &node) in children.iter().enumerate().rev() {
            let aabb = self.bvh.nodes[node].aabb();
            let child = if levels > 1 || self.plan.is_leaf(node) {
                self.child(node, arena, levels - 1, deferred)
            } else {
                deferred.push(DeferredChild { node, line, lane });
                NodeRef::END
            };
            lanes[lane] = (Vec3::from(aabb.min), Vec3::from(aabb.max), child);
        }
        arena.fill(line, &lanes[..count]);
        NodeRef::to_node(line)
    }

    fn leaf(&self, n: usize, arena: &mut ArenaBuilder) -> NodeRef {
        let (mut triangles, mut quads) = (Vec::new(), Vec::new());
        let mut todo = vec![n];
        while let Some(n) = todo.pop() {
            let node = &self.bvh.nodes[n];
            if !node.is_leaf() {
                todo.extend([node.first_index as usize + 1, node.first_index as usize]);
                continue;
            }
            match self.primitives[self.bvh.primitive_indices[node.first_index as usize] as usize] {
                Primitive::Triangle(id) => triangles.push((self.triangles.corners(id as usize), id)),
                Primitive::Quad(id) => {
                    let ([a, b, c], [_, _, d]) =
                        (self.triangles.corners(id as usize), self.triangles.corners(id as usize + 1));
                    quads.push(([a, b, c, d], id));
                }
                // These are always leaves of their own.
                Primitive::Analytic(id) => return NodeRef::to_leaf(Leaf::Analytic(id)),
                Primitive::Instance(index) => return NodeRef::to_leaf(Leaf::Instance(index)),
            }
        }
        NodeRef::to_leaf(if quads.is_empty() {
            arena.triangles(&triangles)
        } else {
            Leaf::Quads(arena.polygons(&quads))
        })
    }
}

/// An arena under construction. References are relative to its first line.
#[derive(Default)]
pub(super) struct ArenaBuilder {
    pub(super) lines: Vec<CacheLine>,
    /// First lines of the nodes.
    nodes: Vec<u32>,
    /// Sums of the areas of the boxes around nodes, and around leaves.
    areas: [f64; 2],
}

impl ArenaBuilder {
    /// Appends a node, to be filled by [`ArenaBuilder::fill`], and returns its line.
    pub(super) fn node(&mut self) -> usize {
        let line = self.lines.len();
        self.nodes.push(line as u32);
        self.add(2 * NODE_LINES);
        line
    }

    /// Writes the node at `line`. Lanes without a child get an inverted box, which no ray enters.
    pub(super) fn fill(&mut self, line: usize, children: &[(Vec3, Vec3, NodeRef)]) {
        let rows: &mut [F32x8] = bytemuck::cast_slice_mut(&mut self.lines[line..line + NODE_LINES]);
        for axis in 0..3 {
            rows[2 * axis] = [f32::INFINITY; WIDTH];
            rows[2 * axis + 1] = [f32::NEG_INFINITY; WIDTH];
        }
        rows[CHILD_ROW] = [f32::from_bits(NodeRef::END.0); WIDTH];
        for (lane, (lo, hi, child)) in children.iter().enumerate() {
            // A child that is set later is a node.
            let is_leaf = child.is_leaf() && *child != NodeRef::END;
            self.areas[usize::from(is_leaf)] += f64::from(half_area(*hi - *lo));
            for axis in 0..3 {
                rows[2 * axis][lane] = lo[axis];
                rows[2 * axis + 1][lane] = hi[axis];
            }
            rows[CHILD_ROW][lane] = f32::from_bits(child.0);
        }
    }

    /// How much larger the boxes of nodes are than those of leaves: what rays enter in vain.
    pub(super) fn growth(&self) -> f64 {
        let [nodes, leaves] = self.areas;
        if leaves > 0.0 { nodes / leaves } else { 0.0 }
    }

    /// Replaces one child reference of the node at `line`.
    pub(super) fn set_child(&mut self, line: usize, lane: usize, child: NodeRef) {
        self.lines[line + CHILD_ROW / 2].0[CHILD_ROW % 2][lane] = f32::from_bits(child.0);
    }

    /// Writes a block of at most eight triangles with their ids, with shared vertices if there are few enough.
    pub(super) fn triangles(&mut self, triangles: &[([Vec3; 3], u32)]) -> Leaf {
        let mut vertices: Vec<Vec3> = Vec::with_capacity(3 * WIDTH);
        let mut indices = [[0u8; WIDTH]; 3];
        for (lane, (corners, _)) in triangles.iter().enumerate() {
            for (indices, p) in indices.iter_mut().zip(corners) {
                // Compared as bits, because 0 and −0 give different products.
                let known = vertices.iter().position(|v| bytemuck::bytes_of(v) == bytemuck::bytes_of(p));
                indices[lane] = known.unwrap_or(vertices.len()) as u8;
                if known.is_none() {
                    vertices.push(*p);
                }
            }
        }
        if vertices.len() > MAX_SHARED {
            return Leaf::Triangles(self.polygons(triangles));
        }
        let line = self.lines.len();
        let rows = self.add(SHARED_ROWS);
        for (i, v) in vertices.iter().enumerate() {
            for axis in 0..3 {
                rows[i / WIDTH * 3 + axis][i % WIDTH] = v[axis];
            }
        }
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut rows[CORNER_ROW]);
        bytes[..3 * WIDTH].copy_from_slice(indices.as_flattened());
        put_ids(&mut rows[CORNER_ROW + 1], triangles.iter().map(|t| t.1));
        Leaf::Shared(line)
    }

    /// Writes a block of at most eight polygons with their ids. Empty lanes are degenerate polygons, which are never hit.
    pub(super) fn polygons<const N: usize>(&mut self, polygons: &[([Vec3; N], u32)]) -> usize {
        let line = self.lines.len();
        let rows = self.add(block_rows(N));
        for (lane, (corners, _)) in polygons.iter().enumerate() {
            for (vertex, corner) in corners.iter().enumerate() {
                for axis in 0..3 {
                    rows[3 * vertex + axis][lane] = corner[axis];
                }
            }
        }
        put_ids(&mut rows[3 * N], polygons.iter().map(|p| p.1));
        line
    }

    fn add(&mut self, rows: usize) -> &mut [F32x8] {
        let line = self.lines.len();
        self.lines.resize(line + rows.div_ceil(2), CacheLine::default());
        bytemuck::cast_slice_mut(&mut self.lines[line..])
    }

    /// Appends other arenas, each with its root, and returns their roots as references into this one.
    pub(super) fn append(&mut self, others: Vec<(ArenaBuilder, NodeRef)>) -> Vec<NodeRef> {
        self.lines.reserve(others.iter().map(|(arena, _)| arena.lines.len()).sum());
        advise_huge_pages(self.lines.spare_capacity_mut());
        others
            .into_iter()
            .map(|(arena, root)| {
                let base = self.lines.len() as u32;
                self.lines.extend_from_slice(&arena.lines);
                self.areas = [0, 1].map(|i| self.areas[i] + arena.areas[i]);
                for line in arena.nodes.iter().map(|n| n + base) {
                    for child in &mut self.lines[line as usize + CHILD_ROW / 2].0[CHILD_ROW % 2] {
                        *child = f32::from_bits(NodeRef(child.to_bits()).offset(base).0);
                    }
                }
                self.nodes.extend(arena.nodes.iter().map(|n| n + base));
                root.offset(base)
            })
            .collect()
    }
}

fn half_area(size: Vec3) -> f32 {
    size.x * size.y + size.y * size.z + size.z * size.x
}

fn put_ids(row: &mut F32x8, ids: impl Iterator<Item = u32>) {
    *row = [f32::from_bits(u32::MAX); WIDTH];
    for (lane, id) in row.iter_mut().zip(ids) {
        *lane = f32::from_bits(id);
    }
}
