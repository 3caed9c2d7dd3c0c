//! Reads files safely: regular files only, up to a limit of bytes. Keeps count of them for those who wait or watch.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::scene::diagnostic::FindingKind;

/// The reason why a file could not be read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ReadError {
    /// The operating system reports an error.
    #[error("cannot read {path}: {source}")]
    Io { path: String, source: std::io::Error },
    /// A folder, a pipe or a device.
    #[error("{0} is not a regular file")]
    NotAFile(String),
    /// Larger than the reader accepts.
    #[error("{path} is larger than {limit} bytes")]
    TooLarge { path: String, limit: u64 },
}

impl ReadError {
    /// The kind of finding this becomes.
    pub(crate) fn kind(&self) -> FindingKind {
        match self {
            ReadError::TooLarge { .. } => FindingKind::Limit,
            _ => FindingKind::File,
        }
    }
}

/// The bytes of a regular file of at most `limit` bytes.
pub(crate) fn read_bytes(path: &Path, limit: u64) -> Result<Vec<u8>, ReadError> {
    let name = || path.display().to_string();
    let io = |source| ReadError::Io { path: name(), source };
    let meta = std::fs::metadata(path).map_err(io)?;
    if !meta.is_file() {
        return Err(ReadError::NotAFile(name())); // opening a pipe would wait for ever
    }
    let too_large = || ReadError::TooLarge { path: name(), limit };
    if meta.len() > limit {
        return Err(too_large());
    }
    let mut bytes = Vec::with_capacity(meta.len() as usize);
    File::open(path).map_err(io)?.take(limit + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > limit { Err(too_large()) } else { Ok(bytes) }
}

/// How far the reading of a scene is, for other threads. What was read is known even where the reading fails.
#[derive(Debug, Default)]
pub struct LoadProgress {
    files: Mutex<Vec<PathBuf>>,
    named: AtomicUsize,
    film: OnceLock<[u32; 2]>,
}

impl LoadProgress {
    /// The files that were opened, in their order; the last one may still be being read.
    pub fn files(&self) -> Vec<PathBuf> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Number of files that the scene is known to name so far, at least those that were opened.
    pub fn total(&self) -> usize {
        let opened = self.files.lock().unwrap_or_else(PoisonError::into_inner).len();
        opened.max(self.named.load(Ordering::Relaxed))
    }

    /// Size of the film in pixels, as soon as it is known.
    pub fn film(&self) -> Option<[u32; 2]> {
        self.film.get().copied()
    }

    pub(crate) fn tell_film(&self, size: [u32; 2]) {
        let _ = self.film.set(size); // the first one counts, as for the scene
    }

    pub(crate) fn tell_named(&self, files: usize) {
        self.named.store(files, Ordering::Relaxed);
    }

    fn opened(&self, path: &Path) {
        let mut files = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        if !files.iter().any(|known| known == path) {
            files.push(path.to_owned());
        }
    }
}

/// The files of a scene: those on disk, and those that the reader of a model has made.
#[derive(Debug, Default)]
pub(crate) struct SceneFiles {
    made: BTreeMap<PathBuf, Vec<u8>>,
    pub(crate) progress: Arc<LoadProgress>,
}

impl SceneFiles {
    /// Adds files that are only in memory.
    pub(crate) fn add(&mut self, made: BTreeMap<PathBuf, Vec<u8>>) {
        self.made.extend(made);
    }

    /// The same files without those that are only in memory.
    pub(crate) fn on_disk(&self) -> Self {
        Self { made: BTreeMap::new(), progress: Arc::clone(&self.progress) }
    }

    /// The bytes of a file of at most `limit` bytes.
    pub(crate) fn read(&self, path: &Path, limit: u64) -> Result<Cow<'_, [u8]>, ReadError> {
        if let Some(bytes) = self.made.get(path) {
            return Ok(Cow::Borrowed(bytes));
        }
        self.progress.opened(path);
        read_bytes(path, limit).map(Cow::Owned)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_folders_and_large_files_are_refused() {
        assert!(matches!(read_bytes(Path::new("/dev/zero"), 10), Err(ReadError::NotAFile(_))));
        assert!(matches!(read_bytes(Path::new("src"), 10), Err(ReadError::NotAFile(_))));
        assert!(matches!(
            read_bytes(Path::new("Cargo.toml"), 10),
            Err(ReadError::TooLarge { limit: 10, .. })
        ));
        assert!(matches!(read_bytes(Path::new("does/not/exist"), 10), Err(ReadError::Io { .. })));
    }
}
