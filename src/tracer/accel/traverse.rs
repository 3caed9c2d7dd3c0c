//! The walk through the tree, four boxes at a time.

use glam::{Vec3, Vec4};

use super::block::{BlockHits, Polygons, ShearedRay};
use super::collapse::{Child, Leaf, WideNode};
use super::{Accel, Hit, PrimRange, Ray};

/// Share of the reach (the farthest coordinate from ray origin or zero) by which boxes are widened: 25 unit roundoffs.
///
/// To first order 13 are enough, so that no box is missed whose triangle the triangle test would accept. Box test: one
/// rounding each for the moved origin, the difference, the reciprocal and the product displace a plane by 4.
/// Triangle test: difference 1, shear (two for its slope, at most 1; one each for z and the product) 4, and the last
/// difference, of up to twice the reach, 2 displace a vertex by 7. Its edge functions may come out as zero outside: 2.
/// `closed_meshes_have_no_holes` in `tests/tracer_geometry.rs` holds it, and fails without.
const WIDEN: f32 = 1.5e-6;

/// A ray in the terms of the box test.
struct SlabRay {
    /// Rows of a node that hold the near and the far planes of each axis.
    near: [usize; 3],
    far: [usize; 3],
    /// Origins moved outwards by the widening: for near planes, for far planes.
    origin_near: [Vec4; 3],
    origin_far: [Vec4; 3],
    inverse: [Vec4; 3],
}

impl SlabRay {
    #[inline]
    fn new(accel: &Accel, ray: &Ray) -> Self {
        let o = ray.origin;
        // A zero component becomes a huge finite reciprocal, so that no box test multiplies 0 by infinity.
        let d = ray.direction;
        let floor = d.abs().max(Vec3::splat(1e-18));
        let inverse = (1.0 / floor).copysign(d);
        let (lo, hi) = accel.bounds;
        let reach = (lo - o).abs().max((hi - o).abs()).max(o.abs()).max_element();
        let shift = Vec3::splat(WIDEN * reach).copysign(d);
        let splat = |v: Vec3| [Vec4::splat(v.x), Vec4::splat(v.y), Vec4::splat(v.z)];
        let negative = d.is_negative_bitmask() as usize;
        let near = [negative & 1, 2 | (negative >> 1 & 1), 4 | (negative >> 2 & 1)];
        Self {
            near,
            far: near.map(|row| row ^ 1),
            origin_near: splat(o + shift),
            origin_far: splat(o - shift),
            inverse: splat(inverse),
        }
    }

    /// Bits of the children that the ray may hit before `t_max`, and where it enters them.
    #[inline(always)]
    fn test(&self, node: &WideNode, t_max: f32) -> (u32, Vec4) {
        let near = |axis: usize| (node.row(self.near[axis]) - self.origin_near[axis]) * self.inverse[axis];
        let far = |axis: usize| (node.row(self.far[axis]) - self.origin_far[axis]) * self.inverse[axis];
        let enter = near(0).max(near(1)).max(near(2).max(Vec4::ZERO));
        let leave = far(0).min(far(1)).min(far(2).min(Vec4::splat(t_max)));
        (enter.cmple(leave).bitmask(), enter)
    }
}

/// The nearest hit.
#[inline(always)]
pub(super) fn closest<const STACK: usize>(accel: &Accel, ray: &Ray) -> Option<Hit> {
    let slab = SlabRay::new(accel, ray);
    let sheared = ShearedRay::new(ray.origin, ray.direction);
    let mut best = Hit { t: ray.t_max, prim: u32::MAX, uv: [0.0; 2], instance: Hit::DIRECT };
    let mut stack = [(0f32, Child(0)); STACK];
    let mut top = 0;
    let mut current = Child(accel.root);
    loop {
        if let Some(index) = current.node() {
            let node = &accel.nodes[index];
            let (mut mask, enter) = slab.test(node, best.t);
            if mask != 0 {
                // Go on with the nearest child, leave the others on the stack.
                let enter = enter.to_array();
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                let mut next = (enter[lane & 3], node.child(lane));
                while mask != 0 {
                    let lane = mask.trailing_zeros() as usize;
                    mask &= mask - 1;
                    let mut other = (enter[lane & 3], node.child(lane));
                    if other.0 < next.0 {
                        std::mem::swap(&mut other, &mut next);
                    }
                    stack[top] = other;
                    top += 1;
                }
                current = next.1;
                continue;
            }
        } else {
            closest_in_leaf(accel, current, (ray, &sheared), &mut best);
        }
        loop {
            if top == 0 {
                return (best.prim != u32::MAX).then_some(best);
            }
            top -= 1;
            let (enter, child) = stack[top];
            if enter < best.t {
                current = child;
                break;
            }
        }
    }
}

