//! `plastic` and `roughplastic`: a transparent coat over a diffuse base.

use super::{BsdfPlugin, Roughness, parts};
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::dispersion::Ior;

/// A smooth transparent coat over a diffuse base.
#[derive(Clone, Debug)]
pub struct PlasticDesc {
    /// Index of the coat.
    pub int_ior: Ior,
    /// Index outside.
    pub ext_ior: Ior,
    /// Albedo of the base.
    pub diffuse_reflectance: SpectrumTexture,
    /// Factor on the reflection of the coat, 1 in nature.
    pub specular_reflectance: SpectrumTexture,
    /// Colours shift with every reflection between coat and base.
    pub nonlinear: bool,
}

impl BsdfPlugin for PlasticDesc {
    const NAME: &'static str = "plastic";

    parts! {
        albedo: diffuse_reflectance,
        reflection: specular_reflectance,
        int_ior: int_ior,
        ext_ior: ext_ior,
    }
}

/// A rough transparent coat over a diffuse base.
#[derive(Clone, Debug)]
pub struct RoughPlasticDesc {
    /// Index of the coat; its value at the sodium line counts for all wavelengths.
    pub int_ior: Ior,
    /// Index outside, likewise.
    pub ext_ior: Ior,
    /// Albedo of the base.
    pub diffuse_reflectance: SpectrumTexture,
    /// Factor on the reflection of the coat, 1 in nature.
    pub specular_reflectance: SpectrumTexture,
    /// Colours shift with every reflection between coat and base.
    pub nonlinear: bool,
    /// Microfacets of the coat, the same along both tangents.
    pub roughness: Roughness,
}

impl BsdfPlugin for RoughPlasticDesc {
    const NAME: &'static str = "roughplastic";
    const SPECTRAL_INDEX: bool = false;

    parts! {
        albedo: diffuse_reflectance,
        reflection: specular_reflectance,
        int_ior: int_ior,
        ext_ior: ext_ior,
    }

    fn roughness(&self) -> Option<Roughness> {
        Some(self.roughness)
    }

    fn number(&self, name: &str) -> Option<f32> {
        self.roughness.number(name)
    }

    fn set_number(&mut self, name: &str, value: f32) {
        self.roughness.set_number(name, value);
    }
}
