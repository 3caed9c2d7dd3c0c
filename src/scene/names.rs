//! What the elements of a file are called and where they stand.

/// Where in the source something was said; lines and columns count from 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// Index into [`SceneDesc::files`](crate::scene::SceneDesc::files).
    pub file: u32,
    /// Line.
    pub line: u32,
    /// Column, in characters.
    pub column: u32,
}

/// Names and places of what has none in its own description; empty for a scene that was not read from a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Names {
    /// Of [`SceneDesc::bsdfs`](crate::scene::SceneDesc::bsdfs).
    pub bsdfs: Vec<Name>,
    /// Of [`SceneDesc::lights`](crate::scene::SceneDesc::lights).
    pub lights: Vec<Name>,
}

/// What an element of a file is called.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Name {
    /// Its `id`, if it has one.
    pub id: Option<String>,
    /// Where it stands; line 0 for what stands nowhere, as the material of a shape that names none.
    pub place: Place,
}
