//! What a path asks of a material at a point. Integrators are generic over it, so that the code for a scene of matt surfaces holds
//! nothing of mirrors, glass and rough metal.
//!
//! Paths per second as planned against those with everything, same program, 95 % over random orders of its functions
//! (`tools/bench effects`), and instructions per path:
//!
//! | scene | code for | path tracing | | bidirectional |
//! |---|---|---|---|---|
//! | Cornell box | [`Diffuse`] | 1.069 [1.064, 1.073] | 28 800, not 30 900 | 1.097 [1.074, 1.121] |
//! | lit from a cove | [`Diffuse`] | | | 1.064 [1.035, 1.094] |
//! | with mirror and glass balls | [`Smooth`](super::Smooth) | 1.056 [1.048, 1.064] | 32 200, not 33 100 | 1.033 [1.024, 1.041] |

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::material::Material;
use crate::tracer::wavelength_mis::Parted;

use super::{Bsdf, Diffuse};

/// A direction chosen by a material.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// The direction, local.
    pub wi: Vec3,
    /// f·|cos θᵢ| / pdf per lane.
    pub weight: SampledSpectrum,
    /// Density of the choice; of a `delta` the probability that it was chosen.
    pub pdf: PdfW,
    /// The direction was the only possible one.
    pub delta: bool,
    /// The direction went through the surface.
    pub transmitted: bool,
    /// The direction is right for the hero wavelength only: [`Bsdf::refract`] knows those of the others.
    pub hero_only: bool,
    /// (nᵢ/nₒ)² for transmission, else 1: undoes the radiance scaling where roulette looks at throughput.
    pub eta2: f32,
}

/// A material at one point and at the wavelengths of one path; every method as [`Bsdf`] has it.
pub trait Scattering: Copy {
    /// The material at the wavelengths of a path. One that this type does not know sends nothing back.
    fn of(material: &Material, lambda: &SampledWavelengths) -> Self;

    /// [`Bsdf::eval`].
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)>;

    /// [`Bsdf::sample`].
    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample>;

    /// The material, where it is diffuse and nothing else.
    fn as_diffuse(&self) -> Option<&Diffuse>;

    /// [`Bsdf::is_delta`].
    #[inline]
    fn is_delta(&self) -> bool {
        false
    }

    /// [`Bsdf::is_glossy`].
    #[inline]
    fn is_glossy(&self) -> bool {
        false
    }

    /// [`Bsdf::transmits`].
    #[inline]
    fn transmits(&self) -> bool {
        false
    }

    /// [`Bsdf::parts_colors`].
    #[inline]
    fn parts_colors(&self) -> bool {
        false
    }

    /// [`Bsdf::part`].
    #[inline]
    fn part(&self, _wo: Vec3, _wi: Vec3) -> Parted {
        Parted::NOTHING
    }

    /// [`Bsdf::refract`].
    #[inline]
    fn refract(&self, _wo: Vec3, _lane: usize) -> Option<(Vec3, f32)> {
        None
    }
}

/// Everything.
impl Scattering for Bsdf {
    #[inline]
    fn of(material: &Material, lambda: &SampledWavelengths) -> Self {
        material.bsdf(lambda)
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        Bsdf::eval(self, wo, wi)
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        Bsdf::sample(self, wo, u, lobe)
    }

    #[inline]
    fn as_diffuse(&self) -> Option<&Diffuse> {
        match self {
            Bsdf::Diffuse(b) => Some(b),
            _ => None,
        }
    }

    #[inline]
    fn is_delta(&self) -> bool {
        Bsdf::is_delta(self)
    }

    #[inline]
    fn is_glossy(&self) -> bool {
        Bsdf::is_glossy(self)
    }

    #[inline]
    fn transmits(&self) -> bool {
        Bsdf::transmits(self)
    }

    #[inline]
    fn parts_colors(&self) -> bool {
        Bsdf::parts_colors(self)
    }

    #[inline]
    fn part(&self, wo: Vec3, wi: Vec3) -> Parted {
        Bsdf::part(self, wo, wi)
    }

    #[inline]
    fn refract(&self, wo: Vec3, lane: usize) -> Option<(Vec3, f32)> {
        Bsdf::refract(self, wo, lane)
    }
}

/// Matt surfaces only.
impl Scattering for Diffuse {
    #[inline]
    fn of(material: &Material, lambda: &SampledWavelengths) -> Self {
        match material {
            Material::Diffuse { reflectance } => Diffuse::new(reflectance.sample(lambda)),
            _ => Diffuse::new(SampledSpectrum::ZERO),
        }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        Diffuse::eval(self, wo, wi)
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2], _: f32) -> Option<BsdfSample> {
        Diffuse::sample(self, wo, u)
    }

    #[inline]
    fn as_diffuse(&self) -> Option<&Diffuse> {
        Some(self)
    }
}
