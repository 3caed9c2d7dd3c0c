//! Scattering at a surface point, at the wavelengths of one path.
//!
//! Conventions: directions are unit vectors in the local shading space, z the front; `wo` points to where the
//! path came from, `wi` to where it goes on, both away from the surface. Values **include the cosine** of `wi`:
//! [`Bsdf::eval`] is f·|cos θᵢ|, the weight of a sample is f·|cos θᵢ| / pdf. Radiance is carried from light to
//! eye, so that transmission scales by (nₒ/nᵢ)². Delta materials evaluate to nothing and can only be sampled; a material with
//! a delta and another part evaluates to the other, with the density that it is chosen and sampled. `None`: the path ends.

pub mod coat;
mod conductor;
mod dielectric;
mod diffuse;
pub mod fresnel;
pub mod microfacet;
mod plastic;
mod rough_conductor;
mod rough_dielectric;
mod rough_plastic;
mod scattering;
mod smooth;
mod twosided;

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::spectrum::SampledSpectrum;
use crate::tracer::wavelength_mis::Parted;

pub use coat::Transmittance;
pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use microfacet::Microfacet;
pub use plastic::{Base, Plastic};
pub use rough_conductor::RoughConductor;
pub use rough_dielectric::RoughDielectric;
pub use rough_plastic::{Coat, RoughPlastic};
pub use scattering::{BsdfSample, Scattering};
pub use smooth::Smooth;
pub use twosided::Sides;

/// A material at one point and at the wavelengths of one path.
#[derive(Clone, Copy, Debug)]
pub enum Bsdf {
    /// Lambert.
    Diffuse(Diffuse),
    /// Smooth interface.
    Dielectric(Dielectric),
    /// Smooth metal.
    Conductor(Conductor),
    /// Rough metal.
    RoughConductor(RoughConductor),
    /// Rough interface.
    RoughDielectric(RoughDielectric),
    /// Smooth coat over a diffuse base.
    Plastic(Plastic),
    /// Rough coat over a diffuse base.
    RoughPlastic(RoughPlastic),
}

impl Bsdf {
    /// f·|cos θᵢ| and the density with which [`Bsdf::sample`] chooses `wi`; `None` where that is zero.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        match self {
            Bsdf::Diffuse(b) => b.eval(wo, wi),
            Bsdf::Dielectric(_) | Bsdf::Conductor(_) => None,
            Bsdf::RoughConductor(b) => b.eval(wo, wi),
            Bsdf::RoughDielectric(b) => b.eval(wo, wi),
            Bsdf::Plastic(b) => b.eval(wo, wi),
            Bsdf::RoughPlastic(b) => b.eval(wo, wi),
        }
    }

    /// Chooses a direction with the numbers `u` (direction) and `lobe`.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        match self {
            Bsdf::Diffuse(b) => b.sample(wo, u),
            Bsdf::Dielectric(b) => b.sample(wo, lobe),
            Bsdf::Conductor(b) => b.sample(wo),
            Bsdf::RoughConductor(b) => b.sample(wo, u),
            Bsdf::RoughDielectric(b) => b.sample(wo, u, lobe),
            Bsdf::Plastic(b) => b.sample(wo, u, lobe),
            Bsdf::RoughPlastic(b) => b.sample(wo, u, lobe),
        }
    }

    /// True when [`Bsdf::eval`] has a peak: which light matters depends on it.
    #[inline]
    pub fn is_glossy(&self) -> bool {
        matches!(self, Bsdf::RoughConductor(_) | Bsdf::RoughDielectric(_) | Bsdf::RoughPlastic(_))
    }

    /// True when [`Bsdf::eval`] may be something for directions on opposite sides.
    #[inline]
    pub fn transmits(&self) -> bool {
        matches!(self, Bsdf::RoughDielectric(_))
    }

    /// True when refraction is in another direction for each lane.
    #[inline]
    pub fn parts_colors(&self) -> bool {
        match self {
            Bsdf::Dielectric(b) => b.parts_colors(),
            Bsdf::RoughDielectric(b) => b.parts_colors(),
            _ => false,
        }
    }

    /// How the lanes share what [`Bsdf::eval`] and [`Bsdf::sample`] give where colours part and it is no delta.
    #[inline]
    pub fn part(&self, wo: Vec3, wi: Vec3) -> Parted {
        match self {
            Bsdf::RoughDielectric(b) => b.part(wo, wi),
            _ => Parted::NOTHING,
        }
    }

    /// Where a delta refracts `lane` to, and its (nᵢ/nₒ)²; `None` on total reflection.
    #[inline]
    pub fn refract(&self, wo: Vec3, lane: usize) -> Option<(Vec3, f32)> {
        match self {
            Bsdf::Dielectric(b) => b.refract(wo, lane),
            _ => None,
        }
    }

    /// True when [`Bsdf::eval`] is always nothing: no light needs to be sampled.
    #[inline]
    pub fn is_delta(&self) -> bool {
        matches!(self, Bsdf::Dielectric(_) | Bsdf::Conductor(_))
    }
}
