//! Matt surfaces of V-shaped cavities whose facets are Lambert's: M. Oren and S. K. Nayar, *Generalization of Lambert's Reflectance
//! Model*, SIGGRAPH 1994: eq. 27, 28 and 30, or the qualitative model of section 4.4. One-sided: black from behind.

use std::f32::consts::{FRAC_1_PI, FRAC_2_PI};

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::math::trigonometry;
use crate::math::warp;
use crate::scene::desc::RoughDiffuseDesc;
use crate::scene::desc::texture::{SpectrumTexture, TexturePoint};
use crate::spectrum::{SampledSpectrum, SampledWavelengths};

use super::{BsdfSample, MaterialModel, ScatteringModel};

/// A rough diffuse material, which needs no preparation.
pub type RoughDiffuseMaterial = RoughDiffuseDesc;

impl MaterialModel for RoughDiffuseMaterial {
    type Bsdf = RoughDiffuse;

    #[inline(never)]
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> RoughDiffuse {
        RoughDiffuse::new(self.reflectance.sample(at, lambda), self.alpha.scalar(at), self.use_fast_approx)
    }

    fn diffuse_texture(&self) -> Option<&SpectrumTexture> {
        Some(&self.reflectance)
    }
}

/// A rough diffuse reflector.
#[derive(Clone, Copy, Debug)]
pub struct RoughDiffuse {
    albedo: SampledSpectrum,
    /// σ², the variance of the angle between facets and surface.
    variance: f32,
    fast: bool,
}

impl RoughDiffuse {
    /// A reflector whose facets have this albedo and the root mean square slope `alpha`. `fast`: by the qualitative model, without
    /// light that meets two facets.
    #[inline]
    pub fn new(albedo: SampledSpectrum, alpha: f32, fast: bool) -> Self {
        Self { albedo, variance: 0.5 * alpha * alpha, fast }
    }

    /// The value over that of Lambert's reflector of albedo 1, for two directions above the horizon.
    fn shape(&self, wo: Vec3, wi: Vec3) -> SampledSpectrum {
        let [sin_o, sin_i] = [wo, wi].map(|w| w.truncate().length());
        let across = sin_o * sin_i;
        // The cosine of the azimuth between them, anything where one is the normal.
        let cos_phi =
            if across > 0.0 { (wo.truncate().dot(wi.truncate()) / across).clamp(-1.0, 1.0) } else { 0.0 };
        // α is the greater of the two angles to the normal, β the smaller.
        let (alpha, beta) =
            if wo.z < wi.z { ((sin_o, wo.z), (sin_i, wi.z)) } else { ((sin_i, wi.z), (sin_o, wo.z)) };
        let tan_beta = beta.0 / beta.1;
        let s = self.variance;
        let (c1, c2) = (1.0 - 0.5 * s / (s + 0.33), 0.45 * s / (s + 0.09));
        if self.fast {
            return self.albedo * (c1 + c2 * cos_phi.max(0.0) * alpha.0 * tan_beta);
        }
        let [alpha_angle, beta_angle] = [alpha, beta].map(|(sin, cos)| trigonometry::atan2(sin, cos));
        let fraction = FRAC_2_PI * beta_angle;
        let spread = if cos_phi >= 0.0 { alpha.0 } else { alpha.0 - fraction.powi(3) };
        let angles = FRAC_2_PI * FRAC_2_PI * alpha_angle * beta_angle;
        let c3 = 0.125 * s / (s + 0.09) * angles * angles;
        let tan_half = (alpha.0 + beta.0) / (alpha.1 + beta.1);
        let once = c1 + cos_phi * c2 * spread * tan_beta + (1.0 - cos_phi.abs()) * c3 * tan_half;
        let twice = 0.17 * s / (s + 0.13) * (1.0 - cos_phi * fraction * fraction);
        self.albedo * once + self.albedo * self.albedo * twice
    }
}

impl ScatteringModel for RoughDiffuse {
    #[inline(never)]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let density = wi.z * FRAC_1_PI;
        (wo.z > 0.0 && wi.z > 0.0).then(|| (self.shape(wo, wi) * density, PdfW(density)))
    }

    /// Cosine-weighted.
    #[inline(never)]
    fn sample(&self, wo: Vec3, u: [f32; 2], _: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let wi = warp::cosine_hemisphere(u);
        let pdf = PdfW(warp::cosine_hemisphere_pdf(wi.z));
        Some(BsdfSample::reflection(wi, self.shape(wo, wi), pdf))
    }

    #[inline]
    fn has_diffuse_part(&self) -> bool {
        true
    }
}
