//! A thin pane, which light passes without being bent.

use glam::{Vec3, Vec4};

use crate::scene::desc::ThinDielectricDesc;
use crate::scene::desc::texture::TexturePoint;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};

use super::scattering::lobe_probability;
use super::{BsdfSample, DeltaLobes, MaterialModel, ScatteringModel, fresnel};

/// A thin pane, which needs no preparation.
pub type ThinDielectricMaterial = ThinDielectricDesc;

impl MaterialModel for ThinDielectricMaterial {
    type Bsdf = ThinDielectric;

    #[inline]
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> ThinDielectric {
        let factors =
            [self.specular_reflectance.sample(at, lambda), self.specular_transmittance.sample(at, lambda)];
        ThinDielectric::new([self.int_ior.sample(lambda), self.ext_ior.sample(lambda)], factors)
    }
}

/// A thin pane. What enters it goes to and fro until it leaves on either side; all of it counts at once. The index may depend on the
/// wavelength: reflectances do then, but directions do not.
#[derive(Clone, Copy, Debug)]
pub struct ThinDielectric {
    /// Index of the pane over that around it, per lane.
    eta: Vec4,
    reflection: SampledSpectrum,
    transmission: SampledSpectrum,
}

impl ThinDielectric {
    /// `eta` = [pane, around]; `factors` = [reflection, transmission].
    #[inline]
    pub fn new(eta: [SampledSpectrum; 2], factors: [SampledSpectrum; 2]) -> Self {
        let [reflection, transmission] = factors;
        Self { eta: eta[0].0 / eta[1].0, reflection, transmission }
    }

    /// r + t r t + t r r r t + … with t = 1 − r.
    #[inline]
    fn reflectance(&self, wo: Vec3) -> Vec4 {
        let once = fresnel::dielectric(wo.z.abs().min(1.0), self.eta);
        2.0 * once / (1.0 + once)
    }

    /// The sample of straight transmission, sampled with this probability, where the reflectance is `r`.
    #[inline]
    fn passing(&self, wo: Vec3, r: Vec4, probability: f32) -> BsdfSample {
        let weight = SampledSpectrum((1.0 - r) / probability) * self.transmission;
        BsdfSample { transmitted: true, ..BsdfSample::delta(-wo, weight, probability) }
    }
}

impl ScatteringModel for ThinDielectric {
    /// The mirror direction or straight through; always delta.
    #[inline]
    fn sample(&self, wo: Vec3, _: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let r = self.reflectance(wo);
        let q = lobe_probability(r.element_sum() * 0.25);
        if lobe < q {
            return Some(BsdfSample::mirror(wo, SampledSpectrum(r / q) * self.reflection, q));
        }
        (q < 1.0).then(|| self.passing(wo, r, 1.0 - q))
    }

    #[inline]
    fn is_delta(&self) -> bool {
        true
    }

    #[inline]
    fn delta_lobes(&self, wo: Vec3) -> DeltaLobes {
        let r = self.reflectance(wo);
        let mirrored = BsdfSample::mirror(wo, SampledSpectrum(r) * self.reflection, 1.0);
        [Some(mirrored), (r.element_sum() < 4.0).then(|| self.passing(wo, r, 1.0))]
    }
}
