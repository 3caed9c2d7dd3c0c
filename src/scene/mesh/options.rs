//! Formats of mesh files, and the options of reading one.

/// A format of mesh files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum MeshFormat {
    /// Wavefront OBJ. All its objects and groups become one mesh; its materials are not used.
    #[default]
    Obj,
    /// Stanford PLY.
    Ply,
    /// Mitsuba's compressed format, versions 3 and 4.
    Serialized,
}

/// Options of reading a mesh file.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct MeshOptions {
    /// The format.
    pub format: MeshFormat,
    /// Which mesh of a file that may hold several.
    pub shape_index: u32,
    /// Facets: no shading normals, even if the file has some.
    pub face_normals: bool,
    /// Turn texture coordinates upside down (v becomes 1 − v).
    pub flip_tex_coords: bool,
    /// Names of the attributes that are kept; a format that has none of such a name leaves it out.
    pub attributes: Vec<String>,
    /// Columns of the object-to-world matrix as bits, when it does more than move, turn and scale evenly:
    /// normals made from faces are those of the faces in the world.
    pub world: Option<[u64; 9]>,
}
