//! `difftrans` of version 0.6: a thin sheet that transmits diffusely.

use super::{BsdfPlugin, parts};
use crate::scene::desc::texture::SpectrumTexture;

/// A diffuse transmitter. It reflects nothing.
#[derive(Clone, Debug)]
pub struct DiffuseTransmitterDesc {
    /// Transmittance.
    pub transmittance: SpectrumTexture,
}

impl BsdfPlugin for DiffuseTransmitterDesc {
    const NAME: &'static str = "difftrans";
    const OTHER_DIFFUSE: bool = true;

    parts! { transmission: transmittance }
}
