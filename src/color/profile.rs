//! Display profiles: primaries, white and the matrix `P` from XYZ to linear RGB.

use glam::Mat3;

/// A matrix display profile.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Name on the command line.
    pub name: &'static str,
    /// XYZ (D65 white has Y = 1) to linear RGB.
    pub from_xyz: Mat3,
}

impl Profile {
    /// sRGB primaries, D65 white.
    pub fn srgb() -> Self {
        Profile { name: "srgb", from_xyz: Mat3::IDENTITY }
    }

    /// The profile of this name, or `None`.
    pub fn named(name: &str) -> Option<Self> {
        (name == "srgb").then(Self::srgb)
    }
}
