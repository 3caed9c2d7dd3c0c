//! Lambert's cosine law, one-sided: black from behind.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::spectrum::SampledSpectrum;

use super::BsdfSample;

/// A diffuse reflector.
#[derive(Clone, Copy, Debug)]
pub struct Diffuse {
    albedo: SampledSpectrum,
}

impl Diffuse {
    /// A reflector of this albedo.
    #[inline]
    pub fn new(albedo: SampledSpectrum) -> Self {
        Self { albedo }
    }

    /// The albedo.
    #[inline]
    pub fn albedo(&self) -> SampledSpectrum {
        self.albedo
    }

    /// `albedo · cos θᵢ / π`.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let density = wi.z * FRAC_1_PI;
        (wo.z > 0.0 && wi.z > 0.0).then(|| (self.albedo * density, PdfW(density)))
    }

    /// Cosine-weighted; the weight is the albedo.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z <= 0.0 || self.albedo.is_black() {
            return None;
        }
        let wi = warp::cosine_hemisphere(u);
        let pdf = PdfW(warp::cosine_hemisphere_pdf(wi.z));
        let (delta, transmitted, hero_only) = (false, false, false);
        Some(BsdfSample { wi, weight: self.albedo, pdf, delta, transmitted, hero_only, eta2: 1.0 })
    }
}
