//! Writing files so that a name holds either the old picture or the whole new one.

use std::fs;
use std::io::{Error, ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::image::error::ImageError;

/// Formats that can be written, told by the end of the name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR: scene-linear floats, all layers.
    Exr,
    /// PNG: the displayed picture.
    Png,
}

impl Format {
    /// The format that a name asks for.
    ///
    /// # Errors
    /// [`ImageError::Extension`] for names that end in neither `.exr` nor `.png` (in any case).
    pub fn of(path: &Path) -> Result<Self, ImageError> {
        let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        match extension.as_deref() {
            Some("exr") => Ok(Format::Exr),
            Some("png") => Ok(Format::Png),
            _ => Err(ImageError::Extension { path: path.to_path_buf() }),
        }
    }
}

/// Fails early where [`atomically`] would fail late: a long render should not end at a missing folder.
///
/// # Errors
/// [`ImageError::Extension`], or [`ImageError::Write`] when no file can be made in the folder.
pub fn check_target(path: &Path) -> Result<Format, ImageError> {
    let format = Format::of(path)?;
    if path.is_dir() {
        return Err(ImageError::write(path, Error::from(ErrorKind::IsADirectory)));
    }
    let temporary = temporary_name(path);
    fs::File::create(&temporary).map_err(|e| ImageError::write(path, e))?;
    fs::remove_file(&temporary).map_err(|e| ImageError::write(path, e))?;
    Ok(format)
}

/// Writes `bytes` to a temporary file beside `path` and renames it to `path`.
///
/// # Errors
/// [`ImageError::Write`]; the temporary file is removed and what stood at `path` is as before.
pub fn atomically(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let temporary = temporary_name(path);
    let written = fs::File::create(&temporary)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        .and_then(|()| fs::rename(&temporary, path));
    written.map_err(|e| {
        // Best effort: the error that matters is the first one.
        let _ = fs::remove_file(&temporary);
        ImageError::write(path, e)
    })
}

/// A name in the same folder (a rename must not cross disks), of this process alone.
fn temporary_name(path: &Path) -> PathBuf {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    path.with_file_name(format!(".{name}.{}.part", std::process::id()))
}
