//! Building: bounds, obvhs, and a balanced tree where obvhs's would be too deep.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::PlocBuilder;
use obvhs::{Boundable, BvhBuildParams};

use crate::tracer::shape::{Disk, Sphere};

use super::Accel;
use super::collapse::{Item, Wide, collapse};

/// The largest stack the walk has.
const MAX_STACK: usize = 256;

/// Share of the nodes that reinsertion looks at.
const REINSERTION: f32 = 0.05;

#[derive(Clone, Copy)]
struct Bounded(Aabb);

impl Boundable for Bounded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

pub(super) fn build(
    (triangles, quads): (&[[Vec3; 3]], &[u32]),
    disks: Vec<Disk>,
    spheres: Vec<Sphere>,
) -> Accel {
    let corners = |t: &[Vec3; 3]| (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
    let mut items = Vec::with_capacity(triangles.len() + disks.len() + spheres.len());
    let mut boxes = Vec::with_capacity(items.capacity());
    let (mut id, mut quads) = (0, quads.iter().copied().peekable());
    while id < triangles.len() {
        let (mut lo, mut hi) = corners(&triangles[id]);
        if quads.next_if_eq(&(id as u32)).is_some() && id + 1 < triangles.len() {
            let (lo2, hi2) = corners(&triangles[id + 1]);
            (lo, hi) = (lo.min(lo2), hi.max(hi2));
            items.push(Item::Quad(id as u32));
            id += 1;
        } else {
            items.push(Item::Triangle(id as u32));
        }
        boxes.push(bounded((lo, hi)));
        id += 1;
    }
    for bounds in disks.iter().map(Disk::bounds).chain(spheres.iter().map(Sphere::bounds)) {
        items.push(Item::Analytic(id as u32));
        boxes.push(bounded(bounds));
        id += 1;
    }
    let mut accel = Accel { disks, spheres, triangle_count: triangles.len() as u32, ..Accel::default() };
    let Some(bounds) = boxes.iter().map(|b| b.0).reduce(|a, b| a.union(&b)) else {
        return accel;
    };
    accel.bounds = (Vec3::from(bounds.min), Vec3::from(bounds.max));
    let wide = wide_tree(&boxes, &items, triangles);
    accel.stack = stack_for(&wide);
    (accel.nodes, accel.blocks, accel.quads, accel.root) = (wide.nodes, wide.blocks, wide.quads, wide.root.0);
    accel
}

fn bounded((lo, hi): (Vec3, Vec3)) -> Bounded {
    Bounded(Aabb { min: Vec3A::from(lo), max: Vec3A::from(hi) })
}

/// Every level leaves at most three children behind and opens one.
fn stack_for(wide: &Wide) -> usize {
    3 * wide.depth + 1
}

fn wide_tree(boxes: &[Bounded], items: &[Item], triangles: &[[Vec3; 3]]) -> Wide {
    if boxes.len() > 2
        && most_coincident(boxes) <= MAX_COINCIDENT
        && let Some(binary) = optimized(boxes)
    {
        let wide = collapse(&binary, items, triangles);
        if stack_for(&wide) <= MAX_STACK {
            return wide;
        }
    }
    // Coincident primitives make a tree as deep as there are primitives; halving never does.
    collapse(&balanced(boxes), items, triangles)
}

/// Among equal boxes PLOC finds one pair a round, each round over all of them: 4,000 take 0.3 s, 100,000 minutes.
const MAX_COINCIDENT: usize = 2048;

/// Size of the largest set of boxes that are the same bit for bit.
fn most_coincident(boxes: &[Bounded]) -> usize {
    let bits = |b: &Bounded| [b.0.min, b.0.max].map(|v| v.to_array().map(f32::to_bits));
    let mut keys: Vec<_> = boxes.iter().map(bits).collect();
    keys.sort_unstable();
    keys.chunk_by(|a, b| a == b).map(<[_]>::len).max().unwrap_or(0)
}

/// obvhs's tree with one primitive per leaf: PLOC, then reinsertion. `None` when it is hopelessly deep. Not by
/// `build_bvh2`, whose own check of the tree recurses as deep as the tree.
fn optimized(boxes: &[Bounded]) -> Option<Bvh2> {
    let BvhBuildParams { ploc_search_distance, sort_precision, search_depth_threshold, .. } =
        BvhBuildParams::medium_build();
    let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(
        ploc_search_distance,
        boxes,
        (0..boxes.len() as u32).collect(),
        sort_precision,
        search_depth_threshold,
    );
    if depth(&bvh) > MAX_STACK {
        return None;
    }
    ReinsertionOptimizer::default().run(&mut bvh, REINSERTION, None);
    Some(bvh)
}

fn depth(bvh: &Bvh2) -> usize {
    let (mut deepest, mut todo) = (0, vec![(0usize, 1usize)]);
    while let Some((n, level)) = todo.pop() {
        deepest = deepest.max(level);
        if !bvh.nodes[n].is_leaf() {
            let first = bvh.nodes[n].first_index as usize;
            todo.extend([(first, level + 1), (first + 1, level + 1)]);
        }
    }
    deepest
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coincident_boxes_are_counted() {
        let at = |x: f32| bounded((Vec3::splat(x), Vec3::splat(x + 1.0)));
        assert_eq!(most_coincident(&[]), 0);
        let boxes = [2.0, 1.0, 2.0, 3.0, 2.0, 1.0].map(at);
        assert_eq!(most_coincident(&boxes), 3);
        // A box that differs by one ulp is another box: then PLOC has a nearest one.
        assert_eq!(most_coincident(&[at(1.0), at(1.0f32.next_up())]), 1);
    }
}
