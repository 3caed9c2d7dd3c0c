//! Relative standard error: how noisy a picture is by its own account.

use super::measured::Measured;
use super::pixels::quantiles;
use crate::image::error::ImageError;
use crate::image::grid::Grid;

/// Share of the picture's mean that is added to every pixel's, so that black pixels do not outweigh all.
const FRACTION: f64 = 0.01;

/// Quantiles of every pixel's standard error over its mean.
#[derive(Clone, Debug, PartialEq)]
pub struct RelativeStandardError {
    /// Half of the pixels are at most this noisy.
    pub median: f64,
    /// 95 % of the pixels are.
    pub p95: f64,
    /// 99 % of the pixels are.
    pub p99: f64,
    /// Pixels left out because mean or variance is not finite (too few samples).
    pub skipped: usize,
    /// Every pixel's; NaN where it is left out.
    pub map: Grid<f32>,
}

/// `√variance / (|Y| + 0.01 · mean of the picture's |Y|)` of every pixel: 0 exact, 1 all noise. A variance below 0 is
/// taken as 0.
///
/// # Errors
/// [`ImageError::Size`] when there are not as many means and variances as pixels.
pub fn relative_standard_error(picture: &Measured) -> Result<RelativeStandardError, ImageError> {
    let size = (picture.width, picture.height);
    let usable = |mean: f64, variance: f64| mean.is_finite() && variance.is_finite();
    let pixels = || picture.mean.iter().zip(&picture.variance).map(|(&m, &v)| (m, v));
    let means: Vec<f64> = pixels().filter(|&(m, v)| usable(m, v)).map(|(m, _)| m.abs()).collect();
    let floor = FRACTION * means.iter().sum::<f64>() / means.len().max(1) as f64;
    let error = |(mean, variance): (f64, f64)| {
        if !usable(mean, variance) {
            f32::NAN
        } else if variance <= 0.0 {
            0.0
        } else {
            (variance.sqrt() / (mean.abs() + floor)) as f32
        }
    };
    let errors: Vec<f32> = pixels().map(error).collect();
    let rows = errors.len().checked_div(size.0).unwrap_or(0);
    let map =
        Grid::from_rows(size.0, size.1, errors).ok_or(ImageError::Size { a: size, b: (size.0, rows) })?;
    let known: Vec<f32> = map.pixels().iter().copied().filter(|e| !e.is_nan()).collect();
    let skipped = map.pixels().len() - known.len();
    let [median, p95, p99] = quantiles(known, [0.5, 0.95, 0.99]);
    Ok(RelativeStandardError { median, p95, p99, skipped, map })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_its_formula() {
        // 100 pixels of mean 2, the i-th with a standard error of i %.
        let picture = Measured {
            width: 10,
            height: 10,
            mean: vec![2.0; 100],
            variance: (1..=100).map(|i| (0.02 * f64::from(i)).powi(2)).collect(),
        };
        let error = relative_standard_error(&picture).expect("100 pixels");
        for (got, percent) in [(error.median, 50.0), (error.p95, 95.0), (error.p99, 99.0)] {
            assert!((got - 0.01 * percent / 1.01).abs() < 1e-6, "{percent}: {got}");
        }
        assert_eq!(error.skipped, 0);
    }

    #[test]
    fn odd_pixels_have_a_defined_result() {
        let picture = |mean: &[f64], variance: &[f64]| Measured {
            width: mean.len(),
            height: 1,
            mean: mean.to_vec(),
            variance: variance.to_vec(),
        };
        let odd = picture(&[1.0, f64::NAN, 1.0, 1.0, -1.0], &[f64::INFINITY, 1.0, 0.0, -1.0, 1.0]);
        let error = relative_standard_error(&odd).expect("5 pixels");
        assert_eq!((error.skipped, error.median), (2, 0.0));
        assert!(error.map.at(0, 0).is_nan() && error.map.at(1, 0).is_nan());
        assert!((error.p99 - 1.0 / 1.01).abs() < 1e-6);
        // Black without and with noise.
        let black = relative_standard_error(&picture(&[0.0, 0.0], &[0.0, 1.0])).expect("2 pixels");
        assert_eq!(black.map.pixels(), [0.0, f32::INFINITY]);
        assert_eq!(relative_standard_error(&picture(&[], &[])).expect("none").p99, 0.0);
        assert!(relative_standard_error(&picture(&[1.0, 2.0], &[1.0])).is_err());
    }
}
