//! Colour: CIE XYZ, the 1931 observer, display profiles, the tone curve.

pub mod cie;
pub mod profile;
pub mod xyz;

pub use profile::Profile;
pub use xyz::Xyz;
