//! Atomic replacement of files: a name refers to either the old file or the complete new one.
//!
//! Every file that the program replaces is written with [`AtomicFile`]: pictures, reports, tables, timings, saved scenes. On a system
//! error, [`ImageError::Write`], the old file stays unchanged.

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

/// Checks early what [`atomically`] would only report late: a long render should not fail on a missing directory.
pub fn check_target(path: &Path) -> Result<FileFormat, ImageError> {
    let format = FileFormat::of(path)?;
    check_place(path)?;
    Ok(format)
}

/// As [`check_target`], for a file of any name.
pub fn check_place(path: &Path) -> Result<(), ImageError> {
    AtomicFile::create(path).map(drop)
}

/// Resolves symbolic links and the directory of `path`. The file need not exist yet; an existing directory, device or pipe is rejected,
/// since the rename would replace it.
fn destination(path: &Path) -> Result<PathBuf, ImageError> {
    let failed = |e| ImageError::write(path, e);
    let mut real = path.to_path_buf();
    // Link limit of Linux.
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

/// Whether both paths refer to the same file, existing or not.
pub fn same_file(a: &Path, b: &Path) -> bool {
    a == b || matches!((destination(a), destination(b)), (Ok(a), Ok(b)) if a == b)
}

/// Replaces the file at `path` by one that holds `bytes`.
pub fn atomically(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let mut file = AtomicFile::create(path)?;
    file.append(bytes)?;
    file.commit()
}

/// A file written beside its destination and renamed to it when complete.
///
/// If dropped unfinished, it is removed and the old file stays unchanged.
#[derive(Debug)]
pub struct AtomicFile {
    file: BufWriter<NamedTempFile>,
    destination: PathBuf,
    path: PathBuf,
}

impl AtomicFile {
    /// Creates an empty file in the destination's directory, because a rename cannot cross file systems.
    pub fn create(path: &Path) -> Result<Self, ImageError> {
        let destination = destination(path)?;
        let folder = destination.parent().unwrap_or(Path::new("."));
        let name = destination.file_name().unwrap_or_default().to_string_lossy();
        let prefix = format!(".{name}.");
        let mut builder = tempfile::Builder::new();
        builder.prefix(&prefix).suffix(".part");
        // Temporary files are private by default; this one gets the permissions of an ordinary file under the umask.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(folder).map_err(|e| ImageError::write(path, e))?;
        Ok(Self { file: BufWriter::new(file), destination, path: path.to_path_buf() })
    }

    /// Appends bytes.
    pub fn append(&mut self, bytes: impl AsRef<[u8]>) -> Result<(), ImageError> {
        self.file.write_all(bytes.as_ref()).map_err(|e| ImageError::write(&self.path, e))
    }

    /// Renames the complete file to its destination; if that fails, the temporary file is removed.
    pub fn commit(self) -> Result<(), ImageError> {
        let file = self.file.into_inner().map_err(|e| e.into_error());
        let placed = file.and_then(|file| {
            file.as_file().sync_all()?;
            file.persist(&self.destination).map_err(|e| e.error)
        });
        placed.map(drop).map_err(|e| ImageError::write(&self.path, e))
    }
}
