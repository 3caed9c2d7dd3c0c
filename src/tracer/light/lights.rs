//! All lights of a scene: choosing one, asking for the density of a direction, and emission: the first ray of a light subpath, and
//! the densities of a given one.
//!
//! From a surface a point is sampled, then a direction by the cosine. From the environment it is the other way round: first
//! the direction, which takes the place of the point, then where the ray passes, on a disk that is perpendicular to it and as
//! large as the scene (Veach 1997, §8.2.2.4; Pharr, Jakob, Humphreys, *Physically Based Rendering*, 4th ed., §16.1.2).

use std::sync::Arc;

use glam::Vec3;

use crate::math::distribution::Distribution;
use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};
use crate::tracer::accel::{AvailableKernel, PrimRange};
use crate::tracer::bounding_sphere::BoundingSphere;
use crate::tracer::light_groups::LightGroups;
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::SurfacePoint;

use super::casters::{AIMED, CausticCasters};
use super::emission::{Emission, EmissionOrigin, EmissionPdf};
use super::points::PointLights;
use super::sample::{LightSample, LightSampleContext};
use super::selector::LightSelector;
use super::shapes::{Light, with_light};
use super::source::LightSource;

/// All lights of a scene and how one is chosen: from a lit point by its importance there, for a light subpath by
/// its power.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// Their geometry; shared between scenes that differ in their spectra.
    lights: Arc<[Light]>,
    spectra: Vec<Spectrum>,
    /// The choice by power, for emission; `None` when there is nothing to choose.
    by_power: Option<Distribution>,
    /// The choice from a lit point.
    selector: LightSelector,
    /// The environment, if there is one.
    environment: Option<u32>,
    /// Those that are points, if there are such.
    points: Option<PointLights>,
    /// The sphere around the scene.
    scene: BoundingSphere,
    /// The caustic casters at which light subpaths are aimed.
    casters: CausticCasters,
    /// The groups of the lights, if paths tell of them.
    groups: Option<LightGroups>,
}

impl Lights {
    /// All lights, their spectra, and the sphere around the scene (for an environment).
    pub fn new(lights: Arc<[Light]>, spectra: Vec<Spectrum>, scene: BoundingSphere) -> Self {
        // Colours that the eye hardly sees must still be sampled.
        let brightness = |s: &Spectrum| s.luminance().max(1e-3 * s.max());
        let brightness: Vec<f32> = spectra.iter().map(brightness).collect();
        let power = |l: &Light| with_light!(&l.shape, s => s.power(scene)) * brightness[l.spectrum as usize];
        let weights: Vec<f32> = lights.iter().map(power).collect();
        // Powers that cannot be compared (overflow, underflow) leave every light the same chance.
        let equal = vec![1.0; lights.len()];
        let (by_power, weights) = match Distribution::new(&weights) {
            Some(by_power) => (Some(by_power), &weights),
            None => (Distribution::new(&equal), &equal),
        };
        let sought = |l: &Light| with_light!(&l.shape, s => s.sought_share());
        let found = |(light, weight): (&Light, &f32)| *weight * sought(light);
        let found: Vec<f32> = lights.iter().zip(weights).map(found).collect();
        let selector = LightSelector::new(&lights, &found, scene);
        let environment = lights.iter().position(Light::is_environment).map(|i| i as u32);
        let points = PointLights::of(&lights, &found);
        let casters = CausticCasters::default();
        Self { by_power, selector, lights, spectra, environment, points, scene, casters, groups: None }
    }

    /// The same lights, whose [aimed](Lights::emit_aimed) rays go to these casters.
    pub fn aiming_at(self, casters: CausticCasters) -> Self {
        Self { casters, ..self }
    }

    /// Computes with the instructions of `kernel` from now on, where there is a choice; the same bits by each.
    pub(in crate::tracer) fn set_kernel(&mut self, kernel: AvailableKernel) {
        self.selector.set_kernel(kernel);
    }

