//! One sample of the stream, and the interface through which an integrator sends its samples.

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
    /// True if the colour consists of numbers from 0 to [`MAX_VALUE`], and the weight is a number within ±[`MAX_VALUE`].
    #[inline]
    pub fn is_sound(&self) -> bool {
        let Sample { xyz: Xyz { x, y, z }, w, .. } = *self;
        // False for NaN as well.
        [x, y, z, w.abs()].iter().all(|v| (0.0..=MAX_VALUE).contains(v))
    }
}

const _: () = {
    assert!(size_of::<Sample>() == 24);
    assert!(std::mem::offset_of!(Sample, xyz) == 8);
    assert!(std::mem::offset_of!(Sample, w) == 20);
};

/// Receives the samples of a path. Implementations reject samples that are not [sound](Sample::is_sound), and count them.
pub trait SampleSink {
    /// A camera sample at `uv`: radiance `value` with filter weight `weight > 0`.
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32);

    /// A light sample at `uv`: `value` is a density over uv (flux per unit of uv²), not divided by the number of light paths.
    fn light(&mut self, uv: [f32; 2], value: Xyz);

    /// A camera sample, with the part of `value` that comes from each group of lights, in order of the groups. All samples of a render
    /// have as many parts. A sink without interest in groups takes the sample alone.
    #[inline]
    fn camera_by_groups(&mut self, uv: [f32; 2], value: Xyz, weight: f32, _parts: &[Xyz]) {
        self.camera(uv, value, weight);
    }

    /// A light sample whose light comes from this group of lights.
    #[inline]
    fn light_of_group(&mut self, uv: [f32; 2], value: Xyz, _group: u8) {
        self.light(uv, value);
    }

    /// A camera sample of the other of two eyes, in a render for both. A sink without interest in that eye leaves it out.
    #[inline]
    fn camera_of_other_eye(&mut self, _uv: [f32; 2], _value: Xyz, _weight: f32) {}

    /// A light sample of the other of two eyes.
    #[inline]
    fn light_of_other_eye(&mut self, _uv: [f32; 2], _value: Xyz) {}

    /// False once nobody waits for the path. An integrator that takes more than a millisecond should check this now and then
    /// and give up.
    fn is_wanted(&self) -> bool {
        true
    }
}

/// Numbers of paths by stream. The light image is divided by `light`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct PathCounts {
    /// Paths started at the camera.
    pub camera: u64,
    /// Paths started at lights.
    pub light: u64,
}

/// The part of the screen that samples must cover. The picture is `[0, 1]²`, and the overscan around it feeds the filter at
/// the border (paper §3.1).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct UvWindow {
    /// Smallest u and v.
    pub min: [f32; 2],
    /// Largest u and v.
    pub max: [f32; 2],
}

impl UvWindow {
    /// Exactly the picture.
    pub const PICTURE: UvWindow = UvWindow { min: [0.0, 0.0], max: [1.0, 1.0] };
}
