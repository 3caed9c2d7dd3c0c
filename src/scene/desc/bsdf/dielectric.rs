//! `dielectric` and `roughdielectric`: an interface between two transparent media.

use super::roughness::varying_roughness;
use super::{AlphaTexture, BsdfPlugin, Roughness, parts};
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::dispersion::Ior;

/// A smooth interface between two transparent media.
#[derive(Clone, Debug)]
pub struct DielectricDesc {
    /// Index on the side the normal points away from.
    pub int_ior: Ior,
    /// Index on the side the normal points to.
    pub ext_ior: Ior,
    /// Factor on reflection, 1 in nature.
    pub specular_reflectance: SpectrumTexture,
    /// Factor on transmission, 1 in nature.
    pub specular_transmittance: SpectrumTexture,
}

impl BsdfPlugin for DielectricDesc {
    const NAME: &'static str = "dielectric";

    parts! {
        reflection: specular_reflectance,
        transmission: specular_transmittance,
        int_ior: int_ior,
        ext_ior: ext_ior,
    }
}

/// A rough interface between two transparent media of different index.
#[derive(Clone, Debug)]
pub struct RoughDielectricDesc {
    /// Index on the side the normal points away from.
    pub int_ior: Ior,
    /// Index on the side the normal points to.
    pub ext_ior: Ior,
    /// Factor on reflection, 1 in nature.
    pub specular_reflectance: SpectrumTexture,
    /// Factor on transmission, 1 in nature.
    pub specular_transmittance: SpectrumTexture,
    /// Its microfacets.
    pub roughness: Roughness,
    /// Texture of the roughness, if it varies; `roughness` then has its mean, or 1 for a mesh attribute.
    pub alpha: Option<Box<AlphaTexture>>,
}

impl BsdfPlugin for RoughDielectricDesc {
    const NAME: &'static str = "roughdielectric";

    parts! {
        reflection: specular_reflectance,
        transmission: specular_transmittance,
        int_ior: int_ior,
        ext_ior: ext_ior,
    }

    varying_roughness! {}
}
