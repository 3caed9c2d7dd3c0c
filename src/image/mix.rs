//! Weighted sums of light-group pictures, and the least-squares fit of the weights to an example.

use crate::math::nnls::NormalEquations;

/// Linear R, G, B of a pixel, or factors on them.
pub type MixRgb = [f32; 3];

/// Sum of the pictures, each multiplied by its factors. All have the same number of pixels.
pub fn mix(pictures: &[&[MixRgb]], factors: &[MixRgb]) -> Vec<MixRgb> {
    let pixels = pictures.iter().map(|picture| picture.len()).min().unwrap_or_default();
    let mut sum = vec![[0.0; 3]; pixels];
    for (picture, factors) in pictures.iter().zip(factors) {
        for (sum, pixel) in sum.iter_mut().zip(*picture) {
            (0..3).for_each(|c| sum[c] += factors[c] * pixel[c]);
        }
    }
    sum
}

/// A wanted colour at a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MixExample {
    /// Index of the pixel.
    pub pixel: usize,
    /// Wanted linear colour.
    pub color: MixRgb,
    /// Weight in the fit; 0 masks the pixel.
    pub weight: f32,
}

/// Degrees of freedom per light in a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MixFreedom {
    /// Intensity: one factor for all channels.
    Intensity,
    /// Colour: one factor per channel.
    Color,
}

/// Non-negative factors that minimise the sum of squared errors of the linear channels between the mix and the examples. A picture that the
/// examples do not determine keeps the factor 1.
pub fn factors_like(
    pictures: &[&[MixRgb]],
    examples: impl IntoIterator<Item = MixExample>,
    freedom: MixFreedom,
) -> Vec<MixRgb> {
    let mut equations = [0, 1, 2].map(|_| NormalEquations::new(pictures.len()));
    let mut shown = vec![0.0; pictures.len()];
    for MixExample { pixel, color, weight } in examples {
        let counts = weight > 0.0 && pictures.iter().all(|picture| pixel < picture.len());
        if !counts {
            continue;
        }
        for c in 0..3 {
            shown.iter_mut().zip(pictures).for_each(|(shown, picture)| *shown = f64::from(picture[pixel][c]));
            let channel = if freedom == MixFreedom::Color { c } else { 0 };
            equations[channel].add(&shown, f64::from(color[c]), f64::from(weight));
        }
    }
    let solved = equations.map(|equations| equations.solve(1.0));
    let channel = |c: usize| if freedom == MixFreedom::Color { c } else { 0 };
    (0..pictures.len()).map(|i| [0, 1, 2].map(|c| solved[channel(c)][i] as f32)).collect()
}

/// Examples of a whole picture, weighted by inverse squared brightness, so that dark parts are matched as well as bright ones. `is_known`
/// masks pixels without information, such as clipped ones.
pub fn examples_of(picture: &[MixRgb], is_known: impl Fn(MixRgb) -> bool) -> Vec<MixExample> {
    let brightness = |[r, g, b]: MixRgb| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let known = |color: &MixRgb| color.iter().all(|c| c.is_finite()) && is_known(*color);
    let sum: f64 =
        picture.iter().filter(|color| known(color)).map(|color| f64::from(brightness(*color))).sum();
    let mean = ((sum / picture.len().max(1) as f64) as f32).max(f32::MIN_POSITIVE);
    let example = |(pixel, color): (usize, &MixRgb)| {
        let relative = brightness(*color).max(0.0) / mean + FLOOR;
        MixExample { pixel, color: *color, weight: 1.0 / (relative * relative) }
    };
    picture.iter().enumerate().filter(|(_, color)| known(color)).map(example).collect()
}

/// Brightness added to each pixel's in its weight, as a fraction of the mean.
const FLOOR: f32 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    fn pictures() -> Vec<Vec<MixRgb>> {
        let mut random = Random(9);
        (0..4).map(|_| (0..200).map(|_| [0; 3].map(|_| random.f32())).collect()).collect()
    }

    #[test]
    fn a_mix_is_found_again() {
        let pictures = pictures();
        let pictures: Vec<&[MixRgb]> = pictures.iter().map(Vec::as_slice).collect();
        let colors = [[2.0, 0.5, 1.0], [0.0, 0.0, 0.0], [0.3, 0.3, 0.4], [1.0, 4.0, 0.0]];
        let one = [2.0, 0.0, 0.3, 5.0].map(|factor| [factor; 3]);
        for (factors, freedom) in [(colors, MixFreedom::Color), (one, MixFreedom::Intensity)] {
            let examples = examples_of(&mix(&pictures, &factors), |_| true);
            let found = factors_like(&pictures, examples, freedom);
            for (found, factor) in found.iter().zip(&factors) {
                assert!((0..3).all(|c| (found[c] - factor[c]).abs() < 1e-4), "{found:?} for {factor:?}");
            }
        }
    }

    /// With fewer pixels than lights, undetermined lights keep their factor, and factors that would be negative become 0.
    #[test]
    fn a_few_pixels_are_enough() {
        let (lamp, sky) = ([[1.0, 1.0, 1.0], [0.0; 3]], [[0.0; 3], [2.0, 2.0, 2.0]]);
        let pictures: [&[MixRgb]; 2] = [&lamp, &sky];
        let at = |pixel, color, weight| MixExample { pixel, color, weight };
        let found =
            factors_like(&pictures, [at(0, [3.0, 2.0, 1.0], 1.0), at(1, [9.0; 3], 0.0)], MixFreedom::Color);
        let expected = [[3.0, 2.0, 1.0], [1.0; 3]];
        for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
            assert!((found - expected).abs() < 1e-5, "{found} is not {expected}");
        }
        let found = factors_like(&pictures, [at(0, [-1.0; 3], 1.0)], MixFreedom::Intensity);
        assert_eq!(found[0], [0.0; 3]);
    }
}
