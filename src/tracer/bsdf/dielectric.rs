//! A smooth interface between two transparent media, with dispersion.

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::scene::desc::DielectricDesc;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::wavelength_mis;

use super::{BsdfSample, MaterialModel, ScatteringModel, fresnel};

/// A smooth interface, which needs no preparation.
pub type DielectricMaterial = DielectricDesc;

impl MaterialModel for DielectricMaterial {
    type Bsdf = Dielectric;

    #[inline]
    fn bsdf(&self, lambda: &SampledWavelengths) -> Dielectric {
        let factors = [self.specular_reflectance.sample(lambda), self.specular_transmittance.sample(lambda)];
        Dielectric::new([self.int_ior.sample(lambda), self.ext_ior.sample(lambda)], factors)
    }
}

/// A smooth dielectric.
///
/// Reflection is the same direction for every wavelength, refraction is not when the media are dispersive: then
/// each wavelength goes its own way ([`ScatteringModel::refract`]). The lobe is chosen by the mean reflectance of the carried
/// wavelengths, whichever is the hero, and each lane gets its own reflectance over that mean: the single-sample
/// estimator with the balance heuristic over wavelengths (Wilkie et al., *Hero Wavelength Spectral Sampling*, 2014, §3).
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    /// Index behind over index in front, per lane.
    eta: Vec4,
    reflection: SampledSpectrum,
    transmission: SampledSpectrum,
    parts_colors: bool,
}

impl Dielectric {
    /// `eta` = [behind, in front]; `factors` = [reflection, transmission].
    #[inline]
    pub fn new(eta: [SampledSpectrum; 2], factors: [SampledSpectrum; 2]) -> Self {
        let eta = eta[0].0 / eta[1].0;
        let [reflection, transmission] = factors;
        Self { eta, reflection, transmission, parts_colors: wavelength_mis::part(eta) }
    }

    /// Index of the far side over that of the side of `wo`.
    #[inline]
    fn eta_from(&self, wo: Vec3) -> Vec4 {
        if wo.z >= 0.0 { self.eta } else { 1.0 / self.eta }
    }
}

impl ScatteringModel for Dielectric {
    /// Reflects or refracts; always delta. Where the hero alone is totally reflected, a refraction has its lane black
    /// and no direction of its own: straight through.
    #[inline]
    fn sample(&self, wo: Vec3, _: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let eta = self.eta_from(wo);
        let cos = wo.z.abs().min(1.0);
        let r = fresnel::dielectric(cos, eta);
        let q = r.element_sum() * 0.25;
        if lobe < q {
            let weight = SampledSpectrum(r / q) * self.reflection;
            let wi = Vec3::new(-wo.x, -wo.y, wo.z);
            return Some(BsdfSample { delta: true, ..BsdfSample::reflection(wi, weight, PdfW(q)) });
        }
        let hero_only = self.parts_colors;
        let wi = match refract(wo, eta.x) {
            Some(wi) => wi,
            None if hero_only => -wo,
            None => return None,
        };
        let (pdf, eta2) = (PdfW(1.0 - q), eta * eta);
        let weight = SampledSpectrum((1.0 - r) / ((1.0 - q) * eta2)) * self.transmission;
        Some(BsdfSample { wi, weight, pdf, delta: true, transmitted: true, hero_only, eta2: eta2.x })
    }

    #[inline]
    fn is_delta(&self) -> bool {
        true
    }

    #[inline]
    fn parts_colors(&self) -> bool {
        self.parts_colors
    }

    #[inline]
    fn refract(&self, wo: Vec3, lane: usize) -> Option<(Vec3, f32)> {
        let eta = self.eta_from(wo)[lane];
        Some((refract(wo, eta)?, eta * eta))
    }
}

/// Snell's law: `eta` = index of the far side over that of the near side. `None` on total reflection.
/// Straight through, to the bit, for `eta` = 1.
#[inline]
fn refract(wo: Vec3, eta: f32) -> Option<Vec3> {
    if eta == 1.0 {
        return Some(-wo);
    }
    let sin2_t = ((1.0 - wo.z) * (1.0 + wo.z)).max(0.0) / (eta * eta);
    if sin2_t >= 1.0 {
        return None;
    }
    let (inverse, z) = (1.0 / eta, (1.0 - sin2_t).sqrt());
    Some(Vec3::new(-wo.x * inverse, -wo.y * inverse, -z.copysign(wo.z)).normalize())
}
