//! The binary tree: one primitive per leaf, split from the top by the surface area heuristic.
//!
//! Sixteen bins along each axis (Wald, *On fast Construction of SAH-based Bounding Volume Hierarchies*, 2007), all cuts of the sorted
//! centres where there are few; then obvhs moves what lies badly (Meister and Bittner, *Parallel Reinsertion for Bounding Volume
//! Hierarchy Optimization*, 2018). obvhs's own bottom-up tree takes longer to build (1.2 s for 1.6 million, here .7) and to walk. The result does not depend on
//! the number of threads.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use rayon::prelude::*;

/// Bins along an axis for many primitives, and for fewer than [`FEWER`].
const BINS: usize = 16;
const FEWER_BINS: usize = 8;
const FEWER: usize = 24;
/// Up to so many primitives every cut is looked at.
const FEW: usize = 6;
/// From so many on both sides are built at once.
const MANY: usize = 4096;
/// From so many on the bins are filled by several threads.
const CROWD: usize = 1 << 17;
/// Primitives that a leaf tests for the price of one.
const AT_ONCE: usize = 8;
/// Share of the nodes that reinsertion looks at.
const REINSERTION: f32 = 0.02;
/// Levels after which sets are halved, whatever it costs.
const MAX_SPLITS: usize = 64;

/// The box of a primitive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounded {
    lo: Vec3,
    /// Index of the primitive.
    index: u32,
    hi: Vec3,
}

impl Bounded {
    pub(super) fn new((lo, hi): (Vec3, Vec3), index: u32) -> Self {
        Self { lo, index, hi }
    }

    #[inline(always)]
    fn aabb(&self) -> Aabb {
        Aabb { min: Vec3A::from(self.lo), max: Vec3A::from(self.hi) }
    }

    /// Twice the centre.
    #[inline(always)]
    fn center(&self) -> Vec3A {
        Vec3A::from(self.lo) + Vec3A::from(self.hi)
    }
}

/// The tree over `primitives`, of which there is at least one; not deeper than 67 + log₂ of their number unless `optimized`.
pub(super) fn build(primitives: &mut [Bounded], optimized: bool) -> Bvh2 {
    // By all threads: memory is first touched here.
    let mut nodes: Vec<Bvh2Node> =
        (1..2 * primitives.len()).into_par_iter().map(|_| Bvh2Node::default()).collect();
    let (root, rest) = nodes.split_at_mut(1);
    let aabb = around(primitives);
    split(Range { node: &mut root[0], rest, base: 1, primitives, first: 0, level: 0 }, aabb);
    let primitive_indices = primitives.iter().map(|p| p.index).collect();
    let mut bvh = Bvh2 { nodes, primitive_indices, ..Bvh2::default() };
    if optimized && primitives.len() > 2 {
        ReinsertionOptimizer::default().run(&mut bvh, REINSERTION, None);
    }
    bvh
}

/// Nodes to be made over some primitives: the one and, for n primitives, 2n − 2 below it, its two children first.
struct Range<'a> {
    node: &'a mut Bvh2Node,
    rest: &'a mut [Bvh2Node],
    /// Index of the first of `rest`.
    base: usize,
    primitives: &'a mut [Bounded],
    /// Index of the first of `primitives`.
    first: usize,
    level: usize,
}

