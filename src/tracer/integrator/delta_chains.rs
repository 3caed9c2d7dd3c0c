//! Lights at the end of the chains of deltas that a camera path does not sample ([`SpecularChain`]).

use glam::Vec3;

use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::bsdf::{BsdfSample, DeltaLobes, Scattering};
use crate::tracer::light_groups::LightCredits;
use crate::tracer::medium::{MediumIndex, PathMedia};
use crate::tracer::specular_chain::SpecularChain;
use crate::tracer::vertex::SurfaceVertex;

use super::RenderContext;

/// Radiance of the lights at the end of chains of deltas.
#[derive(Clone, Copy)]
pub(super) struct LightBehindDeltas<C> {
    pub(super) radiance: SampledSpectrum,
    /// The radiance by groups of lights.
    pub(super) credits: C,
}

/// A chain that is followed.
struct FollowedChain<'a> {
    lambda: &'a SampledWavelengths,
    chain: SpecularChain,
    /// Product of the values from where it left the path, times the probability of the path's choices before.
    value: SampledSpectrum,
    /// Segments of the path so far.
    segments: u32,
}

impl RenderContext {
    /// Radiance at `vertex`, `segments` segments from the camera, of lights along chains of deltas that do not begin with the sample `s`; to be
    /// multiplied by the throughput. `chain` leads to the vertex, and is extended by `s`. Dispersive deltas are not followed, so the wavelength
    /// MIS weight is 1.
    #[inline(always)]
    pub(super) fn light_behind_deltas<B: Scattering, C: LightCredits>(
        &self,
        chain: &mut SpecularChain,
        vertex: &SurfaceVertex<B>,
        s: &BsdfSample,
        lambda: &SampledWavelengths,
        segments: u32,
    ) -> Option<LightBehindDeltas<C>> {
        // Chains ignore media, so that scenes with media do not follow them.
        if B::Media::PRESENT && self.scene.media().is_some() {
            *chain = SpecularChain::PathAlone;
        }
        if *chain == SpecularChain::PathAlone {
            return None;
        }
        let mut lobes = vertex.bsdf.delta_lobes(vertex.wo);
        let value = SampledSpectrum::splat(chain.probability());
        let here = FollowedChain { lambda, chain: *chain, value, segments };
        *chain = chain.then(&lobes, s);
        if s.delta {
            lobes[usize::from(s.transmitted)] = None;
        }
        let mut sum = LightBehindDeltas { radiance: SampledSpectrum::ZERO, credits: C::default() };
        self.follow_all(vertex, &lobes, &here, &mut sum);
        (!sum.radiance.is_black()).then_some(sum)
    }

    /// Adds the radiance at `vertex` along chains that begin with these lobes.
    #[inline]
    fn follow_all<B: Scattering, C: LightCredits>(
        &self,
        vertex: &SurfaceVertex<B>,
        lobes: &DeltaLobes,
        to: &FollowedChain,
        sum: &mut LightBehindDeltas<C>,
    ) {
        for s in lobes.iter().flatten() {
            let chain = to.chain.step(s, 1.0);
            let wi = vertex.frame.to_world(s.wi);
            if chain != SpecularChain::PathAlone
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

    /// Adds the radiance at `vertex` from the direction `wi`.
    #[inline(never)]
    fn follow_one<B: Scattering, C: LightCredits>(
        &self,
        vertex: &SurfaceVertex<B>,
        wi: Vec3,
        followed: &FollowedChain,
        sum: &mut LightBehindDeltas<C>,
    ) {
        let scene = &self.scene;
        let mut ray = vertex.hit.spawn(wi);
        while let Some(hit) = self.closest(&mut ray, followed.segments) {
            if let Some(light) = hit.emitter() {
                let value = followed.value * scene.lights.spectrum(light, hit.point.p, wi, followed.lambda);
                sum.radiance += value;
                sum.credits.add(&scene.lights, light, value);
            }
            if !scene.passes(&mut ray, &hit) {
                if followed.segments == self.longest() {
                    return;
                }
                let vertex = SurfaceVertex::<B>::new(scene, hit, followed.lambda, MediumIndex::VACUUM);
                return self.follow_all(&vertex, &vertex.bsdf.delta_lobes(vertex.wo), followed, sum);
            }
        }
    }
}
