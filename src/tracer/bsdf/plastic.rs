//! A diffuse base under a smooth transparent coat, one-sided: black from behind.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::spectrum::SampledSpectrum;

use super::{BsdfSample, fresnel};

/// A smooth coat over Lambert, with the light that the coat sends back to the base; the model of Mitsuba 3's `plastic`.
///
/// Both a delta and a diffuse material: [`Plastic::eval`] is the diffuse base alone, and its density counts that the
/// base was chosen; a sample of the coat is delta.
#[derive(Clone, Copy, Debug)]
pub struct Plastic {
    /// Index of the coat over that of the outside, per lane.
    eta: Vec4,
    coat: SampledSpectrum,
    /// Of the base, with internal scattering and 1/η².
    base: SampledSpectrum,
    /// Share of the coat in what can be reflected.
    coat_share: f32,
    hero_only: bool,
}

/// What lies under a coat, and what happens to light within it.
#[derive(Clone, Copy, Debug)]
pub struct Base {
    /// Albedo of the base.
    pub albedo: SampledSpectrum,
    /// Reflectance of the coat from within for diffuse light.
    pub internal: SampledSpectrum,
    /// Light is coloured anew at every reflection from the base, not once.
    pub nonlinear: bool,
}

impl Base {
    /// Albedo of the base with all of its reflections within a coat of index `eta`, over η².
    #[inline]
    pub(super) fn within(&self, eta: Vec4) -> SampledSpectrum {
        let each = if self.nonlinear { self.albedo.0 } else { Vec4::ONE };
        let rest = (1.0 - each * self.internal.0).max(Vec4::splat(1e-6));
        SampledSpectrum(self.albedo.0 / (rest * eta * eta))
    }
}

impl Plastic {
    /// `eta` = [coat, outside]; `coat`: factor on the reflection of the coat; `hero_only`: only the hero wavelength
    /// is carried.
    #[inline]
    pub fn new(eta: [SampledSpectrum; 2], coat: SampledSpectrum, base: Base, hero_only: bool) -> Self {
        let eta = eta[0].0 / eta[1].0;
        let coat_share = share(coat, base.albedo, hero_only);
        Self { eta, coat, base: base.within(eta), coat_share, hero_only }
    }

    /// The base: `albedo / (1 − internal) · (1 − Fₒ)(1 − Fᵢ) cos θᵢ / (π η²)`.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        let f_o = self.fresnel(wo);
        let pdf = (1.0 - self.coat_probability(f_o)?) * warp::cosine_hemisphere_pdf(wi.z);
        let value = self.base * SampledSpectrum((1.0 - f_o) * (1.0 - self.fresnel(wi)));
        (pdf > 0.0).then_some((value * (wi.z * FRAC_1_PI), PdfW(pdf)))
    }

    /// The mirror direction of the coat, or a cosine-weighted one of the base.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let f_o = self.fresnel(wo);
        let p = self.coat_probability(f_o)?;
        let (transmitted, hero_only, eta2) = (false, false, 1.0);
        if lobe < p {
            let (wi, delta, pdf) = (Vec3::new(-wo.x, -wo.y, wo.z), true, PdfW(p));
            let weight = SampledSpectrum(f_o / p) * self.coat;
            return Some(BsdfSample { wi, weight, pdf, delta, transmitted, hero_only, eta2 });
        }
        let (wi, delta) = (warp::cosine_hemisphere(u), false);
        let pdf = PdfW((1.0 - p) * warp::cosine_hemisphere_pdf(wi.z));
        let weight = self.base * SampledSpectrum((1.0 - f_o) * (1.0 - self.fresnel(wi)) / (1.0 - p));
        Some(BsdfSample { wi, weight, pdf, delta, transmitted, hero_only, eta2 })
    }

    #[inline]
    fn fresnel(&self, w: Vec3) -> Vec4 {
        fresnel::dielectric(w.z.min(1.0), self.eta)
    }

    /// How likely the coat is chosen; `None` when nothing is reflected at all.
    #[inline]
    fn coat_probability(&self, f_o: Vec4) -> Option<f32> {
        let f = if self.hero_only { f_o.x } else { f_o.element_sum() * 0.25 };
        let (coat, base) = (f * self.coat_share, (1.0 - f) * (1.0 - self.coat_share));
        (coat + base > 0.0).then(|| coat / (coat + base))
    }
}

/// The part of `coat` in the sum of both, as the carried wavelengths see it; 1 when both are black.
#[inline]
pub(super) fn share(coat: SampledSpectrum, base: SampledSpectrum, hero_only: bool) -> f32 {
    let mean = |s: SampledSpectrum| if hero_only { s.0.x } else { s.mean() };
    let (coat, base) = (mean(coat), mean(base));
    if base > 0.0 { coat / (coat + base) } else { 1.0 }
}
