//! Writing files so that a name holds either the old picture or the whole new one.

use std::fs;
use std::io::{BufWriter, Error, ErrorKind, Write};
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
    check_place(path)?;
    Ok(format)
}

/// As [`check_target`], for a file of any name.
///
/// # Errors
/// [`ImageError::Write`].
pub fn check_place(path: &Path) -> Result<(), ImageError> {
    let temporary = temporary_name(&destination(path)?);
    fs::File::create(&temporary).map_err(|e| ImageError::write(path, e))?;
    fs::remove_file(&temporary).map_err(|e| ImageError::write(path, e))
}

/// The file that `path` means: symbolic links followed, in its folder's own name. It need not exist yet.
///
/// # Errors
/// [`ImageError::Write`] when there is no such folder, or when a folder, a device or a pipe stands there: a rename
/// would put a file in its place.
pub fn destination(path: &Path) -> Result<PathBuf, ImageError> {
    let failed = |e| ImageError::write(path, e);
    let mut real = path.to_path_buf();
    // As many links as Linux follows.
    for _ in 0..40 {
        let Ok(next) = fs::read_link(&real) else { break };
        real = real.parent().unwrap_or(Path::new("")).join(next);
    }
    match fs::metadata(&real) {
        Ok(known) if known.is_dir() => return Err(failed(ErrorKind::IsADirectory.into())),
        Ok(known) if !known.is_file() => {
            return Err(failed(Error::new(ErrorKind::InvalidInput, "this is no regular file")));
        }
        Err(e) if e.kind() != ErrorKind::NotFound => return Err(failed(e)),
        _ => {}
    }
    let folder = real.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = real.file_name().ok_or_else(|| failed(ErrorKind::IsADirectory.into()))?;
    Ok(folder.canonicalize().map_err(failed)?.join(name))
}

/// Writes `bytes` to a temporary file beside the [`destination`] of `path` and renames it to that.
///
/// # Errors
/// [`ImageError::Write`]; the temporary file is removed and what stood at `path` is as before.
pub fn atomically(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let real = destination(path)?;
    let temporary = temporary_name(&real);
    let written = fs::File::create(&temporary)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        .and_then(|()| fs::rename(&temporary, &real));
    written.map_err(|e| {
        // Best effort: the error that matters is the first one.
        let _ = fs::remove_file(&temporary);
        ImageError::write(path, e)
    })
}

/// A file that grows beside the [`destination`] of its name and takes its place when it is complete. Dropping it unfinished
/// removes it: what stood there is as before.
#[derive(Debug)]
pub struct Growing {
    file: BufWriter<fs::File>,
    temporary: PathBuf,
    real: PathBuf,
    path: PathBuf,
    done: bool,
}

impl Growing {
    /// Begins an empty file.
    ///
    /// # Errors
    /// [`ImageError::Write`].
    pub fn create(path: &Path) -> Result<Self, ImageError> {
        let real = destination(path)?;
        let temporary = temporary_name(&real);
        let file = fs::File::create(&temporary).map_err(|e| ImageError::write(path, e))?;
        Ok(Self { file: BufWriter::new(file), temporary, real, path: path.to_path_buf(), done: false })
    }

    /// Appends.
    ///
    /// # Errors
    /// [`ImageError::Write`].
    pub fn append(&mut self, text: &str) -> Result<(), ImageError> {
        self.file.write_all(text.as_bytes()).map_err(|e| ImageError::write(&self.path, e))
    }

    /// Puts the complete file in its place.
    ///
    /// # Errors
    /// [`ImageError::Write`]; the temporary file is removed.
    pub fn commit(mut self) -> Result<(), ImageError> {
        let written = self.file.flush().and_then(|()| self.file.get_ref().sync_all());
        let placed = written.and_then(|()| fs::rename(&self.temporary, &self.real));
        self.done = placed.is_ok();
        placed.map_err(|e| ImageError::write(&self.path, e))
    }
}

impl Drop for Growing {
    fn drop(&mut self) {
        if !self.done {
            // Best effort: nobody asks any more.
            let _ = fs::remove_file(&self.temporary);
        }
    }
}

/// A name in the same folder (a rename must not cross disks), of this process alone.
fn temporary_name(path: &Path) -> PathBuf {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    path.with_file_name(format!(".{name}.{}.part", std::process::id()))
}
