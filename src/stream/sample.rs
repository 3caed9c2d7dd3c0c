//! The record of the stream.

use crate::color::Xyz;

/// Largest `|x|`, `|y|`, `|z|`, `|w|` that enters the stream, 2^100 ≈ 1.3e30: sums of 2^27 such samples stay finite
/// in `f32`, and no radiance comes near.
pub const MAX_VALUE: f32 = 1_267_650_600_228_229_401_496_703_205_376.0;

/// One point sample, `[u, v], [x, y, z, w]`, 24 bytes on the wire (paper §3.1).
///
/// `w > 0`: camera stream, averaged: `x, y, z` are already multiplied by `w`.
/// `w < 0`: light stream, summed; `w` is exactly −1. Zero and NaN weights never enter the stream.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Sample {
    /// Screen position: (0, 0) is the top left corner of the picture, (1, 1) the bottom right; overscan lies outside.
    pub uv: [f32; 2],
    /// CIE XYZ, times `w` on the camera stream.
    pub xyz: Xyz,
    /// Weight and stream, see above.
    pub w: f32,
}

impl Sample {
    /// True when colour and weight are numbers within ±[`MAX_VALUE`].
    #[inline]
    pub fn in_range(&self) -> bool {
        let Sample { xyz: Xyz { x, y, z }, w, .. } = *self;
        // False for NaN as well.
        [x, y, z, w].iter().all(|v| v.abs() <= MAX_VALUE)
    }
}

const _: () = {
    assert!(size_of::<Sample>() == 24);
    assert!(std::mem::offset_of!(Sample, xyz) == 8);
    assert!(std::mem::offset_of!(Sample, w) == 20);
};
