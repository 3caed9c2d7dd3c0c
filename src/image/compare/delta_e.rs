//! ΔE in OKLab: the distance of displayed colours.

use glam::Vec3;

use super::pixels::{is_finite, map, mean, quantiles};
use crate::color::oklab;
use crate::image::error::ImageError;
use crate::image::grid::Grid;

/// Distances in OKLab: 1 is that of black from white, the largest in sRGB; side by side, 0.02 is just seen.
#[derive(Clone, Debug, PartialEq)]
pub struct DeltaE {
    /// Mean over the pixels.
    pub mean: f64,
    /// 95 % of the pixels are at most this far off.
    pub p95: f64,
    /// Every pixel's distance.
    pub map: Grid<f32>,
}

/// Euclidean distance in OKLab of every pixel of two displayed pictures, linear sRGB in [0, 1]. A pixel that is not
/// finite counts as 1, black against white.
///
/// # Errors
/// [`ImageError::Size`] for pictures of different sizes.
///
/// # Source
/// ΔE_OK of CSS Color Module Level 4, where 0.02 is the difference just noticed. The space is Ottosson's ([`oklab`]).
pub fn delta_e(picture: &Grid<[f32; 3]>, reference: &Grid<[f32; 3]>) -> Result<DeltaE, ImageError> {
    let map = map(picture, reference, |x, r| {
        if !(is_finite(x) && is_finite(r)) {
            return 1.0;
        }
        let lab = |rgb: [f32; 3]| oklab::from_linear_srgb(Vec3::from(rgb));
        lab(x).distance(lab(r))
    })?;
    let [p95] = quantiles(map.pixels().to_vec(), [0.95]);
    Ok(DeltaE { mean: mean(map.pixels()), p95, map })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(a: [f32; 3], b: [f32; 3]) -> f64 {
        let grid = |v| Grid::from_rows(1, 1, vec![v]).expect("one pixel");
        delta_e(&grid(a), &grid(b)).expect("same size").mean
    }

    #[test]
    fn known_colours_are_their_distance_apart() {
        assert_eq!(of([0.2, 0.4, 0.6], [0.2, 0.4, 0.6]), 0.0);
        assert!((of([0.0; 3], [1.0; 3]) - 1.0).abs() < 1e-5);
        // The published L, a, b of red and green: (−.238, .459, −.054).
        let expected = (0.238_48f64.powi(2) + 0.458_75f64.powi(2) + 0.053_65f64.powi(2)).sqrt();
        assert!((of([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]) - expected).abs() < 1e-4);
        // Greys have L = ∛Y: 1/8 is ½.
        assert!((of([0.125; 3], [1.0; 3]) - 0.5).abs() < 1e-4);
    }

    #[test]
    fn quantile_and_odd_pixels() {
        let grid = |pixels: Vec<[f32; 3]>| Grid::from_rows(pixels.len(), 1, pixels).expect("a row");
        let mut pixels = vec![[0.0; 3]; 100];
        pixels[..4].fill([f32::NAN; 3]);
        let few = delta_e(&grid(pixels.clone()), &grid(vec![[0.0; 3]; 100])).expect("same size");
        assert!((few.mean - 0.04).abs() < 1e-9 && few.p95 == 0.0, "{few:?}");
        pixels[..6].fill([1.0; 3]);
        let more = delta_e(&grid(pixels), &grid(vec![[0.0; 3]; 100])).expect("same size");
        assert!((more.p95 - 1.0).abs() < 1e-5, "{more:?}");
        assert!(matches!(delta_e(&grid(vec![]), &grid(vec![[0.0; 3]])), Err(ImageError::Size { .. })));
        assert_eq!(delta_e(&grid(vec![]), &grid(vec![])).expect("same size").p95, 0.0);
    }
}
