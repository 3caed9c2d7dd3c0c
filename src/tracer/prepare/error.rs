//! Why a scene cannot be traced.

use crate::scene::desc::{BsdfId, GroupId, MOST_PARTS, MediumId, MeshId, Place};
use crate::tracer::medium::MOST_LOBES;

/// References to cache lines have 28 bits. They suffice even if every primitive takes a block (4 lines) and a node (4 lines).
pub(super) const MAX_PRIMITIVES: usize = 33_000_000;

/// Why a scene cannot be traced.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum PrepareError {
    /// The camera cannot be used.
    #[error("the camera at line {}, column {} cannot be used: {what}", place.line, place.column)]
    Camera {
        /// Its place in the scene file.
        place: Place,
        /// The problem and what to do.
        what: String,
    },
    /// A shape or material names a material that does not exist.
    #[error("material {} is named but does not exist: the scene description is inconsistent", id.0)]
    UnknownMaterial {
        /// The id.
        id: BsdfId,
    },
    /// A shape or the camera names a medium that does not exist.
    #[error("medium {} is named but does not exist: the scene description is inconsistent", id.0)]
    UnknownMedium {
        /// The id.
        id: MediumId,
    },
    /// A phase function that is not traced.
    #[error(
        "the phase function of the medium{named} is a blend of more than {MOST_LOBES} others, or a table without a density: leave it out"
    )]
    PhaseFunction {
        /// Name and place of the medium.
        named: String,
    },
    /// A material is made of too many others.
    #[error("material {} is made of more than {MOST_PARTS} others", id.0)]
    TooManyParts {
        /// The id.
        id: BsdfId,
    },
    /// A shape names a mesh that does not exist.
    #[error("the shape at line {}, column {} names mesh {}, which does not exist", place.line, place.column, id.0)]
    UnknownMesh {
        /// The id.
        id: MeshId,
        /// The shape.
        place: Place,
    },
    /// An instance names a group that does not exist.
    #[error("the instance at line {}, column {} names group {}, which does not exist", place.line, place.column, id.0)]
    UnknownGroup {
        /// The id.
        id: GroupId,
        /// The instance.
        place: Place,
    },
    /// A shape that cannot be part of a group.
    #[error("the shape at line {}, column {} cannot be part of a group: {what}", place.line, place.column)]
    InGroup {
        /// Its place in the scene file.
        place: Place,
        /// The problem.
        what: &'static str,
    },
    /// Two-sided materials contain each other.
    #[error("material {} is two-sided and contains itself: name a one-sided material for each side", id.0)]
    NestedTwoSided {
        /// The id.
        id: BsdfId,
    },
    /// More primitives than ids.
    #[error("{count} primitives are too many: at most 33 million fit; simplify the meshes")]
    TooManyPrimitives {
        /// Their number.
        count: usize,
    },
}
