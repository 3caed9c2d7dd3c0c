//! Colour: CIE XYZ, the 1931 observer, display profiles, the tone curve.

pub mod cie;
pub mod icc;
pub mod pq;
pub mod profile;
pub mod xyz;

pub use profile::{Profile, TransferTable};
pub use xyz::Xyz;
