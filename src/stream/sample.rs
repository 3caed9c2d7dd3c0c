//! The record of the stream.

use crate::color::Xyz;

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

const _: () = {
    assert!(size_of::<Sample>() == 24);
    assert!(std::mem::offset_of!(Sample, xyz) == 8);
    assert!(std::mem::offset_of!(Sample, w) == 20);
};
