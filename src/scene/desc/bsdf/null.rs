//! `null`: an invisible surface.

use super::{BsdfPlugin, parts};

/// An invisible surface: every ray passes straight through.
#[derive(Clone, Copy, Debug)]
pub struct NullDesc;

impl BsdfPlugin for NullDesc {
    const NAME: &'static str = "null";

    parts! {}
}
