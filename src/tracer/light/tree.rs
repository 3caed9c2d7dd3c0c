//! Choosing one of many lights by walking down a tree of light bounds, and building that tree.
//!
//! At each node the walk takes a child in proportion to the importance of both (Conty Estevez and Kulla 2018, §5), with
//! one number that is stretched again after each choice. Lights infinitely far away are beside the root. The tree is built top down, by
//! binned splits that keep groups of lights small, of one direction and weak.

use glam::Vec3;

use crate::tracer::bounding_sphere::BoundingSphere;

use super::bounds::LightBounds;
use super::sample::LightSampleContext;
use super::shapes::{Light, with_light};
use super::source::LightSource;

/// Least probability of lights infinitely far away and of the tree, where there are both.
const LEAST: f32 = 0.1;

/// A node. The first child of an interior one is the next node.
#[derive(Clone, Copy, Debug)]
struct LightTreeNode {
    bounds: LightBounds,
    /// The second child, or [`LEAF`] with the light.
    link: u32,
}

const LEAF: u32 = 1 << 31;

/// The trail of a light that is not in the tree.
const NO_TRAIL: u64 = u64::MAX;

/// All lights that shine.
#[derive(Clone, Debug)]
pub(super) struct LightTree {
    nodes: Vec<LightTreeNode>,
    /// Bit trails, by light: at which nodes the second child is taken, the root's bit lowest.
    trails: Vec<u64>,
    /// Lights infinitely far away.
    far: Vec<(u32, LightBounds)>,
}

impl LightTree {
    /// A tree of `items`, of `all` lights; those without an item never shine.
    pub(super) fn new(mut items: Vec<TreeItem>, all: usize) -> Self {
        let mut far = Vec::new();
        while let Some(i) = items.iter().position(|item| item.bounds.is_far()) {
            let TreeItem { light, bounds, .. } = items.swap_remove(i);
            far.push((light, bounds));
        }
        let mut trails = vec![NO_TRAIL; all];
        // Children are behind their parents.
        let mut nodes = Vec::with_capacity(2 * items.len());
        if !items.is_empty() {
            grow(&mut items, 0, 0, &mut nodes, &mut trails);
        }
        Self { nodes, trails, far }
    }

    /// The probability of the lights infinitely far away, together.
    #[inline]
    fn far(&self, at: LightSampleContext) -> f32 {
        if self.far.is_empty() {
            return 0.0;
        }
        let Some(root) = self.nodes.first() else { return 1.0 };
        let near = root.bounds.importance(at);
        let far = self.far_importance(0, at);
        let share = far / (far + near);
        // NaN fails the comparison.
        if share > LEAST { share.min(1.0 - LEAST) } else { LEAST }
    }

    /// The importance of the lights infinitely far away from the `first` on.
    #[inline]
    fn far_importance(&self, first: usize, at: LightSampleContext) -> f32 {
        self.far[first..].iter().map(|(_, bounds)| bounds.importance(at)).sum()
    }

    /// The probability of the light infinitely far away in this `place`, among it and those behind it; the last is certain.
    #[inline]
    fn far_share(&self, place: usize, at: LightSampleContext) -> f32 {
        if place + 1 == self.far.len() {
            return 1.0;
        }
        let this = self.far[place].1.importance(at);
        let share = this / self.far_importance(place, at);
        // None of them seems to light the point.
        if share.is_nan() { 1.0 / (self.far.len() - place) as f32 } else { share }
    }

    /// The probability of the first of two children.
    #[inline]
    fn first(&self, children: [&LightBounds; 2], at: LightSampleContext) -> f32 {
        let [a, b] = children.map(|c| c.importance(at));
        let share = a / (a + b);
        // Neither seems to light the point, or the point is nowhere.
        if share.is_nan() { children[0].power / (children[0].power + children[1].power) } else { share }
    }

    #[inline]
    fn children(&self, node: usize) -> [usize; 2] {
        [node + 1, self.nodes[node].link as usize]
    }

    /// A light and its probability, by `u` in [0, 1).
    #[inline]
    pub(super) fn sample(&self, at: LightSampleContext, mut u: f64) -> (u32, f32) {
        let mut probability = 1.0;
        let mut take = |first: f32| {
            let p = f64::from(first);
            // A child of probability 0 is never taken, whatever rounding does to the number.
            let second = (u >= p && p < 1.0) || p == 0.0;
            (u, probability) = if second {
                (((u - p) / (1.0 - p)).clamp(0.0, BELOW_1), probability * (1.0 - p))
            } else {
                ((u / p).min(BELOW_1), probability * p)
            };
            second
        };
        if !self.far.is_empty() && !take(self.far(at)) {
            let chosen = (0..self.far.len() - 1).find(|place| !take(self.far_share(*place, at)));
            let (light, _) = self.far[chosen.unwrap_or(self.far.len() - 1)];
            return (light, probability as f32);
        }
        let mut node = 0;
        while self.nodes[node].link & LEAF == 0 {
            let children = self.children(node);
            let first = self.first(children.map(|i| &self.nodes[i].bounds), at);
            node = children[usize::from(take(first))];
        }
        (self.nodes[node].link & !LEAF, probability as f32)
    }

    /// The probability of `light`, by the same steps.
    #[inline]
    pub(super) fn probability(&self, light: u32, at: LightSampleContext) -> f32 {
        let far = f64::from(self.far(at));
        if let Some(place) = self.far.iter().position(|(far, _)| *far == light) {
            let passed = |before: usize| 1.0 - f64::from(self.far_share(before, at));
            return ((0..place).map(passed).product::<f64>() * far * f64::from(self.far_share(place, at)))
                as f32;
        }
        let mut trail = self.trails[light as usize];
        if trail == NO_TRAIL {
            return 0.0;
        }
        let mut probability = 1.0 - far;
        let mut node = 0;
        while self.nodes[node].link & LEAF == 0 && probability > 0.0 {
            let children = self.children(node);
            let p = f64::from(self.first(children.map(|i| &self.nodes[i].bounds), at));
            probability *= if trail & 1 == 1 { 1.0 - p } else { p };
            node = children[(trail & 1) as usize];
            trail >>= 1;
        }
        probability as f32
    }
}

