//! Files of meshes and pictures that were read before a plugin asked for them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::image::bitmap::Bitmap;
use crate::image::error::ImageError;
use crate::scene::files::{ReadError, SceneFiles};
use crate::scene::limits;
use crate::scene::mesh::{MeshError, MeshOptions, MeshRead};

/// Files that were read, by all that decides what is read.
#[derive(Default)]
pub(crate) struct Prefetched {
    pub(crate) meshes: BTreeMap<(PathBuf, MeshOptions), Result<MeshRead, MeshError>>,
    /// By file, and whether the values are raw.
    pub(crate) bitmaps: BTreeMap<(PathBuf, bool), Result<Bitmap, BitmapError>>,
}

impl Prefetched {
    /// The meshes that were read without an error; they are shared.
    pub(crate) fn meshes_again(&self) -> Self {
        let read = |(key, read): (&(PathBuf, MeshOptions), &Result<MeshRead, MeshError>)| {
            let read = read.as_ref().ok()?;
            Some((key.clone(), Ok(read.clone())))
        };
        Self { meshes: self.meshes.iter().filter_map(read).collect(), bitmaps: BTreeMap::new() }
    }
}

/// Why the picture of a texture cannot be used.
pub(crate) enum BitmapError {
    Unreadable(ReadError),
    Damaged(ImageError),
}

/// The picture of a file.
pub(crate) fn read_bitmap(files: &SceneFiles, path: &Path, raw: bool) -> Result<Bitmap, BitmapError> {
    let bytes = files.read(path, limits::IMAGE_BYTES).map_err(BitmapError::Unreadable)?;
    Bitmap::decode(path, &bytes, raw, limits::IMAGE_PIXELS).map_err(BitmapError::Damaged)
}
