//! A rough metal, one-sided: black from behind. Facets are mirrors, each scatters once.

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::scene::desc::RoughConductorDesc;
use crate::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};

use super::microfacet::Microfacet;
use super::{BsdfSample, MaterialModel, ScatteringModel, fresnel};

/// A rough metal.
#[derive(Clone, Debug)]
pub struct RoughConductorMaterial {
    eta: Spectrum,
    k: Spectrum,
    reflectance: Spectrum,
    microfacet: Microfacet,
}

impl From<RoughConductorDesc> for RoughConductorMaterial {
    fn from(desc: RoughConductorDesc) -> Self {
        let RoughConductorDesc { eta, k, specular_reflectance, roughness } = desc;
        Self { eta, k, reflectance: specular_reflectance, microfacet: Microfacet::new(roughness) }
    }
}

impl MaterialModel for RoughConductorMaterial {
    type Bsdf = RoughConductor;

    #[inline]
    fn bsdf(&self, lambda: &SampledWavelengths) -> RoughConductor {
        let index = [self.eta.sample(lambda), self.k.sample(lambda)];
        RoughConductor::new(index, self.reflectance.sample(lambda), &self.microfacet)
    }
}

/// A microfacet reflector with the Fresnel reflectance of a metal (Torrance and Sparrow 1967; Walter et al.,
/// *Microfacet Models for Refraction through Rough Surfaces*, EGSR 2007, eq. 20).
#[derive(Clone, Copy, Debug)]
pub struct RoughConductor {
    eta: Vec4,
    k: Vec4,
    reflectance: SampledSpectrum,
    microfacet: Microfacet,
}

impl RoughConductor {
    /// `index` = [η, k] relative to the outside, a factor on the reflection, and the facets.
    #[inline]
    pub fn new(index: [SampledSpectrum; 2], reflectance: SampledSpectrum, microfacet: &Microfacet) -> Self {
        Self { eta: index[0].0, k: index[1].0, reflectance, microfacet: *microfacet }
    }

    #[inline]
    fn density(&self, wo: Vec3, m: Vec3) -> f32 {
        self.microfacet.d(m) / (4.0 * self.microfacet.cross_section(wo))
    }

    #[inline]
    fn fresnel(&self, cos: f32) -> SampledSpectrum {
        SampledSpectrum(fresnel::conductor(cos.clamp(0.0, 1.0), self.eta, self.k)) * self.reflectance
    }
}

impl ScatteringModel for RoughConductor {
    /// `F D G₁G₁ / (4 cos θₒ)`, and the density D / (4 σ(wo)).
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        let m = (wo + wi).normalize_or_zero();
        let density = self.density(wo, m);
        let value = self.fresnel(wo.dot(m)) * (density * self.microfacet.g1(wi));
        (density > 0.0).then_some((value, PdfW(density)))
    }

    /// Mirrors in a visible facet; the weight is F·G₁(wi).
    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2], _: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let m = self.microfacet.sample_visible(wo, u);
        let cos = wo.dot(m);
        let wi = (m * (2.0 * cos) - wo).normalize();
        let pdf = PdfW(self.density(wo, m));
        if cos <= 0.0 || wi.z <= 0.0 || pdf.0 <= 0.0 {
            return None;
        }
        let weight = self.fresnel(cos) * self.microfacet.g1(wi);
        Some(BsdfSample::reflection(wi, weight, pdf))
    }

    #[inline]
    fn is_glossy(&self) -> bool {
        true
    }
}