/// The largest number below 1.
const BELOW_1: f64 = 1.0 - f64::EPSILON / 2.0;

/// A light from which the tree is built.
#[derive(Clone, Copy, Debug)]
pub(super) struct TreeItem {
    /// Its index among all lights.
    pub(super) light: u32,
    pub(super) bounds: LightBounds,
    /// Corners of its box, which contains no point for a light infinitely far away.
    lo: Vec3,
    hi: Vec3,
}

impl TreeItem {
    /// `light`, of power `power` over π.
    pub(super) fn new(index: u32, light: &Light, power: f32, scene: BoundingSphere) -> Self {
        let (bounds, [lo, hi]) = with_light!(&light.shape, l => l.bounds(power, scene));
        Self { light: index, bounds, lo, hi }
    }
}

const BINS: usize = 16;

/// For up to this many lights all three axes are tried, for more only the longest.
const ALL_AXES: usize = 4096;

/// From this depth on lights are split into halves, so that the trail of a light fits into 63 bits.
const HALVING_DEPTH: u32 = 28;

/// Adds the nodes over `items` and returns their bounds. `trail`, of `depth` bits, leads there.
fn grow(
    items: &mut [TreeItem],
    trail: u64,
    depth: u32,
    nodes: &mut Vec<LightTreeNode>,
    trails: &mut [u64],
) -> GroupBounds {
    let at = nodes.len();
    if let [TreeItem { light, bounds, .. }] = *items {
        nodes.push(LightTreeNode { bounds, link: LEAF | light });
        trails[light as usize] = trail;
        return GroupBounds::of(&items[0]);
    }
    let middle = split(items, depth);
    let (first, second) = items.split_at_mut(middle);
    // The bounds are known once the children are.
    nodes.push(LightTreeNode { bounds: first[0].bounds, link: 0 });
    let a = grow(first, trail, depth + 1, nodes, trails);
    let link = nodes.len() as u32;
    let b = grow(second, trail | 1 << depth, depth + 1, nodes, trails);
    let both = a.join(&b);
    nodes[at] = LightTreeNode { bounds: both.light_bounds(), link };
    both
}

/// Reorders `items` and returns where the second child begins. Neither child is empty.
fn split(items: &mut [TreeItem], depth: u32) -> usize {
    let center = |item: &TreeItem| 0.5 * (item.lo + item.hi);
    let (lo, hi) = items.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), item| {
        (lo.min(center(item)), hi.max(center(item)))
    });
    let size = hi - lo;
    let longest = usize::from(size.y > size.x);
    let longest = if size.z > size[longest] { 2 } else { longest };
    let half = items.len() / 2;
    if depth >= HALVING_DEPTH {
        let key = |item: &TreeItem| center(item)[longest];
        items.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)));
        return half;
    }
    let axes = if items.len() <= ALL_AXES { 0..3 } else { longest..longest + 1 };
    let bin = |item: &TreeItem, axis: usize| {
        let place = (center(item)[axis] - lo[axis]) / size[axis];
        ((place * BINS as f32) as usize).min(BINS - 1)
    };
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in axes.filter(|axis| size[*axis] > 0.0) {
        let mut bins = [const { None::<GroupBounds> }; BINS];
        for item in items.iter() {
            let (bin, this) = (&mut bins[bin(item, axis)], GroupBounds::of(item));
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
fn costs(bins: &[Option<GroupBounds>; BINS]) -> impl Iterator<Item = (f64, usize)> {
    let joined = |a: &Option<GroupBounds>, b: &Option<GroupBounds>| match (a, b) {
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

/// Bounds of a group of lights while the tree is built.
#[derive(Clone, Copy, Debug)]
struct GroupBounds {
    lo: Vec3,
    hi: Vec3,
    axis: Vec3,
    /// Half angle of the cone of normals.
    angle: f32,
    power: f64,
}

impl GroupBounds {
    fn of(item: &TreeItem) -> Self {
        let LightBounds { axis, cos, power, .. } = item.bounds;
        let angle = if cos > 0.0 { 0.0 } else { std::f32::consts::PI };
        Self { lo: item.lo, hi: item.hi, axis, angle, power: f64::from(power) }
    }

    fn join(&self, other: &Self) -> Self {
        let (axis, angle) = join_cones(self.axis, self.angle, other.axis, other.angle);
        let (lo, hi) = (self.lo.min(other.lo), self.hi.max(other.hi));
        Self { lo, hi, axis, angle, power: self.power + other.power }
    }

    /// The cost of the group: power times surface times the measure of directions (Conty Estevez and Kulla 2018, eq. 1 and 2).
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

    fn light_bounds(&self) -> LightBounds {
        LightBounds {
            center: 0.5 * (self.lo + self.hi),
            radius2: 0.25 * (self.hi - self.lo).length_squared(),
            axis: self.axis,
            // Widened by what rounding may have taken.
            cos: if self.angle < 3.1 { (self.angle + 1e-3).cos() } else { -1.0 },
            power: self.power as f32,
        }
    }
}

/// The smallest cone around two, by axis and half angle.
fn join_cones(a: Vec3, angle_a: f32, b: Vec3, angle_b: f32) -> (Vec3, f32) {
    const PI: f32 = std::f32::consts::PI;
    if angle_b > angle_a {
        return join_cones(b, angle_b, a, angle_a);
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
