//! Twin of `tonemap`: scene-linear XYZ becomes 8-bit display RGB (paper §4.2, steps 6 to 8).
//!
//! The paper scales X and Z "by Y/Y'", which is the ratio upside down: it is Y'/Y.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use crate::client::settings::{DisplayImage, Settings};
use crate::image::Grid;

/// Below this argument `1 − exp(−t)` is taken from its series, which does not cancel.
pub const SERIES_BELOW: f32 = 1e-2;

/// Largest `X/Y` and `Z/Y` used: no real stimulus comes near, and `∞` would have no hue.
pub const MAX_CHROMATICITY_RATIO: f32 = 1e4;

/// The values of one repaint, as the shader gets them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToneParameters {
    /// Brightness `B`.
    pub exposure: f32,
    /// Contrast `C`.
    pub contrast: f32,
    /// `1/G`.
    pub inverse_gamma: f32,
    /// Matrix `P`, XYZ to linear RGB; white `(X, Y, Z)` of luminance 1 maps to `(1, 1, 1)`.
    pub from_xyz: Mat3,
}

impl From<&Settings> for ToneParameters {
    fn from(s: &Settings) -> Self {
        Self {
            exposure: s.exposure,
            contrast: s.contrast,
            inverse_gamma: 1.0 / s.gamma,
            from_xyz: s.profile.from_xyz,
        }
    }
}

/// The whole picture, rows in parallel.
pub fn tonemap(picture: &Grid<Vec3>, p: &ToneParameters) -> DisplayImage {
    let mut rgb = vec![[0; 3]; picture.pixels().len()];
    let rows = picture.pixels().par_chunks(picture.width().max(1));
    rgb.par_chunks_mut(picture.width().max(1)).zip(rows).for_each(|(out, row)| {
        for (out, &xyz) in out.iter_mut().zip(row) {
            *out = encode(display_linear(xyz, p), p.inverse_gamma);
        }
    });
    DisplayImage { width: picture.width() as u32, height: picture.height() as u32, rgb }
}

/// `Y' = 1 − exp(−(B·Y)^C)`: 0 for NaN and for `y ≤ 0`, else in `[0, 1]` and never falling.
#[inline]
pub fn tone_curve(y: f32, exposure: f32, contrast: f32) -> f32 {
    let t = (exposure * y).powf(contrast);
    if !(y > 0.0 && t > 0.0) {
        0.0
    } else if t < SERIES_BELOW {
        t * (1.0 - t * (0.5 - t * (1.0 / 6.0 - t * (1.0 / 24.0))))
    } else {
        1.0 - (-t).exp()
    }
}

/// Display-linear RGB in `[0, 1]` of a scene-linear colour: tone curve, matrix, desaturation.
#[inline]
pub fn display_linear(xyz: Vec3, p: &ToneParameters) -> Vec3 {
    let luminance = tone_curve(xyz.y, p.exposure, p.contrast);
    if luminance == 0.0 {
        return Vec3::ZERO;
    }
    // X/Y first: Y'/Y overflows where Y is tiny.
    let ratio = |v: f32| if v > 0.0 { (v / xyz.y).min(MAX_CHROMATICITY_RATIO) } else { 0.0 };
    let toned = Vec3::new(ratio(xyz.x), 1.0, ratio(xyz.z)) * luminance;
    desaturate(p.from_xyz * toned, luminance)
}

/// Moves `rgb` towards the grey of its own luminance by the least amount that brings every channel into
/// `[0, 1]`; luminance is unchanged.
#[inline]
pub fn desaturate(rgb: Vec3, luminance: f32) -> Vec3 {
    let mut keep = 1.0f32;
    for c in rgb.to_array() {
        if c > 1.0 {
            keep = keep.min((1.0 - luminance) / (c - luminance));
        } else if c < 0.0 {
            keep = keep.min(luminance / (luminance - c));
        }
    }
    (Vec3::splat(luminance) + (rgb - luminance) * keep).clamp(Vec3::ZERO, Vec3::ONE)
}

/// Display gamma and rounding to 8 bits.
#[inline]
pub fn encode(rgb: Vec3, inverse_gamma: f32) -> [u8; 3] {
    rgb.to_array().map(|c| (c.powf(inverse_gamma) * 255.0 + 0.5).floor() as u8)
}
