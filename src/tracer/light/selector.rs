//! Which light a point samples: by the importance of each there, which bounds how much light it, or a group of lights, may
//! bring.
//!
//! Bounds are those of Conty Estevez and Kulla, *Importance Sampling of Many Lights with Adaptive Tree Splitting*,
//! HPG 2018, §4.1 (also Pharr, Jakob, Humphreys, *Physically Based Rendering*, 4th ed., §12.6.3): a sphere around the
//! lights, a cone around their normals, and the sum of their powers. All lights here emit by the cosine, evenly or into
//! less than that, so that the angle beyond the normals to which light is sent is always 90°.

use glam::Vec3;

use super::tree::{LightTree, TreeItem};
use super::{BoundingSphere, Light, LightSampleContext};

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
    bounds: Vec<LightBounds>,
    /// Their indices among all lights.
    lights: Vec<u32>,
    /// Position in `bounds` of every light; `NONE` for one that never shines.
    slots: Vec<u8>,
}

const NONE: u8 = u8::MAX;

impl FewLights {
    fn new(items: &[TreeItem], all: usize) -> Self {
        let mut slots = vec![NONE; all];
        for (slot, item) in items.iter().enumerate() {
            slots[item.light as usize] = slot as u8;
        }
        let (lights, bounds) = items.iter().map(|item| (item.light, item.bounds)).unzip();
        Self { bounds, lights, slots }
    }

    /// The weights that lights are chosen in proportion to, and their sum.
    #[inline]
    fn weights(&self, at: LightSampleContext) -> ([f32; FEW], f32) {
        let mut weights = [0.0; FEW];
        let (mut sum, mut count) = (0.0, 0.0);
        for (weight, bounds) in weights.iter_mut().zip(&self.bounds) {
            *weight = bounds.importance(at);
            sum += *weight;
            count += if *weight > 0.0 { 1.0 } else { 0.0 };
        }
        let share = EVEN * sum / count;
        let mut total = 0.0;
        // A sum of 0, and one that is no number, leaves the choice to the powers.
        let usable = share > 0.0 && share.is_finite();
        for (weight, bounds) in weights.iter_mut().zip(&self.bounds) {
            if !usable {
                *weight = bounds.power;
            } else if *weight > 0.0 {
                *weight += share;
            }
            total += *weight;
        }
        (weights, total)
    }

