//! The error of a denoised picture.
//!
//! The filter F mixes the samples of neighbouring pixels, so that the difference of two replicates a and b, both of which it has used, says
//! nothing about its error. Instead, each replicate is filtered alone. Then F(a) is independent of b, and with the true picture μ
//!
//! E[(F(a) − b)²] = E[(F(a) − μ)²] + Var(b),
//!
//! where (a − b)²/2 estimates the variance. This is the principle of held-out samples in cross-validation. Let S be the mean error of F(a)
//! and F(b). The error of the mean of F(a) and F(b) is M = S − (F(a) − F(b))²/4: their noise is halved, and their bias is not. The
//! displayed picture is filtered from all samples at once, which have half the noise. A filter that adapts to it halves its bias as well,
//! so that the error is S/2; for one that does not, it is M. The stated error is the geometric mean of both; either lies well within the
//! interval.
//!
//! Bias common to both replicates is excluded, such as photon blur and light that no sample has found.
//!
//! A single pixel is nearly uninformative, and noise remains in the sum over a tile: only over the whole picture is the estimate unbiased.
//! It is distributed over the tiles in proportion to the noise of the unfiltered picture, except where they deviate significantly (James
//! and Stein 1961).

use crate::image::compare::luminance;
use crate::study::error::{ErrorEstimate, QUANTILES};
use crate::study::error_tile::{FLOOR, TILE};
use crate::study::interval::Interval;
use crate::study::noisy::Noisy;

