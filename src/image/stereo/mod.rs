//! Stereo pictures: the display pictures of both eyes as one picture, and JPEG files that hold both.
//!
//! | file | content |
//! |---|---|
//! | `layout.rs` | [`StereoLayout`]: which pixel of which eye each pixel of the composed picture shows |
//! | `places.rs` | which place of which eye's picture a place of the composed picture shows |
//! | `anaglyph.rs` | [`Anaglyph`]: the matrices that mix both eyes for coloured glasses |
//! | `coding.rs` | [`DisplayCoding`]: linear light of the encoded values |
//! | `compose.rs` | [`compose`]: the composed picture, pixel by pixel |
//! | `files.rs` | [`StereoFormat`], pairs of PNG files, JPS and MPO |
//!
//! Mapping and matrices are data without a device, so that a shader can be their twin. Multi-view EXR files are those of
//! [`exr`](crate::image::exr).

mod anaglyph;
mod coding;
mod compose;
mod files;
mod layout;
mod places;

pub use anaglyph::Anaglyph;
pub use coding::DisplayCoding;
pub use compose::compose;
pub use files::{StereoFormat, pair_paths, write_jps, write_mpo};
pub use layout::{StereoLayout, StereoSource};

/// One of the two eyes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Eye {
    /// The left eye.
    Left,
    /// The right eye.
    Right,
}

impl Eye {
    /// Both, the left one first.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// The name of its view in files (OpenEXR, “Storing Multi-View Images”).
    pub const fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

/// Why two pictures cannot be composed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StereoError {
    /// The eyes see pictures of different sizes.
    #[error(
        "the left eye's picture has {}×{} pixels and the right eye's {}×{}: render both at the same size",
        left[0], left[1], right[0], right[1]
    )]
    Size {
        /// Width and height of the left eye's picture.
        left: [usize; 2],
        /// Width and height of the right eye's picture.
        right: [usize; 2],
    },
    /// The composed picture does not fit into memory.
    #[error("a stereo picture of {}×{} pixels does not fit into memory: render a smaller one", size[0], size[1])]
    Memory {
        /// Its width and height.
        size: [usize; 2],
    },
    /// The values are not 8-bit signals of a display.
    #[error("a stereo picture is composed of the 8-bit values of an ordinary display, and these are {0}")]
    Encoding(&'static str),
}
