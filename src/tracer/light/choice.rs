//! Which light a point samples: by what each may bring there.

use super::build::Item;
use super::cluster::Cluster;
use super::tree::Tree;
use super::{Extent, Light, LitPoint};

/// With up to this many lights each is looked at; more are put into a tree.
pub(super) const FEW: usize = 16;

/// With up to this many lights it pays to sample them all where a choice without the material is a poor one.
const EACH: usize = 8;

/// Part of the choice of few lights that is shared evenly among those that may shine at all: what shadows is not known.
const EVENLY: f32 = 0.1;

/// How a lit point chooses a light. The probability of a light is that of the choice, to the bit.
#[derive(Clone, Debug, Default)]
pub(super) enum Choice {
    /// There is nothing to choose.
    #[default]
    None,
    /// The only light that shines.
    One(u32),
    /// Each is looked at.
    Few(Few),
    /// A tree of them.
    Many(Tree),
}

impl Choice {
    /// A choice among `lights`, whose powers (over π) are `powers`: not negative and of finite, positive sum.
    pub(super) fn new(lights: &[Light], powers: &[f32], extent: Extent) -> Self {
        let largest = powers.iter().fold(0.0f32, |a, b| a.max(*b));
        let shining = powers.iter().enumerate().filter(|(_, power)| **power > 0.0);
        // Relative to the strongest, so that no quotient overflows; what is far weaker keeps a chance.
        let relative = |power: f32| (power / largest).max(1e-30);
        let items: Vec<Item> =
            shining.map(|(i, power)| Item::new(i as u32, &lights[i], relative(*power), extent)).collect();
        // Distances below this are not told apart.
        let near2 = (1e-12 * extent.radius * extent.radius).max(1e-30);
        match items.len() {
            0 => Choice::None,
            1 => Choice::One(items[0].light),
            2..=FEW => Choice::Few(Few::new(&items, lights.len(), near2)),
            _ => Choice::Many(Tree::new(items, lights.len(), near2)),
        }
    }

    /// A light and its probability, by `u` in [0, 1).
    #[inline(always)]
    pub(super) fn sample(&self, at: LitPoint, u: f64) -> Option<(u32, f32)> {
        match self {
            Choice::None => None,
            Choice::One(light) => Some((*light, 1.0)),
            Choice::Few(few) => Some(few.sample(at, u)),
            Choice::Many(tree) => Some(tree.sample(at, u)),
        }
    }

    /// The lights that shine, if there are between 2 and [`EACH`] of them.
    #[inline]
    pub(super) fn each(&self) -> Option<&[u32]> {
        match self {
            Choice::Few(few) if few.lights.len() <= EACH => Some(&few.lights),
            _ => None,
        }
    }

    /// The probability of `light`.
    #[inline]
    pub(super) fn probability(&self, light: u32, at: LitPoint) -> f32 {
        match self {
            Choice::None => 0.0,
            Choice::One(only) => f32::from(u8::from(light == *only)),
            Choice::Few(few) => few.probability(light, at),
            Choice::Many(tree) => tree.probability(light, at),
        }
    }
}

/// Lights few enough to look at each.
#[derive(Clone, Debug)]
pub(super) struct Few {
    clusters: Vec<Cluster>,
    /// Their indices among all lights.
    lights: Vec<u32>,
    /// Position in `clusters` of every light; `NONE` for one that never shines.
    slots: Vec<u8>,
    near2: f32,
}

const NONE: u8 = u8::MAX;

impl Few {
    fn new(items: &[Item], all: usize, near2: f32) -> Self {
        let mut slots = vec![NONE; all];
        for (slot, item) in items.iter().enumerate() {
            slots[item.light as usize] = slot as u8;
        }
        let (lights, clusters) = items.iter().map(|item| (item.light, item.cluster)).unzip();
        Self { clusters, lights, slots, near2 }
    }

    /// What each light is chosen in proportion to, and the sum.
    #[inline]
    fn weights(&self, at: LitPoint) -> ([f32; FEW], f32) {
        let mut weights = [0.0; FEW];
        let (mut sum, mut count) = (0.0, 0.0);
        for (weight, cluster) in weights.iter_mut().zip(&self.clusters) {
            *weight = cluster.importance(at, self.near2);
            sum += *weight;
            count += if *weight > 0.0 { 1.0 } else { 0.0 };
        }
        let share = EVENLY * sum / count;
        let mut total = 0.0;
        // A sum of 0, and one that is no number, leaves the choice to the powers.
        let usable = share > 0.0 && share.is_finite();
        for (weight, cluster) in weights.iter_mut().zip(&self.clusters) {
            if !usable {
                *weight = cluster.power;
            } else if *weight > 0.0 {
                *weight += share;
            }
            total += *weight;
        }
        (weights, total)
    }

    #[inline]
    fn sample(&self, at: LitPoint, u: f64) -> (u32, f32) {
        let (weights, total) = self.weights(at);
        let mut left = u * f64::from(total);
        let mut chosen = 0;
        for (i, weight) in weights[..self.clusters.len()].iter().enumerate() {
            if *weight > 0.0 {
                chosen = i;
                left -= f64::from(*weight);
                if left < 0.0 {
                    break;
                }
            }
        }
        (self.lights[chosen], weights[chosen] / total)
    }

    #[inline]
    fn probability(&self, light: u32, at: LitPoint) -> f32 {
        let (weights, total) = self.weights(at);
        match self.slots[light as usize] {
            NONE => 0.0,
            slot => weights[usize::from(slot)] / total,
        }
    }
}
