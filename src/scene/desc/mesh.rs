//! Triangle meshes.

use glam::{Vec2, Vec3};

/// An indexed triangle mesh; already checked: indices in range, vertices finite, no triangle without area.
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
    /// The number of each triangle in its file; empty where that is its index, because none before it was left out.
    pub numbers: Vec<u32>,
    /// What the materials of its shapes ask for besides; may be empty.
    pub attributes: Vec<MeshAttribute>,
}

impl Mesh {
    /// The number in the file of the triangle of this index.
    pub fn number(&self, index: usize) -> u32 {
        self.numbers.get(index).copied().unwrap_or(index as u32)
    }
}

/// One or three numbers at every vertex or on every triangle of a mesh, Mitsuba's mesh attribute.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshAttribute {
    /// Its name, which begins with `vertex_` or `face_`.
    pub name: String,
    /// The numbers of a vertex or triangle: 1, or 3 for a colour in linear Rec.709.
    pub channels: usize,
    /// The numbers, those of a vertex or triangle together.
    pub values: Vec<f32>,
}

impl MeshAttribute {
    /// The beginning of names of attributes of vertices.
    pub const VERTEX: &str = "vertex_";

    /// The beginning of names of attributes of triangles.
    pub const FACE: &str = "face_";

    /// The attribute that colours of vertices are.
    pub(crate) const VERTEX_COLOR: &str = "vertex_color";

    /// The attribute that colours of faces are.
    pub(crate) const FACE_COLOR: &str = "face_color";

    /// It has numbers for triangles, not for vertices.
    pub fn is_of_faces(&self) -> bool {
        self.name.starts_with(Self::FACE)
    }
}
