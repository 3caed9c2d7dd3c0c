//! `null`: a surface that is not there for light.

use super::{BsdfPlugin, parts};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader};
use crate::spectrum::{Spectrum, dispersion::Ior};

/// An invisible surface: every ray goes straight on.
#[derive(Clone, Copy, Debug)]
pub struct NullDesc;

impl BsdfPlugin for NullDesc {
    const NAME: &'static str = "null";

    fn read(_: &mut Reader<'_>, _: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self)
    }

    parts! {}
}