fn split(range: Range, aabb: Aabb) {
    let Range { node, rest, base, primitives, first, level } = range;
    let count = primitives.len();
    if count == 1 {
        *node = Bvh2Node::new(aabb, 1, first as u32);
        return;
    }
    *node = Bvh2Node::new(aabb, 0, base as u32);
    let Halves { left, boxes } = if count == 2 {
        Halves { left: 1, boxes: [primitives[0].aabb(), primitives[1].aabb()] }
    } else if count <= FEW {
        swept(primitives)
    } else {
        let binned = match count {
            _ if level >= MAX_SPLITS => None,
            0..FEWER => binned::<FEWER_BINS>(primitives),
            _ => binned::<BINS>(primitives),
        };
        binned.unwrap_or_else(|| halved(primitives, aabb))
    };
    let (children, rest) = rest.split_at_mut(2);
    let (one, two) = children.split_at_mut(1);
    let (left_rest, right_rest) = rest.split_at_mut(2 * left - 2);
    let (left_primitives, right_primitives) = primitives.split_at_mut(left);
    let level = level + 1;
    let one = Range {
        node: &mut one[0],
        rest: left_rest,
        base: base + 2,
        primitives: left_primitives,
        first,
        level,
    };
    let two = Range {
        node: &mut two[0],
        rest: right_rest,
        base: base + 2 * left,
        primitives: right_primitives,
        first: first + left,
        level,
    };
    if count >= MANY {
        rayon::join(|| split(one, boxes[0]), || split(two, boxes[1]));
    } else {
        split(one, boxes[0]);
        split(two, boxes[1]);
    }
}

/// How primitives were divided: so many to the left, and the boxes of both sides.
struct Halves {
    left: usize,
    boxes: [Aabb; 2],
}

fn around(primitives: &[Bounded]) -> Aabb {
    primitives.iter().fold(Aabb::INVALID, |a, p| a.union(&p.aabb()))
}

#[inline(always)]
fn price(aabb: &Aabb, count: usize) -> f32 {
    aabb.half_area() * count.div_ceil(AT_ONCE) as f32
}

/// The best cut of the centres sorted along any axis.
fn swept(primitives: &mut [Bounded]) -> Halves {
    let n = primitives.len();
    let mut best = (f32::INFINITY, 0, 1, [Aabb::INVALID; 2]);
    let mut sorted_along = 3;
    for axis in 0..3 {
        sort(primitives, axis);
        let mut from_right = [Aabb::INVALID; FEW];
        let mut right = Aabb::INVALID;
        for i in (1..n).rev() {
            right = right.union(&primitives[i].aabb());
            from_right[i] = right;
        }
        let mut left = Aabb::INVALID;
        for i in 1..n {
            left = left.union(&primitives[i - 1].aabb());
            let cost = price(&left, i) + price(&from_right[i], n - i);
            if cost < best.0 {
                best = (cost, axis, i, [left, from_right[i]]);
            }
        }
        sorted_along = axis;
    }
    if best.0 == f32::INFINITY {
        // Areas beyond all floats.
        best = (0.0, sorted_along, 1, [around(&primitives[..1]), around(&primitives[1..])]);
    }
    if best.1 != sorted_along {
        sort(primitives, best.1);
    }
    Halves { left: best.2, boxes: best.3 }
}

fn sort(few: &mut [Bounded], axis: usize) {
    few.sort_unstable_by(|a, b| {
        let [a_at, b_at] = [a, b].map(|p| p.lo[axis] + p.hi[axis]);
        a_at.total_cmp(&b_at).then(a.index.cmp(&b.index))
    });
}

#[derive(Clone, Copy)]
struct Bin {
    aabb: Aabb,
    count: usize,
}

const EMPTY: Bin = Bin { aabb: Aabb::INVALID, count: 0 };

/// Where centres fall.
#[derive(Clone, Copy)]
struct Grid<const N: usize> {
    lo: Vec3A,
    scale: Vec3A,
}

impl<const N: usize> Grid<N> {
    #[inline(always)]
    fn bins_of(&self, p: &Bounded) -> [usize; 3] {
        let at = (p.center() - self.lo) * self.scale;
        [at.x, at.y, at.z].map(|x| (x as i32).clamp(0, N as i32 - 1) as usize)
    }

