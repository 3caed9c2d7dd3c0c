//! Lights behind chains of deltas: those that the camera sees over mirrors and through glass alone.
//!
//! At glass a path samples either reflection or refraction. A light behind the less likely of the two is the brightest noise of a picture: a
//! small light mirrored in a glass ball contributes to one path in twenty-five, times twenty-five. So a camera path that has met deltas only also
//! follows, at each vertex, the chains of deltas that begin with the lobes it did not sample, as Whitted does (*An Improved Illumination Model for
//! Shaded Display*, 1980). A light that the path hits itself counts times the [probability](SpecularChain::probability) of its own chain. So every
//! chain counts once whatever the path samples, and the expected value is the same.
//!
//! This module says what a chain is and where chains may lead; [`integrator`](super::integrator) follows them.
//!
//! Only chains to lights with a surface are followed ([`ChainBounds`]); an environment, which hardly any chain misses, is left to sampling. So are
//! chains of many steps (`LONGEST_CHAIN`), of little throughput (`LEAST_VALUE`), and dispersive deltas. This depends on the chain alone, so that
//! all paths agree.

use std::sync::Arc;

use glam::Vec3;

use super::bounding_sphere::BoundingSphere;
use super::bsdf::{BsdfSample, DeltaLobes};

/// Most steps of a chain that is followed.
const LONGEST_CHAIN: u32 = 6;

/// Least share of the light at its end that a chain shows to the camera. Just below .04, which common glass reflects: one reflection is followed,
/// and none within the glass, whose rays would cost more than they gain (`caustic.xml` by paths takes 12 % longer with .01, 5 % with .05).
const LEAST_VALUE: f32 = 0.039;

/// Most spheres of [`ChainBounds`]: more objects share some.
const MOST_SPHERES: usize = 16;

/// Spheres around all that a chain leads to: surfaces that emit, and surfaces with deltas. Most rays of chains miss all of them, and need not be
/// traced.
#[derive(Clone, Debug, Default)]
pub struct ChainBounds {
    spheres: Arc<[BoundingSphere]>,
}

impl ChainBounds {
    /// The bounds of what is in these spheres.
    pub fn new(spheres: Vec<BoundingSphere>) -> Self {
        Self { spheres: BoundingSphere::few(spheres, MOST_SPHERES).into() }
    }

    /// False only where nothing of it is met from `p` in the unit direction `d`.
    #[inline]
    pub(super) fn may_be_met(&self, p: Vec3, d: Vec3) -> bool {
        self.spheres.iter().any(|sphere| sphere.may_be_hit(p, d))
    }
}

/// Whether every path looks along a chain of so many steps and one more by this lobe, which then has this value. False for NaN.
#[inline]
pub(super) fn is_followed(steps: u32, value: f32, lobe: &BsdfSample) -> bool {
    steps < LONGEST_CHAIN && value >= LEAST_VALUE && !lobe.hero_only
}

/// The deltas that a camera path has met so far: they decide with which weight a light counts that it hits next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpecularChain {
    /// Deltas only, each strong enough to be followed: a light that is hit counts with the probability of this chain, because paths that took another
    /// branch find it too.
    Followed {
        /// Number of deltas.
        steps: u32,
        /// Product of their values.
        value: f32,
        /// Product of the probabilities with which they were chosen.
        probability: f32,
    },
    /// Any other path: a light that is hit counts in full, because only paths along this chain find it.
    PathAlone,
}

impl SpecularChain {
    /// No vertex but the camera.
    pub const CAMERA: Self = Self::Followed { steps: 0, value: 1.0, probability: 1.0 };

    /// This chain and one step more, by a delta that is chosen with this probability.
    #[inline]
    pub(super) fn step(self, lobe: &BsdfSample, chosen: f32) -> Self {
        let Self::Followed { steps, value, probability } = self else { return self };
        let value = value * (lobe.weight.max_element() * lobe.eta2);
        let next = Self::Followed { steps: steps + 1, value, probability: probability * chosen };
        if is_followed(steps, value, lobe) { next } else { Self::PathAlone }
    }

    /// This chain and one step more, by the sample `s` of a vertex with the deltas `lobes`.
    #[inline]
    pub(super) fn then(self, lobes: &DeltaLobes, s: &BsdfSample) -> Self {
        match &lobes[usize::from(s.transmitted)] {
            Some(lobe) if s.delta => self.step(lobe, s.pdf.0),
            _ => Self::PathAlone,
        }
    }

    /// The factor on the emission of a light that the path hits next.
    #[inline]
    pub fn probability(self) -> f32 {
        match self {
            Self::Followed { probability, .. } => probability,
            Self::PathAlone => 1.0,
        }
    }
}
