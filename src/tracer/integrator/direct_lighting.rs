//! Direct lighting: next-event estimation, and the emission of lights that a path hits by chance.
//!
//! Both find the same paths. Their contributions are combined by multiple importance sampling with the power heuristic
//! (Veach and Guibas 1995). Path tracing and the camera paths of photon mapping carry a [`PathState`] and share everything
//! here. The bidirectional method has weights of its own over all strategies ([`super::bidirectional`]): it uses
//! [`sample_direct`] and [`EmissionCache`] with them.

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::stream::{FaultyValue, MAX_VALUE, faults};
use crate::tracer::accel::Ray;
use crate::tracer::bsdf::{BsdfSample, Scattering};
use crate::tracer::interaction::SurfaceInteraction;
use crate::tracer::light::{LightSample, LightSampleContext, Lights};
use crate::tracer::light_groups::LightCredits;
use crate::tracer::medium::{EdgeWavelengths, FlightPiece, FreeFlight, MediumIndex, PathMedia};
use crate::tracer::record::PathEvent;
use crate::tracer::roulette::{self, Policy};
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::specular_chain::SpecularChain;
use crate::tracer::vertex::SurfaceVertex;
use crate::tracer::walk::{Walk, is_rough_dispersion};
use crate::tracer::{Scene, mis};

use super::RenderContext;
use super::delta_chains::LightBehindDeltas;
use super::lit_flight::LitFlight;

/// Next-event estimation: samples a light from `vertex` and returns it with the sample and what that contributes, or `None` for nothing.
///
/// `unoccluded` returns the contribution of a light sample including its MIS weight, as if nothing stood in between. The
/// shadow ray is the costly part, so it is traced only for a sample that contributes. `wavelengths` are those of the path to the vertex.
#[inline(always)]
pub(super) fn sample_direct<B: Scattering>(
    scene: &Scene,
    vertex: &SurfaceVertex<B>,
    u: &VertexNumbers,
    wavelengths: EdgeWavelengths<'_>,
    unoccluded: impl FnMut(u32, &LightSample) -> Option<SampledSpectrum>,
) -> Option<(u32, LightSample, SampledSpectrum)> {
    let context = vertex.light_context();
    let (light, sample, value) =
        scene.lights().sample_by_contribution(context, u.light_choice, u.light, unoccluded)?;
    let factor = vertex.light_factor(scene, light, &sample, wavelengths);
    let (from, visible) = (vertex.hit.point.p, factor.max_element());
    B::record(|| PathEvent::Light { from, light, sample, value, visible });
    (!factor.is_black()).then(|| (light, sample, value * factor))
}

/// The light that a path asked for last, since most paths ask for one light again and again: its emission, or the factor of it that is the
/// same everywhere, and whether there is another.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct EmissionCache(Option<(u32, SampledSpectrum, bool)>);

impl EmissionCache {
    /// The spectrum of `light` seen at its point `p` along `wi`. The cache must be cleared when `lambda` changes.
    #[inline(always)]
    pub(super) fn emission(
        &mut self,
        lights: &Lights,
        light: u32,
        p: Vec3,
        wi: Vec3,
        lambda: &SampledWavelengths,
    ) -> SampledSpectrum {
        let (constant, varies) = match self.0 {
            Some((known, constant, varies)) if known == light => (constant, varies),
            _ => {
                let (constant, varies) = (lights.constant_factor(light, lambda), lights.varies(light));
                self.0 = Some((light, constant, varies));
                (constant, varies)
            }
        };
        if varies { constant * lights.varying_factor(light, p, wi, lambda) } else { constant }
    }
}

/// Whether a camera path splits into branches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Splitting {
    /// The path splits at its first vertex that is no delta.
    Pending,
    /// The path is a branch of one that has split.
    Branch,
    /// The path stays whole.
    Never,
}

/// The emission on its way that a camera path takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TakenEmission {
    /// That of lights and of media.
    All,
    /// That of media, which no photon carries.
    OfMedia,
    /// None: others find it.
    Nothing,
}

