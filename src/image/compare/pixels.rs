//! What all figures need: equal sizes, luminance, means, quantiles, the worst pixel.

use crate::image::error::ImageError;
use crate::image::grid::Grid;

/// Luminance of linear Rec.709 RGB (ITU-R BT.709).
pub fn luminance(rgb: [f32; 3]) -> f64 {
    0.212_639 * f64::from(rgb[0]) + 0.715_169 * f64::from(rgb[1]) + 0.072_192 * f64::from(rgb[2])
}

/// The place of the largest figure of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// Column, 0 at the left.
    pub x: usize,
    /// Row, 0 at the top.
    pub y: usize,
    /// The figure.
    pub value: f32,
}

/// The figure of the largest magnitude, the first of equals. NaN (no figure) is passed over; `None` where nothing differs
/// from 0.
pub fn worst(map: &Grid<f32>) -> Option<Worst> {
    let mut found: Option<(usize, f32)> = None;
    for (i, &value) in map.pixels().iter().enumerate() {
        if value.abs() > found.map_or(0.0, |(_, most)| most.abs()) {
            found = Some((i, value));
        }
    }
    found.map(|(i, value)| Worst { x: i % map.width(), y: i / map.width(), value })
}

/// # Errors
/// [`ImageError::Size`] for different sizes.
pub(super) fn same_size(a: (usize, usize), b: (usize, usize)) -> Result<(), ImageError> {
    if a == b { Ok(()) } else { Err(ImageError::Size { a, b }) }
}

/// The map of what `figure` says of each pair of pixels.
///
/// # Errors
/// [`ImageError::Size`] for pictures of different sizes.
pub(super) fn map<A: Copy, B: Copy>(
    a: &Grid<A>,
    b: &Grid<B>,
    figure: impl Fn(A, B) -> f32,
) -> Result<Grid<f32>, ImageError> {
    let size = (a.width(), a.height());
    same_size(size, (b.width(), b.height()))?;
    let figures = a.pixels().iter().zip(b.pixels()).map(|(&a, &b)| figure(a, b)).collect();
    Grid::from_rows(size.0, size.1, figures).ok_or(ImageError::Size { a: size, b: size })
}

/// True when all channels are finite.
pub(super) fn is_finite(rgb: [f32; 3]) -> bool {
    rgb.iter().all(|c| c.is_finite())
}

/// The mean; 0 of nothing.
pub(super) fn mean(values: &[f32]) -> f64 {
    values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len().max(1) as f64
}

/// The values below which shares `p` of all lie, by nearest rank (ISO 3534: a value that occurs); 0 of nothing.
pub(super) fn quantiles<const N: usize>(mut values: Vec<f32>, p: [f64; N]) -> [f64; N] {
    values.sort_by(f32::total_cmp);
    let last = values.len().saturating_sub(1);
    p.map(|p| {
        let rank = (p * values.len() as f64).ceil() as usize;
        values.get(rank.saturating_sub(1).min(last)).map_or(0.0, |&v| f64::from(v))
    })
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
