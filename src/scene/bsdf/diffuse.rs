//! `diffuse`: Lambert's cosine law.

use super::{BsdfPlugin, color, parts};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader};
use crate::scene::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// A diffuse reflector.
#[derive(Clone, Debug)]
pub struct DiffuseDesc {
    /// Albedo.
    pub reflectance: SpectrumTexture,
}

impl BsdfPlugin for DiffuseDesc {
    const NAME: &'static str = "diffuse";

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { reflectance: color(reader, params, "reflectance", 0.5)? })
    }

    parts! { albedo: reflectance }
}
