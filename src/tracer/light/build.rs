//! Building the tree of lights: top down, by binned splits that keep clusters small, of one direction and weak.

use glam::Vec3;

use super::cluster::{Cluster, bounds};
use super::tree::{LEAF, Node};
use super::{Extent, Light};

/// A light on its way into the tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    /// Its index among all lights.
    pub(super) light: u32,
    pub(super) cluster: Cluster,
    /// Corners of its box.
    lo: Vec3,
    hi: Vec3,
}

impl Item {
    pub(super) fn new(index: u32, light: &Light, power: f32, extent: Extent) -> Self {
        let (lo, hi) = bounds(light);
        Self { light: index, cluster: Cluster::new(light, power, extent), lo, hi }
    }
}

/// Bins of a split.
const BINS: usize = 16;

/// Up to so many lights all three axes are tried, then only the longest.
const THOROUGH: usize = 4096;

/// From this depth on halves are taken, so that the way to a light fits into 63 bits.
const DEEP: u32 = 28;

/// The nodes over `items`, children behind their parents; also writes the way to each light.
pub(super) fn tree(items: &mut [Item], ways: &mut [u64]) -> Vec<Node> {
    let mut nodes = Vec::with_capacity(2 * items.len());
    if !items.is_empty() {
        grow(items, (0, 0), &mut nodes, ways);
    }
    nodes
}

/// Adds the nodes over `items` and returns their bounds; `(way, depth)` leads there.
fn grow(items: &mut [Item], (way, depth): (u64, u32), nodes: &mut Vec<Node>, ways: &mut [u64]) -> Bounds {
    let at = nodes.len();
    if let [Item { light, cluster, .. }] = *items {
        nodes.push(Node { cluster, link: LEAF | light });
        ways[light as usize] = way;
        return Bounds::of(&items[0]);
    }
    let middle = split(items, depth);
    let (first, second) = items.split_at_mut(middle);
    // The bounds are known once the children are.
    nodes.push(Node { cluster: first[0].cluster, link: 0 });
    let a = grow(first, (way, depth + 1), nodes, ways);
    let link = nodes.len() as u32;
    let b = grow(second, (way | 1 << depth, depth + 1), nodes, ways);
    let both = a.join(&b);
    nodes[at] = Node { cluster: both.cluster(), link };
    both
}

/// Orders `items` so that those up to the index returned are one child: neither is empty.
fn split(items: &mut [Item], depth: u32) -> usize {
    let center = |item: &Item| 0.5 * (item.lo + item.hi);
    let (lo, hi) = items.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), item| {
        (lo.min(center(item)), hi.max(center(item)))
    });
    let size = hi - lo;
    let longest = usize::from(size.y > size.x);
    let longest = if size.z > size[longest] { 2 } else { longest };
    let half = items.len() / 2;
    if depth >= DEEP {
        let key = |item: &Item| center(item)[longest];
        items.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)));
        return half;
    }
    let axes = if items.len() <= THOROUGH { 0..3 } else { longest..longest + 1 };
    let bin = |item: &Item, axis: usize| {
        let place = (center(item)[axis] - lo[axis]) / size[axis];
        ((place * BINS as f32) as usize).min(BINS - 1)
    };
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in axes.filter(|axis| size[*axis] > 0.0) {
        let mut bins = [const { None::<Bounds> }; BINS];
        for item in items.iter() {
            let (bin, this) = (&mut bins[bin(item, axis)], Bounds::of(item));
            *bin = Some(bin.as_ref().map_or(this, |b| b.join(&this)));
        }
        // Thin boxes are worth less to cut the short way.
        let stretch = f64::from(size[longest] / size[axis]);
        for (cost, end) in costs(&bins) {
            if best.is_none_or(|(least, ..)| cost * stretch < least) {
                best = Some((cost * stretch, axis, end));
            }
        }
    }
    // All in one place.
    let Some((_, axis, end)) = best else { return half };
    let mut middle = 0;
    for i in 0..items.len() {
        if bin(&items[i], axis) < end {
            items.swap(i, middle);
            middle += 1;
        }
    }
    middle
}

