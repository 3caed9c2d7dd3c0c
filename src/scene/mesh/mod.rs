//! Mesh files. A mesh that comes out has indices in range, finite vertices and triangles with area.

mod check;
mod clean;
mod normals;
pub mod obj;

use crate::scene::desc::Mesh;
use crate::scene::diagnostic::{FindingKind, SceneError, SceneWarning};

/// Options of reading a mesh file.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct MeshOptions {
    /// Facets: no shading normals, even if the file has some.
    pub face_normals: bool,
    /// Turn texture coordinates upside down (v becomes 1 − v).
    pub flip_tex_coords: bool,
    /// Columns of the object-to-world matrix as bits, when it does more than move, turn and scale evenly:
    /// normals made from faces are those of the faces in the world.
    pub world: Option<[u64; 9]>,
}

/// A mesh, with what was wrong with its file.
#[derive(Clone, Debug)]
pub struct MeshRead {
    /// Size of the file.
    pub bytes: usize,
    /// The mesh; at least one triangle.
    pub mesh: Mesh,
    /// One warning for each kind of fault that was dropped or mended, at its first place.
    pub warnings: Vec<SceneWarning>,
}

/// The reason why a mesh could not be read.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// A fault in the file, with its place.
    #[error(transparent)]
    At(#[from] SceneError),
    /// The file cannot be opened; the place is where the scene names it.
    #[error("{1}")]
    Unreadable(FindingKind, String),
}
