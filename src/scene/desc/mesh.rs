//! Triangle meshes.

use glam::{Vec2, Vec3};

/// An indexed triangle mesh. The reader has checked it: indices are in range, vertices finite, and every triangle has an area.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Positions, object space.
    pub positions: Vec<Vec3>,
    /// Shading normals per vertex; empty for a faceted mesh.
    pub normals: Vec<Vec3>,
    /// Texture coordinates per vertex; may be empty.
    pub uvs: Vec<Vec2>,
    /// Vertex indices.
    pub triangles: Vec<[u32; 3]>,
    /// Number of each triangle in its file; empty if no triangle was dropped, so that numbers are indices.
    pub numbers: Vec<u32>,
    /// Attributes that the materials of its shapes use.
    pub attributes: Vec<MeshAttribute>,
}

impl Mesh {
    /// Number in the file of the triangle at an index.
    pub fn number(&self, index: usize) -> u32 {
        self.numbers.get(index).copied().unwrap_or(index as u32)
    }
}

/// One or three numbers at every vertex or on every triangle of a mesh, Mitsuba's mesh attribute.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshAttribute {
    /// Its name, which begins with `vertex_` or `face_`.
    pub name: String,
    /// Values per vertex or triangle: 1, or 3 for a colour in linear Rec.709.
    pub channels: usize,
    /// The values; those of one vertex or triangle are adjacent.
    pub values: Vec<f32>,
}

impl MeshAttribute {
    /// Prefix of the names of vertex attributes.
    pub const VERTEX: &str = "vertex_";

    /// Prefix of the names of face attributes.
    pub const FACE: &str = "face_";

    /// Name of the attribute that holds vertex colours.
    pub(crate) const VERTEX_COLOR: &str = "vertex_color";

    /// Name of the attribute that holds face colours.
    pub(crate) const FACE_COLOR: &str = "face_color";

    /// True for a face attribute, false for a vertex attribute.
    pub fn is_of_faces(&self) -> bool {
        self.name.starts_with(Self::FACE)
    }
}
