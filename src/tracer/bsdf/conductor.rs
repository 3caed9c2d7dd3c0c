//! A smooth metal, one-sided: black from behind.

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::spectrum::SampledSpectrum;

use super::{BsdfSample, fresnel};

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

    /// The mirror direction; always delta.
    #[inline]
    pub fn sample(&self, wo: Vec3) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let weight =
            SampledSpectrum(fresnel::conductor(wo.z.min(1.0), self.eta.0, self.k.0)) * self.reflectance;
        let wi = Vec3::new(-wo.x, -wo.y, wo.z);
        let (delta, transmitted, hero_only) = (true, false, false);
        Some(BsdfSample { wi, weight, pdf: PdfW(1.0), delta, transmitted, hero_only, eta2: 1.0 })
    }
}
