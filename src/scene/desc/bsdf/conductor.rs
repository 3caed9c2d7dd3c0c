//! `conductor` and `roughconductor`: metals.

use super::roughness::varying_roughness;
use super::{AlphaTexture, BsdfPlugin, Roughness, parts};
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::Spectrum;

/// A smooth metal.
#[derive(Clone, Debug)]
pub struct ConductorDesc {
    /// Real part of the index of refraction.
    pub eta: Spectrum,
    /// Imaginary part; η = 0 with k = 1 reflects everything (`material="none"`).
    pub k: Spectrum,
    /// Factor on reflection, 1 in nature.
    pub specular_reflectance: SpectrumTexture,
}

impl BsdfPlugin for ConductorDesc {
    const NAME: &'static str = "conductor";

    parts! { reflection: specular_reflectance, eta: eta, k: k }
}

/// A rough metal.
#[derive(Clone, Debug)]
pub struct RoughConductorDesc {
    /// Real part of the index of refraction.
    pub eta: Spectrum,
    /// Imaginary part.
    pub k: Spectrum,
    /// Factor on reflection, 1 in nature.
    pub specular_reflectance: SpectrumTexture,
    /// Its microfacets.
    pub roughness: Roughness,
    /// Texture of the roughness, if it varies; `roughness` then has its mean, or 1 for a mesh attribute.
    pub alpha: Option<Box<AlphaTexture>>,
}

impl BsdfPlugin for RoughConductorDesc {
    const NAME: &'static str = "roughconductor";

    parts! { reflection: specular_reflectance, eta: eta, k: k }

    varying_roughness! {}
}
