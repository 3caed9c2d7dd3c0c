//! Pictures as plain data: pixel grids, EXR and PNG files, comparison of pictures, mixes of pictures by groups of lights.
//!
//! A leaf: knows colour and mathematics, and nothing of tracers, films or devices. Files are written to
//! a temporary name in the same folder and renamed, so that a name never holds half a picture.

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
pub mod write;

pub use error::ImageError;
pub use grid::Grid;

/// What a file tells about how it was made.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// Text in UTF-8.
    Text(String),
    /// A number.
    Number(f64),
}
