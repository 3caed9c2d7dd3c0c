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

#[cfg(test)]
mod tests {
    use super::*;

    fn glass(eta: [f32; 4]) -> Dielectric {
        let one = SampledSpectrum::ONE;
        Dielectric::new([SampledSpectrum(Vec4::from_array(eta)), one], [one, one])
    }

    /// R + T = 1: the expected weight over the lobe number, radiance scaling undone, from both sides.
    #[test]
    fn nothing_is_lost() {
        for cos in [1.0f32, 0.9, 0.5, 0.1, 1e-4, -1.0, -0.8, -0.3, -1e-4] {
            let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
            let (mut sum, n) = (Vec4::ZERO, 4096);
            for i in 0..n {
                let s = glass([1.5; 4])
                    .sample(wo, [0.5; 2], (i as f32 + 0.5) / n as f32)
                    .expect("always samples");
                assert!((s.wi.length() - 1.0).abs() < 1e-6);
                sum += s.weight.0 * s.eta2 / n as f32;
            }
            assert!((sum - 1.0).abs().max_element() < 1e-3, "cos {cos}: {sum}");
        }
    }

    /// With dispersion each lane alone must still be conserved, also where some are totally reflected: at 0.755 only the
    /// first is not, at 0.79 all but the last, at 0.78 the third and fourth.
    #[test]
    fn dispersion_conserves_every_lane() {
        let eta = Vec4::new(1.50, 1.52, 1.55, 1.60);
        for cos in [0.6f32, 0.1, -0.9, -0.79, -0.78, -0.77, -0.755, -0.75, -0.3] {
            for turn in 0..4 {
                let lanes: [f32; 4] = std::array::from_fn(|i| eta[(i + turn) % 4]);
                let (g, wo) = (glass(lanes), Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos));
                let (mut reflected, mut sum, n) = (Vec4::ZERO, Vec4::ZERO, 16_384);
                for i in 0..n {
                    let Some(s) = g.sample(wo, [0.5; 2], (i as f32 + 0.5) / n as f32) else { continue };
                    if !s.transmitted {
                        assert!(!s.hero_only);
                        reflected += s.weight.0 / n as f32;
                        sum += s.weight.0 / n as f32;
                        continue;
                    }
                    assert!(s.hero_only && s.wi.is_finite() && s.weight.is_finite());
                    for lane in 0..4 {
                        let relative = if cos > 0.0 { lanes[lane] } else { 1.0 / lanes[lane] };
                        let Some((wi, eta2)) = g.refract(wo, lane) else {
                            assert_eq!(s.weight.0[lane], 0.0, "totally reflected");
                            continue;
                        };
                        assert!((wi.x * relative + wo.x).abs() < 1e-6 && wi.z * wo.z <= 0.0, "Snell");
                        sum[lane] += s.weight.0[lane] * eta2 / n as f32;
                    }
                }
                let relative = if cos > 0.0 { Vec4::from(lanes) } else { 1.0 / Vec4::from(lanes) };
                let expected = fresnel::dielectric(cos.abs(), relative);
                assert!((reflected - expected).abs().max_element() < 1e-4, "{cos}: {reflected} {expected}");
                // One number of 16384 in the other lobe moves a weight of 4 at most.
                assert!((sum - 1.0).abs().max_element() < 4e-4, "{cos} {turn}: {sum}");
            }
        }
    }

    #[test]
    fn equal_media_let_everything_straight_through() {
        let wo = Vec3::new(0.6, 0.0, 0.8);
        for lobe in [0.0, 0.5, 0.999_999_94] {
            let s = glass([1.0; 4]).sample(wo, [0.5; 2], lobe).expect("always samples");
            assert_eq!((s.wi, s.weight.0), (-wo, Vec4::ONE));
        }
    }
}
