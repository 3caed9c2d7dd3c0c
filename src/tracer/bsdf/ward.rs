//! Ward's model, the Gaussian of the slope of the half vector, in three normalisations ([`WardVariant`]). Its density is that of B. Walter,
//! *Notes on the Ward BRDF*, report PCG-05-06, Cornell 2005.
//!
//! Only `balanced` keeps to the light that arrives. The two older ones return more of it at grazing angles, without a bound.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::Vec3;

use crate::math::trigonometry;
use crate::scene::desc::texture::{SpectrumTexture, TexturePoint};
use crate::scene::desc::{AlphaTexture, Roughness, WardDesc, WardVariant};
use crate::spectrum::SampledWavelengths;

use super::MaterialModel;
use super::lobe::{Lobe, LobeOverDiffuse};
use super::microfacet::MIN_ALPHA;

/// A Ward material, which needs no preparation.
pub type WardMaterial = WardDesc;

/// A Ward lobe over a diffuse part.
pub type Ward = LobeOverDiffuse<WardLobe>;

/// Cosines below this one count as it where values are divided by them.
const LEAST_COSINE: f32 = 1e-6;

/// The same of half vectors of any length.
const LEAST_HEIGHT: f32 = 1e-12;

impl MaterialModel for WardMaterial {
    type Bsdf = Ward;

    #[inline(never)]
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> Ward {
        let Roughness { alpha, .. } = self.roughness;
        let alpha = self.alpha.as_deref().map_or(alpha, |texture: &AlphaTexture| texture.at(at));
        let lobe = WardLobe::new(self.variant, alpha);
        Ward::textured(lobe, [&self.specular_reflectance, &self.diffuse_reflectance], at, lambda)
    }

    fn diffuse_texture(&self) -> Option<&SpectrumTexture> {
        Some(&self.diffuse_reflectance)
    }
}

/// A Gaussian of the slope of the half vector.
#[derive(Clone, Copy, Debug)]
pub struct WardLobe {
    variant: WardVariant,
    alpha: [f32; 2],
}

impl WardLobe {
    /// The lobe with these slopes along the two tangents.
    #[inline]
    pub fn new(variant: WardVariant, alpha: [f32; 2]) -> Self {
        Self { variant, alpha: alpha.map(|alpha| alpha.max(MIN_ALPHA)) }
    }
}

impl Lobe for WardLobe {
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> [f32; 2] {
        let (half, [u, v]) = (wo + wi, self.alpha);
        let height = half.z.max(LEAST_HEIGHT);
        let slope = half.truncate() / height;
        let gauss = (-(slope.x / u).powi(2) - (slope.y / v).powi(2)).exp() * (FRAC_1_PI / (u * v));
        // 1 / cos² of the half vector.
        let secant2 = 1.0 + slope.length_squared();
        if gauss == 0.0 {
            return [0.0; 2];
        }
        let [cos_o, cos_i] = [wo.z, wi.z].map(|cos| cos.max(LEAST_COSINE));
        let value = match self.variant {
            WardVariant::Ward => 0.25 * wi.z / (cos_o * cos_i).sqrt(),
            WardVariant::Duer => 0.25 * (wi.z / cos_i) / cos_o,
            WardVariant::Balanced => secant2 * (wi.z / height) / height,
        };
        [gauss * value, gauss * secant2 * 0.5 / height]
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let radius = (-(1.0 - u[0]).ln()).sqrt();
        let (sin_phi, cos_phi) = trigonometry::sin_cos(TAU * u[1]);
        let half =
            Vec3::new(self.alpha[0] * radius * cos_phi, self.alpha[1] * radius * sin_phi, 1.0).normalize();
        (half * (2.0 * wo.dot(half)) - wo).normalize()
    }
}
