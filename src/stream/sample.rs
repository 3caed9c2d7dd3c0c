//! One sample of the stream.

use crate::color::Xyz;

/// Largest `|x|`, `|y|`, `|z|`, `|w|` in the stream, 2^100 ≈ 1.3e30. Sums of 2^27 such samples stay finite in `f32`, and no
/// radiance comes near it.
pub const MAX_VALUE: f32 = 1_267_650_600_228_229_401_496_703_205_376.0;

/// One point sample, `[u, v], [x, y, z, w]`, in 24 bytes (paper §3.1).
///
/// `w > 0` is the camera stream, which is averaged: `x, y, z` are already multiplied by `w`.
/// `w = −1` is the light stream, which is summed. Other weights never enter the stream.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Sample {
    /// Screen position: (0, 0) is the top left corner of the picture, (1, 1) the bottom right. Overscan lies outside.
    pub uv: [f32; 2],
    /// CIE XYZ, on the camera stream multiplied by `w`.
    pub xyz: Xyz,
    /// Weight and stream.
    pub w: f32,
}

impl Sample {
    /// True if colour and weight are numbers within ±[`MAX_VALUE`].
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
