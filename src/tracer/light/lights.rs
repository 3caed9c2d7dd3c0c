//! All lights of a scene: choosing one, and asking for the density of a direction.

use std::sync::Arc;

use glam::Vec3;

use crate::math::distribution::Distribution;
use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};
use crate::tracer::accel::PrimRange;
use crate::tracer::shape::SurfacePoint;

use super::{Extent, Light, LightSample, LightShape, LitPoint};

/// All lights of a scene and how one is chosen: by power.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// Where they emit from; shared between scenes that differ in their spectra.
    pub(super) lights: Arc<[Light]>,
    spectra: Vec<Spectrum>,
    /// By power; `None` when there is nothing to choose.
    pub(super) choice: Option<Distribution>,
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
        let choice = Distribution::new(&weights).or_else(|| Distribution::new(&vec![1.0; lights.len()]));
        let environment =
            lights.iter().position(|l| matches!(l.shape, LightShape::Constant(_))).map(|i| i as u32);
        Self { choice, lights, spectra, environment, extent }
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
    #[inline]
    pub fn sample(&self, at: LitPoint, choice: f64, u: [f32; 2]) -> Option<(u32, LightSample)> {
        let chosen = self.choice.as_ref()?.sample(choice);
        let mut sample = self.lights[chosen.index].sample(at, u)?;
        sample.pdf.0 *= chosen.probability;
        Some((chosen.index as u32, sample))
    }

    /// The density of `wi` towards `light`, where it was met at `hit` (nowhere, for the environment).
    #[inline]
    pub fn pdf(&self, light: u32, at: LitPoint, to: (Vec3, Option<&SurfacePoint>)) -> PdfW {
        let pdf = self.lights[light as usize].pdf(at, to.0, to.1);
        PdfW(pdf.0 * self.choice.as_ref().map_or(0.0, |c| c.probability(light as usize)))
    }

    /// The light's spectrum at the wavelengths of a path: radiance, or intensity for a point.
    #[inline]
    pub fn spectrum(&self, light: u32, lambda: &SampledWavelengths) -> SampledSpectrum {
        self.spectra[self.lights[light as usize].spectrum as usize].sample(lambda)
    }

    /// The primitives that never shadow `light`.
    #[inline]
    pub fn prims(&self, light: u32) -> PrimRange {
        self.lights[light as usize].prims
    }
}
