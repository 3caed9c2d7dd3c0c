//! Materials: what a surface is made of, before the wavelengths of a path are known.

use crate::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum, dispersion::Ior};

use super::bsdf::{Base, Bsdf, Coat, Conductor, Dielectric, Diffuse};
use super::bsdf::{Microfacet, Plastic, RoughConductor, RoughDielectric, RoughPlastic};
use super::features::built::{IfDeltas, IfGlossy, IfTransmission, if_deltas, if_glossy, if_transmission};

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
        int_ior: IfDeltas<IfTransmission<Ior>>,
        /// Index in front of it.
        ext_ior: Ior,
        /// Factors on reflection and transmission.
        factors: [Spectrum; 2],
    },
    /// Smooth metal.
    Conductor {
        /// Real part of the index.
        eta: IfDeltas<Spectrum>,
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
        microfacet: IfGlossy<Microfacet>,
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
        microfacet: IfGlossy<IfTransmission<Microfacet>>,
    },
    /// Smooth coat over a diffuse base.
    Plastic {
        /// Index of the coat and of the outside.
        ior: [Ior; 2],
        /// Factor on the reflection of the coat.
        coat: IfDeltas<Spectrum>,
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
        coat: IfGlossy<Coat>,
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

/// A smooth interface.
#[inline]
fn clear(eta: [SampledSpectrum; 2], factors: [SampledSpectrum; 2]) -> IfDeltas<IfTransmission<Dielectric>> {
    if_deltas(if_transmission(Dielectric::new(eta, factors)))
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
                Bsdf::Dielectric(clear(eta, factors))
            }
            Material::Conductor { eta, k, reflectance } => {
                let (eta, k) = (eta.sample(lambda), k.sample(lambda));
                Bsdf::Conductor(if_deltas(Conductor::new(eta, k, reflectance.sample(lambda))))
            }
            Material::RoughConductor { index, reflectance, microfacet } => {
                let index = [index[0].sample(lambda), index[1].sample(lambda)];
                Bsdf::RoughConductor(if_glossy(RoughConductor::new(
                    index,
                    reflectance.sample(lambda),
                    microfacet,
                )))
            }
            Material::RoughDielectric { int_ior, ext_ior, factors, microfacet } => {
                let eta = [int_ior.sample(lambda), ext_ior.sample(lambda)];
                let factors = [factors[0].sample(lambda), factors[1].sample(lambda)];
                match RoughDielectric::new(eta, factors, microfacet) {
                    Some(rough) => Bsdf::RoughDielectric(if_glossy(if_transmission(rough))),
                    None => Bsdf::Dielectric(clear(eta, factors)),
                }
            }
            Material::Plastic { ior, coat, base, internal, nonlinear } => {
                let eta = [ior[0].sample(lambda), ior[1].sample(lambda)];
                let (albedo, internal) = (base.sample(lambda), internal.sample(lambda));
                let base = Base { albedo, internal, nonlinear: *nonlinear };
                Bsdf::Plastic(if_deltas(Plastic::new(eta, coat.sample(lambda), base, lambda.is_hero_only())))
            }
            Material::RoughPlastic { coat, reflectance, base, internal, nonlinear } => {
                let internal = SampledSpectrum::splat(*internal);
                let base = Base { albedo: base.sample(lambda), internal, nonlinear: *nonlinear };
                let reflectance = reflectance.sample(lambda);
                Bsdf::RoughPlastic(if_glossy(RoughPlastic::new(
                    coat,
                    reflectance,
                    base,
                    lambda.is_hero_only(),
                )))
            }
        }
    }
}
