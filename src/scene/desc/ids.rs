//! How the lists of a description refer to each other, and where their objects stand in the files.

/// A place in a source file; lines and columns count from 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// Index into [`SceneDesc::files`](super::SceneDesc::files).
    pub file: u32,
    /// Line.
    pub line: u32,
    /// Column, in characters.
    pub column: u32,
}

/// Names and places of objects whose descriptions have none; empty for a scene that was not read from a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Names {
    /// Names of [`SceneDesc::bsdfs`](super::SceneDesc::bsdfs).
    pub bsdfs: Vec<Name>,
    /// Names of [`SceneDesc::lights`](super::SceneDesc::lights).
    pub lights: Vec<Name>,
    /// Names of [`SceneDesc::media`](super::SceneDesc::media).
    pub media: Vec<Name>,
}

/// The name of an element of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Name {
    /// Its `id`, if it has one.
    pub id: Option<String>,
    /// Its place; line 0 for an object that is not in the file, such as the material of a shape that names none.
    pub place: Place,
}

/// Index into [`SceneDesc::bsdfs`](super::SceneDesc::bsdfs).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub struct BsdfId(pub u32);

impl BsdfId {
    /// The material of an instance: the shapes of its group have materials of their own.
    pub const NONE: BsdfId = BsdfId(u32::MAX);
}

/// Index into [`SceneDesc::meshes`](super::SceneDesc::meshes).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MeshId(pub u32);

/// Index into [`SceneDesc::media`](super::SceneDesc::media).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub struct MediumId(pub u32);

/// Index into [`SceneDesc::groups`](super::SceneDesc::groups).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct GroupId(pub u32);
