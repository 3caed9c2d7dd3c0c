//! One scattering of a camera path, to be evaluated again at the wavelengths of a photon.

use glam::{Vec3, Vec4};

use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::Scene;
use crate::tracer::bsdf::{Bsdf, BsdfSample};
use crate::tracer::interaction::SurfaceInteraction;
use crate::tracer::material::Material;

/// A lobe number that chooses whatever comes last: transmission.
const LAST: f32 = 1.0 - f32::EPSILON / 2.0;

/// A scattering that has happened.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    hit: SurfaceInteraction,
    wo: Vec3,
    wi: Vec3,
    delta: bool,
    transmitted: bool,
    /// Roulette's factor over the density with which the direction, or the delta, was chosen.
    scale: f32,
}

impl Step {
    /// Scattering at `hit`, from the local direction `wo` into that of `sample`.
    pub fn new(hit: &SurfaceInteraction, wo: Vec3, sample: &BsdfSample) -> Self {
        let BsdfSample { wi, pdf, delta, transmitted, .. } = *sample;
        Self { hit: *hit, wo, wi, delta, transmitted, scale: 1.0 / pdf.0 }
    }

    /// Roulette has let the path go on with this factor.
    pub fn boost(&mut self, factor: f32) {
        self.scale *= factor;
    }

    /// The weight of this scattering at other wavelengths.
    #[inline]
    pub fn weight(&self, scene: &Scene, lambda: &SampledWavelengths) -> SampledSpectrum {
        let (material, _) = scene.material(&self.hit);
        let bsdf = material.bsdf(lambda);
        let value = if self.delta {
            // The same lobe; where these wavelengths never choose it, its value is zero.
            let lobe = if self.transmitted { LAST } else { 0.0 };
            match bsdf.sample(self.wo, [0.5; 2], lobe) {
                Some(s) if s.delta && s.transmitted == self.transmitted => s.weight * s.pdf.0,
                _ => SampledSpectrum::ZERO,
            }
        } else {
            self.value(material, &bsdf, lambda)
        };
        value * self.scale
    }

    /// f·|cos| per lane. Where colours part, values hold a factor of the hero's, so each wavelength is looked at alone.
    #[inline]
    fn value(&self, material: &Material, bsdf: &Bsdf, lambda: &SampledWavelengths) -> SampledSpectrum {
        let at = |bsdf: &Bsdf| bsdf.eval(self.wo, self.wi).map_or(SampledSpectrum::ZERO, |(f, _)| f);
        if !bsdf.parts_colors() {
            return at(bsdf);
        }
        let lane = |i: usize| at(&material.bsdf(&lambda.alone(i))).0[i];
        SampledSpectrum(Vec4::from_array([0, 1, 2, 3].map(lane)))
    }
}
