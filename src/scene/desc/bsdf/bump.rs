//! `normalmap` and `bumpmap`: a picture tilts the shading frame of a nested material.

use super::{BsdfPlugin, parts};
use crate::scene::desc::ids::BsdfId;
use crate::scene::desc::texture::BitmapTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// What normal maps and bump maps have in common.
#[derive(Clone, Debug)]
pub struct BumpDesc {
    /// The material whose frame is tilted.
    pub bsdf: BsdfId,
    /// A normal that faces away from who looks is turned around the unperturbed one by 180° (Schüssler et al. 2017,
    /// *Microfacet-based normal mapping for robust Monte Carlo path tracing*).
    pub flip_invalid_normals: bool,
    /// Light fades out towards the horizon (Conty Estevez, Lecocq and Stein 2019, *A Microfacet-Based Shadowing Function to Solve
    /// the Bump Terminator Problem*).
    pub use_shadowing_function: bool,
}

impl BumpDesc {}

/// A material whose normals a picture holds.
#[derive(Clone, Debug)]
pub struct NormalMapDesc {
    /// Normals in the shading frame, x along ∂p/∂u, as (n + 1) / 2.
    pub normals: BitmapTexture,
    /// The rest.
    pub bump: BumpDesc,
}

impl BsdfPlugin for NormalMapDesc {
    const NAME: &'static str = "normalmap";

    parts! {}

    fn bump(&self) -> Option<&BumpDesc> {
        Some(&self.bump)
    }
}

/// A material whose normals follow from heights over the surface, in a picture.
#[derive(Clone, Debug)]
pub struct BumpMapDesc {
    /// Heights in world units: the luminance of the picture.
    pub heights: BitmapTexture,
    /// Factor on them.
    pub scale: f32,
    /// The rest.
    pub bump: BumpDesc,
}

impl BsdfPlugin for BumpMapDesc {
    const NAME: &'static str = "bumpmap";

    parts! {}

    fn bump(&self) -> Option<&BumpDesc> {
        Some(&self.bump)
    }
}
