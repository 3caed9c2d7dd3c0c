//! `null`: a surface that is not there for light.

use super::{BsdfPlugin, parts};
use crate::spectrum::{Spectrum, dispersion::Ior};

/// An invisible surface: every ray goes straight on.
#[derive(Clone, Copy, Debug)]
pub struct NullDesc;

impl BsdfPlugin for NullDesc {
    const NAME: &'static str = "null";

    parts! {}
}
