//! A lobe over a diffuse part, as the empirical models have it: both are added, neither hides the other. One-sided: black from behind.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::scene::desc::texture::{SpectrumTexture, TexturePoint};
use crate::spectrum::{SampledSpectrum, SampledWavelengths};

use super::scattering::{carried_mean, lobe_probability};
use super::{BsdfSample, ScatteringModel};

/// A lobe of reflectance 1. Both directions are above the horizon.
pub trait Lobe: Copy {
    /// f·cos θᵢ, and the density with which [`sample`](Self::sample) chooses `wi`.
    fn eval(&self, wo: Vec3, wi: Vec3) -> [f32; 2];

    /// Chooses a direction, which may be below the horizon.
    fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3;
}

/// A lobe over a diffuse part.
#[derive(Clone, Copy, Debug)]
pub struct LobeOverDiffuse<L> {
    lobe: L,
    specular: SampledSpectrum,
    diffuse: SampledSpectrum,
    /// The probability of the lobe.
    chance: f32,
}

impl<L: Lobe> LobeOverDiffuse<L> {
    /// With these factors on either. Where they add up to more than 1, both are scaled, so that together they reflect no more than
    /// arrives. `hero_only`: the first lane alone counts in the choice between them.
    #[inline]
    pub fn new(lobe: L, [specular, diffuse]: [SampledSpectrum; 2], hero_only: bool) -> Self {
        let scale = SampledSpectrum(Vec4::ONE / (specular + diffuse).0.max(Vec4::ONE));
        let [specular, diffuse] = [specular, diffuse].map(|factor| factor * scale);
        let [lobes, base] = [specular, diffuse].map(|factor| carried_mean(factor, hero_only));
        let chance = if lobes + base > 0.0 { lobe_probability(lobes / (lobes + base)) } else { 0.0 };
        Self { lobe, specular, diffuse, chance }
    }

    /// At a point of a surface, with the factors that these textures have there.
    #[inline]
    pub fn textured(
        lobe: L,
        factors: [&SpectrumTexture; 2],
        at: &TexturePoint,
        lambda: &SampledWavelengths,
    ) -> Self {
        Self::new(lobe, factors.map(|factor| factor.sample(at, lambda)), lambda.is_hero_only())
    }
}

impl<L: Lobe> ScatteringModel for LobeOverDiffuse<L> {
    #[inline(never)]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        let cosine = wi.z * FRAC_1_PI;
        let [value, density] = self.lobe.eval(wo, wi);
        let pdf = self.chance * density + (1.0 - self.chance) * cosine;
        (pdf > 0.0).then(|| (self.specular * value + self.diffuse * cosine, PdfW(pdf)))
    }

    /// A direction of one of the two; both count.
    #[inline(never)]
    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let wi = if lobe < self.chance { self.lobe.sample(wo, u) } else { warp::cosine_hemisphere(u) };
        let (value, pdf) = self.eval(wo, wi)?;
        Some(BsdfSample::reflection(wi, value * (1.0 / pdf.0), pdf))
    }

    #[inline]
    fn has_diffuse_part(&self) -> bool {
        true
    }

    #[inline]
    fn is_glossy(&self) -> bool {
        true
    }
}
