//! False colours for maps of figures: black over violet, red and orange to pale yellow.
//!
//! A way through OKLab on which lightness rises evenly with the figure, so that the order is seen also in grey
//! and by the colour-blind, as with matplotlib's `inferno`.

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

fn lab(figure: f32) -> Vec3 {
    let last = WAY.len() - 1;
    let at = figure.clamp(0.0, 1.0) * last as f32;
    let i = (at as usize).min(last - 1);
    Vec3::from(WAY[i]).lerp(Vec3::from(WAY[i + 1]), at - i as f32)
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
}
