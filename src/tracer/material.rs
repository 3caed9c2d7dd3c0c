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

/// A smooth interface; `ior` inside and outside, `factors` on reflection and transmission.
#[inline]
pub(super) fn dielectric(ior: [&Ior; 2], factors: &[Spectrum; 2], lambda: &SampledWavelengths) -> Dielectric {
    let factors = [factors[0].sample(lambda), factors[1].sample(lambda)];
    Dielectric::new(ior.map(|ior| ior.sample(lambda)), factors)
}

/// A smooth metal.
#[inline]
pub(super) fn conductor(
    [eta, k]: [&Spectrum; 2],
    reflectance: &Spectrum,
    lambda: &SampledWavelengths,
) -> Conductor {
    Conductor::new(eta.sample(lambda), k.sample(lambda), reflectance.sample(lambda))
}

/// A smooth coat over a diffuse base; `ior` of the coat and of the outside.
#[inline]
pub(super) fn plastic(
    ior: &[Ior; 2],
    (coat, base, internal): (&Spectrum, &Spectrum, &Spectrum),
    nonlinear: bool,
    lambda: &SampledWavelengths,
) -> Plastic {
    let eta = [ior[0].sample(lambda), ior[1].sample(lambda)];
    let base = Base { albedo: base.sample(lambda), internal: internal.sample(lambda), nonlinear };
    Plastic::new(eta, coat.sample(lambda), base, lambda.is_hero_only())
}

impl Material {
    /// The material at the wavelengths of a path.
    #[inline]
    pub fn bsdf(&self, lambda: &SampledWavelengths) -> Bsdf {
        match self {
            Material::Diffuse { reflectance } => Bsdf::Diffuse(Diffuse::new(reflectance.sample(lambda))),
            Material::Dielectric { int_ior, ext_ior, factors } => {
                Bsdf::Dielectric(dielectric([int_ior, ext_ior], factors, lambda))
            }
            Material::Conductor { eta, k, reflectance } => {
                Bsdf::Conductor(conductor([eta, k], reflectance, lambda))
            }
            Material::RoughConductor { index, reflectance, microfacet } => {
                let index = [index[0].sample(lambda), index[1].sample(lambda)];
                Bsdf::RoughConductor(RoughConductor::new(index, reflectance.sample(lambda), microfacet))
            }
            Material::RoughDielectric { int_ior, ext_ior, factors, microfacet } => {
                let eta = [int_ior.sample(lambda), ext_ior.sample(lambda)];
                let both = [factors[0].sample(lambda), factors[1].sample(lambda)];
                match RoughDielectric::new(eta, both, microfacet) {
                    Some(rough) => Bsdf::RoughDielectric(rough),
                    None => Bsdf::Dielectric(dielectric([int_ior, ext_ior], factors, lambda)),
                }
            }
            Material::Plastic { ior, coat, base, internal, nonlinear } => {
                Bsdf::Plastic(plastic(ior, (coat, base, internal), *nonlinear, lambda))
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