    /// The same lights in `count` groups: `of_sources` has that of each [source](Lights::source), and then that of each medium.
    pub(in crate::tracer) fn grouped(self, of_sources: &[u8], count: usize) -> Self {
        let group = |light: &Light| of_sources.get(light.spectrum as usize).copied().unwrap_or_default();
        let of_media = of_sources.get(self.spectra.len()..).unwrap_or_default();
        let groups = LightGroups::new(self.lights.iter().map(group).collect(), of_media.into(), count);
        Self { groups: Some(groups), ..self }
    }

    /// The groups of lights, if paths tell of them.
    #[inline]
    pub fn groups(&self) -> Option<&LightGroups> {
        self.groups.as_ref()
    }

    /// The group of a light, if paths tell of it.
    #[inline]
    pub fn group(&self, light: u32) -> Option<u8> {
        self.groups.as_ref()?.of(light)
    }

    /// The share that each [source](Lights::source) has of the power of all lights, as light subpaths choose them.
    pub fn power_shares(&self) -> Vec<f32> {
        let mut shares = vec![0.0; self.spectra.len()];
        for (i, light) in self.lights.iter().enumerate() {
            let share = self.by_power.as_ref().map_or(0.0, |by_power| by_power.probability(i));
            if let Some(sum) = shares.get_mut(light.spectrum as usize) {
                *sum += share;
            }
        }
        shares
    }

    /// The environment's index, if there is one.
    #[inline]
    pub fn environment(&self) -> Option<u32> {
        self.environment
    }

    /// The lights that are points, if there are such.
    #[inline]
    pub fn points(&self) -> Option<&PointLights> {
        self.points.as_ref()
    }

    /// How many lights there are.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// True where next-event estimation has nothing to choose but the point of one surface (a mesh has one for each triangle), or nothing at all.
    #[inline]
    pub fn is_single_surface(&self) -> bool {
        self.selector.only().is_some_and(|only| only.is_none() || only != self.environment)
    }

    /// The source of a light: emitting shapes are numbered first, in their order, and then all other lights.
    pub fn source(&self, light: u32) -> u32 {
        self.lights.get(light as usize).map_or(light, |light| light.spectrum)
    }

    /// The same lights with other spectra, of which there must be as many.
    pub fn relit(&self, spectra: Vec<Spectrum>) -> Self {
        Self::new(self.lights.clone(), spectra, self.scene).aiming_at(self.casters.clone())
    }

    /// True when nothing emits.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// Chooses a light by `choice` and a direction towards it by `u`; returns the light's index with it.
    #[inline(always)]
    pub fn sample(&self, at: LightSampleContext, choice: f64, u: [f32; 2]) -> Option<(u32, LightSample)> {
        let (light, probability) = self.selector.sample(at, choice)?;
        let mut sample = with_light!(&self.lights[light as usize].shape, l => l.sample(at, u))?;
        if self.each(at).is_some() {
            sample.scale /= probability;
        } else {
            sample.pdf.0 *= probability;
        }
        Some((light, sample))
    }

    /// The only direction from a lit point to a light that is a point, with the density of [`Lights::sample_by_contribution`]; `None` where the
    /// light does not shine there, or is never chosen.
    #[inline]
    pub fn sample_of(&self, light: u32, at: LightSampleContext) -> Option<LightSample> {
        let mut sample = with_light!(&self.lights[light as usize].shape, l => l.sample(at, [0.0; 2]))?;
        sample.pdf.0 *= self.probability(light, at);
        (sample.pdf.0 > 0.0).then_some(sample)
    }

    /// As [`Lights::sample`], where `contribution` is what a sample contributes if nothing occludes it, MIS weight and all, or
    /// `None` for nothing. Where each light is sampled ([`LightSampleContext::glossy`]) one of the samples is taken in
    /// proportion to that, so that a single shadow ray serves all, and its value stands for theirs (Talbot, Cline, Egbert,
    /// *Importance Resampling for Global Illumination*, EGSR 2005, with one sample of every light).
    #[inline(always)]
    pub fn sample_by_contribution(
        &self,
        at: LightSampleContext,
        choice: f64,
        u: [f32; 2],
        mut contribution: impl FnMut(u32, &LightSample) -> Option<SampledSpectrum>,
    ) -> Option<(u32, LightSample, SampledSpectrum)> {
        let Some(each) = self.each(at) else {
            let (light, sample) = self.sample(at, choice, u)?;
            return contribution(light, &sample).map(|value| (light, sample, value));
        };
        let (mut total, mut chosen, mut left) = (0.0, None, choice);
        for &light in each {
            let sample = with_light!(&self.lights[light as usize].shape, l => l.sample(at, u));
            let Some(sample) = sample else { continue };
            let Some(value) = contribution(light, &sample) else { continue };
            let share = value.0.element_sum();
            if !(share > 0.0 && share.is_finite()) {
                continue;
            }
            total += share;
            // One number for all: stretched again after each decision.
            let p = f64::from(share / total);
            if left < p {
                (chosen, left) = (Some((light, sample, value, share)), left / p);
            } else {
                left = (left - p) / (1.0 - p);
            }
        }
        chosen.map(|(light, sample, value, share)| (light, sample, value * (total / share)))
    }

