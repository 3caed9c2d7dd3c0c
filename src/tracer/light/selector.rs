//! Which light a point samples: by the importance of each there, which [`bounds`](super::bounds) estimate.

use crate::tracer::accel::{AvailableKernel, for_kernel};
use crate::tracer::bounding_sphere::BoundingSphere;

use super::bounds::{BoundsPack, LightBounds};
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

    /// Computes importances by `kernel` from now on; the same bits by each.
    pub(super) fn set_kernel(&mut self, kernel: AvailableKernel) {
        if let LightSelector::Few(few) = self {
            few.kernel = kernel;
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
    bounds: FewBounds,
    /// Their indices among all lights.
    lights: Vec<u32>,
    /// Position in `lights` of every light; `NONE` for one that never shines.
    slots: Vec<u8>,
    kernel: AvailableKernel,
}

const NONE: u8 = u8::MAX;

/// The bounds of few lights, as many at once as there are.
#[derive(Clone, Debug)]
enum FewBounds {
    UpTo4(Box<BoundsPack<4>>),
    UpTo8(Box<BoundsPack<8>>),
    UpTo16(Box<BoundsPack<FEW>>),
}

/// The weights that few lights are chosen in proportion to.
struct Weights {
    each: [f32; FEW],
    sum: f32,
}

for_kernel! {
    /// The weights of up to eight lights.
    weights_of_8 => weights(bounds: &BoundsPack<8>, at: &LightSampleContext) -> Weights
}

for_kernel! {
    /// The weights of up to sixteen lights.
    weights_of_16 => weights(bounds: &BoundsPack<16>, at: &LightSampleContext) -> Weights
}

/// The weights of lights by their importances at `at`.
#[inline(always)]
fn weights<const N: usize>(bounds: &BoundsPack<N>, at: &LightSampleContext) -> Weights {
    let importances = bounds.importances(at);
    let shining = importances.map(|importance| if importance > 0.0 { 1.0 } else { 0.0 });
    let sum = sum_of_lanes(importances);
    let share = EVEN * sum / sum_of_lanes(shining);
    // A sum of 0, and one that is no number, leaves the choice to the powers.
    let usable = share > 0.0 && share < f32::INFINITY;
    let mut each = [0.0; FEW];
    for i in 0..N {
        each[i] = if usable { importances[i] + share * shining[i] } else { bounds.power[i] };
    }
    let sum = if usable { sum * (1.0 + EVEN) } else { sum_of_lanes(bounds.power) };
    Weights { each, sum }
}

/// The sum of `N` numbers, a power of two, by halves: fewer steps than one after the other, and the same bits for any width of registers.
#[inline(always)]
fn sum_of_lanes<const N: usize>(mut lanes: [f32; N]) -> f32 {
    let mut half = N / 2;
    while half > 0 {
        for i in 0..half {
            lanes[i] += lanes[i + half];
        }
        half /= 2;
    }
    lanes[0]
}

impl FewLights {
    fn new(items: &[TreeItem], all: usize) -> Self {
        let mut slots = vec![NONE; all];
        for (slot, item) in items.iter().enumerate() {
            slots[item.light as usize] = slot as u8;
        }
        let (lights, bounds): (_, Vec<LightBounds>) =
            items.iter().map(|item| (item.light, item.bounds)).unzip();
        let bounds = match items.len() {
            0..=4 => FewBounds::UpTo4(BoundsPack::new(&bounds).into()),
            5..=8 => FewBounds::UpTo8(BoundsPack::new(&bounds).into()),
            _ => FewBounds::UpTo16(BoundsPack::new(&bounds).into()),
        };
        Self { bounds, lights, slots, kernel: AvailableKernel::best() }
    }

    #[inline]
    fn weights(&self, at: LightSampleContext) -> Weights {
        match &self.bounds {
            FewBounds::UpTo4(bounds) => weights(bounds, &at),
            FewBounds::UpTo8(bounds) => weights_of_8(self.kernel, bounds, &at),
            FewBounds::UpTo16(bounds) => weights_of_16(self.kernel, bounds, &at),
        }
    }

    #[inline]
    fn sample(&self, at: LightSampleContext, u: f64) -> (u32, f32) {
        let Weights { each, sum } = self.weights(at);
        let mut left = u * f64::from(sum);
        let mut chosen = 0;
        for (i, weight) in each[..self.lights.len()].iter().enumerate() {
            if *weight > 0.0 {
                chosen = i;
                left -= f64::from(*weight);
                if left < 0.0 {
                    break;
                }
            }
        }
        (self.lights[chosen], each[chosen] / sum)
    }

    #[inline]
    fn probability(&self, light: u32, at: LightSampleContext) -> f32 {
        let Weights { each, sum } = self.weights(at);
        match self.slots[light as usize] {
            NONE => 0.0,
            slot => each[usize::from(slot)] / sum,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::math::bits::mix;
    use crate::tracer::accel::SimdKernel;

    /// A number in [0, 1).
    fn number(i: u64) -> f32 {
        (mix(i) >> 40) as f32 / (1u64 << 24) as f32
    }

    /// A vector in a cube of side 2 around the origin.
    fn vector(i: u64) -> Vec3 {
        2.0 * Vec3::new(number(3 * i), number(3 * i + 1), number(3 * i + 2)) - 1.0
    }

    /// Every third light is a ball, every fourth infinitely far away, and the others are flat.
    fn light(i: u64) -> LightBounds {
        let (center, power) = (4.0 * vector(1000 + i), 0.1 + number(7000 + i));
        match i % 12 {
            0 | 3 | 6 | 9 => LightBounds::round(center, 0.01, power),
            4 | 8 => LightBounds { radius2: -1.0, ..LightBounds::round(center, 0.0, power) },
            _ => LightBounds::flat([center, center + 0.3], vector(2000 + i).normalize(), power),
        }
    }

    fn weights_by<const N: usize>(
        count: u64,
        weights: impl Fn(AvailableKernel, &BoundsPack<N>, &LightSampleContext) -> Weights,
    ) {
        let lights: Vec<LightBounds> = (0..count).map(light).collect();
        let pack = BoundsPack::new(&lights);
        for i in 0..200 {
            let (p, n) = (4.0 * vector(3000 + i), vector(4000 + i).normalize());
            let at = LightSampleContext { p, n, through: i % 5 == 0, glossy: false };
            let bits = |kernel| {
                let Weights { each, sum } = weights(kernel, &pack, &at);
                (each.map(f32::to_bits), sum.to_bits())
            };
            let (each, sum) = bits(SimdKernel::Scalar.available().expect("any processor runs it"));
            let (total, sum) =
                (each.iter().map(|v| f64::from(f32::from_bits(*v))).sum::<f64>(), f32::from_bits(sum));
            assert!((total - f64::from(sum)).abs() <= 1e-5 * total && sum > 0.0, "{total} {sum}");
            assert!(each[count as usize..].iter().all(|weight| *weight == 0), "no light has no weight");
            for kernel in SimdKernel::ALL.into_iter().filter_map(SimdKernel::available) {
                assert_eq!(bits(kernel), (each, sum.to_bits()), "{kernel:?}, {count} lights, context {i}");
            }
        }
    }

    #[test]
    fn every_kernel_weighs_lights_alike() {
        (5..=8).for_each(|count| weights_by::<8>(count, weights_of_8));
        (9..=16).for_each(|count| weights_by::<16>(count, weights_of_16));
    }
}
