//! Models as scenes: OBJ with its materials, PLY, glTF and USD, without a scene file around them.
//!
//! A model becomes the text of a scene that Mitsuba's reader then reads, and files in memory that the text names: meshes as PLY,
//! pictures of which a material needs one channel or a multiple. So every material, texture and check exists once, and what
//! is saved of a model in the viewer is a scene that includes it.
//!
//! | file | what |
//! |---|---|
//! | `text.rs` | writes the text and keeps the files |
//! | `obj.rs` | OBJ: a mesh for each material |
//! | `mtl.rs`, `obj_material.rs` | MTL files; what bsdf each of their materials is |
//! | `ply.rs` | PLY: its colours and pictures |
//! | `gltf/` | glTF 2.0: nodes, lights and cameras; buffers; materials; pictures |
//! | `usd/` | USD: composed stages, materials, lights, cameras |
//! | `surface.rs`, `specular.rs`, `picture_changes.rs`, `mesh_shape.rs` | what glTF and USD share: materials, their pictures, meshes at places |
//! | `stage.rs` | what a model lacks: a sky, a camera that sees all of it |
//!
//! Units are those of glTF, one to one: a radiance of 1 in the scene is 1 cd/m², a point of 1 cd has the intensity 1.

mod gltf;
mod mesh_shape;
mod mtl;
mod obj;
mod obj_material;
mod picture_changes;
mod ply;
mod specular;
mod stage;
mod surface;
mod text;
mod usd;

use std::path::Path;

use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::files::SceneFiles;
use crate::scene::limits;

pub(crate) use stage::frame;
use text::{ModelScene, SceneText, finding};

/// A format of models that are shown without a scene file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelFormat {
    /// Wavefront OBJ with MTL.
    Obj,
    /// Stanford PLY.
    Ply,
    /// glTF 2.0, as text or in one binary file.
    Gltf,
    /// Pixar's USD, as text, as a binary crate or in a package.
    Usd,
}

impl ModelFormat {
    /// The format that the ending of a file names; none for a scene file.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        match ending.as_str() {
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            "gltf" | "glb" => Some(Self::Gltf),
            "usd" | "usda" | "usdc" | "usdz" => Some(Self::Usd),
            _ => None,
        }
    }
}

/// Reads a model.
///
/// # Errors
///
/// [`SceneError`] that names the file, with line and column where the format has lines.
pub(crate) fn read(path: &Path, format: ModelFormat, files: &SceneFiles) -> Result<ModelScene, SceneError> {
    let mut text = SceneText::new(path);
    match format {
        ModelFormat::Obj => obj::read(&mut text, files)?,
        ModelFormat::Ply => ply::read(&mut text, files)?,
        ModelFormat::Gltf => gltf::read(&mut text, files)?,
        ModelFormat::Usd => usd::read(&mut text, files)?,
    }
    if text.is_too_long() {
        let message =
            format!("as a scene this model has more than {} bytes of text", limits::TOTAL_XML_BYTES);
        let found = finding(path, FindingKind::Limit, [1, 1], message);
        return Err(found.help("it shows shapes that emit at too many places").error());
    }
    let srgb_pictures = matches!(format, ModelFormat::Gltf | ModelFormat::Usd);
    Ok(ModelScene { srgb_pictures, ..text.finish() })
}
