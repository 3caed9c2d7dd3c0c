//! What a path is given at its start and at every vertex, as numbers in [0, 1).

use super::tables::Lanes;

/// Numbers for the start of a camera path; all in [0, 1).
#[derive(Clone, Copy, Debug)]
pub struct CameraNumbers {
    /// Position over the whole window, 32 bits of precision kept until the splat; never exactly 0.
    pub screen: [f64; 2],
    /// Position on the lens.
    pub lens: [f32; 2],
    /// Wavelength.
    pub wavelength: f32,
    /// Time.
    pub time: f32,
    /// Which connections are made.
    pub connection: f32,
}

/// Numbers for one vertex of a path; all in [0, 1).
#[derive(Clone, Copy, Debug)]
pub struct VertexNumbers {
    /// Point on the light.
    pub light: [f32; 2],
    /// Direction of the BSDF.
    pub bsdf: [f32; 2],
    /// Which light; 32 bits of precision, since there may be a million of them.
    pub light_choice: f64,
    /// Which lobe of the BSDF.
    pub lobe: f32,
    /// Russian roulette.
    pub roulette: f32,
}

#[inline(always)]
pub(super) fn vertex_numbers(light: [u32; 2], bsdf: [u32; 2], single: &Lanes) -> VertexNumbers {
    VertexNumbers {
        light: light.map(unit_f32),
        bsdf: bsdf.map(unit_f32),
        light_choice: unit_f64(single[4]),
        lobe: unit_f32(single[5]),
        roulette: unit_f32(single[7]),
    }
}

/// A 32-bit fraction as `f32` in [0, 1): shifted before conversion, which would otherwise round up to 1.
#[inline(always)]
pub fn unit_f32(x: u32) -> f32 {
    (x >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A 32-bit fraction as `f64` in (0, 1), at the middle of its cell; exact.
#[inline(always)]
pub fn unit_f64(x: u32) -> f64 {
    (f64::from(x) + 0.5) * (1.0 / 4_294_967_296.0)
}