/// Pictures of both replicates, linear Rec.709, row-major.
pub struct FilteredHalves<'a> {
    /// Unfiltered, as on the film.
    pub film: [&'a [[f32; 3]]; 2],
    /// Filtered, each without the other.
    pub filtered: [&'a [[f32; 3]]; 2],
}

/// Sums over the pixels of a tile.
#[derive(Clone, Copy, Debug, Default)]
struct TileSums {
    pixels: f64,
    luminance: f64,
    /// Squared error of luminance.
    square: SquaredError,
    /// As `square`, relative to squared luminance as in relMSE.
    relative: SquaredError,
    /// The squared difference of both replicates.
    noise: f64,
}

/// Squared error of a filtered replicate, and of the mean of both, with the noise of the estimate.
#[derive(Clone, Copy, Debug, Default)]
struct SquaredError {
    single: f64,
    mean: f64,
}

impl SquaredError {
    fn of([a, b]: [f64; 2], [fa, fb]: [f64; 2]) -> Self {
        let single = 0.5 * ((fa - b).powi(2) + (fb - a).powi(2) - (a - b).powi(2));
        Self { single, mean: single - 0.25 * (fa - fb).powi(2) }
    }

    fn plus(self, other: Self, times: f64) -> Self {
        Self { single: self.single + times * other.single, mean: self.mean + times * other.mean }
    }

    /// Squared error of the picture filtered from all samples, as a factor on that of the mean, and the standard deviation of its
    /// logarithm; `None` if there is too little data.
    fn of_all(self) -> Option<(f64, f64)> {
        let least = 0.5 * self.single;
        // Except for noise it is never smaller.
        let most = self.mean.max(least);
        (self.mean > 0.0 && least > 0.0)
            .then(|| ((least * most).sqrt() / self.mean, 0.5 * (most / least).ln()))
    }
}

/// Additional standard deviation of the logarithm of an error in a part of the picture, over that of the sum: the location of errors is
/// only roughly known.
const PLACE_DEVIATION: f64 = 0.1;

impl FilteredHalves<'_> {
    /// Error of the filtered picture of `size` pixels. `None` if the picture is too small.
    pub fn error(&self, size: [usize; 2]) -> Option<ErrorEstimate> {
        let tiles = self.tiles(size)?;
        let pixels: f64 = tiles.iter().map(|tile| tile.pixels).sum();
        let mean = tiles.iter().map(|tile| tile.luminance).sum::<f64>() / pixels;
        // Means over pixels, relative to the luminance of the tile.
        let scale = |tile: &TileSums| {
            let against = (tile.luminance / tile.pixels).abs() + FLOOR * mean.abs();
            if against > 0.0 { 1.0 / (tile.pixels * against * against) } else { 0.0 }
        };
        let all = tiles.iter().fold(SquaredError::default(), |sum, tile| sum.plus(tile.square, scale(tile)));
        let (factor, apart) = all.of_all()?;
        let squares: Vec<f64> = tiles.iter().map(|tile| tile.square.mean * scale(tile) * factor).collect();
        let noise: Vec<f64> = tiles.iter().map(|tile| tile.noise * scale(tile)).collect();
        let mut errors: Vec<f64> =
            spread(&squares, &noise, size.map(|n| n.div_ceil(TILE))).into_iter().map(f64::sqrt).collect();
        errors.sort_unstable_by(f64::total_cmp);
        let at = |q: f64| errors[((q * errors.len() as f64) as usize).min(errors.len() - 1)];
        // Standard deviation of the logarithm of a mean square.
        let uncertain = |values: &[f64], apart: f64| deviation(values).min(1.0).hypot(apart);
        let of_root = (0.5 * uncertain(&squares, apart)).hypot(PLACE_DEVIATION);
        let relative = tiles.iter().fold(SquaredError::default(), |sum, tile| sum.plus(tile.relative, 1.0));
        let (relative_factor, relative_apart) = relative.of_all()?;
        let by_tile: Vec<f64> = tiles.iter().map(|tile| tile.relative.mean).collect();
        Some(ErrorEstimate {
            relative: QUANTILES.map(|q| Interval::of_log(at(q), of_root)),
            rel_mse: Interval::of_log(
                relative.mean * relative_factor / pixels,
                uncertain(&by_tile, relative_apart),
            ),
            mean_square: tiles.iter().map(|tile| tile.square.mean).sum::<f64>().max(0.0) * factor / pixels,
        })
    }

    /// Tiles of a picture of this size; `None` if its pixels are incomplete.
    fn tiles(&self, [width, height]: [usize; 2]) -> Option<Vec<TileSums>> {
        let columns = width.div_ceil(TILE);
        let mut tiles = vec![TileSums::default(); columns * height.div_ceil(TILE)];
        if self.film.iter().chain(&self.filtered).any(|picture| picture.len() != width * height) {
            return None;
        }
        for i in 0..width * height {
            let (film, filtered) =
                (self.film.map(|picture| picture[i]), self.filtered.map(|picture| picture[i]));
            let shown = 0.5 * filtered.iter().map(|rgb| luminance(*rgb)).sum::<f64>();
            let [a, b] = film.map(luminance);
            let tile = &mut tiles[i / width / TILE * columns + i % width / TILE];
            tile.pixels += 1.0;
            tile.luminance += shown;
            tile.noise += (a - b).powi(2);
            tile.square = tile.square.plus(SquaredError::of([a, b], filtered.map(luminance)), 1.0);
            for c in 0..3 {
                let channel = |rgb: [f32; 3]| f64::from(rgb[c]);
                let error = SquaredError::of(film.map(channel), filtered.map(channel));
                tile.relative = tile.relative.plus(error, 1.0 / (3.0 * (shown * shown + 0.01)));
            }
        }
        Some(tiles)
    }
}

/// A tile is averaged with at most this many tiles on each side.
const NEAR: usize = 2;

/// Up to this number of standard deviations a tile counts as consistent with its noise.
const CLEAR: f64 = 2.0;

/// Non-negative tile values with the same sum as `values`: proportional to `noise`, except where the values, or their means over
/// neighbouring tiles, deviate significantly.
fn spread(values: &[f64], noise: &[f64], grid: [usize; 2]) -> Vec<f64> {
    let total: f64 = values.iter().sum();
    let all: f64 = noise.iter().sum();
    let usual: Vec<f64> = noise.iter().map(|noise| total * noise / all.max(f64::MIN_POSITIVE)).collect();
    let more: Vec<f64> = values.iter().zip(&usual).map(|(value, usual)| value - usual).collect();
    let square = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
    let scale = square(&more) / square(noise).max(f64::MIN_POSITIVE);
    let excess =
        |(value, noise): (&f64, &f64)| Some(Noisy { value: *value, variance: scale * noise * noise });
    let more: Vec<Option<Noisy>> = more.iter().zip(noise).map(excess).collect();
    let clearest = |i: usize| {
        let means = (0..=NEAR).map(|reach| Noisy::mean_around(&more, grid, i, reach));
        means.max_by(|a, b| a.deviations().abs().total_cmp(&b.deviations().abs()))
    };
    let known = |(i, usual): (usize, f64)| {
        let more =
            clearest(i).map_or(0.0, |more| more.value * (1.0 - (CLEAR / more.deviations()).powi(2)).max(0.0));
        (usual + more).max(0.0)
    };
    let known: Vec<f64> = usual.into_iter().enumerate().map(known).collect();
    let sum: f64 = known.iter().sum();
    known.into_iter().map(|value| if sum > 0.0 { value * total / sum } else { 0.0 }).collect()
}