    /// The density of `wi` towards `light`, which it hits at `hit` (nowhere, for the environment).
    #[inline]
    pub fn pdf(&self, light: u32, at: LightSampleContext, wi: Vec3, hit: Option<&SurfacePoint>) -> PdfW {
        let pdf = with_light!(&self.lights[light as usize].shape, l => l.pdf(at, wi, hit));
        PdfW(pdf.0 * self.probability(light, at))
    }

    /// The probability that `light` is sampled from `at`.
    #[inline]
    pub fn probability(&self, light: u32, at: LightSampleContext) -> f32 {
        match self.each(at) {
            // All but what next-event estimation never looks for.
            Some(each) => f32::from(u8::from(each.contains(&light))),
            None => self.selector.probability(light, at),
        }
    }

    /// The lights, if each of them is sampled from `at`.
    #[inline(always)]
    fn each(&self, at: LightSampleContext) -> Option<&[u32]> {
        if at.glossy { self.selector.each() } else { None }
    }

    /// The light's spectrum at the wavelengths of a path, as seen at its point `p` (not used for an environment) along the unit
    /// direction `wi` (towards the light): radiance, intensity for a point, irradiance for a single direction. Only that of a light
    /// that [varies](Lights::varies) depends on `p` and `wi`.
    #[inline]
    pub fn spectrum(&self, light: u32, p: Vec3, wi: Vec3, lambda: &SampledWavelengths) -> SampledSpectrum {
        let spectrum = self.constant_factor(light, lambda);
        with_light!(&self.lights[light as usize].shape, l => {
            if l.varies() { spectrum * l.factor(p, wi, lambda) } else { spectrum }
        })
    }

    /// The factor of [`spectrum`](Self::spectrum) that is the same at every place and in every direction.
    #[inline]
    pub fn constant_factor(&self, light: u32, lambda: &SampledWavelengths) -> SampledSpectrum {
        self.spectra[self.lights[light as usize].spectrum as usize].sample(lambda)
    }

    /// The other factor, of a light that [varies](Self::varies).
    #[inline]
    pub fn varying_factor(
        &self,
        light: u32,
        p: Vec3,
        wi: Vec3,
        lambda: &SampledWavelengths,
    ) -> SampledSpectrum {
        with_light!(&self.lights[light as usize].shape, l => l.factor(p, wi, lambda))
    }

    /// The light's spectrum as the ray of `emission` carries it.
    #[inline]
    pub fn emitted(&self, emission: &Emission, lambda: &SampledWavelengths) -> SampledSpectrum {
        let spectrum = self.constant_factor(emission.light, lambda);
        let (p, direction) = (emission.from.p, emission.direction);
        with_light!(&self.lights[emission.light as usize].shape, l => {
            if l.varies() { spectrum * l.emitted(p, direction, lambda) } else { spectrum }
        })
    }

    /// True when [`Lights::spectrum`] of this light depends on the place or the direction.
    #[inline]
    pub fn varies(&self, light: u32) -> bool {
        with_light!(&self.lights[light as usize].shape, l => l.varies())
    }

    /// True when some light is found by light subpaths only.
    pub fn has_beams(&self) -> bool {
        self.lights.iter().any(|light| with_light!(&light.shape, l => l.is_beam()))
    }

