//! Pictures with a known variance: the noise of one, and whether two have the same expectation.

use super::{quantiles, same_size};
use crate::image::error::ImageError;
use crate::image::grid::Grid;

/// A picture's luminance with the variance of every pixel's mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Luminance Y.
    pub mean: Vec<f64>,
    /// Variance of `mean`, not of single samples.
    pub variance: Vec<f64>,
}

impl Measured {
    /// Name of the channel that holds the variance of the mean.
    pub const VARIANCE_CHANNEL: &'static str = "variance.Y";
}

/// Fraction of the picture's mean that is added to every pixel's mean, so that black pixels do not dominate.
const FRACTION: f64 = 0.01;

/// Quantiles of the relative standard error of the pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct RelativeStandardError {
    /// Median over the pixels.
    pub median: f64,
    /// 95 % quantile.
    pub p95: f64,
    /// 99 % quantile.
    pub p99: f64,
    /// Pixels left out because mean or variance is not finite (too few samples).
    pub skipped: usize,
    /// The relative standard error of every pixel; NaN if the pixel is left out.
    pub map: Grid<f32>,
}

/// `√variance / (|Y| + 0.01 · mean of the picture's |Y|)` of every pixel: 0 exact, 1 all noise. A variance below 0 is
/// taken as 0.
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
    let map = as_grid(size, errors)?;
    let known: Vec<f32> = map.pixels().iter().copied().filter(|e| !e.is_nan()).collect();
    let skipped = map.pixels().len() - known.len();
    let [median, p95, p99] = quantiles(known, [0.5, 0.95, 0.99]);
    Ok(RelativeStandardError { median, p95, p99, skipped, map })
}

/// Result of a test whether two pictures have the same expectation in every pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZTest {
    /// Pixels compared: those whose means and variances are finite in both pictures.
    pub pixels: usize,
    /// Pixels left out because a variance was not finite (too few samples).
    pub skipped: usize,
    /// `|z|` above which a pixel is rejected.
    pub critical_z: f64,
    /// Share of the compared pixels that are accepted; 0 when none could be compared.
    pub accepted: f64,
    /// Largest `|z|`.
    pub largest_z: f64,
    /// Mean of `z²`: 1 when means agree and variances are right.
    pub mean_z2: f64,
    /// Mean of the first picture over the mean of the second.
    pub mean_ratio: f64,
    /// Standard error of `mean_ratio`, pixels taken as independent (a splat filter wider than a pixel
    /// correlates neighbours: the true error is then larger).
    pub mean_ratio_error: f64,
}

/// Two-sided z-test in every pixel at level `alpha` for the whole picture: by Šidák's correction each of n
/// pixels is tested at `1 − (1 − α)^(1/n)`.
///
/// A mean that is not finite is rejected. Where both variances are 0 the means must be equal within 1e-6.
pub fn z_test(a: &Measured, b: &Measured, alpha: f64) -> Result<ZTest, ImageError> {
    same_size((a.width, a.height), (b.width, b.height))?;
    let mut scores = Vec::new();
    let (mut sums, mut variances) = ([0.0; 2], [0.0; 2]);
    for pair in pairs(a, b).filter(|pair| pair.iter().map(|(_, v)| v).sum::<f64>().is_finite()) {
        scores.push(score(pair).abs());
        for (k, (mean, variance)) in pair.into_iter().enumerate() {
            sums[k] += mean;
            variances[k] += variance;
        }
    }
    let n = scores.len();
    // ln_1p and exp_m1, because 1 − (1 − α)^(1/n) cancels for a million pixels.
    let per_pixel = -((-alpha).ln_1p() / n.max(1) as f64).exp_m1();
    let critical_z = critical_value(per_pixel);
    let accepted = scores.iter().filter(|z| **z <= critical_z).count();
    let relative = |k: usize| if sums[k] == 0.0 { 0.0 } else { variances[k] / (sums[k] * sums[k]) };
    let mean_ratio = if sums[0] == sums[1] { 1.0 } else { sums[0] / sums[1] };
    Ok(ZTest {
        pixels: n,
        skipped: a.mean.len() - n,
        critical_z,
        accepted: accepted as f64 / n.max(1) as f64,
        largest_z: scores.iter().copied().fold(0.0, f64::max),
        mean_z2: scores.iter().map(|z| z * z).sum::<f64>() / n.max(1) as f64,
        mean_ratio,
        mean_ratio_error: mean_ratio.abs() * (relative(0) + relative(1)).sqrt(),
    })
}

/// `z` of every pixel: positive where the first picture is brighter, infinite for a mean that is not finite, NaN where a
/// variance is not finite.
pub fn z_map(a: &Measured, b: &Measured) -> Result<Grid<f32>, ImageError> {
    let size = (a.width, a.height);
    same_size(size, (b.width, b.height))?;
    let scores: Vec<f32> = pairs(a, b).map(|pair| score(pair) as f32).collect();
    as_grid(size, scores)
}

/// The grid of these values, which are refused by [`ImageError::Size`] unless there are as many as pixels.
fn as_grid(size: (usize, usize), values: Vec<f32>) -> Result<Grid<f32>, ImageError> {
    let rows = values.len().checked_div(size.0).unwrap_or(0);
    Grid::from_rows(size.0, size.1, values).ok_or(ImageError::Size { a: size, b: (size.0, rows) })
}

/// Mean and variance of every pixel in both pictures.
fn pairs<'a>(a: &'a Measured, b: &'a Measured) -> impl Iterator<Item = [(f64, f64); 2]> + 'a {
    let of = |i: usize, m: &Measured| Some((*m.mean.get(i)?, *m.variance.get(i)?));
    (0..a.mean.len()).map_while(move |i| Some([of(i, a)?, of(i, b)?]))
}

/// `z` of one pixel; infinite for a mean that is not finite, NaN for a variance that is not.
fn score([(a, variance_a), (b, variance_b)]: [(f64, f64); 2]) -> f64 {
    let (difference, variance) = (a - b, variance_a + variance_b);
    if !variance.is_finite() {
        f64::NAN
    } else if difference.is_nan() {
        f64::INFINITY
    } else if variance > 0.0 {
        difference / variance.sqrt()
    } else if difference.abs() <= 1e-6 * a.abs().max(b.abs()) {
        0.0
    } else {
        f64::INFINITY.copysign(difference)
    }
}

/// The `z` that a standard normal variable exceeds on either side with probability `p`.
pub fn critical_value(p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..100 {
        let z = 0.5 * (low + high);
        if libm::erfc(z / std::f64::consts::SQRT_2) > p { low = z } else { high = z }
    }
    0.5 * (low + high)
}
