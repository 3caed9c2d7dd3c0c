//! All lights of a scene: choosing one, and asking for the density of a direction.

use std::sync::Arc;

use glam::Vec3;

use crate::math::distribution::Distribution;
use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};
use crate::tracer::accel::PrimRange;
use crate::tracer::shape::SurfacePoint;

use super::choice::Choice;
use super::{Extent, Light, LightSample, LightShape, LitPoint};

/// All lights of a scene and how one is chosen: from a lit point by what each may bring there, for a light subpath by
/// power.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// Where they emit from; shared between scenes that differ in their spectra.
    pub(super) lights: Arc<[Light]>,
    spectra: Vec<Spectrum>,
    /// By power, for emission; `None` when there is nothing to choose.
    pub(super) by_power: Option<Distribution>,
    /// From a lit point.
    choice: Choice,
    /// The environment, if there is one.
    environment: Option<u32>,
    pub(super) extent: Extent,
}

impl Lights {
    /// All lights, their spectra, and the extent of the scene (for an environment).
    pub fn new(lights: Vec<Light>, spectra: Vec<Spectrum>, extent: Extent) -> Self {
        Self::with(lights.into(), spectra, extent)
    }

    /// The same lights with other spectra, of which there must be as many.
    pub fn relit(&self, spectra: Vec<Spectrum>) -> Self {
        Self::with(self.lights.clone(), spectra, self.extent)
    }

    fn with(lights: Arc<[Light]>, spectra: Vec<Spectrum>, extent: Extent) -> Self {
        // Colours that the eye hardly sees must still be sampled.
        let brightness = |s: &Spectrum| s.luminance().max(1e-3 * s.max());
        let brightness: Vec<f32> = spectra.iter().map(brightness).collect();
        let power = |l: &Light| l.extent(extent.radius) * brightness[l.spectrum as usize];
        let weights: Vec<f32> = lights.iter().map(power).collect();
        // Powers that cannot be compared (overflow, underflow) leave every light the same chance.
        let equal = vec![1.0; lights.len()];
        let (by_power, weights) = match Distribution::new(&weights) {
            Some(by_power) => (Some(by_power), &weights),
            None => (Distribution::new(&equal), &equal),
        };
        let choice = Choice::new(&lights, weights, extent);
        let environment = lights.iter().position(Light::is_environment).map(|i| i as u32);
        Self { by_power, choice, lights, spectra, environment, extent }
    }

    /// The environment's index, if there is one.
    #[inline]
    pub fn environment(&self) -> Option<u32> {
        self.environment
    }

    /// How many lights there are.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// True when nothing emits.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// Chooses a light by `choice` and a direction towards it by `u`; returns the light's index with it.
    #[inline(always)]
    pub fn sample(&self, at: LitPoint, choice: f64, u: [f32; 2]) -> Option<(u32, LightSample)> {
        let (light, probability) = self.choice.sample(at, choice)?;
        let mut sample = self.lights[light as usize].sample(at, u)?;
        if self.each(at).is_some() {
            sample.scale /= probability;
        } else {
            sample.pdf.0 *= probability;
        }
        Some((light, sample))
    }

    /// As [`Lights::sample`], with `value` what a sample is worth but for shadows, MIS weight and all, or `None` for
    /// nothing. Where each light is sampled ([`LitPoint::glossy`]) one of the samples is taken in proportion to
    /// that, so that a single shadow ray serves all, and its value stands for theirs (Talbot, Cline, Egbert,
    /// *Importance Resampling for Global Illumination*, EGSR 2005, with one sample of every light).
    #[inline]
    pub fn sample_by(
        &self,
        at: LitPoint,
        (choice, u): (f64, [f32; 2]),
        mut value: impl FnMut(u32, &LightSample) -> Option<SampledSpectrum>,
    ) -> Option<(u32, LightSample, SampledSpectrum)> {
        let Some(each) = self.each(at) else {
            let (light, sample) = self.sample(at, choice, u)?;
            return value(light, &sample).map(|value| (light, sample, value));
        };
        let (mut total, mut chosen, mut left) = (0.0, None, choice);
        for &light in each {
            let Some(sample) = self.lights[light as usize].sample(at, u) else { continue };
            let Some(value) = value(light, &sample) else { continue };
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

    /// The density of `wi` towards `light`, where it was met at `hit` (nowhere, for the environment).
    #[inline]
    pub fn pdf(&self, light: u32, at: LitPoint, to: (Vec3, Option<&SurfacePoint>)) -> PdfW {
        let pdf = self.lights[light as usize].pdf(at, to.0, to.1);
        PdfW(pdf.0 * self.probability(light, at))
    }

    /// The probability that `light` is sampled from `at`.
    #[inline]
    pub fn probability(&self, light: u32, at: LitPoint) -> f32 {
        if self.each(at).is_some() { 1.0 } else { self.choice.probability(light, at) }
    }

    /// The lights, where each is sampled.
    #[inline(always)]
    fn each(&self, at: LitPoint) -> Option<&[u32]> {
        if at.glossy { self.choice.each() } else { None }
    }

    /// The light's spectrum at the wavelengths of a path, as seen along the unit direction `wi` (towards the light):
    /// radiance, or intensity for a point. Only that of an environment depends on `wi`.
    #[inline]
    pub fn spectrum(&self, light: u32, wi: Vec3, lambda: &SampledWavelengths) -> SampledSpectrum {
        let Light { shape, spectrum, .. } = &self.lights[light as usize];
        let spectrum = self.spectra[*spectrum as usize].sample(lambda);
        match shape {
            LightShape::Map(map) => spectrum * map.radiance(wi, lambda),
            _ => spectrum,
        }
    }

    /// True when [`Lights::spectrum`] of this light depends on the direction.
    #[inline]
    pub fn is_directional(&self, light: u32) -> bool {
        matches!(self.lights[light as usize].shape, LightShape::Map(_))
    }

    /// A unit direction towards the environment `light`, and its density per steradian (without the choice of the
    /// light): the same for every point, as emission from it needs. `None` for other lights, and where all is black.
    pub fn sample_direction(&self, light: u32, u: [f32; 2]) -> Option<(Vec3, PdfW)> {
        match &self.lights[light as usize].shape {
            LightShape::Constant(l) => Some(l.sample_direction(u)),
            LightShape::Map(l) => l.sample_direction(u),
            _ => None,
        }
    }

    /// The density of [`Lights::sample_direction`] at `wi`; 0 for lights that are no environment.
    pub fn pdf_direction(&self, light: u32, wi: Vec3) -> PdfW {
        match &self.lights[light as usize].shape {
            LightShape::Constant(l) => l.pdf_direction(),
            LightShape::Map(l) => l.pdf_direction(wi),
            _ => PdfW::ZERO,
        }
    }

    /// The primitives that never shadow `light`.
    #[inline]
    pub fn prims(&self, light: u32) -> PrimRange {
        self.lights[light as usize].prims
    }
}
