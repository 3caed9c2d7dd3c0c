//! The error of two pictures as one, such as those of both eyes.
//!
//! Pictures of both eyes share paths, so that their errors are correlated. By how much differs from place to place with the disparity, and two
//! replicates do not tell. So the intervals are those of fully correlated errors: they are conservative, and exact where all is shared.

use crate::study::error::{ErrorEstimate, TileSubset, quantiles};
use crate::study::interval::Interval;
use crate::study::monitor::ErrorStatus;

/// Error of two pictures of the same size together, from the status of each; `subset`: the tiles that [`ErrorStatus::held_out`] is of.
///
/// - Relative errors are those that 50 %, 95 % and 99 % of the tiles of both pictures together stay below. Such a quantile changes by a factor
///   between those of the pictures, so its bounds are the value times the lesser and the greater of the relative bounds of both.
/// - relMSE and mean square error are the means of both pictures. The quantiles of a sum of fully correlated numbers are the sums of their
///   quantiles, so the bounds are the means of the bounds.
pub fn joint_estimate(pictures: [&ErrorStatus; 2], subset: TileSubset) -> ErrorEstimate {
    let tiles = |status: &ErrorStatus| {
        let (columns, errors) = (status.map.0.max(1), &status.map.1);
        let subset = subset.among(errors.len());
        let counts = move |i: usize| subset.contains(i % columns, i / columns);
        let of_subset = errors.iter().enumerate().filter(|(i, _)| counts(*i)).map(|(_, error)| *error);
        of_subset.collect::<Vec<f64>>()
    };
    let [left, right] = pictures.map(|status| status.held_out);
    let values = quantiles(pictures.into_iter().flat_map(tiles).collect());
    let bounds = |interval: &Interval| match interval.value > 0.0 {
        true => [interval.low / interval.value, interval.high / interval.value],
        false => [1.0; 2],
    };
    let relative = std::array::from_fn(|i| {
        let [a, b] = [left, right].map(|estimate| bounds(&estimate.relative[i]));
        let value = values[i];
        Interval { value, low: value * a[0].min(b[0]), high: value * a[1].max(b[1]) }
    });
    let mean = |a: f64, b: f64| 0.5 * (a + b);
    let (a, b) = (left.rel_mse, right.rel_mse);
    let rel_mse =
        Interval { value: mean(a.value, b.value), low: mean(a.low, b.low), high: mean(a.high, b.high) };
    ErrorEstimate { relative, rel_mse, mean_square: mean(left.mean_square, right.mean_square) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of 10×4 tiles whose errors are `scale` times 1 … 40, in an order that differs from column to column.
    fn status(scale: f64, spread: f64) -> ErrorStatus {
        let errors: Vec<f64> = (0..40).map(|i| scale * f64::from(1 + i * 27 % 40)).collect();
        let interval = |value: f64| Interval::of_log(value, spread);
        let held_out = ErrorEstimate {
            relative: quantiles(errors.clone()).map(interval),
            rel_mse: interval(scale * scale),
            mean_square: scale * scale,
        };
        ErrorStatus { held_out, map: (10, errors), ..ErrorStatus::default() }
    }

    #[test]
    fn two_equal_pictures_have_the_error_of_one() {
        let one = status(0.01, 0.2);
        let both = joint_estimate([&one, &one], TileSubset::All);
        for (both, one) in both.relative.iter().zip(&one.held_out.relative) {
            let pairs = [(both.value, one.value), (both.low, one.low), (both.high, one.high)];
            assert!(pairs.into_iter().all(|(a, b)| (a / b - 1.0).abs() < 1e-12), "{both:?} {one:?}");
        }
        assert_eq!(both.rel_mse, one.held_out.rel_mse);
        assert_eq!(both.mean_square, one.held_out.mean_square);
    }

    /// Where one picture is twice as noisy, 95 % of all tiles stay below an error that 90 % of its own stay below.
    #[test]
    fn quantiles_are_those_of_all_tiles() {
        let (quiet, noisy) = (status(0.01, 0.1), status(0.02, 0.3));
        let both = joint_estimate([&quiet, &noisy], TileSubset::All);
        for (at, q) in [0.5, 0.95, 0.99].into_iter().enumerate() {
            let value = both.relative[at].value;
            let below = |status: &ErrorStatus| status.map.1.iter().filter(|error| **error < value).count();
            assert_eq!(below(&quiet) + below(&noisy), (q * 80.0) as usize);
            let [a, b] = [&quiet, &noisy].map(|status| status.held_out.relative[at].value);
            assert!((a..=b).contains(&value), "{a} {value} {b}");
            // As uncertain as the more uncertain of both.
            let wide = noisy.held_out.relative[at];
            assert!((both.relative[at].high / value - wide.high / wide.value).abs() < 1e-12);
        }
        assert!((both.rel_mse.value - 0.5 * (1e-4 + 4e-4)).abs() < 1e-15);
        let bound = 0.5 * (quiet.held_out.rel_mse.high + noisy.held_out.rel_mse.high);
        assert_eq!(both.rel_mse.high, bound);
    }

    /// The tiles that decide about the end of a render are left out.
    #[test]
    fn only_tiles_of_the_subset_count() {
        let mut status = status(0.01, 0.1);
        for (i, error) in status.map.1.iter_mut().enumerate() {
            *error = if TileSubset::HeldOut.contains(i % 10, i / 10) { 0.5 } else { 0.1 };
        }
        let of = |subset| joint_estimate([&status, &status], subset).relative[1].value;
        assert_eq!([of(TileSubset::HeldOut), of(TileSubset::Deciding)], [0.5, 0.1]);
    }
}