/// Approximate relative standard deviation of a sum of independent values.
fn deviation(values: &[f64]) -> f64 {
    let squares: f64 = values.iter().map(|value| value * value).sum();
    squares.sqrt() / values.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    const SIDE: usize = 128;

    /// Halves of a picture of luminance 1 with noise of standard deviation .3, filtered as means of 5×5 pixels of which all are brighter by `bias` in
    /// the left half. Returns what is stated, and the true mean squared error of
    /// the mean of both filtered halves. The filter does not adapt to noise.
    fn filtered(seed: u64, bias: f32) -> (Option<ErrorEstimate>, f64) {
        let mut random = Random(seed);
        let film = [0, 1].map(|_| -> Vec<[f32; 3]> {
            (0..SIDE * SIDE).map(|_| [1.0 + 0.3 * 3.4641 * (random.f32() - 0.5); 3]).collect()
        });
        let blurred = film.each_ref().map(|picture| -> Vec<[f32; 3]> {
            let near = |at: usize| at.saturating_sub(2)..(at + 3).min(SIDE);
            let mean = |i: usize| {
                let (x, y) = (i % SIDE, i / SIDE);
                let all = near(y).flat_map(|y| near(x).map(move |x| y * SIDE + x)).map(|j| picture[j][0]);
                let count = (near(x).len() * near(y).len()) as f32;
                [all.sum::<f32>() / count + if x < SIDE / 2 { bias } else { 0.0 }; 3]
            };
            (0..SIDE * SIDE).map(mean).collect()
        });
        let [a, b] = &blurred;
        let truth = a.iter().zip(b).map(|(a, b)| (f64::from(a[0] + b[0]) / 2.0 - 1.0).powi(2)).sum::<f64>();
        let halves = FilteredHalves {
            film: film.each_ref().map(Vec::as_slice),
            filtered: blurred.each_ref().map(Vec::as_slice),
        };
        (halves.error([SIDE; 2]), truth / (SIDE * SIDE) as f64)
    }

    #[test]
    fn noise_and_bias_of_a_filter_are_told() {
        for bias in [0.0, 0.05] {
            let (mut held, mut stated, mut all) = (0, 0.0, 0.0);
            for seed in 0..20 {
                let (estimate, truth) = filtered(seed, bias);
                // relMSE of luminance 1 divides by 1.01; what the filter shows stands for it.
                let estimate = estimate.expect("it is large enough");
                held += usize::from(estimate.rel_mse.holds(truth / 1.01));
                (stated, all) = (stated + estimate.rel_mse.value, all + truth / 1.01);
            }
            assert!(held >= 16, "{held} of 20 intervals held");
            // With noise alone M is S/2; with bias alone M is twice that, and the stated error is smaller by √2.
            assert!((0.65..1.1).contains(&(stated / all)), "{}", stated / all);
        }
    }

    #[test]
    fn bias_is_told_where_it_is() {
        let (estimate, _) = filtered(1, 0.1);
        let [median, p95, _] = estimate.expect("it is large enough").relative.map(|error| error.value);
        assert!((0.06..0.16).contains(&p95) && median < p95, "{median} {p95}");
    }

    #[test]
    fn pictures_of_other_sizes_tell_nothing() {
        let picture: &[[f32; 3]] = &[[1.0; 3]; 4];
        let halves = FilteredHalves { film: [picture; 2], filtered: [picture, &picture[..3]] };
        assert!(halves.error([2; 2]).is_none());
        let halves = FilteredHalves { film: [picture; 2], filtered: [picture; 2] };
        assert!(halves.error([2; 2]).is_none(), "without any error");
    }
}
