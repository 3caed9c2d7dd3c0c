//! The random walk: how a path scatters at a vertex and continues, for every integrator.
//!
//! A step is [`Walk::sample`], [`Walk::scatter`] and `Walk::survive`, in this order. Camera paths with next-event estimation
//! (`PathState` in `integrator/direct_lighting.rs`) and [subpaths](super::subpath) hold a walk, and keep beside it what their MIS weights need.
//! No other file knows what a vertex is or how a dispersive interface affects the wavelengths.
//!
//! Walks from the camera and from lights differ in what a scattering does to the throughput:
//!
//! - from the camera it is multiplied by the weight of the BSDF sample, which includes the radiance scaling of refraction;
//! - from a light that scaling is undone, and where the shading normal differs from the geometric one the weight is multiplied by
//!   |cos θₛ(l) cos θ(e)| / |cos θ(l) cos θₛ(e)|, l towards the light and e towards the eye, s for shading
//!   (Veach 1997, §5.2 and §5.3).

use glam::{Vec3, Vec4};

use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::stream::{FaultyValue, faults};

use super::Scene;
use super::bsdf::{BsdfSample, Scattering};
use super::interaction::SurfaceInteraction;
use super::medium::{EdgeWavelengths, MediumIndex, PathMedia};
use super::record::CarriedLight;
use super::roulette;
use super::sampler::VertexNumbers;
use super::vertex::SurfaceVertex;
use super::wavelength_mis::WavelengthMis;

/// The state of a random walk between two vertices.
#[derive(Clone, Copy, Debug)]
pub struct Walk<const FROM_LIGHT: bool> {
    /// The wavelengths at which materials and lights are evaluated: those of the path, or one of them alone.
    pub lambda: SampledWavelengths,
    /// Product of the weights of all scatterings so far; from a light also the emitted spectrum over the density of its emission.
    pub throughput: SampledSpectrum,
    /// Relative densities with which each wavelength as the hero would have sampled the same directions.
    pub wavelength_mis: WavelengthMis,
    /// Factor that converts the throughput to the value that Russian roulette compares with 1. It undoes the radiance scaling of refraction and
    /// the share of a branch.
    pub(super) relative: f32,
    /// Number of segments up to the last vertex.
    pub depth: u32,
    /// The medium that the walk is in.
    pub medium: MediumIndex,
}

impl<const FROM_LIGHT: bool> Walk<FROM_LIGHT> {
    /// A walk before its first segment, which begins in `medium`.
    #[inline]
    pub(super) fn new(
        lambda: SampledWavelengths,
        throughput: SampledSpectrum,
        relative: f32,
        medium: MediumIndex,
    ) -> Self {
        Self { lambda, throughput, wavelength_mis: WavelengthMis::ALL, relative, depth: 0, medium }
    }

    /// One of `count` equal branches of this walk.
    #[inline]
    pub(super) fn branch(&self, count: u32) -> Self {
        let share = 1.0 / count as f32;
        Self { throughput: self.throughput * share, relative: self.relative * count as f32, ..*self }
    }

    /// Goes straight on in the direction `d` behind the surface at `hit`, which the walk has passed, and all else in its place.
    #[inline(always)]
    pub(super) fn pass<B: Scattering>(&mut self, scene: &Scene, hit: &SurfaceInteraction, d: Vec3) {
        if B::Media::PRESENT
            && let Some(media) = scene.media()
        {
            self.medium = scene.medium_behind(media, hit, d, self.medium);
        }
    }

    /// Samples the material at `vertex`; `None` ends the walk.
    #[inline(always)]
    pub fn sample<B: Scattering>(vertex: &SurfaceVertex<B>, u: &VertexNumbers) -> Option<BsdfSample> {
        let SurfaceVertex { bsdf, wo, .. } = vertex;
        match FROM_LIGHT {
            true => bsdf.sample_from_light(*wo, u.bsdf, u.lobe),
            false => bsdf.sample(*wo, u.bsdf, u.lobe),
        }
    }

    /// Scatters at `vertex` into the direction of `s`, and returns it in world space. `None` ends the walk: geometric and shading normal
    /// disagree about the side, or the throughput is not finite, which is a fault.
    #[inline(always)]
    pub fn scatter<B: Scattering>(&mut self, vertex: &SurfaceVertex<B>, s: &BsdfSample) -> Option<Vec3> {
        let SurfaceVertex { hit, frame, bsdf, wo, .. } = vertex;
        let wi = frame.to_world(s.wi);
        if !hit.sides_agree(wi, s.transmitted) {
            return None;
        }
        self.throughput *= s.weight;
        if is_rough_dispersion(vertex, s) {
            let dispersion = bsdf.dispersion(*wo, s.wi);
            self.wavelength_mis = self.wavelength_mis.and(dispersion.wavelength_mis);
            if FROM_LIGHT {
                self.throughput *= SampledSpectrum(dispersion.eta2);
            }
        }
        if FROM_LIGHT {
            self.throughput *= s.eta2;
            if hit.smooth {
                let cos = wi.dot(hit.point.ng).abs();
                let shading = (wo.z * cos) / (hit.wo.dot(hit.point.ng) * s.wi.z);
                self.throughput *= shading.abs();
            }
        } else {
            self.relative *= s.eta2;
        }
        if !self.throughput.is_finite() {
            faults::raise(FaultyValue::Scattering, self.throughput.into(), hit.known_surface(), None);
            return None;
        }
        self.medium = vertex.medium_towards(wi);
        Some(wi)
    }

