//! Which medium is on which side of a vertex.

use std::fmt::Debug;

use glam::Vec3;

use crate::scene::desc::MediumId;

/// A medium of a scene, or vacuum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MediumIndex(pub(super) u32);

impl MediumIndex {
    /// No medium.
    pub const VACUUM: Self = Self(u32::MAX);

    /// Its place in the list of media.
    #[inline]
    pub fn number(self) -> u32 {
        self.0
    }

    /// The medium of the description; `None` for vacuum.
    pub fn id(self) -> Option<MediumId> {
        (self != Self::VACUUM).then_some(MediumId(self.0))
    }
}

impl From<Option<MediumId>> for MediumIndex {
    fn from(id: Option<MediumId>) -> Self {
        id.map_or(Self::VACUUM, |id| Self(id.0))
    }
}

/// The media at a vertex of a path; `()` in code without media.
pub trait PathMedia: Copy + Debug {
    /// False for `()`.
    const PRESENT: bool;

    /// The media at a vertex to which a path came through `medium`; `sides` returns those behind and in front of a surface that has others.
    fn at(medium: MediumIndex, sides: impl FnOnce() -> Option<[MediumIndex; 2]>) -> Self;

    /// The medium into which a path leaves a vertex of the geometric normal `ng` in the direction `d`.
    fn towards(self, ng: Vec3, d: Vec3) -> MediumIndex;
}

impl PathMedia for () {
    const PRESENT: bool = false;

    #[inline(always)]
    fn at(_: MediumIndex, _: impl FnOnce() -> Option<[MediumIndex; 2]>) -> Self {}

    #[inline(always)]
    fn towards(self, _: Vec3, _: Vec3) -> MediumIndex {
        MediumIndex::VACUUM
    }
}

/// The media behind a vertex and in front of it; the same twice at a vertex within a medium, and on a surface that leaves the medium as it is.
#[derive(Clone, Copy, Debug)]
pub struct MediumSides(pub(super) [MediumIndex; 2]);

impl PathMedia for MediumSides {
    const PRESENT: bool = true;

    #[inline]
    fn at(medium: MediumIndex, sides: impl FnOnce() -> Option<[MediumIndex; 2]>) -> Self {
        Self(sides().unwrap_or([medium; 2]))
    }

    #[inline]
    fn towards(self, ng: Vec3, d: Vec3) -> MediumIndex {
        self.0[usize::from(d.dot(ng) > 0.0)]
    }
}
