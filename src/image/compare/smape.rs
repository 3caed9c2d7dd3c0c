//! SMAPE: symmetric mean absolute percentage error.

use super::pixels::{is_finite, map, mean};
use crate::image::error::ImageError;
use crate::image::grid::Grid;

/// Keeps black against almost black from counting as all wrong; radiance.
const EPSILON: f64 = 0.01;

/// Mean of `|x − r| / (|x| + |r| + 0.01)` over pixels and channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Smape {
    /// From 0, equal, to 1, all wrong.
    pub mean: f64,
    /// The mean over the channels of every pixel.
    pub map: Grid<f32>,
}

/// SMAPE of two scene-linear pictures; the same with the two exchanged. A pixel that is not finite counts as 1, all
/// wrong.
///
/// # Errors
/// [`ImageError::Size`] for pictures of different sizes.
///
/// # Source
/// Vogels et al., *Denoising with Kernel Prediction and Asymmetric Loss Functions* (2018), with their ε = 0.01. Without the
/// factor 2 that forecasters use: theirs goes to 2.
pub fn smape(picture: &Grid<[f32; 3]>, reference: &Grid<[f32; 3]>) -> Result<Smape, ImageError> {
    let map = map(picture, reference, |x, r| {
        if !(is_finite(x) && is_finite(r)) {
            return 1.0;
        }
        let term = |x: f32, r: f32| {
            let (x, r) = (f64::from(x), f64::from(r));
            (x - r).abs() / (x.abs() + r.abs() + EPSILON)
        };
        (x.iter().zip(r).map(|(&x, r)| term(x, r)).sum::<f64>() / 3.0) as f32
    })?;
    Ok(Smape { mean: mean(map.pixels()), map })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(a: [f32; 3], b: [f32; 3]) -> f64 {
        let grid = |v| Grid::from_rows(1, 1, vec![v]).expect("one pixel");
        smape(&grid(a), &grid(b)).expect("same size").mean
    }

    #[test]
    fn it_is_its_formula() {
        // Term by term: 1/(2 + 1 + 0.01), 0, 0.09/(0.1 + 0.01).
        let expected = (1.0 / 3.01 + 0.0 + 0.09 / 0.11) / 3.0;
        assert!((of([2.0, 5.0, 0.095], [1.0, 5.0, 0.005]) - expected).abs() < 1e-6);
        assert!((of([1.0, 5.0, 0.005], [2.0, 5.0, 0.095]) - expected).abs() < 1e-6);
        assert_eq!(of([0.0; 3], [0.0; 3]), 0.0);
        assert!((of([1e30; 3], [0.0; 3]) - 1.0).abs() < 1e-6);
        assert!((of([f32::MAX; 3], [-f32::MAX; 3]) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn what_is_not_finite_is_all_wrong() {
        for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!((of([0.0, odd, 0.0], [0.0; 3]), of([1.0; 3], [odd, 1.0, 1.0])), (1.0, 1.0));
        }
        let empty = Grid::from_rows(0, 0, vec![]).expect("none");
        assert_eq!(smape(&empty, &empty).expect("same size").mean, 0.0);
        let one = Grid::from_rows(1, 1, vec![[0.0; 3]]).expect("one");
        assert!(matches!(smape(&empty, &one), Err(ImageError::Size { .. })));
    }
}
