//! The traversal of the BVH, eight boxes or eight primitives at a time.

use std::hint::{black_box, select_unpredictable};

use glam::Vec3;

use crate::tracer::accel::bvh::{Accel, BvhRoot};
use crate::tracer::accel::layout::{CHILD_ROW, F32x8, Leaf, NodeRef, SHARED_ROWS, block_rows};
use crate::tracer::accel::ray::{Hit, HitId, PrimRange, Ray};

use super::polygon::{BlockHits, corners, exact_distance, quads, shared, shared_corners, triangles};
use super::ray::{ShearedRay, prepare_ray};
use super::simd::Simd8;
use super::stack::TraversalStack;

/// Cache lines that are prefetched: those of a node or of most blocks.
const AHEAD: usize = 4;

/// Replaces `best` by the closest hit in `bvh` (seen through `instance`), if that is closer; with `SKIP` of anything but what has the
/// [ids](Hit::id) of `skip`.
///
/// The result does not depend on the order of traversal: of hits at the same distance the lowest id wins, and boxes are
/// skipped only if they begin beyond the best distance. (For a polygon seen so exactly edge-on that its distance consists of
/// rounding this is tested, not proven.)
#[inline(always)]
pub fn closest<S: Simd8, const SKIP: bool>(
    s: S,
    accel: &Accel,
    bvh: &BvhRoot,
    ray: &Ray,
    skip: &[HitId],
    instance: u32,
    best: &mut Hit,
) {
    let Some((slab, sheared)) = prepare_ray(s, bvh.extent, ray) else { return };
    let (mut stack, mut top) = TraversalStack::new();
    let mut current = bvh.root;
    loop {
        let mut key;
        if current.is_leaf() {
            if current == NodeRef::END {
                return;
            }
            closest_in_leaf::<S, SKIP>(s, accel, current, ray, &sheared, skip, instance, best);
            (key, current) = stack.pop(&mut top);
        } else {
            // SAFETY: `current` was read from a node of this BVH, or is its root, and is not a leaf.
            let node = unsafe { accel.arena.rows::<8>(current.line()) };
            let (enter, leave) = slab.intersect_boxes(s, node, best.t);
            let mask = s.le(enter, leave);
            if mask == 0 {
                (key, current) = stack.pop(&mut top);
            } else if mask & (mask - 1) == 0 {
                // Adjacent camera rays agree on this case, so that the branch is predicted (it saves a third of their time).
                current = NodeRef(node[CHILD_ROW][mask.trailing_zeros() as usize & 7].to_bits());
                s.prefetch::<AHEAD>(accel.arena.address(current).cast());
                continue;
            } else {
                let keys = s.keys(enter);
                key = s.smallest(s.select_keys_le(keys, enter, leave, i32::MAX));
                current = NodeRef(node[CHILD_ROW][(key & 7) as usize].to_bits());
                // Prefetched before the sort (it saves 2 to 8 % of the time of bounce rays in a large mesh).
                s.prefetch::<AHEAD>(accel.arena.address(current).cast());
                let sorted = s.sort_descending(s.select_keys_le(keys, enter, leave, -1));
                stack.push_sorted(s, &node[CHILD_ROW], sorted, mask.count_ones() as usize, &mut top);
            }
        }
        s.prefetch::<AHEAD>(accel.arena.address(stack.next_child(top)).cast());
        // A key has lost its lowest three bits, so they must not decide.
        while key > (best.t.to_bits() | 7) as i32 {
            (key, current) = stack.pop(&mut top);
        }
    }
}

#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "the state of the loop that it is a part of")]
fn closest_in_leaf<S: Simd8, const SKIP: bool>(
    s: S,
    accel: &Accel,
    leaf: NodeRef,
    ray: &Ray,
    sheared: &ShearedRay,
    skip: &[HitId],
    instance: u32,
    best: &mut Hit,
) {
    // Hidden from the compiler, which would load it into registers before it is known whether there is a block.
    let sheared = black_box(sheared);
    macro_rules! block {
        ($line:expr, $rows:expr, $test:ident, $corners:ident) => {{
            // SAFETY: `leaf` was read from a node of this BVH, or is its root, and refers to a block of this kind.
            let rows = unsafe { accel.arena.rows::<{ $rows }>($line) };
            if let Some(hits) = $test::<S, true>(s, rows, sheared, best.t) {
                closest_of::<S, SKIP>(s, rows, $corners, &hits, ray, skip, instance, best);
            }
        }};
    }
    match leaf.leaf() {
        Leaf::Shared(line) => block!(line, SHARED_ROWS, shared, shared_corners),
        Leaf::Triangles(line) => block!(line, block_rows(3), triangles, corners),
        Leaf::Quads(line) => block!(line, block_rows(4), quads, corners),
        Leaf::Analytic(prim) => {
            if !(SKIP && skip.contains(&(prim, instance)))
                && let Some(t) = accel.intersect_analytic(prim, ray, best.t.next_up())
            {
                best.improve(Hit { t, prim, uv: [0.0; 2], instance });
            }
        }
        Leaf::Instance(index) if SKIP => accel.closest_except_in_instance(index, ray, skip, best),
        Leaf::Instance(index) => accel.closest_in_instance(index, ray, best),
    }
}

