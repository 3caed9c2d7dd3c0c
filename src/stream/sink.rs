//! The interface through which an integrator sends its samples.

use crate::color::Xyz;

/// Receives the samples of a path. Implementations reject samples that are not finite, and count them.
pub trait SampleSink {
    /// A camera sample at `uv`: radiance `value` with filter weight `weight > 0`.
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32);

    /// A light sample at `uv`: `value` is a density over uv (flux per unit of uv²), not divided by the number of light paths.
    fn light(&mut self, uv: [f32; 2], value: Xyz);

    /// False once nobody waits for the path. An integrator that takes more than a millisecond should check this now and then
    /// and give up.
    fn is_wanted(&self) -> bool {
        true
    }
}

/// Numbers of paths by stream. The light image is divided by `light`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PathCounts {
    /// Paths started at the camera.
    pub camera: u64,
    /// Paths started at lights.
    pub light: u64,
}

/// The part of the screen that samples must cover. The picture is `[0, 1]²`, and the overscan around it feeds the filter at
/// the border (paper §3.1).
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
