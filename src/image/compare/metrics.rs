//! Error metrics, pixel by pixel: relMSE, SMAPE, and ΔE in OKLab.

use glam::Vec3;

use super::{MetricMap, Rgb, is_finite, luminance, map, same_size};
use crate::color::oklab;
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

/// Keeps black against almost black from counting as completely wrong; radiance.
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

/// The metric with its mean; 1 where a pixel is not finite.
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

    type Rgb = Grid<[f32; 3]>;

    type Metric = fn(&Rgb, &Rgb) -> Result<MetricMap, ImageError>;

    /// A metric of two pictures of one pixel.
    fn of_pixels(metric: Metric, a: [f32; 3], b: [f32; 3]) -> f64 {
        let grid = |v| Grid::from_rows(1, 1, vec![v]).expect("one pixel");
        metric(&grid(a), &grid(b)).expect("same size").mean
    }

    #[test]
    fn smape_is_its_formula() {
        let of = |a, b| of_pixels(smape, a, b);
        // Term by term: 1/(2 + 1 + 0.01), 0, 0.09/(0.1 + 0.01).
        let expected = (1.0 / 3.01 + 0.0 + 0.09 / 0.11) / 3.0;
        assert!((of([2.0, 5.0, 0.095], [1.0, 5.0, 0.005]) - expected).abs() < 1e-6);
        assert!((of([1.0, 5.0, 0.005], [2.0, 5.0, 0.095]) - expected).abs() < 1e-6);
        assert_eq!(of([0.0; 3], [0.0; 3]), 0.0);
        assert!((of([1e30; 3], [0.0; 3]) - 1.0).abs() < 1e-6);
        assert!((of([f32::MAX; 3], [-f32::MAX; 3]) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn smape_of_what_is_not_finite_is_1() {
        let of = |a, b| of_pixels(smape, a, b);
        for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!((of([0.0, odd, 0.0], [0.0; 3]), of([1.0; 3], [odd, 1.0, 1.0])), (1.0, 1.0));
        }
        let empty = Grid::from_rows(0, 0, vec![]).expect("none");
        assert_eq!(smape(&empty, &empty).expect("same size").mean, 0.0);
        let one = Grid::from_rows(1, 1, vec![[0.0; 3]]).expect("one");
        assert!(matches!(smape(&empty, &one), Err(ImageError::Size { .. })));
    }

    #[test]
    fn known_colours_are_their_distance_apart() {
        let of = |a, b| of_pixels(delta_e, a, b);
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
        assert!((few.mean - 0.04).abs() < 1e-9 && few.quantile(0.95) == 0.0, "{few:?}");
        pixels[..6].fill([1.0; 3]);
        let more = delta_e(&grid(pixels), &grid(vec![[0.0; 3]; 100])).expect("same size");
        assert!((more.quantile(0.95) - 1.0).abs() < 1e-5, "{more:?}");
        assert!(matches!(delta_e(&grid(vec![]), &grid(vec![[0.0; 3]])), Err(ImageError::Size { .. })));
        assert_eq!(delta_e(&grid(vec![]), &grid(vec![])).expect("same size").quantile(0.95), 0.0);
    }
}