/// Adds to the radiance of a camera path, and to its parts by groups of lights, what the medium of a piece of its flight emits along that: no
/// other strategy finds it.
#[inline]
pub(super) fn add_emitted_by_medium<B: Scattering, C: LightCredits>(
    radiance: &mut SampledSpectrum,
    credits: &mut C,
    lights: &Lights,
    piece: &FlightPiece,
) {
    let emitted = piece.emitted;
    if emitted.is_black() {
        return;
    }
    match emitted.is_within(MAX_VALUE) {
        true => {
            *radiance += emitted;
            credits.add_of_medium(lights, piece.medium, emitted);
        }
        false => faults::raise(FaultyValue::Emission, emitted.into(), None, None),
    }
    B::record(|| PathEvent::Radiance(*radiance));
}

/// A camera path or one of its branches: its walk, what its MIS weights need, and the radiance found so far.
#[derive(Clone)]
pub(super) struct PathState<C> {
    /// Throughput, wavelengths and depth.
    pub(super) walk: Walk<false>,
    /// Radiance found so far, at the wavelengths of the path.
    pub(super) radiance: SampledSpectrum,
    /// The radiance by groups of lights.
    pub(super) credits: C,
    /// The weight that follows from the wavelength MIS of the walk.
    pub(super) wavelength_weight: f32,
    /// Where and with which density the last direction was sampled; `None` after a delta and at the camera.
    last: Option<(LightSampleContext, PdfW)>,
    /// The chain of deltas so far, which decides the weight of a light that is hit next.
    pub(super) chain: SpecularChain,
    emission: EmissionCache,
    splitting: Splitting,
    /// Binary logarithm of the factor on the number of branches.
    more_branches: u32,
}

impl<C: LightCredits> PathState<C> {
    /// A path that starts at these wavelengths in `medium`.
    pub(super) fn new(lambda: SampledWavelengths, splitting: Splitting, medium: MediumIndex) -> Self {
        Self {
            walk: Walk::new(lambda, SampledSpectrum::ONE, 1.0, medium),
            radiance: SampledSpectrum::ZERO,
            credits: C::default(),
            wavelength_weight: 1.0,
            last: None,
            chain: SpecularChain::CAMERA,
            emission: EmissionCache::default(),
            splitting,
            more_branches: 0,
        }
    }

    /// True for a path that has yet to split.
    #[inline]
    pub(super) fn splits(&self) -> bool {
        self.splitting == Splitting::Pending
    }

    /// Doubles the number of branches into which the path will split.
    pub(super) fn double_branches(&mut self) {
        self.more_branches += 1;
    }

    /// Binary logarithm of the factor on the number of branches.
    #[inline]
    pub(super) fn more_branches(&self) -> u32 {
        self.more_branches
    }

    /// One of `count` equal branches, which has found nothing yet.
    #[inline]
    pub(super) fn branch(&self, count: u32) -> Self {
        Self {
            walk: self.walk.branch(count),
            radiance: SampledSpectrum::ZERO,
            credits: C::default(),
            splitting: Splitting::Branch,
            ..*self
        }
    }

    /// The same path as another `walk`, of a single wavelength or to another vertex, which has found nothing yet.
    pub(super) fn alone(&self, walk: Walk<false>) -> Self {
        Self {
            walk,
            radiance: SampledSpectrum::ZERO,
            credits: C::default(),
            emission: EmissionCache::default(),
            ..*self
        }
    }

    /// Adds what a branch of this path has found.
    #[inline]
    pub(super) fn join(&mut self, branch: &Self) {
        self.radiance += branch.radiance;
        self.credits.add_all(&branch.credits, SampledSpectrum::ONE);
    }

    /// Terminates the secondary wavelengths. The caller has taken the radiance found so far, which is valid for all four.
    #[cold]
    pub(super) fn drop_companions(&mut self) {
        self.radiance = SampledSpectrum::ZERO;
        self.credits.settle(&self.walk.lambda);
        self.walk.terminate_secondary();
        self.emission = EmissionCache::default();
        self.wavelength_weight = self.walk.wavelength_weight();
    }

