//! A diffuse base under a rough transparent coat, one-sided: black from behind.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::spectrum::SampledSpectrum;

use super::plastic::share;
use super::{Base, BsdfSample, Microfacet, Transmittance, fresnel};

/// A rough coat over Lambert, with the light that the coat sends back to the base; the model of Mitsuba 3's
/// `roughplastic`. The index of the coat is the same for all wavelengths.
#[derive(Clone, Copy, Debug)]
pub struct RoughPlastic {
    /// Index of the coat over that of the outside.
    eta: f32,
    coat: SampledSpectrum,
    /// Of the base, with internal scattering and 1/η².
    base: SampledSpectrum,
    /// Share of the coat in what can be reflected.
    coat_share: f32,
    microfacet: Microfacet,
    transmittance: Transmittance,
}

/// A rough coat.
#[derive(Clone, Copy, Debug)]
pub struct Coat {
    /// Its index over that of the outside.
    pub eta: f32,
    /// Its facets, the same along both tangents.
    pub microfacet: Microfacet,
    /// What it lets through to the base, and from the base out.
    pub transmittance: Transmittance,
}

impl RoughPlastic {
    /// `reflectance`: factor on the reflection of the coat; `hero_only`: only the hero wavelength is carried.
    #[inline]
    pub fn new(coat: &Coat, reflectance: SampledSpectrum, base: Base, hero_only: bool) -> Self {
        let Coat { eta, microfacet, transmittance } = *coat;
        let coat_share = share(reflectance, base.albedo, hero_only);
        let base = base.within(Vec4::splat(eta));
        Self { eta, coat: reflectance, base, coat_share, microfacet, transmittance }
    }

    /// `F D G₁G₁ / (4 cos θₒ)` of the coat and `albedo / (1 − internal) · Tₒ Tᵢ cos θᵢ / (π η²)` of the base.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        let t_o = self.transmittance.at(wo.z);
        let p = self.coat_probability(t_o)?;
        let m = (wo + wi).normalize_or_zero();
        let density = self.microfacet.d(m) / (4.0 * self.microfacet.cross_section(wo));
        let cos = wo.dot(m).clamp(0.0, 1.0);
        let r = fresnel::dielectric(cos, Vec4::splat(self.eta)).x;
        let coat = self.coat * (r * density * self.microfacet.g1(wi));
        let base = self.base * (t_o * self.transmittance.at(wi.z) * wi.z * FRAC_1_PI);
        let pdf = p * density + (1.0 - p) * warp::cosine_hemisphere_pdf(wi.z);
        (pdf > 0.0).then_some((coat + base, PdfW(pdf)))
    }

    /// Mirrors in a visible facet of the coat, or a cosine-weighted direction of the base; both parts count for either.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let wi = if lobe < self.coat_probability(self.transmittance.at(wo.z))? {
            let m = self.microfacet.sample_visible(wo, u);
            (m * (2.0 * wo.dot(m)) - wo).normalize()
        } else {
            warp::cosine_hemisphere(u)
        };
        let (value, pdf) = self.eval(wo, wi)?;
        let weight = value * (1.0 / pdf.0);
        let (delta, transmitted, hero_only) = (false, false, false);
        weight.is_finite().then_some(BsdfSample { wi, weight, pdf, delta, transmitted, hero_only, eta2: 1.0 })
    }

    /// How likely the coat is chosen; `None` when nothing is reflected at all.
    #[inline]
    fn coat_probability(&self, t_o: f32) -> Option<f32> {
        let (coat, base) = ((1.0 - t_o) * self.coat_share, t_o * (1.0 - self.coat_share));
        (coat + base > 0.0).then(|| coat / (coat + base))
    }
}
