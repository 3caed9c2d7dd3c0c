//! Replacing files in one step: a name holds either the old file or the complete new one.
//!
//! Every file that the program replaces goes through [`AtomicFile`]: pictures, reports, tables, timings, saved scenes. Where the
//! system refuses, the error is [`ImageError::Write`], and what stood there is as before.

use std::fs;
use std::io::{BufWriter, Error, ErrorKind, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::image::error::ImageError;

/// Formats that can be written, told by the end of the name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileFormat {
    /// OpenEXR: scene-linear floats, all layers.
    Exr,
    /// PNG: the displayed picture.
    Png,
}

impl FileFormat {
    /// The format that a name asks for; [`ImageError::Extension`] for names that end in neither `.exr` nor `.png` (in any case).
    pub fn of(path: &Path) -> Result<Self, ImageError> {
        let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        match extension.as_deref() {
            Some("exr") => Ok(FileFormat::Exr),
            Some("png") => Ok(FileFormat::Png),
            _ => Err(ImageError::Extension { path: path.to_path_buf() }),
        }
    }
}

/// Fails early where [`atomically`] would fail late: a long render should not end at a missing folder.
pub fn check_target(path: &Path) -> Result<FileFormat, ImageError> {
    let format = FileFormat::of(path)?;
    check_place(path)?;
    Ok(format)
}

/// As [`check_target`], for a file of any name.
pub fn check_place(path: &Path) -> Result<(), ImageError> {
    AtomicFile::create(path).map(drop)
}

/// The file that `path` means: symbolic links followed, in its folder's own name. It need not exist yet, but a folder, a device
/// or a pipe that stands there is refused: a rename would put a file in its place.
fn destination(path: &Path) -> Result<PathBuf, ImageError> {
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

/// True when both paths name the same file, whether it exists or not.
pub fn same_file(a: &Path, b: &Path) -> bool {
    a == b || matches!((destination(a), destination(b)), (Ok(a), Ok(b)) if a == b)
}

/// Replaces the file at `path` by one that holds `bytes`.
pub fn atomically(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let mut file = AtomicFile::create(path)?;
    file.append(bytes)?;
    file.commit()
}

/// A file that is written beside the destination of its name and takes its place when it is complete.
///
/// Dropping it unfinished removes it: what stood there is as before.
#[derive(Debug)]
pub struct AtomicFile {
    file: BufWriter<NamedTempFile>,
    destination: PathBuf,
    path: PathBuf,
}

impl AtomicFile {
    /// Begins an empty file in the folder of its destination, because a rename must not cross disks.
    pub fn create(path: &Path) -> Result<Self, ImageError> {
        let destination = destination(path)?;
        let folder = destination.parent().unwrap_or(Path::new("."));
        let name = destination.file_name().unwrap_or_default().to_string_lossy();
        let prefix = format!(".{name}.");
        let mut builder = tempfile::Builder::new();
        builder.prefix(&prefix).suffix(".part");
        // A temporary file is private by default; this one becomes an ordinary file, as the umask has it.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(folder).map_err(|e| ImageError::write(path, e))?;
        Ok(Self { file: BufWriter::new(file), destination, path: path.to_path_buf() })
    }

    /// Appends.
    pub fn append(&mut self, bytes: impl AsRef<[u8]>) -> Result<(), ImageError> {
        self.file.write_all(bytes.as_ref()).map_err(|e| ImageError::write(&self.path, e))
    }

    /// Puts the complete file in its place; where that fails, the temporary file is removed.
    pub fn commit(self) -> Result<(), ImageError> {
        let file = self.file.into_inner().map_err(|e| e.into_error());
        let placed = file.and_then(|file| {
            file.as_file().sync_all()?;
            file.persist(&self.destination).map_err(|e| e.error)
        });
        placed.map(drop).map_err(|e| ImageError::write(&self.path, e))
    }
}
