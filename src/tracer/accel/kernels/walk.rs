//! The walk through the tree, eight boxes or eight primitives at a time.

use std::hint::{black_box, select_unpredictable};

use glam::Vec3;

use crate::tracer::accel::layout::{CHILDREN, Child, Leaf, Row, SHARED_ROWS, block_rows};
use crate::tracer::accel::tree::{Part, Tree};
use crate::tracer::accel::{Hit, PrimRange, Ray};

use super::lanes::Lanes;
use super::polygon::{Hits, corners, plane_t, quads, shared, shared_corners, triangles};
use super::ray::{ShearedRay, prepared};
use super::stack::Stack;

/// Lines asked for in advance: those of a node or of most blocks.
const AHEAD: usize = 4;

/// Finds what is hit in `part` (seen through `instance`) before `best`, and puts it there.
///
/// What is found does not depend on the order of the walk: of hits at the same distance the lowest id wins, and boxes
/// are left out only when they begin beyond the best distance. (Of a polygon seen so exactly edge-on that its distance is all
/// rounding this is tested, not proven.)
#[inline(always)]
pub(super) fn closest<S: Lanes>(
    s: S,
    (tree, part): (&Tree, &Part),
    ray: &Ray,
    instance: u32,
    best: &mut Hit,
) {
    let Some((slab, sheared)) = prepared(s, part.extent, ray) else { return };
    let (mut stack, mut top) = Stack::new();
    let mut current = part.root;
    loop {
        let mut key;
        if current.is_leaf() {
            if current == Child::END {
                return;
            }
            closest_in_leaf(s, (tree, current), (ray, &sheared), instance, best);
            (key, current) = stack.pop(&mut top);
        } else {
            // SAFETY: `current` was read from a node of this tree, or is its root, and is no leaf.
            let node = unsafe { tree.arena.rows::<8>(current.line()) };
            let (enter, leave) = slab.through(s, node, best.t);
            let mask = s.le(enter, leave);
            if mask == 0 {
                (key, current) = stack.pop(&mut top);
            } else if mask & (mask - 1) == 0 {
                // Neighbours on a picture agree on it, so that the way on is foretold (a third of their time, measured).
                current = Child(node[CHILDREN][mask.trailing_zeros() as usize & 7].to_bits());
                s.prefetch::<AHEAD>(tree.arena.address(current).cast());
                continue;
            } else {
                let keys = s.keys(enter);
                key = s.smallest(s.keys_where_le(keys, (enter, leave), i32::MAX));
                current = Child(node[CHILDREN][(key & 7) as usize].to_bits());
                // All of its lines at once, before the sort (2 to 8 % of bounce rays in a large mesh, measured).
                s.prefetch::<AHEAD>(tree.arena.address(current).cast());
                let sorted = s.sorted(s.keys_where_le(keys, (enter, leave), -1));
                stack.put(s, &node[CHILDREN], (sorted, mask.count_ones() as usize), &mut top);
            }
        }
        s.prefetch::<AHEAD>(tree.arena.address(stack.next_child(top)).cast());
        // A key has lost its lowest bits: nothing is left out for them.
        while key > (best.t.to_bits() | 7) as i32 {
            (key, current) = stack.pop(&mut top);
        }
    }
}

#[inline(always)]
fn closest_in_leaf<S: Lanes>(
    s: S,
    (tree, leaf): (&Tree, Child),
    (ray, sheared): (&Ray, &ShearedRay),
    instance: u32,
    best: &mut Hit,
) {
    // Hidden from the compiler, which would spread it over registers before it is known whether a block is met.
    let sheared = black_box(sheared);
    macro_rules! block {
        ($line:expr, $rows:expr, $test:ident, $corners:ident) => {{
            // SAFETY: `leaf` was read from a node of this tree, or is its root, and says that such a block is there.
            let rows = unsafe { tree.arena.rows::<{ $rows }>($line) };
            if let Some(hits) = $test::<S, true>(s, rows, sheared, best.t) {
                closest_of(s, (rows, $corners), &hits, (ray, instance), best);
            }
        }};
    }
    match leaf.leaf() {
        Leaf::Shared(line) => block!(line, SHARED_ROWS, shared, shared_corners),
        Leaf::Triangles(line) => block!(line, block_rows(3), triangles, corners),
        Leaf::Quads(line) => block!(line, block_rows(4), quads, corners),
        Leaf::Analytic(prim) => {
            if let Some(t) = tree.analytic(prim, ray, best.t.next_up()) {
                best.improve(Hit { t, prim, uv: [0.0; 2], instance });
            }
        }
        Leaf::Instance(index) => tree.closest_in(index, ray, best),
    }
}

