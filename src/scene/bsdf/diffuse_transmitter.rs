//! `difftrans` of version 0.6: a thin sheet that spreads light to its other side.

use super::{BsdfPlugin, color, parts};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader};
use crate::scene::texture::SpectrumTexture;
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

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { transmittance: color(reader, params, "transmittance", 0.5)? })
    }

    parts! { transmission: transmittance }
}
