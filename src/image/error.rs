//! What can go wrong with image files; every message names the file and what to do.

use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

/// An error of reading, writing or comparing pictures.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The name does not say which format is wanted.
    #[error("cannot tell the format of {}: the name must end in .exr or .png", path.display())]
    Extension {
        /// The file.
        path: PathBuf,
    },

    /// The system refused to write.
    #[error("cannot write {}: {source}; {advice}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: Error,
        /// What to do.
        advice: &'static str,
    },

    /// The system refused to read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: Error,
    },

    /// The picture cannot be put into this format.
    #[error("cannot store a picture in {}: {reason}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// What the format lacks.
        reason: String,
    },

    /// The file is not what its name says, or is damaged.
    #[error("{} is no picture that can be read: {reason}; write it again or choose another file", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },

    /// A channel that is needed is not in the file.
    #[error("{} has no channel {channel}: it holds {found}", path.display())]
    Channel {
        /// The file.
        path: PathBuf,
        /// Name of the channel.
        channel: String,
        /// Names of the channels that are there.
        found: String,
    },

    /// It is not clear which channels of the file are the picture.
    #[error("cannot tell which channels of {} are the picture: {reason}", path.display())]
    Layer {
        /// The file.
        path: PathBuf,
        /// What was looked for and what there is.
        reason: String,
    },

    /// The picture has more pixels than a comparison can take.
    #[error("a picture of {}×{} pixels is too large to be compared: cut both to {most} pixels", size.0, size.1)]
    TooLarge {
        /// Width and height.
        size: (usize, usize),
        /// Most pixels.
        most: usize,
    },

    /// Pictures of different sizes cannot be compared.
    #[error("cannot compare pictures of {}×{} and {}×{} pixels: render both at the same size", a.0, a.1, b.0, b.1)]
    Size {
        /// Width and height of the first.
        a: (usize, usize),
        /// Width and height of the second.
        b: (usize, usize),
    },
}

impl ImageError {
    /// A failed write, with advice by its kind.
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
}
