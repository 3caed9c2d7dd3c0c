//! `null`: a surface that is not there for light.

use super::{BsdfPlugin, parts};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader};
use crate::scene::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// An invisible surface: light goes straight through.
#[derive(Clone, Debug)]
pub struct NullDesc {
    /// What is let through: 1, or 0 where the effect `transmission` is taken out.
    pub transmittance: SpectrumTexture,
}

impl BsdfPlugin for NullDesc {
    const NAME: &'static str = "null";

    fn read(_: &mut Reader<'_>, _: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { transmittance: Spectrum::Constant(1.0).into() })
    }

    parts! { transmission: transmittance }
}
