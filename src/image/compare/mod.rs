//! Comparison of pictures: error metrics, each with its map, and a statistical test of equality.
//!
//! | metric | of | says |
//! |---|---|---|
//! | [`rel_mse()`] | scene-linear RGB | squared error in units of the reference's luminance; what noise is measured by |
//! | [`smape()`] | scene-linear RGB | error in units of both; a firefly counts no more than any wrong pixel |
//! | [`flip()`] | displayed RGB | how much a person sees when the two alternate |
//! | [`delta_e()`] | displayed RGB | distance of colours, pixel by pixel |
//! | [`relative_standard_error`] | a [`Measured`] | how noisy one picture is, without a reference |
//! | [`z_test`] | two [`Measured`] | whether two pictures may have the same expectation |
//!
//! Scene-linear pictures are Rec.709. *Displayed* ones are linear sRGB in [0, 1] after a tone curve, which is the
//! caller's; a pixel that is not finite stays so there, and counts as wrong in every figure instead of being hidden:
//! each says how. Maps have the pictures' size, rows from the top. Pictures without pixels have errors of 0. Pictures of different
//! sizes are refused by [`ImageError::Size`].

mod flip;
mod metrics;
mod picture;
mod variance;

pub use flip::{PIXELS_PER_DEGREE, flip};
pub use metrics::{RelMse, delta_e, rel_mse, rel_mse_map, smape};
pub use picture::Picture;
pub use variance::{
    Measured, RelativeStandardError, ZTest, critical_value, relative_standard_error, z_map, z_test,
};

use crate::image::error::ImageError;
use crate::image::grid::Grid;
use crate::math::quantile::nearest_rank;

/// Linear R, G, B of every pixel.
type Rgb = Grid<[f32; 3]>;

/// An error metric over a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct MetricMap {
    /// Mean over the pixels.
    pub mean: f64,
    /// The metric of every pixel.
    pub map: Grid<f32>,
}

impl MetricMap {
    fn new(map: Grid<f32>) -> Self {
        Self { mean: mean(map.pixels()), map }
    }

    /// Quantile `p` of the pixels' values.
    pub fn quantile(&self, p: f64) -> f64 {
        quantiles(self.map.pixels().to_vec(), [p])[0]
    }
}

/// Luminance of linear Rec.709 RGB (ITU-R BT.709).
pub fn luminance(rgb: [f32; 3]) -> f64 {
    0.212_639 * f64::from(rgb[0]) + 0.715_169 * f64::from(rgb[1]) + 0.072_192 * f64::from(rgb[2])
}

/// The place of the largest value of a map. Field names are JSON keys.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Worst {
    /// Column, 0 at the left.
    pub x: usize,
    /// Row, 0 at the top.
    pub y: usize,
    /// The value.
    pub value: f32,
}

/// The value of largest magnitude, the first of equal ones. NaN (no value) is skipped; `None` if all values are 0.
pub fn worst(map: &Grid<f32>) -> Option<Worst> {
    let mut found: Option<(usize, f32)> = None;
    for (i, &value) in map.pixels().iter().enumerate() {
        if value.abs() > found.map_or(0.0, |(_, most)| most.abs()) {
            found = Some((i, value));
        }
    }
    found.map(|(i, value)| Worst { x: i % map.width(), y: i / map.width(), value })
}

fn same_size(a: (usize, usize), b: (usize, usize)) -> Result<(), ImageError> {
    if a == b { Ok(()) } else { Err(ImageError::Size { a, b }) }
}

/// Applies `metric` to pairs of pixels.
fn map<A: Copy, B: Copy>(
    a: &Grid<A>,
    b: &Grid<B>,
    metric: impl Fn(A, B) -> f32,
) -> Result<Grid<f32>, ImageError> {
    let size = (a.width(), a.height());
    same_size(size, (b.width(), b.height()))?;
    let values = a.pixels().iter().zip(b.pixels()).map(|(&a, &b)| metric(a, b)).collect();
    Grid::from_rows(size.0, size.1, values).ok_or(ImageError::Size { a: size, b: size })
}

fn is_finite(rgb: [f32; 3]) -> bool {
    rgb.iter().all(|c| c.is_finite())
}

/// Mean; 0 of an empty slice.
fn mean(values: &[f32]) -> f64 {
    values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len().max(1) as f64
}

/// Nearest-rank quantiles `p`; 0 of an empty vector.
fn quantiles<const N: usize>(mut values: Vec<f32>, p: [f64; N]) -> [f64; N] {
    values.sort_by(f32::total_cmp);
    p.map(|p| nearest_rank(&values, p).map_or(0.0, f64::from))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_that_occur() {
        let values: Vec<f32> = (1..=100).rev().map(|v| v as f32).collect();
        assert_eq!(quantiles(values, [0.0, 0.5, 0.95, 1.0]), [1.0, 50.0, 95.0, 100.0]);
        assert_eq!(quantiles(vec![f32::INFINITY, 1.0], [0.5, 0.95]), [1.0, f64::INFINITY]);
        assert_eq!(quantiles(vec![], [0.5]), [0.0]);
    }

    #[test]
    fn the_worst_is_the_largest_of_either_sign() {
        let grid = |pixels: Vec<f32>| Grid::from_rows(2, pixels.len() / 2, pixels).expect("rows of 2");
        let found = worst(&grid(vec![1.0, f32::NAN, -3.0, 3.0]));
        assert_eq!(found, Some(Worst { x: 0, y: 1, value: -3.0 }));
        assert_eq!(worst(&grid(vec![f32::INFINITY, 2.0])).map(|w| (w.x, w.y)), Some((0, 0)));
        for nothing in [vec![], vec![0.0; 4], vec![f32::NAN; 2]] {
            assert_eq!(worst(&grid(nothing)), None);
        }
    }
}
