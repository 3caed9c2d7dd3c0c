//! Lamps that the camera sees over mirrors and glass alone.
//!
//! A path that meets glass chooses between reflection and refraction. A lamp in the rarer of both is bright, so that this choice makes the
//! brightest noise of all: a small lamp that a glass ball mirrors contributes to one path in twenty-five, times twenty-five. So a camera
//! path that has met deltas only, and chooses one of several, also looks for lamps along the others: it follows all chains of deltas that begin
//! there, as Whitted does (*An Improved Illumination Model for Shaded Display*, 1980). A lamp that it hits itself then counts as if its choices
//! had been the only ones, times the [probability](SpecularChain::probability) that they had. So each chain is counted once, whatever the path
//! chooses, and the expected value is the same.
//!
//! Of the chains only those to lamps are followed ([`ChainBounds`]); an environment, which hardly any chain misses, is left to the choice. So are
//! chains of many steps ([`LONGEST_CHAIN`]), those that carry little ([`LEAST_VALUE`]) and what dispersion parts: which these are is known from
//! the chain alone.

use std::sync::Arc;

use glam::Vec3;

use crate::spectrum::{SampledSpectrum, SampledWavelengths};

use super::bounding_sphere::BoundingSphere;
use super::bsdf::{BsdfSample, Scattering};
use super::integrator::RenderContext;
use super::interaction::SurfaceVertex;

/// Most steps of a chain that is followed.
const LONGEST_CHAIN: u32 = 6;

/// Least share of the light at its end that a chain shows to the camera.
const LEAST_VALUE: f32 = 0.05;

/// Most spheres of [`ChainBounds`]: more objects share some.
const MOST_SPHERES: usize = 16;

/// Spheres around all that a chain leads to: what emits, and what has deltas. Other rays of the tree need not be traced, and most are such.
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
    fn may_be_met(&self, p: Vec3, d: Vec3) -> bool {
        self.spheres.iter().any(|sphere| sphere.may_be_hit(p, d))
    }
}

/// A camera path so far, as far as it decides who finds a lamp that it hits next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpecularChain {
    /// Deltas alone: the path and all others that begin like it, together.
    Followed {
        /// Number of deltas.
        steps: u32,
        /// Product of their values.
        value: f32,
        /// Product of the probabilities with which they were chosen.
        probability: f32,
    },
    /// Anything else: the path alone.
    Left,
}

impl SpecularChain {
    /// No vertex but the camera.
    pub const CAMERA: Self = Self::Followed { steps: 0, value: 1.0, probability: 1.0 };

    /// This chain and one step more, by a delta that is chosen with this probability.
    #[inline]
    fn step(self, lobe: &BsdfSample, chosen: f32) -> Self {
        let Self::Followed { steps, value, probability } = self else { return self };
        let value = value * (lobe.weight.max_element() * lobe.eta2);
        // False for NaN.
        let is_followed = steps < LONGEST_CHAIN && value >= LEAST_VALUE && !lobe.hero_only;
        let next = Self::Followed { steps: steps + 1, value, probability: probability * chosen };
        if is_followed { next } else { Self::Left }
    }

    /// This chain and one step more, by the sample `s` of a vertex with the deltas `lobes`.
    #[inline]
    fn then(self, lobes: &DeltaLobes, s: &BsdfSample) -> Self {
        match &lobes[usize::from(s.transmitted)] {
            Some(lobe) if s.delta => self.step(lobe, s.pdf.0),
            _ => Self::Left,
        }
    }

    /// The factor on a lamp that the path hits next.
    #[inline]
    pub fn probability(self) -> f32 {
        match self {
            Self::Followed { probability, .. } => probability,
            Self::Left => 1.0,
        }
    }
}

/// Result of [`ScatteringModel::delta_lobes`](super::bsdf::ScatteringModel::delta_lobes).
type DeltaLobes = [Option<BsdfSample>; 2];

/// A chain that is followed.
struct FollowedChain<'a> {
    lambda: &'a SampledWavelengths,
    chain: SpecularChain,
    /// Product of the values from where it left the path.
    value: SampledSpectrum,
    /// Segments of the path so far.
    segments: u32,
}

impl RenderContext {
    /// The light of lamps that arrives at `vertex`, to which `segments` lead, over chains of deltas that begin otherwise than by the sample
    /// `s`; `chain` goes on by that. The light is to be multiplied by the throughput at the vertex and by the probability of the chain so far.
    #[inline(always)]
    pub(in crate::tracer) fn lamps_beside<B: Scattering>(
        &self,
        chain: &mut SpecularChain,
        vertex: &SurfaceVertex<B>,
        s: &BsdfSample,
        lambda: &SampledWavelengths,
        segments: u32,
    ) -> Option<SampledSpectrum> {
        if *chain == SpecularChain::Left {
            return None;
        }
        let mut lobes = vertex.bsdf.delta_lobes(vertex.wo);
        let here = FollowedChain { lambda, chain: *chain, value: SampledSpectrum::ONE, segments };
        *chain = chain.then(&lobes, s);
        if s.delta {
            lobes[usize::from(s.transmitted)] = None;
        }
        let mut sum = SampledSpectrum::ZERO;
        self.follow_all(vertex, &lobes, &here, &mut sum);
        (!sum.is_black()).then_some(sum)
    }

    /// Adds what arrives at `vertex` over chains of these lobes.
    #[inline]
    fn follow_all<B: Scattering>(
        &self,
        vertex: &SurfaceVertex<B>,
        lobes: &DeltaLobes,
        to: &FollowedChain,
        sum: &mut SampledSpectrum,
    ) {
        for s in lobes.iter().flatten() {
            let chain = to.chain.step(s, 1.0);
            let wi = vertex.frame.to_world(s.wi);
            if chain != SpecularChain::Left
                && to.segments < self.longest()
                && self.scene.chains.may_be_met(vertex.hit.point.p, wi)
                && vertex.hit.sides_agree(wi, s.transmitted)
            {
                let next =
                    FollowedChain { chain, value: to.value * s.weight, segments: to.segments + 1, ..*to };
                self.follow_one(vertex, wi, &next, sum);
            }
        }
    }

    /// Adds what arrives at `vertex` from the direction `wi`.
    #[inline(never)]
    fn follow_one<B: Scattering>(
        &self,
        vertex: &SurfaceVertex<B>,
        wi: Vec3,
        followed: &FollowedChain,
        sum: &mut SampledSpectrum,
    ) {
        let scene = &self.scene;
        let mut ray = vertex.hit.spawn(wi);
        while let Some(hit) = self.closest(&mut ray, followed.segments) {
            if let Some(light) = hit.emitter() {
                *sum += followed.value * scene.lights.spectrum(light, hit.point.p, wi, followed.lambda);
            }
            if !scene.passes(&mut ray, &hit) {
                let vertex = SurfaceVertex::<B>::new(scene, hit, followed.lambda);
                return self.follow_all(&vertex, &vertex.bsdf.delta_lobes(vertex.wo), followed, sum);
            }
        }
    }
}