/// Finds the corners of a lane in the rows of a block.
type Corners = fn(&[F32x8], usize) -> [Vec3; 4];

#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "the state of the loop that it is a part of")]
fn closest_of<S: Simd8, const SKIP: bool>(
    s: S,
    rows: &[F32x8],
    corners: Corners,
    hits: &BlockHits<S>,
    ray: &Ray,
    skip: &[HitId],
    instance: u32,
    best: &mut Hit,
) {
    let mut mask = hits.mask;
    while mask != 0 {
        let lane = mask.trailing_zeros() as usize;
        mask &= mask - 1;
        let t = distance(rows, corners, hits, lane, ray);
        if t > 0.0 && t <= best.t && !(SKIP && skip.contains(&(id(rows, lane), instance))) {
            best.improve(Hit { t, prim: id(rows, lane), uv: hits.uv(s, lane), instance });
        }
    }
}

/// The distance in `lane`, computed exactly if it is doubtful.
#[inline(always)]
fn distance<S: Simd8>(rows: &[F32x8], corners: Corners, hits: &BlockHits<S>, lane: usize, ray: &Ray) -> f32 {
    if hits.doubtful >> lane & 1 == 1 { exact_distance(corners(rows, lane), ray) } else { hits.t[lane & 7] }
}

/// The id in `lane` of a block, from its last row.
#[inline(always)]
fn id(rows: &[F32x8], lane: usize) -> u32 {
    rows[rows.len() - 1][lane & 7].to_bits()
}

/// True if anything of `bvh` but the primitives of `skip` is hit.
#[inline(always)]
pub fn occluded<S: Simd8>(s: S, accel: &Accel, bvh: &BvhRoot, ray: &Ray, skip: PrimRange) -> bool {
    let Some((slab, sheared)) = prepare_ray(s, bvh.extent, ray) else { return false };
    let (mut stack, mut top) = TraversalStack::new();
    let mut current = bvh.root;
    loop {
        if current.is_leaf() {
            if current == NodeRef::END {
                return false;
            }
            if occluded_in_leaf(s, accel, current, ray, &sheared, skip) {
                return true;
            }
            current = stack.pop_child(&mut top);
        } else {
            // SAFETY: `current` was read from a node of this BVH, or is its root, and is not a leaf.
            let node = unsafe { accel.arena.rows::<8>(current.line()) };
            let (enter, leave) = slab.intersect_boxes(s, node, ray.t_max);
            let mask = s.le(enter, leave);
            // The last child is visited at once. It is read from the node, because a store to the stack takes time to be read.
            let next = node[CHILD_ROW][(mask.leading_zeros() ^ 31) as usize & 7].to_bits();
            current = NodeRef(select_unpredictable(mask == 0, stack.next_child(top).0, next));
            stack.push_masked(s, &node[CHILD_ROW], mask, &mut top);
            s.prefetch::<AHEAD>(accel.arena.address(stack.next_child(top)).cast());
        }
    }
}

#[inline(always)]
fn occluded_in_leaf<S: Simd8>(
    s: S,
    accel: &Accel,
    leaf: NodeRef,
    ray: &Ray,
    sheared: &ShearedRay,
    skip: PrimRange,
) -> bool {
    // As in `closest_in_leaf`.
    let sheared = black_box(sheared);
    macro_rules! block {
        ($line:expr, $rows:expr, $test:ident, $corners:ident) => {{
            // SAFETY: `leaf` was read from a node of this BVH, or is its root, and refers to a block of this kind.
            let rows = unsafe { accel.arena.rows::<{ $rows }>($line) };
            let hits = $test::<S, false>(s, rows, sheared, ray.t_max);
            hits.is_some_and(|hits| any_of(rows, $corners, &hits, ray, skip))
        }};
    }
    match leaf.leaf() {
        Leaf::Shared(line) => block!(line, SHARED_ROWS, shared, shared_corners),
        Leaf::Triangles(line) => block!(line, block_rows(3), triangles, corners),
        Leaf::Quads(line) => block!(line, block_rows(4), quads, corners),
        Leaf::Analytic(prim) => {
            !skip.contains(prim) && accel.intersect_analytic(prim, ray, ray.t_max).is_some()
        }
        Leaf::Instance(index) => accel.occluded_in_instance(index, ray, skip),
    }
}

#[inline(always)]
fn any_of<S: Simd8>(
    rows: &[F32x8],
    corners: Corners,
    hits: &BlockHits<S>,
    ray: &Ray,
    skip: PrimRange,
) -> bool {
    let mut mask = hits.mask;
    if mask & !hits.doubtful != 0 && skip == PrimRange::NONE {
        return true;
    }
    while mask != 0 {
        let lane = mask.trailing_zeros() as usize;
        mask &= mask - 1;
        let t = distance(rows, corners, hits, lane, ray);
        if t > 0.0 && t < ray.t_max && !skip.contains(id(rows, lane)) {
            return true;
        }
    }
    false
}
