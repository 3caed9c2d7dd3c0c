//! Materials: what a surface is made of, before the wavelengths of a path are known.

use crate::spectrum::{SampledWavelengths, Spectrum, dispersion::Ior};

use super::bsdf::{Bsdf, Conductor, Dielectric, Diffuse};

/// A one-sided material. Two-sidedness is a pair of these per surface, see [`Sides`](super::bsdf::Sides).
#[derive(Clone, Debug)]
pub enum Material {
    /// Lambert.
    Diffuse {
        /// Albedo.
        reflectance: Spectrum,
    },
    /// Smooth interface.
    Dielectric {
        /// Index behind the surface.
        int_ior: Ior,
        /// Index in front of it.
        ext_ior: Ior,
        /// Factors on reflection and transmission.
        factors: [Spectrum; 2],
    },
    /// Smooth metal.
    Conductor {
        /// Real part of the index.
        eta: Spectrum,
        /// Imaginary part.
        k: Spectrum,
        /// Factor on reflection.
        reflectance: Spectrum,
    },
}

impl Material {
    /// The material at the wavelengths of a path.
    #[inline]
    pub fn bsdf(&self, lambda: &SampledWavelengths) -> Bsdf {
        match self {
            Material::Diffuse { reflectance } => Bsdf::Diffuse(Diffuse::new(reflectance.sample(lambda))),
            Material::Dielectric { int_ior, ext_ior, factors } => {
                let dispersive = int_ior.is_dispersive() || ext_ior.is_dispersive();
                let eta = [int_ior.sample(lambda), ext_ior.sample(lambda)];
                let factors = [factors[0].sample(lambda), factors[1].sample(lambda)];
                Bsdf::Dielectric(Dielectric::new(eta, factors, (dispersive, lambda.is_hero_only())))
            }
            Material::Conductor { eta, k, reflectance } => Bsdf::Conductor(Conductor::new(
                eta.sample(lambda),
                k.sample(lambda),
                reflectance.sample(lambda),
            )),
        }
    }
}
