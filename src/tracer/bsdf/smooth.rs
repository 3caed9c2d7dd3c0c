//! Materials without rough parts: what most scenes of mirrors and glass are made of.

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::material::{self, Material};

use super::{BsdfSample, Conductor, Dielectric, Diffuse, Plastic, Scattering};

/// [`Bsdf`](super::Bsdf) without its rough variants.
#[derive(Clone, Copy, Debug)]
pub enum Smooth {
    /// Lambert.
    Diffuse(Diffuse),
    /// Smooth interface.
    Dielectric(Dielectric),
    /// Smooth metal.
    Conductor(Conductor),
    /// Smooth coat over a diffuse base.
    Plastic(Plastic),
}

impl Scattering for Smooth {
    #[inline]
    fn of(material: &Material, lambda: &SampledWavelengths) -> Self {
        match material {
            Material::Diffuse { reflectance } => Smooth::Diffuse(Diffuse::new(reflectance.sample(lambda))),
            Material::Dielectric { int_ior, ext_ior, factors } => {
                Smooth::Dielectric(material::dielectric([int_ior, ext_ior], factors, lambda))
            }
            Material::Conductor { eta, k, reflectance } => {
                Smooth::Conductor(material::conductor([eta, k], reflectance, lambda))
            }
            Material::Plastic { ior, coat, base, internal, nonlinear } => {
                Smooth::Plastic(material::plastic(ior, (coat, base, internal), *nonlinear, lambda))
            }
            _ => Smooth::Diffuse(Diffuse::new(SampledSpectrum::ZERO)),
        }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        match self {
            Smooth::Diffuse(b) => b.eval(wo, wi),
            Smooth::Dielectric(_) | Smooth::Conductor(_) => None,
            Smooth::Plastic(b) => b.eval(wo, wi),
        }
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        match self {
            Smooth::Diffuse(b) => b.sample(wo, u),
            Smooth::Dielectric(b) => b.sample(wo, lobe),
            Smooth::Conductor(b) => b.sample(wo),
            Smooth::Plastic(b) => b.sample(wo, u, lobe),
        }
    }

    #[inline]
    fn as_diffuse(&self) -> Option<&Diffuse> {
        match self {
            Smooth::Diffuse(b) => Some(b),
            _ => None,
        }
    }

    #[inline]
    fn is_delta(&self) -> bool {
        matches!(self, Smooth::Dielectric(_) | Smooth::Conductor(_))
    }

    #[inline]
    fn parts_colors(&self) -> bool {
        match self {
            Smooth::Dielectric(b) => b.parts_colors(),
            _ => false,
        }
    }

    #[inline]
    fn refract(&self, wo: Vec3, lane: usize) -> Option<(Vec3, f32)> {
        match self {
            Smooth::Dielectric(b) => b.refract(wo, lane),
            _ => None,
        }
    }
}
