//! Reads the files that a scene names before anything asks for them, in parallel.
//!
//! The reader then takes the same data that it would have read itself, and errors come where it would have met them. A file that cannot be told
//! beforehand, or does not fit the limits of a scene, is left to the reader.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use rayon::prelude::*;

use super::document::{Document, ElementId};
use super::params::Params;
use super::prefetched::{Prefetched, read_bitmap};
use super::shape::{mesh_file, mesh_format};

use crate::scene::limits;
use crate::scene::mesh::{self, MeshOptions};
use crate::spectrum::Spectrum;

/// A file that the scene names.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum NamedFile {
    Mesh(PathBuf, MeshOptions),
    Bitmap(PathBuf, bool),
}

/// Reads all files of meshes and textures of `document`.
pub(crate) fn prefetch(document: &Document) -> Prefetched {
    let ids = (0..document.elements.len() as u32).map(ElementId);
    let mut files: BTreeSet<NamedFile> = ids.filter_map(|id| named(document, id)).collect();
    let mut textures = document.elements.iter().filter(|element| element.tag.name == "texture");
    if textures.any(|texture| texture.value("type") == Some("mesh_attribute")) {
        // Which attributes of a mesh are read depends on its material.
        files.retain(|file| !matches!(file, NamedFile::Mesh(..)));
    }
    let textured = files.iter().any(|file| matches!(file, NamedFile::Bitmap(..)));
    let (triangles, bytes, texels) = (AtomicUsize::new(0), AtomicU64::new(0), AtomicUsize::new(0));
    let read = files.into_par_iter().map(|file| {
        let mut one = Prefetched::default();
        match file {
            NamedFile::Mesh(path, options) => {
                let size = std::fs::metadata(&path).map_or(0, |m| m.len());
                let fits = bytes.fetch_add(size, Ordering::Relaxed) + size <= limits::TOTAL_MESH_BYTES
                    && triangles.load(Ordering::Relaxed) <= limits::SCENE_TRIANGLES;
                if fits {
                    let read = mesh::load(&document.files, &path, &options);
                    let count = read.as_ref().map_or(0, |read| read.mesh.triangles.len());
                    triangles.fetch_add(count, Ordering::Relaxed);
                    one.meshes.insert((path, options), read);
                }
            }
            NamedFile::Bitmap(path, raw) => {
                if texels.load(Ordering::Relaxed) <= limits::TOTAL_TEXELS {
                    let read = read_bitmap(&document.files, &path, raw);
                    let count = read.as_ref().map_or(0, |bitmap| bitmap.width() * bitmap.height());
                    texels.fetch_add(count, Ordering::Relaxed);
                    one.bitmaps.insert((path, raw), read);
                }
            }
        }
        one
    });
    let read: Vec<Prefetched> = read.collect();
    if textured {
        // Ready when the first path needs it, while the scene is prepared.
        rayon::spawn(Spectrum::prepare_textures);
    }
    let mut all = Prefetched::default();
    for one in read {
        // `append` would build the whole map anew for each file.
        all.meshes.extend(one.meshes);
        all.bitmaps.extend(one.bitmaps);
    }
    all
}

/// The file that an element names, if it can be told beforehand.
fn named(document: &Document, id: ElementId) -> Option<NamedFile> {
    let element = document.element(id);
    let plugin = element.value("type")?;
    match element.tag.name {
        "shape" => {
            let format = mesh_format(plugin)?;
            let params = Params::new(document, id).ok()?;
            let (path, options) = mesh_file(document, &params, &params.to_world().ok()?, format).ok()?;
            Some(NamedFile::Mesh(path, options))
        }
        "texture" if plugin == "bitmap" => {
            let params = Params::new(document, id).ok()?;
            let name = params.filename("", "").ok()?;
            let span = params.get("filename").map_or(params.span(), |e| e.span_of("value"));
            Some(NamedFile::Bitmap(document.resolve(&name, span), params.boolean("raw", false).ok()?))
        }
        _ => None,
    }
}
