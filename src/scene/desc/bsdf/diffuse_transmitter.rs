//! `difftrans` of version 0.6: a thin sheet that spreads light to its other side.

use super::{BsdfPlugin, parts};
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// A diffuse transmitter. It reflects nothing.
#[derive(Clone, Debug)]
pub struct DiffuseTransmitterDesc {
    /// Share of light that is let through.
    pub transmittance: SpectrumTexture,
}

impl BsdfPlugin for DiffuseTransmitterDesc {
    const NAME: &'static str = "difftrans";
    const OTHER_DIFFUSE: bool = true;

    parts! { transmission: transmittance }
}
