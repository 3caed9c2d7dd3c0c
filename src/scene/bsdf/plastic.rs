//! `plastic` and `roughplastic`: a transparent coat over a diffuse base.

use super::dielectric::ior;
use super::roughness::ReadRoughness;
use super::{BsdfPlugin, Roughness, color, parts};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader};
use crate::scene::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

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

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self {
            int_ior: ior(params, "int_ior", "polypropylene")?,
            ext_ior: ior(params, "ext_ior", "air")?,
            diffuse_reflectance: color(reader, params, "diffuse_reflectance", 0.5)?,
            specular_reflectance: color(reader, params, "specular_reflectance", 1.0)?,
            nonlinear: params.boolean("nonlinear", false)?,
        })
    }

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

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let (int_ior, ext_ior) = (ior(params, "int_ior", "polypropylene")?, ior(params, "ext_ior", "air")?);
        if int_ior == ext_ior {
            let message = "a coat has another index of refraction than what is around it";
            return Err(params.error("int_ior", message).help("without a coat it is `diffuse`").error());
        }
        let roughness = ReadRoughness::read(reader, params)?.uniform(params);
        if roughness.alpha[0] != roughness.alpha[1] {
            let found = params.error("alpha_u", "the coat of a plastic is as rough along as across");
            return Err(found.help("give one `alpha`").error());
        }
        Ok(Self {
            int_ior,
            ext_ior,
            diffuse_reflectance: color(reader, params, "diffuse_reflectance", 0.5)?,
            specular_reflectance: color(reader, params, "specular_reflectance", 1.0)?,
            nonlinear: params.boolean("nonlinear", false)?,
            roughness,
        })
    }

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
