//! Errors of image files; every message names the file and what to do.

use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

/// An error of reading, writing or comparing pictures.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ImageError {
    /// The file name does not tell the format.
    #[error("cannot tell the format of {}: the name must end in .exr or .png", path.display())]
    Extension { path: PathBuf },

    /// The system refused to write.
    #[error("cannot write {}: {source}; {advice}", path.display())]
    Write { path: PathBuf, source: Error, advice: &'static str },

    /// The system refused to read.
    #[error("cannot read {}: {source}", path.display())]
    Read { path: PathBuf, source: Error },

    /// The picture cannot be encoded in this format.
    #[error("cannot store a picture in {}: {reason}", path.display())]
    Encode { path: PathBuf, reason: String },

    /// The file is not what its name says, or is damaged.
    #[error("{} is no picture that can be read: {reason}; write it again or choose another file", path.display())]
    Decode { path: PathBuf, reason: String },

    /// A required channel is missing.
    #[error("{} has no channel {channel}: it holds {found}", path.display())]
    Channel { path: PathBuf, channel: String, found: String },

    /// It is ambiguous which channels are the picture.
    #[error("cannot tell which channels of {} are the picture: {reason}", path.display())]
    Layer { path: PathBuf, reason: String },

    /// The picture is too large for a comparison.
    #[error("a picture of {}×{} pixels is too large to be compared: cut both to {most} pixels", size.0, size.1)]
    TooLarge { size: (usize, usize), most: usize },

    /// Pictures of different sizes cannot be compared.
    #[error("cannot compare pictures of {}×{} and {}×{} pixels: render both at the same size", a.0, a.1, b.0, b.1)]
    Size { a: (usize, usize), b: (usize, usize) },
}

impl ImageError {
    /// Converts a failed write, with advice by its kind.
    pub fn write(path: &Path, source: Error) -> Self {
        let advice = match source.kind() {
            ErrorKind::NotFound => "the folder does not exist: create it, or give another name",
            ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
                "choose a folder that you may write to"
            }
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::WriteZero => {
                "the disk is full: free some space, or write to another disk"
            }
            ErrorKind::IsADirectory => "the name is that of a folder: give a file name",
            ErrorKind::InvalidInput => {
                "a whole file is replaced, not a device, pipe or socket: give a file name"
            }
            ErrorKind::NotADirectory => "a part of the path is a file, not a folder: check the path",
            _ => "check the path, or write to another folder",
        };
        Self::Write { path: path.to_path_buf(), source, advice }
    }

    /// Converts a failed read.
    pub(super) fn read(path: &Path) -> impl FnOnce(Error) -> Self {
        move |source| Self::Read { path: path.to_path_buf(), source }
    }

    /// Converts a decoding error.
    pub(super) fn decode(path: &Path) -> impl Fn(String) -> Self + Copy {
        move |reason| Self::Decode { path: path.to_path_buf(), reason }
    }
}
