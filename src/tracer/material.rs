//! Materials: what a surface is made of, before the wavelengths of a path are known.

use crate::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum, dispersion::Ior};

use super::bsdf::{Base, Bsdf, Coat, Conductor, Dielectric, Diffuse};
use super::bsdf::{Microfacet, Plastic, RoughConductor, RoughDielectric, RoughPlastic};

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
    /// Rough metal.
    RoughConductor {
        /// Real and imaginary part of the index.
        index: [Spectrum; 2],
        /// Factor on reflection.
        reflectance: Spectrum,
        /// Its facets.
        microfacet: Microfacet,
    },
    /// Rough interface.
    RoughDielectric {
        /// Index behind the surface.
        int_ior: Ior,
        /// Index in front of it.
        ext_ior: Ior,
        /// Factors on reflection and transmission.
        factors: [Spectrum; 2],
        /// Its facets.
        microfacet: Microfacet,
    },
    /// Smooth coat over a diffuse base.
    Plastic {
        /// Index of the coat and of the outside.
        ior: [Ior; 2],
        /// Factor on the reflection of the coat.
        coat: Spectrum,
        /// Albedo of the base.
        base: Spectrum,
        /// Reflectance of the coat from within for diffuse light.
        internal: Spectrum,
        /// Light is coloured at every reflection between coat and base.
        nonlinear: bool,
    },
    /// Rough coat over a diffuse base.
    RoughPlastic {
        /// The coat.
        coat: Coat,
        /// Factor on its reflection.
        reflectance: Spectrum,
        /// Albedo of the base.
        base: Spectrum,
        /// Reflectance of the coat from within for diffuse light.
        internal: f32,
        /// Light is coloured at every reflection between coat and base.
        nonlinear: bool,
    },
}

impl Material {
    /// The material at the wavelengths of a path.
    #[inline]
    pub fn bsdf(&self, lambda: &SampledWavelengths) -> Bsdf {
        match self {
            Material::Diffuse { reflectance } => Bsdf::Diffuse(Diffuse::new(reflectance.sample(lambda))),
            Material::Dielectric { int_ior, ext_ior, factors } => {
                let eta = [int_ior.sample(lambda), ext_ior.sample(lambda)];
                let factors = [factors[0].sample(lambda), factors[1].sample(lambda)];
                Bsdf::Dielectric(Dielectric::new(eta, factors))
            }
            Material::Conductor { eta, k, reflectance } => Bsdf::Conductor(Conductor::new(
                eta.sample(lambda),
                k.sample(lambda),
                reflectance.sample(lambda),
            )),
            Material::RoughConductor { index, reflectance, microfacet } => {
                let index = [index[0].sample(lambda), index[1].sample(lambda)];
                Bsdf::RoughConductor(RoughConductor::new(index, reflectance.sample(lambda), *microfacet))
            }
            Material::RoughDielectric { int_ior, ext_ior, factors, microfacet } => {
                let eta = [int_ior.sample(lambda), ext_ior.sample(lambda)];
                let factors = [factors[0].sample(lambda), factors[1].sample(lambda)];
                RoughDielectric::new(eta, factors, *microfacet)
                    .map_or_else(|| Bsdf::Dielectric(Dielectric::new(eta, factors)), Bsdf::RoughDielectric)
            }
            Material::Plastic { ior, coat, base, internal, nonlinear } => {
                let eta = [ior[0].sample(lambda), ior[1].sample(lambda)];
                let (albedo, internal) = (base.sample(lambda), internal.sample(lambda));
                let base = Base { albedo, internal, nonlinear: *nonlinear };
                Bsdf::Plastic(Plastic::new(eta, coat.sample(lambda), base, lambda.is_hero_only()))
            }
            Material::RoughPlastic { coat, reflectance, base, internal, nonlinear } => {
                let internal = SampledSpectrum::splat(*internal);
                let base = Base { albedo: base.sample(lambda), internal, nonlinear: *nonlinear };
                let reflectance = reflectance.sample(lambda);
                Bsdf::RoughPlastic(RoughPlastic::new(coat, reflectance, base, lambda.is_hero_only()))
            }
        }
    }
}
