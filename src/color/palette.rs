//! False colours for maps of figures: black over violet, red and orange to pale yellow; for signed ones blue over white to red.
//!
//! A way through OKLab on which lightness rises evenly with the figure, so that the order is seen also in grey
//! and by the colour-blind, as with matplotlib's `inferno`. Of signed figures lightness falls evenly with the magnitude, and blue and red
//! tell the sign to the colour-blind as well.

use glam::Vec3;

use crate::color::{oklab, srgb};

/// The way: L, a, b at even steps of the figure; straight between. It begins where 8 bits still tell steps of L apart.
const WAY: [[f32; 3]; 5] = [
    [0.10, 0.0, 0.0],
    [0.315, 0.090, -0.095],
    [0.53, 0.165, 0.020],
    [0.745, 0.080, 0.130],
    [0.96, -0.025, 0.100],
];

/// Colour of what has no figure, on no part of the way: teal.
pub const NOTHING: [u8; 3] = [0, 128, 128];

/// The colour of a figure from 0 to 1 in 8 bits of sRGB; figures outside are clamped, NaN is [`NOTHING`].
pub fn color(figure: f32) -> [u8; 3] {
    if figure.is_nan() {
        return NOTHING;
    }
    oklab::to_linear_srgb(lab(figure)).to_array().map(srgb::encode_8bit)
}

/// The ways from 0 to −1, blue, and to 1, red.
const SIGNED: [[[f32; 3]; 3]; 2] = [
    [[0.97, 0.0, 0.0], [0.695, -0.03, -0.11], [0.42, -0.02, -0.14]],
    [[0.97, 0.0, 0.0], [0.695, 0.12, 0.06], [0.42, 0.15, 0.07]],
];

/// The colour of a figure from −1, blue, over 0, white, to 1, red, in 8 bits of sRGB; figures outside are clamped, NaN is [`NOTHING`].
pub fn signed(figure: f32) -> [u8; 3] {
    if figure.is_nan() {
        return NOTHING;
    }
    let way = &SIGNED[usize::from(figure > 0.0)];
    oklab::to_linear_srgb(along(way, figure.abs())).to_array().map(srgb::encode_8bit)
}

fn lab(figure: f32) -> Vec3 {
    along(&WAY, figure)
}

/// The place on a way of at least two points, for a figure clamped to 0 … 1.
fn along(way: &[[f32; 3]], figure: f32) -> Vec3 {
    let last = way.len() - 1;
    let at = figure.clamp(0.0, 1.0) * last as f32;
    let i = (at as usize).min(last - 1);
    Vec3::from(way[i]).lerp(Vec3::from(way[i + 1]), at - i as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lightness_rises_evenly_within_the_gamut() {
        let mut last = -1.0;
        for i in 0..=200 {
            let figure = i as f32 / 200.0;
            let rgb = oklab::to_linear_srgb(lab(figure));
            assert!(rgb.min_element() > -2e-3 && rgb.max_element() < 1.002, "{figure}: {rgb}");
            let stored = Vec3::from(color(figure).map(|c| srgb::decode(f32::from(c) / 255.0)));
            let lightness = oklab::from_linear_srgb(stored).x;
            assert!((lightness - 0.10 - 0.86 * figure).abs() < 0.01, "{figure}: {lightness}");
            assert!(lightness > last - 2e-3, "{figure}: {lightness} after {last}");
            last = lightness;
        }
        assert_eq!((color(0.0), color(-1.0), color(f32::NAN)), ([3; 3], [3; 3], NOTHING));
        assert_eq!(color(f32::INFINITY), color(1.0));
    }

    #[test]
    fn signed_figures_darken_evenly_to_blue_and_red() {
        for i in -100i32..=100 {
            let figure = i as f32 / 100.0;
            let linear = Vec3::from(signed(figure).map(|c| srgb::decode(f32::from(c) / 255.0)));
            let found = oklab::from_linear_srgb(linear);
            assert!((found.x - 0.97 + 0.55 * figure.abs()).abs() < 0.01, "{figure}: {found}");
            // Blue has a negative b, red a positive a.
            assert!(i >= 0 || found.z < 0.0 || i > -3, "{figure}: {found}");
            assert!(i <= 0 || found.y > 0.0 || i < 3, "{figure}: {found}");
        }
        let [low, high] = [-1.0, 1.0].map(signed);
        assert!(low[2] > low[0] && high[0] > high[2], "{low:?} {high:?}");
        assert_eq!((signed(f32::NEG_INFINITY), signed(7.0), signed(f32::NAN)), (low, high, NOTHING));
    }
}
