//! `diffuse`: Lambert's cosine law.

use super::{BsdfPlugin, parts};
use crate::scene::desc::texture::SpectrumTexture;

/// A diffuse reflector.
#[derive(Clone, Debug)]
pub struct DiffuseDesc {
    /// Albedo.
    pub reflectance: SpectrumTexture,
}

impl BsdfPlugin for DiffuseDesc {
    const NAME: &'static str = "diffuse";

    parts! { albedo: reflectance }
}
