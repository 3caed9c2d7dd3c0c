//! PLY as a model: clay, in the colours of its vertices or faces, or with the pictures that its comments name.

use super::obj::{clay, parts, write_part};
use super::text::{SceneText, unreadable};
use crate::scene::diagnostic::SceneError;
use crate::scene::files::SceneFiles;
use crate::scene::{limits, mesh};

/// Reads a PLY file.
pub(super) fn read(text: &mut SceneText<'_>, files: &SceneFiles) -> Result<(), SceneError> {
    let path = text.path;
    let bytes = files.read(path, limits::MESH_BYTES).map_err(|e| unreadable(path, &e))?;
    let name = path.to_string_lossy();
    let mesh::PlySummary { color, pictures, has_uvs, numbered } = mesh::ply_summary(&name, &bytes)?;
    // Those that are there; places count, since faces have numbers.
    let found: Vec<Option<&String>> =
        pictures.iter().map(|name| Some(name).filter(|name| has_uvs && text.is_there(name))).collect();
    let unused =
        pictures.iter().zip(&found).filter(|(_, found)| found.is_none()).map(|(name, _)| name.as_str());
    let unused: Vec<&str> = unused.collect();
    if !unused.is_empty() {
        let why = if has_uvs { "not found" } else { "not used: the model has no texture coordinates" };
        text.note(format!("`TextureFile` names pictures that are {why}: {}", unused.join(", ")));
    }
    if let Some(first) = found.iter().flatten().next()
        && !numbered
    {
        if found.iter().flatten().count() > 1 {
            text.note(format!("faces have no `texnumber`, so that of the pictures only `{first}` is used"));
        }
        textured(text, "textured", first);
        // Photogrammetry counts v upwards.
        text.shape("ply", &text.own_name(), "textured", |text| {
            text.value("boolean", "flip_tex_coords", true)
        });
    } else if found.iter().any(Option::is_some) {
        let mesh::NamedParts { mesh, materials, warnings } = mesh::ply_parts(&name, &bytes)?;
        warnings.into_iter().for_each(|warning| text.warn(warning));
        let mut clay_is_there = false;
        for (i, (number, triangles)) in parts(&mesh, &materials.uses).iter().enumerate() {
            let picture = number.parse().ok().and_then(|i: usize| *found.get(i)?);
            let id = match picture {
                Some(picture) => {
                    let id = text.id(&format!("textured {i}"));
                    textured(text, &id, picture);
                    id
                }
                None => {
                    if !std::mem::replace(&mut clay_is_there, true) {
                        clay(text, None);
                    }
                    "clay".to_owned()
                }
            };
            write_part(text, i, &mesh, triangles, false, &id, |_| ());
        }
    } else {
        clay(text, color);
        text.shape("ply", &text.own_name(), "clay", |_| ());
    }
    Ok(())
}

/// Writes a material in the colours of a picture.
fn textured(text: &mut SceneText<'_>, id: &str, file: &str) {
    text.object("bsdf", "twosided", &[("id", id)], |text| {
        text.object("bsdf", "diffuse", &[], |text| {
            text.object("texture", "bitmap", &[("name", "reflectance")], |text| {
                text.value("string", "filename", file);
            });
        });
    });
}