    fn fill(&self, primitives: &[Bounded]) -> [[Bin; N]; 3] {
        if primitives.len() >= CROWD {
            let (a, b) = primitives.split_at(primitives.len() / 2);
            let (mut a, b) = rayon::join(|| self.fill(a), || self.fill(b));
            for (a, b) in a.iter_mut().flatten().zip(b.iter().flatten()) {
                *a = Bin { aabb: a.aabb.union(&b.aabb), count: a.count + b.count };
            }
            return a;
        }
        let mut bins = [[EMPTY; N]; 3];
        for p in primitives {
            let aabb = p.aabb();
            for (bins, i) in bins.iter_mut().zip(self.bins_of(p)) {
                bins[i].aabb.min = bins[i].aabb.min.min(aabb.min);
                bins[i].aabb.max = bins[i].aabb.max.max(aabb.max);
                bins[i].count += 1;
            }
        }
        bins
    }
}

fn centers(primitives: &[Bounded]) -> (Vec3A, Vec3A) {
    if primitives.len() >= CROWD {
        let (a, b) = primitives.split_at(primitives.len() / 2);
        let (a, b) = rayon::join(|| centers(a), || centers(b));
        return (a.0.min(b.0), a.1.max(b.1));
    }
    let none = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
    primitives.iter().fold(none, |(lo, hi), p| (lo.min(p.center()), hi.max(p.center())))
}

/// The best cut between bins, or `None` when all centres fall into one.
fn binned<const N: usize>(primitives: &mut [Bounded]) -> Option<Halves> {
    let (lo, hi) = centers(primitives);
    let spread = hi - lo;
    // A little less than the number of bins: the last centre falls into the last bin.
    let scale = (Vec3A::splat(N as f32 * 0.9999) / spread).map(|x| if x.is_finite() { x } else { 0.0 });
    let grid = Grid::<N> { lo, scale };
    let bins = grid.fill(primitives);
    let n = primitives.len();
    let mut best = (f32::INFINITY, 0, 0, [Aabb::INVALID; 2]);
    for (axis, bins) in bins.iter().enumerate() {
        let mut from_right = [(Aabb::INVALID, 0.0); N];
        let (mut right, mut count) = (Aabb::INVALID, 0);
        for i in (1..N).rev() {
            right = right.union(&bins[i].aabb);
            count += bins[i].count;
            from_right[i] = (right, price(&right, count));
        }
        let (mut left, mut count) = (Aabb::INVALID, 0);
        for i in 1..N {
            left = left.union(&bins[i - 1].aabb);
            count += bins[i - 1].count;
            if count == 0 || count == n {
                continue;
            }
            let cost = price(&left, count) + from_right[i].1;
            if cost < best.0 {
                best = (cost, axis, i, [left, from_right[i].0]);
            }
        }
    }
    let (cost, axis, cut, boxes) = best;
    (cost < f32::INFINITY).then(|| {
        let left = partition(primitives, |p| grid.bins_of(p)[axis] < cut);
        Halves { left, boxes }
    })
}

/// Moves what `is_left` to the front; returns how many.
fn partition(primitives: &mut [Bounded], is_left: impl Fn(&Bounded) -> bool) -> usize {
    let (mut from, mut to) = (0, primitives.len());
    loop {
        while from < to && is_left(&primitives[from]) {
            from += 1;
        }
        while from < to && !is_left(&primitives[to - 1]) {
            to -= 1;
        }
        if from == to {
            return from;
        }
        primitives.swap(from, to - 1);
        from += 1;
        to -= 1;
    }
}

/// Half of the primitives to each side, by their centres along the longest axis.
fn halved(primitives: &mut [Bounded], aabb: Aabb) -> Halves {
    let size = aabb.max - aabb.min;
    let axis = if size.x > size.y.max(size.z) { 0 } else { 1 + usize::from(size.z > size.y) };
    let left = primitives.len() / 2;
    primitives.select_nth_unstable_by(left, |a, b| {
        a.center()[axis].total_cmp(&b.center()[axis]).then(a.index.cmp(&b.index))
    });
    Halves { left, boxes: [around(&primitives[..left]), around(&primitives[left..])] }
}
