//! Choosing one of many lights by walking down a tree of clusters.
//!
//! At each node the path takes a child in proportion to the importance of both (Conty Estevez and Kulla 2018, §5), with
//! one number that is stretched again after each choice. The environment is beside the root.

use super::LitPoint;
use super::build::{self, Item};
use super::cluster::Cluster;

/// The environment's probability is at least this, and at most 1 less this, where there is also a tree.
const LEAST: f32 = 0.1;

/// A node; the first child of an interior one is the next node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) cluster: Cluster,
    /// The second child, or [`LEAF`] with the light.
    pub(super) link: u32,
}

/// Marks a leaf.
pub(super) const LEAF: u32 = 1 << 31;

/// The way of a light that is not in the tree.
pub(super) const NO_WAY: u64 = u64::MAX;

/// All lights that shine.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// By light: at which nodes the second child is taken, the root's bit lowest.
    ways: Vec<u64>,
    /// The environment.
    far: Option<(u32, Cluster)>,
    near2: f32,
}

impl Tree {
    /// A tree of `items`, of `all` lights; those without an item never shine.
    pub(super) fn new(mut items: Vec<Item>, all: usize, near2: f32) -> Self {
        let far = items.iter().position(|item| item.cluster.is_far());
        let far = far.map(|i| items.swap_remove(i)).map(|item| (item.light, item.cluster));
        let mut ways = vec![NO_WAY; all];
        let nodes = build::tree(&mut items, &mut ways);
        Self { nodes, ways, far, near2 }
    }

    /// The probability of the environment.
    #[inline]
    fn far(&self, at: LitPoint) -> f32 {
        let Some((_, far)) = &self.far else { return 0.0 };
        let near = self.nodes[0].cluster.importance(at, self.near2);
        let share = far.power / (far.power + near);
        // NaN fails the comparison.
        if share > LEAST { share.min(1.0 - LEAST) } else { LEAST }
    }

    /// The probability of the first of two children.
    #[inline]
    fn first(&self, children: [&Cluster; 2], at: LitPoint) -> f32 {
        let [a, b] = children.map(|c| c.importance(at, self.near2));
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
    pub(super) fn sample(&self, at: LitPoint, mut u: f64) -> (u32, f32) {
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
        if let Some((light, _)) = self.far
            && !take(self.far(at))
        {
            return (light, probability as f32);
        }
        let mut node = 0;
        while self.nodes[node].link & LEAF == 0 {
            let children = self.children(node);
            let first = self.first(children.map(|i| &self.nodes[i].cluster), at);
            node = children[usize::from(take(first))];
        }
        (self.nodes[node].link & !LEAF, probability as f32)
    }

    /// The probability of `light`, by the same steps.
    #[inline]
    pub(super) fn probability(&self, light: u32, at: LitPoint) -> f32 {
        let far = f64::from(self.far(at));
        if self.far.is_some_and(|(far, _)| far == light) {
            return far as f32;
        }
        let mut way = self.ways[light as usize];
        if way == NO_WAY {
            return 0.0;
        }
        let mut probability = if self.far.is_some() { 1.0 - far } else { 1.0 };
        let mut node = 0;
        while self.nodes[node].link & LEAF == 0 && probability > 0.0 {
            let children = self.children(node);
            let p = f64::from(self.first(children.map(|i| &self.nodes[i].cluster), at));
            probability *= if way & 1 == 1 { 1.0 - p } else { p };
            node = children[(way & 1) as usize];
            way >>= 1;
        }
        probability as f32
    }
}

/// The largest number below 1.
const BELOW_1: f64 = 1.0 - f64::EPSILON / 2.0;
