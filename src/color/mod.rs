//! Colour: CIE XYZ, the 1931 observer, display profiles, OKLab, false colours.

pub mod cie;
pub mod icc;
pub mod oklab;
pub mod palette;
pub mod pq;
pub mod profile;
pub mod srgb;
pub mod xyz;

pub use profile::{Profile, TransferTable};
pub use xyz::Xyz;
