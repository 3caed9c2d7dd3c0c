//! Refitting: the same tree over primitives that have moved.
//!
//! Which hits a ray has does not depend on the tree, so that a refitted one gives the same samples as one that is built, bit for bit; only
//! their time differs. It takes a fraction of the time of building.

use bytemuck::cast_slice;
use glam::Vec3;
use rayon::prelude::*;

use super::build::{analytic_bounds, instance_bounds, placed, triangle_bounds};
use super::bvh::{Accel, BvhRoot};
use super::layout::{Arena, CHILD_ROW, F32x8, Leaf, NODE_LINES, NodeRef, SHARED_ROWS, WIDTH, block_rows};
use super::shapes::{Instance, PrimitiveGroup, Shapes};
use super::write::ArenaBuilder;

/// Levels of nodes that are written last. The subtrees below them are written in parallel.
const UPPER_LEVELS: usize = 3;

/// A tree whose boxes are this many times as large, beside those of its leaves, as when it was built is built anew.
const MOST_GROWTH: f64 = 1.4;

/// A node or a block in its new place, with its box.
#[derive(Clone, Copy)]
struct Refitted {
    child: NodeRef,
    lo: Vec3,
    hi: Vec3,
}

/// A place for a subtree that was written already.
struct SubtreePlace {
    line: usize,
    lane: usize,
}

impl Accel {
    /// This tree with the same primitives in other places. `None` where they are not the same primitives, or so far from where they were that
    /// the tree would be slow: it has to be built then.
    pub fn refitted(
        &self,
        shapes: &Shapes,
        groups: &[PrimitiveGroup],
        instances: &[Instance],
    ) -> Option<Accel> {
        let counts = [shapes.disks.len(), shapes.spheres.len(), shapes.cylinders.len(), shapes.curves.len()];
        let known = [self.disks.len(), self.spheres.len(), self.cylinders.len(), self.curves.len()];
        let same = shapes.triangles.count() == self.first_disk as usize
            && counts == known
            && *shapes.quads == *self.quads
            && *groups == *self.ranges
            && instances.iter().map(|i| i.group).eq(self.instances.iter().map(|i| i.group));
        if !same {
            return None;
        }
        let mut arena = ArenaBuilder::default();
        let mut refit = TreeRefit { arena: &self.arena, shapes, instances, groups: Vec::new() };
        for group in &self.groups {
            let root = refit.root(group, &mut arena);
            refit.groups.push(root);
        }
        let world = refit.root(&self.world, &mut arena);
        if arena.growth() > MOST_GROWTH * self.growth {
            return None;
        }
        Some(Accel {
            arena: Arena::new(arena.lines),
            world,
            groups: refit.groups,
            instances: instances.iter().map(placed).collect(),
            disks: shapes.disks.clone(),
            spheres: shapes.spheres.clone(),
            cylinders: shapes.cylinders.clone(),
            curves: shapes.curves.clone(),
            quads: self.quads.clone(),
            ranges: self.ranges.clone(),
            ..*self
        })
    }
}

/// A tree on its way to its new places.
struct TreeRefit<'a> {
    arena: &'a Arena,
    shapes: &'a Shapes<'a>,
    instances: &'a [Instance],
    /// The groups that are refitted already: all of them before the world.
    groups: Vec<BvhRoot>,
}

