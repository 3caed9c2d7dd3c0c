//! Comparison of pictures: error figures and a statistical test of equality.

use std::path::Path;

use crate::image::error::ImageError;
use crate::image::exr;
use crate::image::grid::Grid;

/// Luminance of linear Rec.709 RGB (ITU-R BT.709).
pub fn luminance(rgb: [f32; 3]) -> f64 {
    0.212_639 * f64::from(rgb[0]) + 0.715_169 * f64::from(rgb[1]) + 0.072_192 * f64::from(rgb[2])
}

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
pub fn rel_mse(picture: &Grid<[f32; 3]>, reference: &Grid<[f32; 3]>) -> Result<RelMse, ImageError> {
    same_size((picture.width(), picture.height()), (reference.width(), reference.height()))?;
    let error = |(x, r): (&[f32; 3], &[f32; 3])| {
        let sum: f64 = x.iter().zip(r).map(|(&x, &r)| (f64::from(x) - f64::from(r)).powi(2)).sum();
        let e = sum / 3.0 / (luminance(*r).powi(2) + 0.01);
        if e.is_nan() { f64::INFINITY } else { e }
    };
    let mut errors: Vec<f64> = picture.pixels().iter().zip(reference.pixels()).map(error).collect();
    errors.sort_by(f64::total_cmp);
    let keep = errors.len() - errors.len().div_ceil(1000);
    let mean = |e: &[f64]| e.iter().sum::<f64>() / e.len().max(1) as f64;
    Ok(RelMse { whole: mean(&errors), trimmed: mean(&errors[..keep]) })
}

fn same_size(a: (usize, usize), b: (usize, usize)) -> Result<(), ImageError> {
    if a == b { Ok(()) } else { Err(ImageError::Size { a, b }) }
}

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

    /// Reads R, G, B and [`VARIANCE_CHANNEL`](Self::VARIANCE_CHANNEL) of an EXR file.
    ///
    /// # Errors
    /// As [`exr::read`], and [`ImageError::Channel`].
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let layers = exr::read(path)?;
        let [r, g, b, variance] =
            ["R", "G", "B", Self::VARIANCE_CHANNEL].map(|name| exr::channel(path, &layers, name));
        let (r, g, b) = (r?, g?, b?);
        Ok(Self {
            width: layers.width,
            height: layers.height,
            mean: (0..r.len()).map(|i| luminance([r[i], g[i], b[i]])).collect(),
            variance: variance?.iter().map(|&v| f64::from(v)).collect(),
        })
    }
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
///
/// # Errors
/// [`ImageError::Size`] for pictures of different sizes.
pub fn z_test(a: &Measured, b: &Measured, alpha: f64) -> Result<ZTest, ImageError> {
    same_size((a.width, a.height), (b.width, b.height))?;
    let mut scores = Vec::new();
    let (mut sums, mut variances) = ([0.0; 2], [0.0; 2]);
    for i in 0..a.mean.len() {
        let variance = a.variance[i] + b.variance[i];
        if !variance.is_finite() {
            continue;
        }
        scores.push(score(a.mean[i], b.mean[i], variance));
        for (k, picture) in [a, b].into_iter().enumerate() {
            sums[k] += picture.mean[i];
            variances[k] += picture.variance[i];
        }
    }
    let n = scores.len();
    // ln_1p and exp_m1: 1 − (1 − α)^(1/n) cancels for a million pixels.
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

/// `|z|` of one pixel; infinite for a mean that is not finite.
fn score(a: f64, b: f64, variance: f64) -> f64 {
    let difference = (a - b).abs();
    if !difference.is_finite() {
        f64::INFINITY
    } else if variance > 0.0 {
        difference / variance.sqrt()
    } else if difference <= 1e-6 * a.abs().max(b.abs()) {
        0.0
    } else {
        f64::INFINITY
    }
}

/// The `z` that a standard normal variable exceeds on either side with probability `p`.
pub fn critical_value(p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..100 {
        let z = 0.5 * (low + high);
        if erfc(z / std::f64::consts::SQRT_2) > p { low = z } else { high = z }
    }
    0.5 * (low + high)
}

/// Complementary error function for `x ≥ 0`, relative error below 1e-10 (Abramowitz, Stegun 7.1.6, 7.1.14).
fn erfc(x: f64) -> f64 {
    let scale = (-x * x).exp() / std::f64::consts::PI.sqrt();
    if x < 2.5 {
        // erf(x) = 2/√π e^(−x²) Σ 2^k x^(2k+1) / (1·3·…·(2k+1))
        let (mut term, mut sum) = (x, x);
        for k in 1..100 {
            term *= 2.0 * x * x / f64::from(2 * k + 1);
            sum += term;
        }
        1.0 - 2.0 * scale * sum
    } else {
        // Continued fraction x + (1/2)/(x + 1/(x + (3/2)/(x + …))), from the inside out.
        let fraction = (1..=60).rev().fold(x, |f, k| x + 0.5 * f64::from(k) / f);
        scale / fraction
    }
}
