//! `normalmap` and `bumpmap`: a picture tilts the shading frame of a nested material.

use super::{BsdfPlugin, parts};
use crate::scene::desc::ids::BsdfId;
use crate::scene::desc::texture::BitmapTexture;

/// The parameters that normal maps and bump maps share.
#[derive(Clone, Debug)]
pub struct BumpDesc {
    /// The material whose frame is tilted.
    pub bsdf: BsdfId,
    /// A perturbed normal that faces away from the viewer is turned around the unperturbed one by 180° (Schüssler et al. 2017,
    /// *Microfacet-based normal mapping for robust Monte Carlo path tracing*).
    pub flip_invalid_normals: bool,
    /// Light fades out towards the horizon (Conty Estevez, Lecocq and Stein 2019, *A Microfacet-Based Shadowing Function to Solve
    /// the Bump Terminator Problem*).
    pub use_shadowing_function: bool,
}

impl BumpDesc {}

/// A material with a normal map.
#[derive(Clone, Debug)]
pub struct NormalMapDesc {
    /// Normals in the shading frame, x along ∂p/∂u, as (n + 1) / 2.
    pub normals: BitmapTexture,
    /// The parameters shared with the other kind of map.
    pub bump: BumpDesc,
}

impl BsdfPlugin for NormalMapDesc {
    const NAME: &'static str = "normalmap";

    parts! {}

    fn bump(&self) -> Option<&BumpDesc> {
        Some(&self.bump)
    }
}

/// A material with a bump map: heights over the surface.
#[derive(Clone, Debug)]
pub struct BumpMapDesc {
    /// Heights in world units: the luminance of the picture.
    pub heights: BitmapTexture,
    /// Factor on the heights.
    pub scale: f32,
    /// The parameters shared with the other kind of map.
    pub bump: BumpDesc,
}

impl BsdfPlugin for BumpMapDesc {
    const NAME: &'static str = "bumpmap";

    parts! {}

    fn bump(&self) -> Option<&BumpDesc> {
        Some(&self.bump)
    }
}
