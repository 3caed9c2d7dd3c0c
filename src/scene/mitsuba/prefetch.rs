//! Reads the files that a scene names before anything asks for them, in parallel.
//!
//! The reader then takes the same data that it would have read itself, and errors come where it would have met them. A file that cannot be told
//! beforehand, or does not fit the limits of a scene, is left to the reader.
//!
//! Decoding the pictures of textures may take seconds. For a preview each large one is replaced by a single texel
//! ([`NamedFiles::without_large_pictures`]).

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use rayon::prelude::*;

use super::document::{Document, ElementId};
use super::params::Params;
use super::prefetched::{Prefetched, read_bitmap};
use super::shape::{mesh_file, mesh_format};

use crate::image::bitmap::Bitmap;
use crate::scene::limits;
use crate::scene::mesh::{self, MeshOptions};
use crate::spectrum::Spectrum;

/// Bytes from which on the file of a picture is large: one of fewer is decoded within a few milliseconds.
const LARGE: u64 = 1 << 18;

/// Bytes of all large pictures from which on a preview is worth showing: their decoding takes some tenths of a second.
const LONG: u64 = 1 << 24;

/// The texel that stands for a picture in a preview: a medium grey, and for raw values, which may be directions of normals, the one
/// that points away from the surface.
const GREY: [u8; 3] = [128; 3];
const RAW: [u8; 3] = [128, 128, 255];

/// The files of meshes and textures that a document names.
pub(crate) struct NamedFiles {
    meshes: BTreeSet<(PathBuf, MeshOptions)>,
    /// With whether their values are raw.
    bitmaps: BTreeSet<(PathBuf, bool)>,
}

/// A file that the scene names.
enum NamedFile {
    Mesh(PathBuf, MeshOptions),
    Bitmap(PathBuf, bool),
}

impl NamedFiles {
    /// The files of `document`.
    pub(crate) fn of(document: &Document) -> Self {
        let (mut meshes, mut bitmaps) = (BTreeSet::new(), BTreeSet::new());
        for id in (0..document.elements.len() as u32).map(ElementId) {
            match named(document, id) {
                Some(NamedFile::Mesh(path, options)) => _ = meshes.insert((path, options)),
                Some(NamedFile::Bitmap(path, raw)) => _ = bitmaps.insert((path, raw)),
                None => {}
            }
        }
        let mut textures = document.elements.iter().filter(|element| element.tag.name == "texture");
        if textures.any(|texture| texture.value("type") == Some("mesh_attribute")) {
            // Which attributes of a mesh are read depends on its material.
            meshes.clear();
        }
        Self { meshes, bitmaps }
    }

    /// Whether decoding the pictures takes so long that a preview is worth showing.
    pub(crate) fn have_large_pictures(&self) -> bool {
        self.bitmaps.iter().map(|(path, _)| size(path)).filter(|size| *size >= LARGE).sum::<u64>() >= LONG
    }

    /// Reads all meshes, and of the pictures those that are small; one texel stands for each of the others.
    pub(crate) fn without_large_pictures(&self, document: &Document) -> Prefetched {
        let is_large = |(path, _): &&(PathBuf, bool)| size(path) >= LARGE;
        let (large, small): (Vec<_>, Vec<_>) = self.bitmaps.iter().partition(is_large);
        let mut read = read(document, self.meshes.iter().collect(), small);
        let stand_in = |(path, raw): &(PathBuf, bool)| {
            let texel = if *raw { RAW } else { GREY };
            ((path.clone(), *raw), Ok(Bitmap::of_eight_bits(1, vec![texel], *raw)))
        };
        read.bitmaps.extend(large.into_iter().map(stand_in));
        read
    }

    /// Reads all files but the meshes that are in `known` already, which are taken from there.
    pub(crate) fn read(&self, document: &Document, known: Prefetched) -> Prefetched {
        let missing = self.meshes.iter().filter(|mesh| !known.meshes.contains_key(mesh)).collect();
        let mut all = read(document, missing, self.bitmaps.iter().collect());
        all.meshes.extend(known.meshes);
        all
    }
}

/// Does parallel work on threads of its own, so that those of the program can show a picture meanwhile.
pub(crate) fn on_own_threads<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().build() {
        Ok(threads) => threads.install(work),
        // The system gives no more threads.
        Err(_) => work(),
    }
}

/// The size of a file in bytes; 0 where it cannot be told.
fn size(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |meta| meta.len())
}

/// Reads these meshes and pictures.
fn read(
    document: &Document,
    meshes: Vec<&(PathBuf, MeshOptions)>,
    bitmaps: Vec<&(PathBuf, bool)>,
) -> Prefetched {
    let (triangles, bytes, texels) = (AtomicUsize::new(0), AtomicU64::new(0), AtomicUsize::new(0));
    let textured = !bitmaps.is_empty();
    let meshes = meshes.into_par_iter().filter_map(|key| {
        let (path, options) = key;
        let fits = bytes.fetch_add(size(path), Ordering::Relaxed) + size(path) <= limits::TOTAL_MESH_BYTES
            && triangles.load(Ordering::Relaxed) <= limits::SCENE_TRIANGLES;
        fits.then(|| {
            let read = mesh::load(&document.files, path, options);
            let count = read.as_ref().map_or(0, |read| read.mesh.triangles.len());
            triangles.fetch_add(count, Ordering::Relaxed);
            (key.clone(), read)
        })
    });
    let bitmaps = bitmaps.into_par_iter().filter_map(|key| {
        (texels.load(Ordering::Relaxed) <= limits::TOTAL_TEXELS).then(|| {
            let read = read_bitmap(&document.files, &key.0, key.1);
            let count = read.as_ref().map_or(0, |bitmap| bitmap.width() * bitmap.height());
            texels.fetch_add(count, Ordering::Relaxed);
            (key.clone(), read)
        })
    });
    let (meshes, bitmaps): (Vec<_>, Vec<_>) = rayon::join(|| meshes.collect(), || bitmaps.collect());
    if textured {
        // Ready when the first path needs it, while the scene is prepared.
        rayon::spawn(Spectrum::prepare_textures);
    }
    Prefetched { meshes: meshes.into_iter().collect(), bitmaps: bitmaps.into_iter().collect() }
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