    /// Russian roulette with this probability of survival, once the walk has `first` segments; `None` ends the walk. Returns the factor by which the
    /// throughput has grown.
    ///
    /// Callers multiply the probability themselves: camera paths and subpaths take its factors in different orders, which round differently.
    #[inline(always)]
    pub(super) fn survive(&mut self, probability: f32, first: u32, u: f32) -> Option<f32> {
        let factor = roulette::survival_factor(probability, self.depth >= first, u)?;
        self.throughput *= factor;
        Some(factor)
    }

    /// The wavelengths that would have chosen the way here, none but the hero where that is all that is carried.
    #[inline]
    pub(super) fn carried_wavelengths(&self) -> WavelengthMis {
        match self.lambda.is_hero_only() {
            true => self.wavelength_mis.and(WavelengthMis::ALONE),
            false => self.wavelength_mis,
        }
    }

    /// The weight of the path by the wavelengths that would have chosen it. The factor 4 of a lone hero is already in the densities of its
    /// wavelengths, so it is removed here.
    #[inline]
    pub(super) fn wavelength_weight(&self) -> f32 {
        self.weight_of(self.wavelength_mis)
    }

    /// As [`wavelength_weight`](Self::wavelength_weight), with this wavelength MIS in the place of its own.
    #[inline]
    pub(super) fn weight_of(&self, wavelength_mis: WavelengthMis) -> f32 {
        match self.lambda.is_hero_only() {
            true => 0.25 * wavelength_mis.and(WavelengthMis::ALONE).weight(),
            false => wavelength_mis.weight(),
        }
    }

    /// Sets the throughput of the secondary wavelengths to zero at a dispersive delta, and keeps evaluating materials at all four: the two
    /// subpaths of a connection must agree on the probabilities of lobes.
    #[inline]
    pub(super) fn keep_hero(&mut self) {
        self.throughput = SampledSpectrum(self.throughput.0 * Vec4::X);
        self.wavelength_mis = self.wavelength_mis.and(WavelengthMis::ALONE);
    }

    /// Terminates the secondary wavelengths: from here on materials and lights are evaluated at the hero alone.
    #[inline]
    pub(super) fn terminate_secondary(&mut self) {
        self.lambda.terminate_companions();
        self.throughput = SampledSpectrum(self.throughput.0 * Vec4::X);
    }

    /// The walks of the four wavelengths, each alone, that follow the dispersive delta of this weight at `vertex`, and the sample with which each
    /// [scatters](Self::scatter) into its own direction. Wavelengths that are totally reflected are left out.
    pub(super) fn split_wavelengths<'a, B: Scattering>(
        &'a self,
        vertex: &'a SurfaceVertex<B>,
        weight: SampledSpectrum,
    ) -> impl Iterator<Item = (Self, BsdfSample)> + 'a {
        (0..4).filter_map(move |lane| {
            let (wi, eta2) = vertex.bsdf.refract(vertex.wo, lane)?;
            let throughput = SampledSpectrum(self.throughput.0 * Vec4::AXES[lane]);
            let walk = Self { lambda: self.lambda.alone(lane), throughput, ..*self };
            // The probability of the lobe is in its weight.
            let s = BsdfSample::delta(wi, weight, 1.0);
            Some((walk, BsdfSample { transmitted: true, hero_only: true, eta2, ..s }))
        })
    }
}

impl<const FROM_LIGHT: bool> From<&Walk<FROM_LIGHT>> for CarriedLight {
    fn from(walk: &Walk<FROM_LIGHT>) -> Self {
        let Walk { lambda, throughput, wavelength_mis, depth, medium, .. } = *walk;
        Self { lambda, throughput, wavelength_mis, from_light: FROM_LIGHT, depth, medium }
    }
}

impl<'a, const FROM_LIGHT: bool> From<&'a Walk<FROM_LIGHT>> for EdgeWavelengths<'a> {
    fn from(walk: &'a Walk<FROM_LIGHT>) -> Self {
        Self { lambda: &walk.lambda, mis: walk.carried_wavelengths() }
    }
}

/// True where `s` is a refraction by a rough dispersive interface, into a direction that all wavelengths can take with different densities
/// ([`ScatteringModel::dispersion`](super::bsdf::ScatteringModel::dispersion)).
#[inline(always)]
pub(super) fn is_rough_dispersion<B: Scattering>(vertex: &SurfaceVertex<B>, s: &BsdfSample) -> bool {
    s.transmitted && !s.delta && vertex.bsdf.is_dispersive()
}
