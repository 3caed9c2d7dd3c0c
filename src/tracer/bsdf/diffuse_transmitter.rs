//! Light that a thin sheet spreads to its other side by Lambert's cosine law, alike from both sides. It reflects nothing.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::scene::desc::DiffuseTransmitterDesc;
use crate::scene::desc::texture::TexturePoint;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};

use super::{BsdfSample, MaterialModel, ScatteringModel};

/// A diffuse transmitter, which needs no preparation.
pub type DiffuseTransmitterMaterial = DiffuseTransmitterDesc;

impl MaterialModel for DiffuseTransmitterMaterial {
    type Bsdf = DiffuseTransmitter;

    #[inline(never)]
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> DiffuseTransmitter {
        DiffuseTransmitter::new(self.transmittance.sample(at, lambda))
    }
}

/// A diffuse transmitter.
#[derive(Clone, Copy, Debug)]
pub struct DiffuseTransmitter {
    transmittance: SampledSpectrum,
}

impl DiffuseTransmitter {
    /// A sheet that lets this share of light through.
    #[inline]
    pub fn new(transmittance: SampledSpectrum) -> Self {
        Self { transmittance }
    }
}

impl ScatteringModel for DiffuseTransmitter {
    /// `transmittance · |cos θᵢ| / π` on the side opposite to `wo`.
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let density = wi.z.abs() * FRAC_1_PI;
        let opposite = wo.z > 0.0 && wi.z < 0.0 || wo.z < 0.0 && wi.z > 0.0;
        opposite.then(|| (self.transmittance * density, PdfW(density)))
    }

    /// Cosine-weighted; the weight is the transmittance.
    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2], _: f32) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let up = warp::cosine_hemisphere(u);
        let pdf = PdfW(warp::cosine_hemisphere_pdf(up.z));
        let wi = up.with_z(-up.z.copysign(wo.z));
        Some(BsdfSample { transmitted: true, ..BsdfSample::reflection(wi, self.transmittance, pdf) })
    }

    #[inline]
    fn has_diffuse_part(&self) -> bool {
        true
    }

    #[inline]
    fn transmits(&self) -> bool {
        true
    }
}
