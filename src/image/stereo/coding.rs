//! Linear light of the 8-bit values of a display, and of linear light the values.

use glam::{Mat3, Vec3};

use crate::color::profile::rec709_from_xyz;
use crate::color::{Profile, srgb};
use crate::image::colors;

/// The encoding of a display: a table of each channel's 256 values, and the colours of its primaries.
///
/// Values are rounded such that decoding and encoding leave all of them as they are, but for those that an ICC profile's tone curves map
/// to the same light.
#[derive(Clone, Debug)]
pub struct DisplayCoding {
    /// Linear light of every value, by channel.
    linear: [[f32; 256]; 3],
    /// Least linear light that is rounded to a value above the index, by channel.
    edges: [[f32; 255]; 3],
    /// The colours of the primaries.
    gamut: Gamut,
}

/// The colours of a display's primaries.
#[derive(Clone, Debug)]
enum Gamut {
    /// Those of Rec.709 and sRGB.
    Rec709,
    /// Others: the matrices to linear Rec.709 and back.
    Other([Mat3; 2]),
}

impl DisplayCoding {
    /// The encoding of a profile: by its own tone curves or, where it has none, by a power.
    pub fn new(profile: &Profile, gamma: f32) -> Self {
        let curves = |signal: f32| match &profile.transfer {
            Some(table) => table.invert(signal),
            None => Vec3::splat(signal.powf(gamma)),
        };
        let [red, green, blue] = profile.primaries;
        let gamut = match colors::are_rec709(&[red, green, blue, colors::REC_709[3]]) {
            true => Gamut::Rec709,
            false => {
                let to_rec709 = rec709_from_xyz() * profile.from_xyz.inverse();
                Gamut::Other([to_rec709, to_rec709.inverse()])
            }
        };
        Self::of(curves, gamut)
    }

    /// The encoding of sRGB (IEC 61966-2-1), which files without colour metadata are taken to have.
    pub fn srgb() -> Self {
        Self::of(|signal| Vec3::splat(srgb::decode(signal)), Gamut::Rec709)
    }

    fn of(curves: impl Fn(f32) -> Vec3, gamut: Gamut) -> Self {
        let at = |c: usize, value: f32| curves(value / 255.0)[c];
        Self {
            linear: std::array::from_fn(|c| std::array::from_fn(|value| at(c, value as f32))),
            edges: std::array::from_fn(|c| std::array::from_fn(|value| at(c, value as f32 + 0.5))),
            gamut,
        }
    }

    /// Whether the primaries are those of Rec.709 and sRGB.
    pub fn is_rec709(&self) -> bool {
        matches!(self.gamut, Gamut::Rec709)
    }

    /// Least linear light that is rounded to a value above the index, by channel; ascending.
    pub fn edges(&self) -> &[[f32; 255]; 3] {
        &self.edges
    }

    /// Linear light of the display's primaries.
    #[inline]
    pub fn decode(&self, rgb: [u8; 3]) -> Vec3 {
        Vec3::from(std::array::from_fn(|c| self.linear[c][usize::from(rgb[c])]))
    }

    /// The values nearest in signal to linear light of the display's primaries, which is clipped to 0 … 1. NaN is 0.
    #[inline]
    pub fn encode(&self, light: Vec3) -> [u8; 3] {
        let light = light.to_array();
        std::array::from_fn(|c| self.edges[c].partition_point(|edge| *edge <= light[c]) as u8)
    }

    /// Linear Rec.709 of linear light of the display's primaries; negative where Rec.709 lacks the colour.
    #[inline]
    pub fn rec709_from_display(&self, light: Vec3) -> Vec3 {
        match &self.gamut {
            Gamut::Rec709 => light,
            Gamut::Other([to_rec709, _]) => *to_rec709 * light,
        }
    }

    /// Linear light of the display's primaries of linear Rec.709.
    #[inline]
    pub fn display_from_rec709(&self, light: Vec3) -> Vec3 {
        match &self.gamut {
            Gamut::Rec709 => light,
            Gamut::Other([_, from_rec709]) => *from_rec709 * light,
        }
    }
}