#[inline(always)]
fn closest_in_leaf(accel: &Accel, leaf: Child, ray: (&Ray, &ShearedRay), best: &mut Hit) {
    match leaf.leaf() {
        Leaf::Quads(blocks) => closest_in_blocks(&accel.quads[blocks], ray, best),
        Leaf::Triangles(blocks) => closest_in_blocks(&accel.blocks[blocks], ray, best),
        Leaf::Analytic(prim) => {
            if let Some(t) = analytic(accel, prim, ray.0, best.t) {
                *best = Hit { t, prim, uv: [0.0; 2], instance: Hit::DIRECT };
            }
        }
    }
}

#[inline(always)]
fn closest_in_blocks(blocks: &[impl Polygons], ray: (&Ray, &ShearedRay), best: &mut Hit) {
    for block in blocks {
        let hits = block.intersect(ray.1, best.t);
        let mut mask = hits.mask;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            let t = distance(block, &hits, lane, ray.0);
            if t > 0.0 && t < best.t {
                *best = Hit { t, prim: block.id(lane), uv: hits.uv(lane), instance: Hit::DIRECT };
            }
        }
    }
}

/// The distance in `lane`, from a better source where the quick one cannot be trusted.
#[inline(always)]
fn distance(block: &impl Polygons, hits: &BlockHits, lane: usize, ray: &Ray) -> f32 {
    if hits.is_doubtful(lane) {
        block.exact_t(lane, (ray.origin, ray.direction))
    } else {
        hits.t.to_array()[lane & 3]
    }
}

/// True when anything is hit.
#[inline]
pub(super) fn occluded<const STACK: usize>(accel: &Accel, ray: &Ray, skip: PrimRange) -> bool {
    let slab = SlabRay::new(accel, ray);
    let sheared = ShearedRay::new(ray.origin, ray.direction);
    let mut stack = [Child(0); STACK];
    let mut top = 1;
    stack[0] = Child(accel.root);
    while top > 0 {
        top -= 1;
        let current = stack[top];
        if let Some(index) = current.node() {
            let node = &accel.nodes[index];
            let (mut mask, _) = slab.test(node, ray.t_max);
            while mask != 0 {
                stack[top] = node.child(mask.trailing_zeros() as usize);
                top += 1;
                mask &= mask - 1;
            }
        } else if occluded_in_leaf(accel, current, (ray, &sheared), skip) {
            return true;
        }
    }
    false
}

#[inline(always)]
fn occluded_in_leaf(accel: &Accel, leaf: Child, ray: (&Ray, &ShearedRay), skip: PrimRange) -> bool {
    match leaf.leaf() {
        Leaf::Quads(blocks) => occluded_in_blocks(&accel.quads[blocks], ray, skip),
        Leaf::Triangles(blocks) => occluded_in_blocks(&accel.blocks[blocks], ray, skip),
        Leaf::Analytic(prim) => !skip.contains(prim) && analytic(accel, prim, ray.0, ray.0.t_max).is_some(),
    }
}

#[inline(always)]
fn occluded_in_blocks(blocks: &[impl Polygons], ray: (&Ray, &ShearedRay), skip: PrimRange) -> bool {
    for block in blocks {
        let hits = block.intersect(ray.1, ray.0.t_max);
        let mut mask = hits.mask;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            let t = distance(block, &hits, lane, ray.0);
            if t > 0.0 && t < ray.0.t_max && !skip.contains(block.id(lane)) {
                return true;
            }
        }
    }
    false
}

/// Where the ray meets the disk or sphere `prim`.
#[inline(never)]
fn analytic(accel: &Accel, prim: u32, ray: &Ray, t_max: f32) -> Option<f32> {
    let i = (prim - accel.triangle_count) as usize;
    match accel.disks.get(i) {
        Some(disk) => disk.intersect(ray, t_max),
        None => accel.spheres.get(i - accel.disks.len())?.intersect(ray, t_max),
    }
}
