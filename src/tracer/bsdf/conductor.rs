//! Metals, smooth and rough, one-sided: black from behind. Rough facets are mirrors, each scatters once.

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::scene::desc::texture::TexturePoint;
use crate::scene::desc::{AlphaTexture, ConductorDesc, RoughConductorDesc};
use crate::spectrum::{SampledSpectrum, SampledWavelengths};

use super::{BsdfSample, DeltaLobes, MaterialModel, Microfacet, ScatteringModel, fresnel};

/// A smooth metal, which needs no preparation.
pub type ConductorMaterial = ConductorDesc;

impl MaterialModel for ConductorMaterial {
    type Bsdf = Conductor;

    #[inline]
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> Conductor {
        let reflectance = self.specular_reflectance.sample(at, lambda);
        Conductor::new(self.eta.sample(lambda), self.k.sample(lambda), reflectance)
    }
}

/// A mirror with the Fresnel reflectance of a metal.
#[derive(Clone, Copy, Debug)]
pub struct Conductor {
    eta: SampledSpectrum,
    k: SampledSpectrum,
    reflectance: SampledSpectrum,
}

impl Conductor {
    /// Complex index `eta + i k` relative to the outside, and a factor on the reflection.
    #[inline]
    pub fn new(eta: SampledSpectrum, k: SampledSpectrum, reflectance: SampledSpectrum) -> Self {
        Self { eta, k, reflectance }
    }

    /// The Fresnel reflectance times the colour, at a cosine in [0, 1].
    #[inline]
    fn reflected(&self, cos: f32) -> SampledSpectrum {
        SampledSpectrum(fresnel::conductor(cos, self.eta.0, self.k.0)) * self.reflectance
    }
}

impl ScatteringModel for Conductor {
    /// The mirror direction; always delta.
    #[inline]
    fn sample(&self, wo: Vec3, _: [f32; 2], _: f32) -> Option<BsdfSample> {
        (wo.z > 0.0).then(|| BsdfSample::mirror(wo, self.reflected(wo.z.min(1.0)), 1.0))
    }

    #[inline]
    fn is_delta(&self) -> bool {
        true
    }

    #[inline]
    fn delta_lobes(&self, wo: Vec3) -> DeltaLobes {
        [self.sample(wo, [0.5; 2], 0.0), None]
    }
}

/// A rough metal.
#[derive(Clone, Debug)]
pub struct RoughConductorMaterial {
    /// The metal as it would be without facets.
    smooth: ConductorMaterial,
    microfacet: Microfacet,
    /// Its roughness, where that varies.
    alpha: Option<Box<AlphaTexture>>,
}

impl From<RoughConductorDesc> for RoughConductorMaterial {
    fn from(desc: RoughConductorDesc) -> Self {
        let RoughConductorDesc { eta, k, specular_reflectance, roughness, alpha } = desc;
        let smooth = ConductorMaterial { eta, k, specular_reflectance };
        Self { smooth, microfacet: Microfacet::new(roughness), alpha }
    }
}

impl MaterialModel for RoughConductorMaterial {
    type Bsdf = RoughConductor;

    #[inline]
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> RoughConductor {
        RoughConductor::new(
            self.smooth.bsdf(at, lambda),
            &self.microfacet.textured(self.alpha.as_deref(), at),
        )
    }
}

/// A microfacet reflector with the Fresnel reflectance of a metal (Torrance and Sparrow 1967; Walter et al.,
/// *Microfacet Models for Refraction through Rough Surfaces*, EGSR 2007, eq. 20).
#[derive(Clone, Copy, Debug)]
pub struct RoughConductor {
    smooth: Conductor,
    microfacet: Microfacet,
}

impl RoughConductor {
    /// The metal of `smooth` with these facets.
    #[inline]
    pub fn new(smooth: Conductor, microfacet: &Microfacet) -> Self {
        Self { smooth, microfacet: *microfacet }
    }

    #[inline]
    fn density(&self, wo: Vec3, m: Vec3) -> f32 {
        self.microfacet.d(m) / (4.0 * self.microfacet.cross_section(wo))
    }
}

impl ScatteringModel for RoughConductor {
    /// `F D G₁G₁ / (4 cos θₒ)`, and the density D / (4 σ(wo)).
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        let half = wo + wi;
        if !self.microfacet.resolves(half) {
            return None;
        }
        let length = half.length();
        let density = self.density(wo, half * (1.0 / length));
        // As a product of the normal and a direction it would have lost its digits where both directions graze.
        let cos = (0.5 * length).min(1.0);
        let value = self.smooth.reflected(cos) * (density * self.microfacet.g1(wi));
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
        let weight = self.smooth.reflected(cos.clamp(0.0, 1.0)) * self.microfacet.g1(wi);
        Some(match self.microfacet.resolves(wo + wi) {
            true => BsdfSample::reflection(wi, weight, pdf),
            false => BsdfSample::delta(wi, weight, 1.0),
        })
    }

    #[inline]
    fn is_glossy(&self) -> bool {
        true
    }
}
