//! `roughconductor`: a rough metal.

use super::conductor::metal;
use super::{BsdfPlugin, Roughness, color, parts};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader};
use crate::spectrum::{Spectrum, dispersion::Ior};

/// A rough metal.
#[derive(Clone, Debug)]
pub struct RoughConductorDesc {
    /// Real part of the index of refraction.
    pub eta: Spectrum,
    /// Imaginary part.
    pub k: Spectrum,
    /// Factor on reflection, 1 in nature.
    pub specular_reflectance: Spectrum,
    /// Its microfacets.
    pub roughness: Roughness,
}

impl BsdfPlugin for RoughConductorDesc {
    const NAME: &'static str = "roughconductor";

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let (eta, k) = metal(reader, params)?;
        let specular_reflectance = color(reader, params, "specular_reflectance", 1.0)?;
        Ok(Self { eta, k, specular_reflectance, roughness: Roughness::read(reader, params)? })
    }

    parts! { reflection: specular_reflectance, eta: eta, k: k }

    fn roughness(&self) -> Option<Roughness> {
        Some(self.roughness)
    }
}
