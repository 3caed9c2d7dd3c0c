//! Phong's model, modified so that it is reciprocal and reflects no more than arrives: E. Lafortune and Y. Willems, *Using the Modified
//! Phong Reflectance Model for Physically Based Rendering*, report CW 197, K.U. Leuven 1994.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::Vec3;

use crate::math::frame::Frame;
use crate::math::trigonometry;
use crate::scene::desc::texture::{SpectrumTexture, TexturePoint};
use crate::scene::desc::{PhongDesc, SHARPEST_PHONG};
use crate::spectrum::SampledWavelengths;

use super::MaterialModel;
use super::lobe::{Lobe, LobeOverDiffuse};

/// A Phong material, which needs no preparation.
pub type PhongMaterial = PhongDesc;

/// A Phong lobe over a diffuse part.
pub type Phong = LobeOverDiffuse<PhongLobe>;

impl MaterialModel for PhongMaterial {
    type Bsdf = Phong;

    #[inline(never)]
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> Phong {
        let lobe = PhongLobe::new(self.exponent.scalar(at));
        Phong::textured(lobe, [&self.specular_reflectance, &self.diffuse_reflectance], at, lambda)
    }

    fn diffuse_texture(&self) -> Option<&SpectrumTexture> {
        Some(&self.diffuse_reflectance)
    }
}

/// A power of the cosine to the mirror direction.
#[derive(Clone, Copy, Debug)]
pub struct PhongLobe {
    exponent: f32,
}

impl PhongLobe {
    /// The lobe of this exponent.
    #[inline]
    pub fn new(exponent: f32) -> Self {
        Self { exponent: exponent.clamp(0.0, SHARPEST_PHONG) }
    }
}

fn mirrored(wo: Vec3) -> Vec3 {
    Vec3::new(-wo.x, -wo.y, wo.z)
}

impl Lobe for PhongLobe {
    /// `(n + 2) cosⁿ α cos θᵢ / 2π` and `(n + 1) cosⁿ α / 2π`.
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> [f32; 2] {
        // 1 − cos α keeps the digits that cos α would lose next to 1.
        let rest = 0.5 * (wi - mirrored(wo)).length_squared();
        if rest >= 1.0 {
            return [0.0; 2];
        }
        let power = (self.exponent * (-rest).ln_1p()).exp() * (0.5 * FRAC_1_PI);
        [(self.exponent + 2.0) * power * wi.z, (self.exponent + 1.0) * power]
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        // cos α = u^(1 / (n + 1)), by what is missing to 1.
        let rest = -(u[0].ln() / (self.exponent + 1.0)).exp_m1();
        let sin = (rest * (2.0 - rest)).max(0.0).sqrt();
        let (sin_phi, cos_phi) = trigonometry::sin_cos(TAU * u[1]);
        Frame::new(mirrored(wo)).to_world(Vec3::new(cos_phi * sin, sin_phi * sin, 1.0 - rest)).normalize()
    }
}
