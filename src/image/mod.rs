//! Image files as plain data: pixel grids, EXR and PNG files, comparison of pictures, mixes of light groups.
//!
//! A leaf module: it knows colour and mathematics, not tracers, films or devices. Files are written under a temporary name in the same
//! directory and renamed, so that a name never refers to an incomplete file.

pub mod bitmap;
pub mod colors;
pub mod compare;
pub mod data_uri;
pub mod error;
pub mod exr;
pub mod grid;
pub(crate) mod ktx2;
pub mod layer;
pub mod mix;
mod pfm;
pub mod png;
pub mod push_pull;
mod radiance;
pub mod stereo;
mod views;
pub mod write;

pub use error::ImageError;
pub use grid::Grid;

/// Value of a metadata attribute.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// Text in UTF-8.
    Text(String),
    /// A number.
    Number(f64),
    /// Bytes whose meaning only the program knows that wrote them.
    Bytes(Vec<u8>),
}

/// As reports and the texts of PNG files tell it.
impl std::fmt::Display for Attribute {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Number(number) => write!(f, "{number}"),
            Self::Bytes(bytes) => write!(f, "{} bytes", bytes.len()),
        }
    }
}