impl TreeRefit<'_> {
    fn root(&self, old: &BvhRoot, arena: &mut ArenaBuilder) -> BvhRoot {
        if old.root == NodeRef::END {
            return BvhRoot::default();
        }
        let mut below = Vec::new();
        if !old.root.is_leaf() {
            self.subtrees(old.root, UPPER_LEVELS, &mut below);
        }
        let written = below.into_par_iter().map(|child| {
            let mut arena = ArenaBuilder::default();
            let refitted = self.child(child, &mut arena);
            (arena, refitted)
        });
        let (arenas, subtrees): (Vec<_>, Vec<_>) = written.collect::<Vec<_>>().into_iter().unzip();
        let mut places = Vec::new();
        let root = self.upper(old.root, UPPER_LEVELS, arena, &mut subtrees.iter(), &mut places);
        let roots = arena.append(arenas.into_iter().zip(subtrees.iter().map(|s| s.child)).collect());
        for (SubtreePlace { line, lane }, root) in places.iter().zip(roots) {
            arena.set_child(*line, *lane, root);
        }
        BvhRoot::new(root.child, (root.lo, root.hi))
    }

    /// The children of a node, from the first lane on.
    fn children(&self, node: NodeRef) -> impl Iterator<Item = NodeRef> + '_ {
        let rows: &[F32x8] = cast_slice(&self.arena.lines()[node.line()..node.line() + NODE_LINES]);
        rows[CHILD_ROW]
            .iter()
            .map(|child| NodeRef(child.to_bits()))
            .take_while(|child| *child != NodeRef::END)
    }

    /// The inner nodes that are `levels` levels below a node, in the order of the lanes.
    fn subtrees(&self, node: NodeRef, levels: usize, below: &mut Vec<NodeRef>) {
        for child in self.children(node).filter(|child| !child.is_leaf()) {
            match is_deferred(child, levels) {
                true => below.push(child),
                false => self.subtrees(child, levels - 1, below),
            }
        }
    }

    /// Writes the upper levels of a tree; `subtrees` are those of [`subtrees`](Self::subtrees).
    fn upper<'s>(
        &self,
        old: NodeRef,
        levels: usize,
        arena: &mut ArenaBuilder,
        subtrees: &mut impl Iterator<Item = &'s Refitted>,
        places: &mut Vec<SubtreePlace>,
    ) -> Refitted {
        if old.is_leaf() {
            return self.leaf(old.leaf(), arena);
        }
        let line = arena.node();
        let mut lanes = Vec::with_capacity(WIDTH);
        for (lane, child) in self.children(old).enumerate() {
            let refitted = match is_deferred(child, levels) {
                true => {
                    places.push(SubtreePlace { line, lane });
                    let subtree = subtrees.next().copied();
                    // There are as many as were counted by the same walk.
                    Refitted { child: NodeRef::END, ..subtree.unwrap_or(NOTHING) }
                }
                false => self.upper(child, levels - 1, arena, subtrees, places),
            };
            lanes.push(refitted);
        }
        self.node(line, &lanes, arena)
    }

    /// Writes a whole subtree.
    fn child(&self, old: NodeRef, arena: &mut ArenaBuilder) -> Refitted {
        if old.is_leaf() {
            return self.leaf(old.leaf(), arena);
        }
        let line = arena.node();
        let (mut lanes, mut count) = ([NOTHING; WIDTH], 0);
        for (lane, child) in lanes.iter_mut().zip(self.children(old)) {
            *lane = self.child(child, arena);
            count += 1;
        }
        self.node(line, &lanes[..count], arena)
    }

    fn node(&self, line: usize, children: &[Refitted], arena: &mut ArenaBuilder) -> Refitted {
        let (mut lanes, mut all) = ([(Vec3::ZERO, Vec3::ZERO, NodeRef::END); WIDTH], NOTHING);
        for (lane, Refitted { child, lo, hi }) in lanes.iter_mut().zip(children) {
            *lane = (*lo, *hi, *child);
            (all.lo, all.hi) = (all.lo.min(*lo), all.hi.max(*hi));
        }
        arena.fill(line, &lanes[..children.len()]);
        Refitted { child: NodeRef::to_node(line), ..all }
    }

    fn leaf(&self, leaf: Leaf, arena: &mut ArenaBuilder) -> Refitted {
        let corners = |id: u32| self.shapes.triangles.corners(id as usize);
        let ids = |line: usize, rows: usize| {
            let block: &[F32x8] = cast_slice(&self.arena.lines()[line..line + rows.div_ceil(2)]);
            let ids = block[rows - 1].map(f32::to_bits);
            ids.into_iter().filter(|id| *id != u32::MAX)
        };
        let mut all = NOTHING;
        let mut enclose = |(lo, hi): (Vec3, Vec3)| (all.lo, all.hi) = (all.lo.min(lo), all.hi.max(hi));
        let child = match leaf {
            Leaf::Shared(line) | Leaf::Triangles(line) => {
                let rows = if matches!(leaf, Leaf::Shared(_)) { SHARED_ROWS } else { block_rows(3) };
                let triangles: Vec<_> = ids(line, rows).map(|id| (corners(id), id)).collect();
                triangles.iter().for_each(|(corners, _)| enclose(triangle_bounds(*corners)));
                arena.triangles(&triangles)
            }
            Leaf::Quads(line) => {
                let quad = |id: u32| {
                    let ([a, b, c], [_, _, d]) = (corners(id), corners(id + 1));
                    ([a, b, c, d], id)
                };
                let quads: Vec<_> = ids(line, block_rows(4)).map(quad).collect();
                for (_, id) in &quads {
                    enclose(triangle_bounds(corners(*id)));
                    enclose(triangle_bounds(corners(id + 1)));
                }
                Leaf::Quads(arena.polygons(&quads))
            }
            Leaf::Analytic(prim) => {
                enclose(analytic_bounds(self.shapes, prim));
                leaf
            }
            Leaf::Instance(index) => {
                let instance = &self.instances[index as usize];
                enclose(instance_bounds(instance, &self.groups[instance.group as usize]));
                leaf
            }
        };
        Refitted { child: NodeRef::to_leaf(child), ..all }
    }
}

/// Whether a child of a node of the upper levels is one of the subtrees that are written in parallel.
fn is_deferred(child: NodeRef, levels: usize) -> bool {
    !child.is_leaf() && levels <= 1
}

/// Around nothing.
const NOTHING: Refitted = Refitted { child: NodeRef::END, lo: Vec3::INFINITY, hi: Vec3::NEG_INFINITY };
