//! `thindielectric`: a pane too thin to displace what is seen through it.

use super::{BsdfPlugin, parts};
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::dispersion::Ior;

/// A smooth pane of a transparent medium, both of whose faces are one surface.
#[derive(Clone, Debug)]
pub struct ThinDielectricDesc {
    /// Index of the pane.
    pub int_ior: Ior,
    /// Index on both of its sides.
    pub ext_ior: Ior,
    /// Factor on reflection, 1 in nature.
    pub specular_reflectance: SpectrumTexture,
    /// Factor on transmission, 1 in nature.
    pub specular_transmittance: SpectrumTexture,
}

impl BsdfPlugin for ThinDielectricDesc {
    const NAME: &'static str = "thindielectric";

    parts! {
        reflection: specular_reflectance,
        transmission: specular_transmittance,
        int_ior: int_ior,
        ext_ior: ext_ior,
    }
}
