//! `plastic`: a smooth transparent coat over a diffuse base.

use super::dielectric::ior;
use super::{BsdfPlugin, color, parts};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader};
use crate::spectrum::{Spectrum, dispersion::Ior};

/// A smooth transparent coat over a diffuse base.
#[derive(Clone, Debug)]
pub struct PlasticDesc {
    /// Index of the coat.
    pub int_ior: Ior,
    /// Index outside.
    pub ext_ior: Ior,
    /// Albedo of the base.
    pub diffuse_reflectance: Spectrum,
    /// Factor on the reflection of the coat, 1 in nature.
    pub specular_reflectance: Spectrum,
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