    /// Traces `ray` to the next surface that it does not pass, or point in a medium, and returns that if the path goes on from there; `ray` then
    /// begins behind what it has passed. Emission that is found on the way is added if the path `takes` it.
    /// `record` receives each piece of the flight, and the walk at its end.
    #[inline(always)]
    pub(super) fn arrive<B: Scattering>(
        &mut self,
        context: &RenderContext,
        ray: &mut Ray,
        mut flight: FreeFlight,
        takes: TakenEmission,
        mut record: impl FnMut(&Walk<false>, FlightPiece),
    ) -> Option<SurfaceInteraction> {
        let (scene, longest, wi) = (&context.scene, context.longest(), ray.direction);
        let lights = scene.lights();
        if self.walk.depth >= longest {
            return None;
        }
        loop {
            let next = context.next_vertex::<B>(&mut self.walk, ray, &mut flight, |walk, piece| {
                if takes != TakenEmission::Nothing {
                    add_emitted_by_medium::<B, _>(&mut self.radiance, &mut self.credits, lights, &piece);
                }
                record(walk, piece);
            });
            if B::Media::PRESENT {
                self.wavelength_weight = self.walk.wavelength_weight();
            }
            let Some(hit) = next else {
                if takes == TakenEmission::All
                    && let Some(light) = context.environment(self.walk.depth)
                {
                    let pdf = |from| lights.pdf(light, from, wi, None);
                    self.add_emitted::<B>(lights, light, Vec3::ZERO, wi, 1.0, pdf);
                }
                return None;
            };
            if takes == TakenEmission::All
                && let Some(light) = hit.emitter()
            {
                // A copy, so that the compiler keeps the hit in registers.
                let point = hit.point;
                let pdf = |from| lights.pdf(light, from, wi, Some(&point));
                self.add_emitted::<B>(lights, light, point.p, wi, self.chain.probability(), pdf);
            }
            if scene.passes(ray, &hit) {
                self.walk.pass::<B>(scene, &hit, wi);
                continue;
            }
            self.walk.depth += 1;
            return (self.walk.depth < longest).then_some(hit);
        }
    }

    /// Adds the emission of a light that the path hit by chance at `p` along `wi`, times `factor`. `light_pdf` is the density with which
    /// next-event estimation would have sampled that direction.
    #[inline]
    fn add_emitted<B: Scattering>(
        &mut self,
        lights: &Lights,
        light: u32,
        p: Vec3,
        wi: Vec3,
        factor: f32,
        light_pdf: impl FnOnce(LightSampleContext) -> PdfW,
    ) {
        let weight = self.last.map_or(1.0, |(from, bsdf_pdf)| mis::power(bsdf_pdf, light_pdf(from)));
        let emission = self.emission.emission(lights, light, p, wi, &self.walk.lambda);
        let value = self.walk.throughput * emission * (weight * factor * self.wavelength_weight);
        match value.is_within(MAX_VALUE) {
            true => {
                self.radiance += value;
                self.credits.add(lights, light, value);
            }
            false => faults::raise(FaultyValue::Emission, value.into(), None, Some(light)),
        }
        B::record(|| PathEvent::Radiance(self.radiance));
    }

    /// Adds the lights that are seen from `vertex` along chains of deltas, except in the direction of `s`, in which the path continues.
    #[inline(always)]
    pub(super) fn add_light_behind_deltas<B: Scattering>(
        &mut self,
        context: &RenderContext,
        vertex: &SurfaceVertex<B>,
        s: &BsdfSample,
    ) {
        let found =
            context.light_behind_deltas(&mut self.chain, vertex, s, &self.walk.lambda, self.walk.depth);
        let Some(found) = found else { return };
        let LightBehindDeltas { radiance, credits } = found;
        let value = self.walk.throughput * radiance;
        match value.is_within(MAX_VALUE) {
            true => {
                self.radiance += value;
                self.credits.add_all(&credits, self.walk.throughput);
            }
            false => faults::raise(FaultyValue::Emission, value.into(), vertex.hit.known_surface(), None),
        }
        B::record(|| PathEvent::Radiance(self.radiance));
    }

