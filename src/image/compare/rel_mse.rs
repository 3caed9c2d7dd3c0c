//! relMSE: mean squared error relative to the reference.

use super::pixels::{luminance, map, same_size};
use crate::image::error::ImageError;
use crate::image::grid::Grid;

/// relMSE = mean of `(x − ref)² / (ref_Y² + 0.01)` over pixels and channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelMse {
    /// Over all pixels.
    pub whole: f64,
    /// Without the worst 0.1 % of pixels.
    pub trimmed: f64,
}

/// relMSE of a picture against a reference. A pixel that is not finite makes it infinite.
///
/// # Errors
/// [`ImageError::Size`] for pictures of different sizes.
///
/// # Source
/// Rousselle, Knaus, Zwicker, *Adaptive Sampling and Reconstruction using Greedy Error Minimization* (2011), with
/// the luminance of the reference in the denominator of all channels.
pub fn rel_mse(picture: &Grid<[f32; 3]>, reference: &Grid<[f32; 3]>) -> Result<RelMse, ImageError> {
    same_size((picture.width(), picture.height()), (reference.width(), reference.height()))?;
    let pairs = picture.pixels().iter().zip(reference.pixels());
    let mut errors: Vec<f64> = pairs.map(|(&x, &r)| error(x, r)).collect();
    errors.sort_by(f64::total_cmp);
    let keep = errors.len() - errors.len().div_ceil(1000);
    let mean = |e: &[f64]| e.iter().sum::<f64>() / e.len().max(1) as f64;
    Ok(RelMse { whole: mean(&errors), trimmed: mean(&errors[..keep]) })
}

/// What every pixel adds to [`RelMse::whole`], which is the map's mean; infinite where a pixel is not finite.
///
/// # Errors
/// [`ImageError::Size`] for pictures of different sizes.
pub fn rel_mse_map(picture: &Grid<[f32; 3]>, reference: &Grid<[f32; 3]>) -> Result<Grid<f32>, ImageError> {
    map(picture, reference, |x, r| error(x, r) as f32)
}

fn error(x: [f32; 3], r: [f32; 3]) -> f64 {
    let sum: f64 = x.iter().zip(r).map(|(&x, r)| (f64::from(x) - f64::from(r)).powi(2)).sum();
    let e = sum / 3.0 / (luminance(r).powi(2) + 0.01);
    if e.is_nan() { f64::INFINITY } else { e }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_adds_up_to_the_figure() {
        let grid = |pixels: Vec<[f32; 3]>| Grid::from_rows(2, 1, pixels).expect("2 pixels");
        let (a, b) = (grid(vec![[1.0, 2.0, 3.0], [0.1; 3]]), grid(vec![[1.0; 3], [0.0; 3]]));
        let map = rel_mse_map(&a, &b).expect("same size");
        // (0 + 1 + 4)/3 over 1.01, and 0.01 over 0.01.
        assert!((map.at(0, 0) - 5.0 / 3.03).abs() < 1e-6 && (map.at(1, 0) - 1.0).abs() < 1e-6, "{map:?}");
        let whole = rel_mse(&a, &b).expect("same size").whole;
        assert!((whole - 0.5 * (5.0 / 3.03 + 1.0)).abs() < 1e-6);
        for odd in [f32::NAN, f32::INFINITY] {
            assert_eq!(rel_mse_map(&grid(vec![[odd; 3]; 2]), &b).expect("same size").at(1, 0), f32::INFINITY);
        }
    }
}
