//! All lights of a scene: choosing one, and asking for the density of a direction.

use std::sync::Arc;

use glam::Vec3;

use crate::math::distribution::Distribution;
use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};
use crate::tracer::accel::PrimRange;
use crate::tracer::shape::SurfacePoint;

use super::selector::LightSelector;
use super::{BoundingSphere, Light, LightSource, with_light};

/// What sampling a light depends on at the point that is lit.
#[derive(Clone, Copy, Debug)]
pub struct LightSampleContext {
    /// Position, world space.
    pub p: Vec3,
    /// Unit shading normal on the side that is seen.
    pub n: Vec3,
    /// The surface also lets light through from the other side.
    pub through: bool,
    /// The material has a peak, which the choice of a light does not consider: where lights are few, each is sampled.
    pub glossy: bool,
}

/// A sampled direction towards a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction to the light.
    pub wi: Vec3,
    /// The point on the light; `None` if it is infinitely far.
    pub target: Option<Vec3>,
    /// Factor on the light's spectrum: 1, or 1/r² for a point; times the inverse of its share where one sample stands
    /// for those of several lights.
    pub scale: f32,
    /// Density, including the choice of the light once it comes out of [`Lights::sample`].
    pub pdf: PdfW,
    /// No path can hit the light by chance.
    pub delta: bool,
}

/// All lights of a scene and how one is chosen: from a lit point by its importance there, for a light subpath by
/// its power.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// Their geometry; shared between scenes that differ in their spectra.
    pub(super) lights: Arc<[Light]>,
    spectra: Vec<Spectrum>,
    /// The choice by power, for emission; `None` when there is nothing to choose.
    pub(super) by_power: Option<Distribution>,
    /// The choice from a lit point.
    selector: LightSelector,
    /// The environment, if there is one.
    environment: Option<u32>,
    /// The sphere around the scene.
    pub(super) scene: BoundingSphere,
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
        let selector = LightSelector::new(&lights, weights, scene);
        let environment = lights.iter().position(Light::is_environment).map(|i| i as u32);
        Self { by_power, selector, lights, spectra, environment, scene }
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

    /// The same lights with other spectra, of which there must be as many.
    pub fn relit(&self, spectra: Vec<Spectrum>) -> Self {
        Self::new(self.lights.clone(), spectra, self.scene)
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

    /// As [`Lights::sample`], where `contribution` is what a sample contributes if nothing occludes it, MIS weight and all, or
    /// `None` for nothing. Where each light is sampled ([`LightSampleContext::glossy`]) one of the samples is taken in
    /// proportion to that, so that a single shadow ray serves all, and its value stands for theirs (Talbot, Cline, Egbert,
    /// *Importance Resampling for Global Illumination*, EGSR 2005, with one sample of every light).
    #[inline]
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
        if self.each(at).is_some() { 1.0 } else { self.selector.probability(light, at) }
    }

    /// The lights, if each of them is sampled from `at`.
    #[inline(always)]
    fn each(&self, at: LightSampleContext) -> Option<&[u32]> {
        if at.glossy { self.selector.each() } else { None }
    }

    /// The light's spectrum at the wavelengths of a path, as seen along the unit direction `wi` (towards the light):
    /// radiance, or intensity for a point. Only that of an environment depends on `wi`.
    #[inline]
    pub fn spectrum(&self, light: u32, wi: Vec3, lambda: &SampledWavelengths) -> SampledSpectrum {
        let Light { shape, spectrum, .. } = &self.lights[light as usize];
        let spectrum = self.spectra[*spectrum as usize].sample(lambda);
        with_light!(shape, l => if l.is_directional() { spectrum * l.directional(wi, lambda) } else { spectrum })
    }

    /// True when [`Lights::spectrum`] of this light depends on the direction.
    #[inline]
    pub fn is_directional(&self, light: u32) -> bool {
        with_light!(&self.lights[light as usize].shape, l => l.is_directional())
    }

    /// The primitives that never shadow `light`.
    #[inline]
    pub fn prims(&self, light: u32) -> PrimRange {
        self.lights[light as usize].prims
    }
}
