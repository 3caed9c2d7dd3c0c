//! Writes the planned tree down, depth first: a node, the blocks of its leaves, then what is below it.

use glam::Vec3;
use obvhs::bvh2::Bvh2;
use rayon::prelude::*;

use super::draft::Draft;
use super::layout::{Child, Leaf, WIDTH};
use super::plan::{Item, Plan};

/// Levels of nodes that are written before all that is below them, which then is written at once.
const UPPER_LEVELS: usize = 3;

/// What is to be written.
pub(super) struct Source<'a> {
    pub(super) bvh: &'a Bvh2,
    pub(super) plan: &'a Plan,
    /// What the leaves of `bvh` are.
    pub(super) items: &'a [Item],
    /// Corners by triangle id.
    pub(super) triangles: &'a [[Vec3; 3]],
}

/// A child that is written later: its node in the binary tree, and the line and lane that wait for it.
struct Later {
    node: usize,
    line: usize,
    lane: usize,
}

impl Source<'_> {
    /// Writes the whole tree.
    pub(super) fn write(&self, draft: &mut Draft) -> Child {
        let mut later = Vec::new();
        let root = self.child(0, draft, UPPER_LEVELS, &mut later);
        let below = |later: &Later| {
            let mut draft = Draft::default();
            let root = self.child(later.node, &mut draft, usize::MAX, &mut Vec::new());
            (draft, root)
        };
        let roots = draft.append(later.par_iter().map(below).collect());
        for (later, root) in later.iter().zip(roots) {
            draft.set_child(later.line, later.lane, root);
        }
        root
    }

    /// Writes node `n` of the binary tree and so many levels below it.
    fn child(&self, n: usize, draft: &mut Draft, levels: usize, later: &mut Vec<Later>) -> Child {
        if self.plan.is_leaf(n) {
            return self.leaf(n, draft);
        }
        let (mut members, count) = self.plan.members(self.bvh, n);
        let members = &mut members[..count];
        // The last slot is the first that a shadow ray visits: leaves, and of these the large.
        members.sort_by(|&a, &b| {
            let area = |n: usize| self.bvh.nodes[n].aabb().half_area();
            (self.plan.is_leaf(a).cmp(&self.plan.is_leaf(b))).then(area(a).total_cmp(&area(b)))
        });
        let line = draft.node();
        let mut children = [(Vec3::ZERO, Vec3::ZERO, Child::END); WIDTH];
        for (lane, &member) in members.iter().enumerate().rev() {
            let aabb = self.bvh.nodes[member].aabb();
            let child = if levels > 1 || self.plan.is_leaf(member) {
                self.child(member, draft, levels - 1, later)
            } else {
                later.push(Later { node: member, line, lane });
                Child::END
            };
            children[lane] = (Vec3::from(aabb.min), Vec3::from(aabb.max), child);
        }
        draft.fill(line, &children[..count]);
        Child::to_node(line)
    }

    fn leaf(&self, n: usize, draft: &mut Draft) -> Child {
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
                // These are always alone.
                Item::Analytic(id) => return Child::to_leaf(Leaf::Analytic(id)),
                Item::Instance(index) => return Child::to_leaf(Leaf::Instance(index)),
            }
        }
        Child::to_leaf(if quads.is_empty() {
            draft.triangles(&triangles)
        } else {
            Leaf::Quads(draft.polygons(&quads))
        })
    }
}
