//! z-test: whether two measured pictures have the same expectation in every pixel.

use super::measured::Measured;
use super::normal::critical_value;
use super::pixels::same_size;
use crate::image::error::ImageError;
use crate::image::grid::Grid;

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
    for pair in pairs(a, b).filter(|pair| pair.iter().map(|(_, v)| v).sum::<f64>().is_finite()) {
        scores.push(score(pair).abs());
        for (k, (mean, variance)) in pair.into_iter().enumerate() {
            sums[k] += mean;
            variances[k] += variance;
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

/// `z` of every pixel: positive where the first picture is brighter, infinite for a mean that is not finite, NaN where a
/// variance is not finite.
///
/// # Errors
/// [`ImageError::Size`] for pictures of different sizes, or with fewer means or variances than pixels.
pub fn z_map(a: &Measured, b: &Measured) -> Result<Grid<f32>, ImageError> {
    let size = (a.width, a.height);
    same_size(size, (b.width, b.height))?;
    let scores: Vec<f32> = pairs(a, b).map(|pair| score(pair) as f32).collect();
    let rows = scores.len().checked_div(size.0).unwrap_or(0);
    Grid::from_rows(size.0, size.1, scores).ok_or(ImageError::Size { a: size, b: (size.0, rows) })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_has_signs_and_odd_pixels() {
        let picture = |mean: [f64; 5], variance: [f64; 5]| Measured {
            width: 5,
            height: 1,
            mean: mean.to_vec(),
            variance: variance.to_vec(),
        };
        let a = picture([1.0, 4.0, 1.0, f64::NAN, 1.0], [9.0, 0.0, 0.0, 1.0, f64::INFINITY]);
        let b = picture([11.0, 4.0, 2.0, 1.0, 1.0], [16.0, 0.0, 0.0, 1.0, 1.0]);
        let map = z_map(&a, &b).expect("same size");
        assert_eq!(map.pixels()[..4], [-2.0, 0.0, f32::NEG_INFINITY, f32::INFINITY]);
        assert!(map.at(4, 0).is_nan());
        let empty = Measured { width: 0, height: 0, mean: vec![], variance: vec![] };
        assert!(z_map(&empty, &empty).expect("same size").pixels().is_empty());
        assert!(z_map(&a, &empty).is_err());
        assert!(z_map(&Measured { mean: vec![], ..a.clone() }, &b).is_err());
    }
}
