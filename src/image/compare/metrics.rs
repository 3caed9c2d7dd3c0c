//! Error metrics, pixel by pixel: relMSE, SMAPE, and ΔE in OKLab.

use glam::Vec3;

use super::{MetricMap, Rgb, is_finite, luminance, map, same_size};
use crate::color::oklab;
use crate::image::error::ImageError;
use crate::image::grid::Grid;

/// relMSE = mean of `(x − ref)² / (ref_Y² + 0.01)` over pixels and channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelMse {
    /// Mean over all pixels.
    pub whole: f64,
    /// Mean without the worst 0.1 % of pixels.
    pub trimmed: f64,
}

/// relMSE of a picture against a reference. A pixel that is not finite makes it infinite.
///
/// # Source
/// Rousselle, Knaus, Zwicker, *Adaptive Sampling and Reconstruction using Greedy Error Minimization* (2011), with
/// the luminance of the reference in the denominator of all channels.
pub fn rel_mse(picture: &Rgb, reference: &Rgb) -> Result<RelMse, ImageError> {
    same_size((picture.width(), picture.height()), (reference.width(), reference.height()))?;
    let pairs = picture.pixels().iter().zip(reference.pixels());
    let mut errors: Vec<f64> = pairs.map(|(&x, &r)| squared_error(x, r)).collect();
    errors.sort_by(f64::total_cmp);
    let keep = errors.len() - errors.len().div_ceil(1000);
    let mean = |e: &[f64]| e.iter().sum::<f64>() / e.len().max(1) as f64;
    Ok(RelMse { whole: mean(&errors), trimmed: mean(&errors[..keep]) })
}

/// The contribution of every pixel to [`RelMse::whole`], which is the map's mean; infinite where a pixel is not finite.
pub fn rel_mse_map(picture: &Rgb, reference: &Rgb) -> Result<Grid<f32>, ImageError> {
    map(picture, reference, |x, r| squared_error(x, r) as f32)
}

fn squared_error(x: [f32; 3], r: [f32; 3]) -> f64 {
    let sum: f64 = x.iter().zip(r).map(|(&x, r)| (f64::from(x) - f64::from(r)).powi(2)).sum();
    let e = sum / 3.0 / (luminance(r).powi(2) + 0.01);
    if e.is_nan() { f64::INFINITY } else { e }
}

/// Added to the denominator, so that black against almost black does not count as completely wrong; radiance.
const EPSILON: f64 = 0.01;

/// SMAPE of two scene-linear pictures: the mean of `|x − r| / (|x| + |r| + 0.01)` over pixels and channels, from 0 (equal)
/// to 1 (completely wrong). It is symmetric in the two. A pixel that is not finite counts as 1.
///
/// # Source
/// Vogels et al., *Denoising with Kernel Prediction and Asymmetric Loss Functions* (2018), with their ε = 0.01. It lacks
/// the factor 2 that forecasters use, so that its largest value is 1.
pub fn smape(picture: &Rgb, reference: &Rgb) -> Result<MetricMap, ImageError> {
    let term = |x: f32, r: f32| {
        let (x, r) = (f64::from(x), f64::from(r));
        (x - r).abs() / (x.abs() + r.abs() + EPSILON)
    };
    metric(picture, reference, |x, r| (x.iter().zip(r).map(|(&x, r)| term(x, r)).sum::<f64>() / 3.0) as f32)
}

/// The metric and its mean; 1 where a pixel is not finite.
fn metric(
    picture: &Rgb,
    reference: &Rgb,
    of: impl Fn([f32; 3], [f32; 3]) -> f32,
) -> Result<MetricMap, ImageError> {
    let or_1 = |x, r| if is_finite(x) && is_finite(r) { of(x, r) } else { 1.0 };
    map(picture, reference, or_1).map(MetricMap::new)
}

/// Euclidean distance in OKLab of every pixel of two displayed pictures, linear sRGB in [0, 1]. 1 is the distance of black
/// from white, the largest in sRGB; 0.02 is just noticeable side by side. A pixel that is not finite counts as 1.
///
/// # Source
/// ΔE_OK of CSS Color Module Level 4, where 0.02 is the difference just noticed. The space is Ottosson's ([`oklab`]).
pub fn delta_e(picture: &Rgb, reference: &Rgb) -> Result<MetricMap, ImageError> {
    let lab = |rgb: [f32; 3]| oklab::from_linear_srgb(Vec3::from(rgb));
    metric(picture, reference, |x, r| lab(x).distance(lab(r)))
}
