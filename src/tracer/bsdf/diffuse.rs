//! Lambert's cosine law, one-sided: black from behind.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::scene::desc::DiffuseDesc;
use crate::scene::desc::texture::{SpectrumTexture, TexturePoint};
use crate::spectrum::{SampledSpectrum, SampledWavelengths};

use super::{BsdfSample, MaterialModel, ScatteringModel};

/// A diffuse material, which needs no preparation.
pub type DiffuseMaterial = DiffuseDesc;

impl MaterialModel for DiffuseMaterial {
    type Bsdf = Diffuse;

    #[inline]
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> Diffuse {
        Diffuse::new(self.reflectance.sample(at, lambda))
    }

    fn diffuse_texture(&self) -> Option<&SpectrumTexture> {
        Some(&self.reflectance)
    }
}

/// A diffuse reflector.
#[derive(Clone, Copy, Debug)]
pub struct Diffuse {
    /// The albedo.
    pub albedo: SampledSpectrum,
}

impl Diffuse {
    /// A reflector of this albedo.
    #[inline]
    pub fn new(albedo: SampledSpectrum) -> Self {
        Self { albedo }
    }
}

impl ScatteringModel for Diffuse {
    /// `albedo · cos θᵢ / π`.
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let density = wi.z * FRAC_1_PI;
        (wo.z > 0.0 && wi.z > 0.0).then(|| (self.albedo * density, PdfW(density)))
    }

    /// Cosine-weighted; the weight is the albedo.
    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2], _: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 || self.albedo.is_black() {
            return None;
        }
        let wi = warp::cosine_hemisphere(u);
        let pdf = PdfW(warp::cosine_hemisphere_pdf(wi.z));
        Some(BsdfSample::reflection(wi, self.albedo, pdf))
    }

    #[inline]
    fn as_diffuse(&self) -> Option<&Diffuse> {
        Some(self)
    }

    #[inline]
    fn has_diffuse_part(&self) -> bool {
        true
    }
}