    /// Adds direct light at `vertex` by next-event estimation. `flight` is the one that led there, where point lights are also sampled from
    /// along that.
    #[inline]
    pub(super) fn add_direct<B: Scattering>(
        &mut self,
        scene: &Scene,
        vertex: &SurfaceVertex<B>,
        u: &VertexNumbers,
        flight: Option<&LitFlight>,
    ) {
        let walk = self.walk;
        let direct = sample_direct(scene, vertex, u, (&walk).into(), |light, sample| {
            let flight = flight.filter(|_| B::Media::PRESENT && sample.delta);
            let weight = flight.map_or(1.0, |flight| flight.mis_weight(scene, light, sample));
            self.unoccluded_contribution(scene.lights(), vertex, light, sample, weight)
        });
        if let Some((light, _, direct)) = direct {
            self.radiance += direct;
            self.credits.add(scene.lights(), light, direct);
        }
    }

    /// Unoccluded contribution of a light sample with its MIS weight; `None` for zero. `delta_weight` is the weight of a light that no path
    /// can hit by chance.
    #[inline]
    pub(super) fn unoccluded_contribution<B: Scattering>(
        &mut self,
        lights: &Lights,
        vertex: &SurfaceVertex<B>,
        light: u32,
        sample: &LightSample,
        delta_weight: f32,
    ) -> Option<SampledSpectrum> {
        let wi = vertex.frame.to_local(sample.wi);
        let (f, pdf) = vertex.bsdf.eval(vertex.wo, wi)?;
        if !vertex.hit.sides_agree(sample.wi, vertex.wo.z * wi.z < 0.0) {
            return None;
        }
        let weight = if sample.delta { delta_weight } else { mis::power(sample.pdf, pdf) };
        let emission = self.emission_of(lights, light, sample);
        let wavelength_weight = match vertex.bsdf.is_dispersive() {
            true => self.walk.weight_of(
                self.walk.wavelength_mis.and(vertex.bsdf.dispersion(vertex.wo, wi).wavelength_mis),
            ),
            false => self.wavelength_weight,
        };
        let value =
            self.walk.throughput * f * emission * (wavelength_weight * sample.scale * weight / sample.pdf.0);
        if !value.is_within(MAX_VALUE) {
            faults::raise(FaultyValue::LightSample, value.into(), vertex.hit.known_surface(), Some(light));
            return None;
        }
        (!value.is_black()).then_some(value)
    }

    /// The emission of a light sample.
    #[inline(always)]
    pub(super) fn emission_of(
        &mut self,
        lights: &Lights,
        light: u32,
        sample: &LightSample,
    ) -> SampledSpectrum {
        let at = sample.target.unwrap_or(Vec3::ZERO);
        self.emission.emission(lights, light, at, sample.wi, &self.walk.lambda)
    }

    /// Scatters at `vertex` into the direction of `s`, and returns it in world space; `None` ends the path ([`Walk::scatter`]).
    #[inline]
    pub(super) fn scatter<B: Scattering>(
        &mut self,
        vertex: &SurfaceVertex<B>,
        s: &BsdfSample,
    ) -> Option<Vec3> {
        let wi = self.walk.scatter(vertex, s)?;
        self.last = (!s.delta).then(|| (vertex.light_context(), s.pdf));
        if is_rough_dispersion(vertex, s) {
            self.wavelength_weight = self.walk.wavelength_weight();
        }
        Some(wi)
    }

    /// Russian roulette: paths that carry little end at random once they have `rr_depth` segments. Returns the factor by
    /// which the throughput of a survivor has grown.
    #[inline]
    pub(super) fn roulette(&mut self, rr_depth: u32, u: f32) -> Option<f32> {
        let branch = self.splitting == Splitting::Branch;
        let Policy { latest, survival } = if branch { roulette::OF_BRANCHES } else { roulette::OF_PATHS };
        let carried = self.walk.throughput.max_element() * self.walk.relative;
        self.walk.survive(survival * carried, rr_depth.min(latest), u)
    }
}