/// The rows of a block, and how a lane's corners are found in them.
type Block<'a> = (&'a [Row], fn(&[Row], usize) -> [Vec3; 3]);

#[inline(always)]
fn closest_of<S: Lanes>(s: S, block: Block, hits: &Hits<S>, (ray, instance): (&Ray, u32), best: &mut Hit) {
    let mut mask = hits.mask;
    while mask != 0 {
        let lane = mask.trailing_zeros() as usize;
        mask &= mask - 1;
        let t = distance(block, hits, lane, ray);
        if t > 0.0 && t <= best.t {
            best.improve(Hit { t, prim: id(block.0, lane), uv: hits.uv(s, lane), instance });
        }
    }
}

/// The distance in `lane`, from a better source where the quick one cannot be trusted.
#[inline(always)]
fn distance<S: Lanes>((rows, corners): Block, hits: &Hits<S>, lane: usize, ray: &Ray) -> f32 {
    if hits.doubtful >> lane & 1 == 1 { plane_t(corners(rows, lane), ray) } else { hits.t[lane & 7] }
}

/// The id in `lane` of a block: its last row.
#[inline(always)]
fn id(rows: &[Row], lane: usize) -> u32 {
    rows[rows.len() - 1][lane & 7].to_bits()
}

/// True when anything of `part` is hit but the primitives of `skip`.
#[inline(always)]
pub(super) fn occluded<S: Lanes>(s: S, (tree, part): (&Tree, &Part), ray: &Ray, skip: PrimRange) -> bool {
    let Some((slab, sheared)) = prepared(s, part.extent, ray) else { return false };
    let (mut stack, mut top) = Stack::new();
    let mut current = part.root;
    loop {
        if current.is_leaf() {
            if current == Child::END {
                return false;
            }
            if occluded_in_leaf(s, (tree, current), (ray, &sheared), skip) {
                return true;
            }
            current = stack.pop_child(&mut top);
        } else {
            // SAFETY: `current` was read from a node of this tree, or is its root, and is no leaf.
            let node = unsafe { tree.arena.rows::<8>(current.line()) };
            let (enter, leave) = slab.through(s, node, ray.t_max);
            let mask = s.le(enter, leave);
            // The last is visited at once: read from the node, for what is put on the stack takes a while to come back.
            let next = node[CHILDREN][(mask.leading_zeros() ^ 31) as usize & 7].to_bits();
            current = Child(select_unpredictable(mask == 0, stack.next_child(top).0, next));
            stack.put_packed(s, &node[CHILDREN], mask, &mut top);
            s.prefetch::<AHEAD>(tree.arena.address(stack.next_child(top)).cast());
        }
    }
}

#[inline(always)]
fn occluded_in_leaf<S: Lanes>(
    s: S,
    (tree, leaf): (&Tree, Child),
    (ray, sheared): (&Ray, &ShearedRay),
    skip: PrimRange,
) -> bool {
    // Hidden from the compiler, which would spread it over registers before it is known whether a block is met.
    let sheared = black_box(sheared);
    macro_rules! block {
        ($line:expr, $rows:expr, $test:ident, $corners:ident) => {{
            // SAFETY: `leaf` was read from a node of this tree, or is its root, and says that such a block is there.
            let rows = unsafe { tree.arena.rows::<{ $rows }>($line) };
            let hits = $test::<S, false>(s, rows, sheared, ray.t_max);
            hits.is_some_and(|hits| any_of((rows, $corners), &hits, ray, skip))
        }};
    }
    match leaf.leaf() {
        Leaf::Shared(line) => block!(line, SHARED_ROWS, shared, shared_corners),
        Leaf::Triangles(line) => block!(line, block_rows(3), triangles, corners),
        Leaf::Quads(line) => block!(line, block_rows(4), quads, corners),
        Leaf::Analytic(prim) => !skip.contains(prim) && tree.analytic(prim, ray, ray.t_max).is_some(),
        Leaf::Instance(index) => tree.occluded_in(index, ray, skip),
    }
}

#[inline(always)]
fn any_of<S: Lanes>(block: Block, hits: &Hits<S>, ray: &Ray, skip: PrimRange) -> bool {
    let mut mask = hits.mask;
    if mask & !hits.doubtful != 0 && skip == PrimRange::NONE {
        return true;
    }
    while mask != 0 {
        let lane = mask.trailing_zeros() as usize;
        mask &= mask - 1;
        let t = distance(block, hits, lane, ray);
        if t > 0.0 && t < ray.t_max && !skip.contains(id(block.0, lane)) {
            return true;
        }
    }
    false
}
