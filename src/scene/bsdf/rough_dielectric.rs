//! `roughdielectric`: a rough interface between two transparent media.

use super::dielectric::ior;
use super::{BsdfPlugin, Roughness, color, parts};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader};
use crate::spectrum::{Spectrum, dispersion::Ior};

/// A rough interface between two transparent media of different index.
#[derive(Clone, Debug)]
pub struct RoughDielectricDesc {
    /// Index on the side the normal points away from.
    pub int_ior: Ior,
    /// Index on the side the normal points to.
    pub ext_ior: Ior,
    /// Factor on reflection, 1 in nature.
    pub specular_reflectance: Spectrum,
    /// Factor on transmission, 1 in nature.
    pub specular_transmittance: Spectrum,
    /// Its microfacets.
    pub roughness: Roughness,
}

impl BsdfPlugin for RoughDielectricDesc {
    const NAME: &'static str = "roughdielectric";

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let (int_ior, ext_ior) = (ior(params, "int_ior", "bk7")?, ior(params, "ext_ior", "air")?);
        if int_ior == ext_ior {
            let message = "both sides of a rough interface have the same index of refraction";
            let help = "without a difference light goes straight through: use `dielectric`";
            return Err(params.error("int_ior", message).help(help).error());
        }
        Ok(Self {
            int_ior,
            ext_ior,
            specular_reflectance: color(reader, params, "specular_reflectance", 1.0)?,
            specular_transmittance: color(reader, params, "specular_transmittance", 1.0)?,
            roughness: Roughness::read(reader, params)?,
        })
    }

    parts! {
        reflection: specular_reflectance,
        transmission: specular_transmittance,
        int_ior: int_ior,
        ext_ior: ext_ior,
    }

    fn roughness(&self) -> Option<Roughness> {
        Some(self.roughness)
    }
}