    /// The primitives that never shadow `light`.
    #[inline]
    pub fn prims(&self, light: u32) -> PrimRange {
        self.lights[light as usize].prims
    }
}

impl Lights {
    /// Chooses a light by power, and a ray that leaves it.
    #[inline]
    pub fn emit(&self, u: &LightNumbers) -> Option<Emission> {
        let chosen = self.by_power.as_ref()?.sample(u.choice);
        let shape = &self.lights[chosen.index].shape;
        let (from, direction) = with_light!(shape, l => l.emit(u, self.scene))?;
        let light = chosen.index as u32;
        let pdf = self.emission_pdf(light, from.p, direction);
        Emission { light, from, direction, pdf }.usable()
    }

    /// As [`Lights::emit`], with a share of rays that are aimed at what casts caustics ([`CausticCasters`]).
    #[inline]
    pub fn emit_aimed(&self, u: &LightNumbers) -> Option<Emission> {
        if self.casters.spheres().is_empty() {
            return self.emit(u);
        }
        let mut emission = self.emit(u)?;
        let Emission { light, from, direction, pdf } = &mut emission;
        if u.aim < AIMED {
            let choice = u.aim / AIMED;
            match pdf.origin {
                EmissionOrigin::Surface | EmissionOrigin::Point => {
                    if let Some(aimed) = self.casters.direction(from.p, choice, u.direction) {
                        *direction = aimed;
                    }
                }
                EmissionOrigin::Infinite | EmissionOrigin::Parallel => {
                    *from = self.casters.parallel_ray(*direction, choice, u.place, self.scene);
                }
                EmissionOrigin::Beam => {}
            }
        }
        *pdf = self.aimed_emission_pdf(*light, from.p, *direction);
        emission.usable()
    }

    /// The densities with which [`Lights::emit_aimed`] sends a ray from the point `p` of `light`, or where that is infinitely far away
    /// through the point `p`, in `direction`.
    #[inline]
    pub fn aimed_emission_pdf(&self, light: u32, p: Vec3, direction: Vec3) -> EmissionPdf {
        let mut pdf = self.emission_pdf(light, p, direction);
        if self.casters.spheres().is_empty() {
            return pdf;
        }
        let aimed = match pdf.origin {
            EmissionOrigin::Surface | EmissionOrigin::Point => self.casters.direction_pdf(p, direction),
            EmissionOrigin::Infinite | EmissionOrigin::Parallel => {
                Some(self.casters.parallel_pdf(p, direction))
            }
            EmissionOrigin::Beam => None,
        };
        // Where the light sends nothing, nothing is sent.
        if let Some(aimed) = aimed.filter(|_| pdf.next > 0.0) {
            pdf.next += AIMED * (aimed - pdf.next);
        }
        pdf
    }

    /// The densities with which [`Lights::emit`] sends a ray from the point `p` of `light` (not used for the environment) in
    /// `direction`.
    #[inline]
    pub fn emission_pdf(&self, light: u32, p: Vec3, direction: Vec3) -> EmissionPdf {
        let choice = self.by_power.as_ref().map_or(0.0, |c| c.probability(light as usize));
        let shape = &self.lights[light as usize].shape;
        with_light!(shape, l => l.emission_pdf(p, direction, self.scene, choice))
    }

    /// The density with which an [aimed](Lights::emit_aimed) light subpath begins with the edge of `sample`, for both of its ends, over that of
    /// next-event estimation from the lit point `p`; per unit of area there. `cos` is |cos| at the lit point, geometric.
    #[inline]
    pub fn emission_over_direct(&self, light: u32, sample: &LightSample, p: Vec3, cos: f32) -> f32 {
        let target = sample.target.unwrap_or(p);
        let pdf = self.aimed_emission_pdf(light, target, -sample.wi);
        let scale = match pdf.origin {
            // cos / d² of the light turns both densities into ones by area and drops out.
            EmissionOrigin::Surface => pdf.next / pdf.cos,
            EmissionOrigin::Point => pdf.next / target.distance_squared(p),
            EmissionOrigin::Beam | EmissionOrigin::Infinite | EmissionOrigin::Parallel => pdf.next,
        };
        pdf.vertex / sample.pdf.0 * (scale * cos)
    }
}
