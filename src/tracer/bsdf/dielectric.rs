//! A smooth interface between two transparent media, with dispersion.

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::spectrum::SampledSpectrum;

use super::{BsdfSample, fresnel};

/// A smooth dielectric.
///
/// Reflection is the same direction for every wavelength, refraction is not when the media are dispersive: then
/// only the hero wavelength goes on. The lobe is chosen by the mean reflectance of the carried wavelengths, and
/// each lane gets its own reflectance over that mean: the single-sample estimator with the balance heuristic
/// over wavelengths (Wilkie et al., *Hero Wavelength Spectral Sampling*, 2014, §3).
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    /// Index behind over index in front, per lane.
    eta: Vec4,
    reflection: SampledSpectrum,
    transmission: SampledSpectrum,
    dispersive: bool,
    hero_only: bool,
}

impl Dielectric {
    /// `eta` = [behind, in front]; `factors` = [reflection, transmission]; `flags` = (the media disperse, only
    /// the hero wavelength is carried).
    #[inline]
    pub fn new(eta: [SampledSpectrum; 2], factors: [SampledSpectrum; 2], flags: (bool, bool)) -> Self {
        let (dispersive, hero_only) = flags;
        Self {
            eta: eta[0].0 / eta[1].0,
            reflection: factors[0],
            transmission: factors[1],
            dispersive,
            hero_only,
        }
    }

    /// Reflects or refracts; always delta.
    #[inline]
    pub fn sample(&self, wo: Vec3, lobe: f32) -> Option<BsdfSample> {
        let eta = if wo.z >= 0.0 { self.eta } else { 1.0 / self.eta };
        let cos = wo.z.abs().min(1.0);
        let r = fresnel::dielectric(cos, eta);
        let q = if self.hero_only { r.x } else { r.element_sum() * 0.25 };
        let delta = true;
        if lobe < q {
            let pdf = PdfW(q);
            let weight = SampledSpectrum(r / q) * self.reflection;
            let (transmitted, hero_only) = (false, false);
            let wi = Vec3::new(-wo.x, -wo.y, wo.z);
            return Some(BsdfSample { wi, weight, pdf, delta, transmitted, hero_only, eta2: 1.0 });
        }
        // Hero lane; without dispersion every lane is like it.
        let hero = eta.x;
        let wi = refract(wo, hero)?;
        let scale = 1.0 / (hero * hero);
        let weight = SampledSpectrum((1.0 - r) / (1.0 - q)) * self.transmission * scale;
        let hero_only = self.dispersive && !self.hero_only;
        let pdf = PdfW(1.0 - q);
        Some(BsdfSample { wi, weight, pdf, delta, transmitted: true, hero_only, eta2: 1.0 / scale })
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

    fn glass(eta: [f32; 4], dispersive: bool) -> Dielectric {
        let one = SampledSpectrum::ONE;
        Dielectric::new([SampledSpectrum(Vec4::from_array(eta)), one], [one, one], (dispersive, false))
    }

    /// R + T = 1: the expected weight over the lobe number, radiance scaling undone, from both sides.
    #[test]
    fn nothing_is_lost() {
        for cos in [1.0f32, 0.9, 0.5, 0.1, 1e-4, -1.0, -0.8, -0.3, -1e-4] {
            let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
            let (mut sum, n) = (Vec4::ZERO, 4096);
            for i in 0..n {
                let s =
                    glass([1.5; 4], false).sample(wo, (i as f32 + 0.5) / n as f32).expect("always samples");
                assert!((s.wi.length() - 1.0).abs() < 1e-6);
                sum += s.weight.0 * s.eta2 / n as f32;
            }
            assert!((sum - 1.0).abs().max_element() < 1e-3, "cos {cos}: {sum}");
        }
    }

    /// With dispersion each lane alone must still be conserved: reflected by all, transmitted by the hero.
    #[test]
    fn dispersion_conserves_the_hero_and_reflects_every_lane() {
        let g = glass([1.50, 1.52, 1.55, 1.60], true);
        let wo = Vec3::new(0.8, 0.0, 0.6);
        let (mut reflected, mut transmitted, n) = (Vec4::ZERO, 0f32, 16_384);
        for i in 0..n {
            let s = g.sample(wo, (i as f32 + 0.5) / n as f32).expect("always samples");
            if s.transmitted {
                assert!(s.hero_only);
                assert!((s.wi.x.abs() - 0.8 / 1.5).abs() < 1e-6, "Snell");
                transmitted += s.weight.0.x * s.eta2 / n as f32;
            } else {
                reflected += s.weight.0 / n as f32;
            }
        }
        let expected = fresnel::dielectric(0.6, Vec4::new(1.50, 1.52, 1.55, 1.60));
        assert!((reflected - expected).abs().max_element() < 1e-4, "{reflected} {expected}");
        assert!((transmitted - (1.0 - expected.x)).abs() < 1e-4);
    }

    #[test]
    fn equal_media_let_everything_straight_through() {
        let wo = Vec3::new(0.6, 0.0, 0.8);
        for lobe in [0.0, 0.5, 0.999_999_94] {
            let s = glass([1.0; 4], false).sample(wo, lobe).expect("always samples");
            assert_eq!((s.wi, s.weight.0), (-wo, Vec4::ONE));
        }
    }
}
