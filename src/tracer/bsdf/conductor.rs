//! A smooth metal, one-sided: black from behind.

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::scene::desc::ConductorDesc;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};

use super::{BsdfSample, MaterialModel, ScatteringModel, fresnel};

/// A smooth metal, which needs no preparation.
pub type ConductorMaterial = ConductorDesc;

impl MaterialModel for ConductorMaterial {
    type Bsdf = Conductor;

    #[inline]
    fn bsdf(&self, lambda: &SampledWavelengths) -> Conductor {
        let reflectance = self.specular_reflectance.sample(lambda);
        Conductor::new(self.eta.sample(lambda), self.k.sample(lambda), reflectance)
    }
}

/// A mirror with the Fresnel reflectance of a metal.
#[derive(Clone, Copy, Debug)]
pub struct Conductor {
    eta: SampledSpectrum,
    k: SampledSpectrum,
    reflectance: SampledSpectrum,
}

impl Conductor {
    /// Complex index `eta + i k` relative to the outside, and a factor on the reflection.
    #[inline]
    pub fn new(eta: SampledSpectrum, k: SampledSpectrum, reflectance: SampledSpectrum) -> Self {
        Self { eta, k, reflectance }
    }
}

impl ScatteringModel for Conductor {
    /// The mirror direction; always delta.
    #[inline]
    fn sample(&self, wo: Vec3, _: [f32; 2], _: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let weight =
            SampledSpectrum(fresnel::conductor(wo.z.min(1.0), self.eta.0, self.k.0)) * self.reflectance;
        let wi = Vec3::new(-wo.x, -wo.y, wo.z);
        Some(BsdfSample { delta: true, ..BsdfSample::reflection(wi, weight, PdfW(1.0)) })
    }

    #[inline]
    fn is_delta(&self) -> bool {
        true
    }
}
