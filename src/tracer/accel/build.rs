//! Building: bounds, obvhs, and a balanced tree where obvhs's would be too deep.

use std::time::Duration;

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::{Boundable, BvhBuildParams};

use crate::tracer::shape::{Disk, Sphere};

use super::Accel;
use super::collapse::{Wide, collapse};

/// The largest stack the walk has.
const MAX_STACK: usize = 256;

#[derive(Clone, Copy)]
struct Bounded(Aabb);

impl Boundable for Bounded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

pub(super) fn build(triangles: &[[Vec3; 3]], disks: Vec<Disk>, spheres: Vec<Sphere>) -> Accel {
    let corners = |t: &[Vec3; 3]| (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
    let boxes: Vec<Bounded> = triangles
        .iter()
        .map(corners)
        .chain(disks.iter().map(Disk::bounds))
        .chain(spheres.iter().map(Sphere::bounds))
        .map(|(lo, hi)| Bounded(Aabb { min: Vec3A::from(lo), max: Vec3A::from(hi) }))
        .collect();
    let mut accel = Accel { disks, spheres, triangle_count: triangles.len() as u32, ..Accel::default() };
    let Some(bounds) = boxes.iter().map(|b| b.0).reduce(|a, b| a.union(&b)) else {
        return accel;
    };
    accel.bounds = (Vec3::from(bounds.min), Vec3::from(bounds.max));
    let wide = wide_tree(&boxes, triangles);
    accel.stack = stack_for(&wide);
    (accel.nodes, accel.blocks, accel.root) = (wide.nodes, wide.blocks, wide.root.0);
    accel
}

/// Every level leaves at most three children behind and opens one.
fn stack_for(wide: &Wide) -> usize {
    3 * wide.depth + 1
}

fn wide_tree(boxes: &[Bounded], triangles: &[[Vec3; 3]]) -> Wide {
    if boxes.len() > 2 {
        let mut params = BvhBuildParams::medium_build();
        (params.max_prims_per_leaf, params.pre_split) = (1, false);
        let wide = collapse(&build_bvh2(boxes, params, &mut Duration::default()), triangles);
        if stack_for(&wide) <= MAX_STACK {
            return wide;
        }
    }
    // Coincident primitives make a tree as deep as there are primitives; halving never does.
    collapse(&balanced(boxes), triangles)
}

/// A binary tree that halves the primitives by the middle of their longest spread, depth ⌈log₂ n⌉.
fn balanced(boxes: &[Bounded]) -> Bvh2 {
    let mut ids: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes = vec![Bvh2Node::default()];
    let mut todo = vec![(0usize, 0usize, boxes.len())];
    while let Some((slot, from, to)) = todo.pop() {
        let range = &mut ids[from..to];
        let union = |a: Aabb, id: &u32| a.union(&boxes[*id as usize].0);
        let aabb = range.iter().skip(1).fold(boxes[range[0] as usize].0, union);
        if range.len() == 1 {
            nodes[slot] = Bvh2Node::new(aabb, 1, from as u32);
            continue;
        }
        let size = aabb.max - aabb.min;
        let axis = if size.x > size.y.max(size.z) { 0 } else { 1 + usize::from(size.z > size.y) };
        let center = |id: u32| boxes[id as usize].0.min[axis] + boxes[id as usize].0.max[axis];
        let middle = range.len() / 2;
        range.select_nth_unstable_by(middle, |&a, &b| center(a).total_cmp(&center(b)).then(a.cmp(&b)));
        let first = nodes.len();
        nodes.extend([Bvh2Node::default(); 2]);
        nodes[slot] = Bvh2Node::new(aabb, 0, first as u32);
        todo.extend([(first, from, from + middle), (first + 1, from + middle, to)]);
    }
    Bvh2 { nodes, primitive_indices: ids, ..Bvh2::default() }
}
