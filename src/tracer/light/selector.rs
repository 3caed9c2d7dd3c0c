//! Which light a point samples: by the importance of each there, which [`bounds`](super::bounds) estimate.

use crate::tracer::bounding_sphere::BoundingSphere;

use super::bounds::{BoundsPack, LightBounds, PACK};
use super::sample::LightSampleContext;
use super::shapes::Light;
use super::tree::{LightTree, TreeItem};

/// With up to this many lights the importance of each is evaluated; more are put into a tree.
const FEW: usize = 16;

/// With up to this many lights it pays to sample all of them where a choice without the material is a poor one.
const EACH: usize = 8;

/// Share of the choice of few lights that is even among those that may shine at all: occlusion is not known.
const EVEN: f32 = 0.1;

/// How a lit point chooses a light. The probability of a light is exactly that of the choice.
#[derive(Clone, Debug, Default)]
pub(super) enum LightSelector {
    /// There is nothing to choose.
    #[default]
    None,
    /// The only light that shines.
    One(u32),
    /// The importance of each is evaluated.
    Few(FewLights),
    Many(LightTree),
}

impl LightSelector {
    /// A choice among `lights`, whose powers (over π) are `powers`: not negative and of finite sum, which is 0 where nothing is looked for.
    pub(super) fn new(lights: &[Light], powers: &[f32], scene: BoundingSphere) -> Self {
        let largest = powers.iter().fold(0.0f32, |a, b| a.max(*b));
        let shining = powers.iter().enumerate().filter(|(_, power)| **power > 0.0);
        // Relative to the strongest, so that no quotient overflows; what is far weaker keeps a chance.
        let relative = |power: f32| (power / largest).max(1e-30);
        let items: Vec<TreeItem> =
            shining.map(|(i, power)| TreeItem::new(i as u32, &lights[i], relative(*power), scene)).collect();
        match items.len() {
            0 => LightSelector::None,
            1 => LightSelector::One(items[0].light),
            2..=FEW => LightSelector::Few(FewLights::new(&items, lights.len())),
            _ => LightSelector::Many(LightTree::new(items, lights.len())),
        }
    }

    /// A light and its probability, by `u` in [0, 1).
    #[inline(always)]
    pub(super) fn sample(&self, at: LightSampleContext, u: f64) -> Option<(u32, f32)> {
        match self {
            LightSelector::None => None,
            LightSelector::One(light) => Some((*light, 1.0)),
            LightSelector::Few(few) => Some(few.sample(at, u)),
            LightSelector::Many(tree) => Some(tree.sample(at, u)),
        }
    }

    /// The one light that is ever chosen, or `Some(None)` where there is none; `None` where there are several.
    #[inline]
    pub(super) fn only(&self) -> Option<Option<u32>> {
        match self {
            LightSelector::None => Some(None),
            LightSelector::One(light) => Some(Some(*light)),
            LightSelector::Few(_) | LightSelector::Many(_) => None,
        }
    }

    /// The lights that shine, if there are between 2 and [`EACH`] of them.
    #[inline]
    pub(super) fn each(&self) -> Option<&[u32]> {
        match self {
            LightSelector::Few(few) if few.lights.len() <= EACH => Some(&few.lights),
            _ => None,
        }
    }

    /// The probability with which `light` is chosen.
    #[inline]
    pub(super) fn probability(&self, light: u32, at: LightSampleContext) -> f32 {
        match self {
            LightSelector::None => 0.0,
            LightSelector::One(only) => f32::from(u8::from(light == *only)),
            LightSelector::Few(few) => few.probability(light, at),
            LightSelector::Many(tree) => tree.probability(light, at),
        }
    }
}

/// Lights few enough to evaluate the importance of each.
#[derive(Clone, Debug)]
pub(super) struct FewLights {
    bounds: Vec<BoundsPack>,
    /// Their indices among all lights.
    lights: Vec<u32>,
    /// Position in `lights` of every light; `NONE` for one that never shines.
    slots: Vec<u8>,
}

const NONE: u8 = u8::MAX;

impl FewLights {
    fn new(items: &[TreeItem], all: usize) -> Self {
        let mut slots = vec![NONE; all];
        for (slot, item) in items.iter().enumerate() {
            slots[item.light as usize] = slot as u8;
        }
        let (lights, bounds): (_, Vec<LightBounds>) =
            items.iter().map(|item| (item.light, item.bounds)).unzip();
        Self { bounds: bounds.chunks(PACK).map(BoundsPack::new).collect(), lights, slots }
    }

    /// The weights that lights are chosen in proportion to, and their sum.
    #[inline]
    fn weights(&self, at: LightSampleContext) -> ([f32; FEW], f32) {
        let mut weights = [0.0; FEW];
        let (mut sum, mut count) = (0.0, 0.0);
        let (packs, _) = weights.as_chunks_mut::<PACK>();
        for (pack, bounds) in packs.iter_mut().zip(&self.bounds) {
            *pack = bounds.importances(at);
            for weight in pack {
                sum += *weight;
                count += if *weight > 0.0 { 1.0 } else { 0.0 };
            }
        }
        let share = EVEN * sum / count;
        let mut total = 0.0;
        // A sum of 0, and one that is no number, leaves the choice to the powers.
        let usable = share > 0.0 && share.is_finite();
        for (pack, bounds) in packs.iter_mut().zip(&self.bounds) {
            for (weight, power) in pack.iter_mut().zip(bounds.power) {
                let even = if *weight > 0.0 { *weight + share } else { *weight };
                *weight = if usable { even } else { power };
                total += *weight;
            }
        }
        (weights, total)
    }

    #[inline]
    fn sample(&self, at: LightSampleContext, u: f64) -> (u32, f32) {
        let (weights, total) = self.weights(at);
        let mut left = u * f64::from(total);
        let mut chosen = 0;
        for (i, weight) in weights[..self.lights.len()].iter().enumerate() {
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
    fn probability(&self, light: u32, at: LightSampleContext) -> f32 {
        let (weights, total) = self.weights(at);
        match self.slots[light as usize] {
            NONE => 0.0,
            slot => weights[usize::from(slot)] / total,
        }
    }
}
