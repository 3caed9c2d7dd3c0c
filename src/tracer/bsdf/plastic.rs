//! A diffuse base under a smooth transparent coat, one-sided: black from behind.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::scene::desc::PlasticDesc;
use crate::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum, dispersion::Ior};

use super::{BsdfSample, MaterialModel, ScatteringModel, fresnel};

/// A diffuse base under a smooth coat.
#[derive(Clone, Debug)]
pub struct PlasticMaterial {
    desc: PlasticDesc,
    /// Reflectance of the coat from within for diffuse light.
    internal: Spectrum,
}

impl From<PlasticDesc> for PlasticMaterial {
    fn from(desc: PlasticDesc) -> Self {
        Self { internal: internal_reflectance(&desc.int_ior, &desc.ext_ior), desc }
    }
}

impl MaterialModel for PlasticMaterial {
    type Bsdf = Plastic;

    #[inline]
    fn bsdf(&self, lambda: &SampledWavelengths) -> Plastic {
        let desc = &self.desc;
        let eta = [desc.int_ior.sample(lambda), desc.ext_ior.sample(lambda)];
        let albedo = desc.diffuse_reflectance.sample(lambda);
        let base = Base { albedo, internal: self.internal.sample(lambda), nonlinear: desc.nonlinear };
        Plastic::new(eta, desc.specular_reflectance.sample(lambda), base, lambda.is_hero_only())
    }
}

/// Reflectance of the coat from within for diffuse light; a table over wavelengths where a medium disperses.
fn internal_reflectance(int_ior: &Ior, ext_ior: &Ior) -> Spectrum {
    let at = |nm: f32| {
        let lambda = Vec4::splat(nm);
        fresnel::diffuse_within(int_ior.eval(lambda).x / ext_ior.eval(lambda).x)
    };
    let constant = Spectrum::Constant(at(550.0));
    if !int_ior.is_dispersive() && !ext_ior.is_dispersive() {
        return constant;
    }
    let points: Vec<(f32, f32)> = (0..=50).map(|i| 350.0 + 10.0 * i as f32).map(|nm| (nm, at(nm))).collect();
    Spectrum::table(&points).unwrap_or(constant)
}

/// A smooth coat over Lambert, with the light that the coat sends back to the base; the model of Mitsuba 3's `plastic`.
///
/// Both a delta and a diffuse material: `eval` is the diffuse base alone, and its density counts that the
/// base was chosen; a sample of the coat is delta.
#[derive(Clone, Copy, Debug)]
pub struct Plastic {
    /// Index of the coat over that of the outside, per lane.
    eta: Vec4,
    coat: SampledSpectrum,
    /// Albedo of the base, with internal scattering and 1/η².
    base: SampledSpectrum,
    /// Share of the coat in what can be reflected.
    coat_share: f32,
    hero_only: bool,
}

/// The diffuse base under a coat, and the scattering between the two.
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

    #[inline]
    fn fresnel(&self, w: Vec3) -> Vec4 {
        fresnel::dielectric(w.z.min(1.0), self.eta)
    }

    /// Probability of choosing the coat; `None` when nothing is reflected at all.
    #[inline]
    fn coat_probability(&self, f_o: Vec4) -> Option<f32> {
        let f = if self.hero_only { f_o.x } else { f_o.element_sum() * 0.25 };
        let (coat, base) = (f * self.coat_share, (1.0 - f) * (1.0 - self.coat_share));
        (coat + base > 0.0).then(|| coat / (coat + base))
    }
}

impl ScatteringModel for Plastic {
    /// The base: `albedo / (1 − internal) · (1 − Fₒ)(1 − Fᵢ) cos θᵢ / (π η²)`.
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
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
    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let f_o = self.fresnel(wo);
        let p = self.coat_probability(f_o)?;
        if lobe < p {
            let wi = Vec3::new(-wo.x, -wo.y, wo.z);
            let weight = SampledSpectrum(f_o / p) * self.coat;
            return Some(BsdfSample { delta: true, ..BsdfSample::reflection(wi, weight, PdfW(p)) });
        }
        let wi = warp::cosine_hemisphere(u);
        let pdf = PdfW((1.0 - p) * warp::cosine_hemisphere_pdf(wi.z));
        let weight = self.base * SampledSpectrum((1.0 - f_o) * (1.0 - self.fresnel(wi)) / (1.0 - p));
        Some(BsdfSample::reflection(wi, weight, pdf))
    }

    #[inline]
    fn has_diffuse_part(&self) -> bool {
        true
    }
}

/// The part of `coat` in the sum of both, as the carried wavelengths see it; 1 when both are black.
#[inline]
pub(super) fn share(coat: SampledSpectrum, base: SampledSpectrum, hero_only: bool) -> f32 {
    let mean = |s: SampledSpectrum| if hero_only { s.0.x } else { s.mean() };
    let (coat, base) = (mean(coat), mean(base));
    if base > 0.0 { coat / (coat + base) } else { 1.0 }
}
