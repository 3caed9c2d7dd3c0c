//! Mesh files. A mesh that comes out has indices in range, finite vertices and triangles with area.
//!
//! ```text
//! obj, obj_parts    Wavefront OBJ, read by several threads
//! ply, ply_header   Stanford PLY: text or binary
//! ply_numbers       the numbers after its header
//! serialized        Mitsuba's own format: compressed, several meshes in a file
//! attributes        columns of a PLY file that are an attribute
//! wedges            texture coordinates of corners of faces
//! file              the file as messages name it; what all formats do when the numbers are read
//! options           formats and options
//! check, normals    faults that only the numbers show; normals made from faces
//! ```
//!
//! A format is a function from a file to a `file::RawMesh`, a line in [`MeshFormat`] and one in [`parse`], and a
//! shape plugin in `mitsuba/shape.rs`.

mod attributes;
mod check;
pub(crate) mod curves;
mod file;
mod normals;
mod obj;
mod obj_parts;
mod options;
mod ply;
mod ply_header;
mod ply_numbers;
mod serialized;
mod wedges;

pub(crate) use file::MISSING_UV;
pub use file::MeshRead;
pub use options::{MeshFormat, MeshOptions};
pub(crate) use ply::{PlySummary, summary as ply_summary};

use std::path::Path;

use glam::DMat3;

use file::{MeshFile, RawMesh};
use obj_parts::NamedMaterials;

use crate::scene::desc::{Mesh, MeshAttribute};
use crate::scene::diagnostic::{SceneError, SceneWarning};
use crate::scene::files::{ReadError, SceneFiles};
use crate::scene::limits;

/// The reason why a mesh could not be read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum MeshError {
    /// A fault in the file, with its place.
    #[error(transparent)]
    At(#[from] SceneError),
    /// The file cannot be opened; the place is where the scene names it.
    #[error(transparent)]
    Unreadable(#[from] ReadError),
}

/// Reads a file of one format.
type MeshReader = for<'a> fn(&MeshFile<'a>, &MeshOptions) -> Result<RawMesh<'a>, SceneError>;

/// Reads the mesh file at `path`.
///
/// # Errors
///
/// [`MeshError::Unreadable`] when the file cannot be opened or is too large, [`MeshError::At`] with the line when it is not of the format
/// or cannot be one at all.
pub(crate) fn load(files: &SceneFiles, path: &Path, options: &MeshOptions) -> Result<MeshRead, MeshError> {
    let bytes = files.read(path, limits::MESH_BYTES)?;
    Ok(parse(&path.to_string_lossy(), &bytes, options)?)
}

/// Reads the bytes of a mesh file; messages call it `name`.
///
/// # Errors
///
/// [`SceneError`] with file and line.
pub fn parse(name: &str, bytes: &[u8], options: &MeshOptions) -> Result<MeshRead, SceneError> {
    let (read, text): (MeshReader, &[u8]) = match options.format {
        MeshFormat::Obj => (obj::read, bytes),
        MeshFormat::Ply => (ply::read, bytes),
        MeshFormat::Serialized => (serialized::read, b"(binary)"),
    };
    let file = MeshFile { name, bytes, text };
    let raw = read(&file, options)?;
    file.finish(raw, options)
}

/// A file with the names of the materials of its triangles; `v` is turned as textures want it. Triangles are those of the file, not
/// checked yet.
pub(crate) struct NamedParts {
    pub(crate) mesh: Mesh,
    pub(crate) materials: NamedMaterials,
    pub(crate) warnings: Vec<SceneWarning>,
}

/// Reads the bytes of an OBJ file whose materials count; messages call it `name`.
///
/// # Errors
///
/// [`SceneError`] with file and line.
pub(crate) fn obj_parts(name: &str, bytes: &[u8]) -> Result<NamedParts, SceneError> {
    let file = MeshFile { name, bytes, text: bytes };
    let (raw, materials) = obj::read_named(&file, &part_options(MeshFormat::Obj))?;
    Ok(named_parts(&file, raw, materials))
}

/// Reads the bytes of a PLY file whose faces have pictures by number; messages call it `name`.
///
/// # Errors
///
/// [`SceneError`] with file and line.
pub(crate) fn ply_parts(name: &str, bytes: &[u8]) -> Result<NamedParts, SceneError> {
    let file = MeshFile { name, bytes, text: bytes };
    let (raw, materials) = ply::read_named(&file, &part_options(MeshFormat::Ply))?;
    Ok(named_parts(&file, raw, materials))
}

fn part_options(format: MeshFormat) -> MeshOptions {
    let attributes =
        if format == MeshFormat::Obj { vec![MeshAttribute::VERTEX_COLOR.to_owned()] } else { Vec::new() };
    MeshOptions { format, flip_tex_coords: true, attributes, ..MeshOptions::default() }
}

fn named_parts(file: &MeshFile<'_>, raw: RawMesh<'_>, materials: NamedMaterials) -> NamedParts {
    let RawMesh { mut mesh, dropped, left, mut warnings, .. } = raw;
    warnings.extend(file.told(dropped));
    warnings.extend(file.left_over(&left));
    // Before it is cut at the seams.
    if mesh.normals.is_empty() {
        mesh.normals = normals::from_faces(&mesh, &DMat3::IDENTITY);
    } else if mesh.normals.contains(&normals::MISSING) {
        let made = normals::from_faces(&mesh, &DMat3::IDENTITY);
        let missing = mesh.normals.iter_mut().zip(made).filter(|(normal, _)| **normal == normals::MISSING);
        missing.for_each(|(normal, made)| *normal = made);
    }
    NamedParts { mesh, materials, warnings }
}
