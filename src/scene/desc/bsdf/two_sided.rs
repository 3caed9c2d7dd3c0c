//! `twosided`: a one-sided material for each side of a surface.

use super::{BsdfPlugin, parts};
use crate::scene::desc::ids::BsdfId;

/// A pair of one-sided materials.
#[derive(Clone, Copy, Debug)]
pub struct TwoSidedDesc {
    /// Seen from the side of the normal.
    pub front: BsdfId,
    /// Seen from the other side.
    pub back: BsdfId,
}

impl BsdfPlugin for TwoSidedDesc {
    const NAME: &'static str = "twosided";

    parts! {}

    fn nested(&self) -> Vec<BsdfId> {
        vec![self.front, self.back]
    }
}
