//! Reads files safely: regular files only, up to a limit of bytes.

use std::fs::File;
use std::io::Read;
use std::path::Path;

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