    #[inline]
    fn sample(&self, at: LightSampleContext, u: f64) -> (u32, f32) {
        let (weights, total) = self.weights(at);
        let mut left = u * f64::from(total);
        let mut chosen = 0;
        for (i, weight) in weights[..self.bounds.len()].iter().enumerate() {
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

/// Bounds of a light, or of several.
#[derive(Clone, Copy, Debug)]
pub struct LightBounds {
    /// Centre of the bounding sphere; not used for a light infinitely far away.
    pub(super) center: Vec3,
    /// Its radius squared; negative for a light infinitely far away, whose importance is the same in all places.
    pub(super) radius2: f32,
    /// Unit axis of the cone that holds all normals.
    pub(super) axis: Vec3,
    /// Cosine of its half angle; −1 when there is light in all directions.
    pub(super) cos: f32,
    /// Irradiance at unit distance, straight in front; at any distance, of a light infinitely far away.
    pub(super) power: f32,
}

impl LightBounds {
    /// Bounds of a flat light in the box from `lo` to `hi`, with front normal `axis`.
    pub(super) fn flat([lo, hi]: [Vec3; 2], axis: Vec3, power: f32) -> Self {
        let (center, radius2) = (0.5 * (lo + hi), 0.25 * (hi - lo).length_squared());
        Self { center, radius2, axis, cos: 1.0, power }
    }

    /// Bounds of a light that emits evenly to all sides.
    pub(super) fn round(center: Vec3, radius2: f32, power: f32) -> Self {
        // A quarter of the surface of a sphere is seen, and lit like a disk.
        Self { center, radius2, axis: Vec3::Z, cos: -1.0, power: 0.25 * power }
    }

    /// Bounds of an environment, whose box contains no point.
    pub(super) fn infinite(power: f32, scene: BoundingSphere) -> (Self, [Vec3; 2]) {
        let far = 1.0 / (scene.radius * scene.radius).max(f32::MIN_POSITIVE);
        let bounds =
            Self { power: (0.25 * power * far).min(f32::MAX), ..Self::round(scene.center, -1.0, power) };
        (bounds, [Vec3::INFINITY, Vec3::NEG_INFINITY])
    }

    /// Bounds of light that goes in the unit direction `axis` everywhere.
    pub(super) fn parallel(axis: Vec3, power: f32, scene: BoundingSphere) -> (Self, [Vec3; 2]) {
        // Four times the irradiance of an environment's power: that comes from all around.
        let (bounds, corners) = Self::infinite(4.0 * power, scene);
        (Self { axis, cos: 1.0, ..bounds }, corners)
    }

    /// True for a light infinitely far away.
    pub(super) fn is_far(&self) -> bool {
        self.radius2 < 0.0
    }

    /// An estimate of the unoccluded irradiance at `at`: ≥ 0, and 0 only where no point of the lights can send light to the
    /// seen side of the surface.
    #[inline]
    pub(super) fn importance(&self, at: LightSampleContext) -> f32 {
        if self.radius2 < 0.0 {
            return if self.cos < 0.0 { self.power } else { self.power * received(at, -self.axis, 0.0) };
        }
        let to = self.center - at.p;
        let distance2 = to.length_squared();
        let falloff = self.power / distance2.max(self.radius2).max(LEAST_DISTANCE2);
        if distance2 <= self.radius2 || distance2 == 0.0 {
            return INSIDE * falloff;
        }
        let wi = to * (1.0 / distance2.sqrt());
        // The bounding sphere is seen under a half angle of this sine.
        let sin_u = (self.radius2 / distance2).sqrt();
        let received = received(at, wi, sin_u);
        if self.cos <= -1.0 {
            return falloff * received;
        }
        // The angle to the axis, less the half angle of the cone.
        let cos_w = -wi.dot(self.axis);
        let cos_w = if self.cos == 1.0 {
            cos_w
        } else if cos_w >= self.cos {
            1.0
        } else {
            let sin2 = ((1.0 - cos_w * cos_w) * (1.0 - self.cos * self.cos)).max(0.0);
            cos_w * self.cos + sin2.sqrt()
        };
        falloff * received * mean_cosine(cos_w, sin_u)
    }
}

/// The least squared distance that is distinguished, 2^−120: the quotient of a power, at most 1, stays finite. It knows
/// nothing of the scene, because one huge object in it would make the choice poor everywhere else.
const LEAST_DISTANCE2: f32 = 64.0 * f32::MIN_POSITIVE;

/// Share of the power that counts within the bounding sphere, where angles say nothing.
const INSIDE: f32 = 0.5;

/// The mean cosine at `at` of light that comes from around `wi`, from a half angle of sine `sin_u`.
#[inline]
fn received(at: LightSampleContext, wi: Vec3, sin_u: f32) -> f32 {
    let cos = wi.dot(at.n);
    mean_cosine(if at.through { cos.abs() } else { cos }, sin_u)
}

/// The mean of the positive cosines over a sphere in a direction of cosine `cos` that fills a half angle of sine `sin_u`:
/// `cos` itself where all of it is above the horizon (exact for a sphere of even radiance), 0 where none is, and between
/// them the parabola that goes on smoothly at both ends.
#[inline]
fn mean_cosine(cos: f32, sin_u: f32) -> f32 {
    // Tolerance, so that rounding hides no light that is just visible.
    const SLACK: f32 = 1e-6;
    let (above, u) = (cos + sin_u, sin_u + SLACK);
    if cos >= sin_u { cos + SLACK } else { (above + SLACK).max(0.0).powi(2) / (4.0 * u) }
}
