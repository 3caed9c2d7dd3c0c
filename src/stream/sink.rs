//! Where an integrator leaves its samples.

use crate::color::Xyz;

/// Takes the samples of one path. Implementations reject what is not finite, and count it.
pub trait SampleSink {
    /// A camera sample at `uv`: radiance `value` with filter weight `weight > 0`.
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32);

    /// A light sample at `uv`: `value` is a density over uv (flux per unit of uv²), not yet divided
    /// by the number of light paths.
    fn light(&mut self, uv: [f32; 2], value: Xyz);

    /// False once nobody waits for the path any more: what takes more than a millisecond may look now and then, and
    /// give up.
    fn is_wanted(&self) -> bool {
        true
    }
}

/// Paths started for each stream; the light image is divided by `light`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PathCounts {
    /// Paths started at the camera.
    pub camera: u64,
    /// Paths started at lights.
    pub light: u64,
}

/// The part of the screen that samples must cover: the picture is `[0, 1]²`, the overscan around it
/// feeds the filter at the border (paper §3.1).
#[derive(Clone, Copy, Debug, PartialEq)]
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