/// The cost of each split that leaves neither side empty, with the bin that the second side begins with.
fn costs(bins: &[Option<Bounds>; BINS]) -> impl Iterator<Item = (f64, usize)> {
    let joined = |a: &Option<Bounds>, b: &Option<Bounds>| match (a, b) {
        (Some(a), Some(b)) => Some(a.join(b)),
        (a, b) => *if a.is_some() { a } else { b },
    };
    let mut behind = *bins;
    for i in (0..BINS - 1).rev() {
        behind[i] = joined(&bins[i], &behind[i + 1]);
    }
    let (bins, mut before) = (*bins, None);
    (1..BINS).filter_map(move |end| {
        before = joined(&before, &bins[end - 1]);
        let (a, b) = (before.as_ref()?, behind[end].as_ref()?);
        // A side that no further bin adds to has been looked at.
        bins[end - 1].is_some().then(|| (a.cost() + b.cost(), end))
    })
}

/// Bounds of several lights.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    lo: Vec3,
    hi: Vec3,
    axis: Vec3,
    /// Half angle of the cone of normals.
    angle: f32,
    power: f64,
}

impl Bounds {
    fn of(item: &Item) -> Self {
        let Cluster { axis, cos, power, .. } = item.cluster;
        let angle = if cos > 0.0 { 0.0 } else { std::f32::consts::PI };
        Self { lo: item.lo, hi: item.hi, axis, angle, power: f64::from(power) }
    }

    fn join(&self, other: &Self) -> Self {
        let (axis, angle) = join_cones((self.axis, self.angle), (other.axis, other.angle));
        let (lo, hi) = (self.lo.min(other.lo), self.hi.max(other.hi));
        Self { lo, hi, axis, angle, power: self.power + other.power }
    }

    /// Power, surface and the measure of directions (Conty Estevez and Kulla 2018, eq. 1 and 2).
    fn cost(&self) -> f64 {
        let d = (self.hi - self.lo).as_dvec3();
        let surface = d.x * d.y + d.y * d.z + d.z * d.x;
        // Lights in a line have no surface, but a length.
        let surface = surface + 1e-4 * d.length_squared();
        let (o, pi) = (f64::from(self.angle), std::f64::consts::PI);
        let w = (o + 0.5 * pi).min(pi);
        let spread = 0.5 * pi * (2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos());
        self.power * surface * (2.0 * pi * (1.0 - o.cos()) + spread)
    }

    fn cluster(&self) -> Cluster {
        Cluster {
            center: 0.5 * (self.lo + self.hi),
            radius2: 0.25 * (self.hi - self.lo).length_squared(),
            axis: self.axis,
            // Widened by what rounding may have taken.
            cos: if self.angle < 3.1 { (self.angle + 1e-3).cos() } else { -1.0 },
            power: self.power as f32,
        }
    }
}

/// The smallest cone around two.
fn join_cones((a, angle_a): (Vec3, f32), (b, angle_b): (Vec3, f32)) -> (Vec3, f32) {
    const PI: f32 = std::f32::consts::PI;
    if angle_b > angle_a {
        return join_cones((b, angle_b), (a, angle_a));
    }
    let cos = a.dot(b);
    // The usual case, of lights that face the same way.
    if angle_a >= PI || (angle_b == 0.0 && cos >= 1.0) {
        return (a, angle_a);
    }
    let between = cos.clamp(-1.0, 1.0).acos();
    if between + angle_b <= angle_a {
        return (a, angle_a);
    }
    let angle = 0.5 * (angle_a + between + angle_b);
    let aside = (b - a * cos).try_normalize();
    match aside {
        Some(aside) if angle < PI => {
            let (sin, cos) = (angle - angle_a).sin_cos();
            ((a * cos + aside * sin).normalize(), angle)
        }
        _ => (a, PI),
    }
}
