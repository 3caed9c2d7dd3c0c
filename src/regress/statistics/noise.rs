//! The noise of a single picture, from the picture itself.

use crate::image::Grid;
use crate::math::quantile::nearest_rank;

/// Half of the side of the window in which the noise is taken to be alike: more than half of its pixels do not belong to a firefly that a splat
/// filter has spread.
const REACH: isize = 3;

/// A pixel whose distance from the median around it exceeds this many standard errors is taken to be noise as a whole.
const OUTLIER: f64 = 3.0;

/// The standard error by which a median deviation of 1 speaks, of normal noise.
const MEDIAN_TO_ERROR: f64 = 1.0 / 0.674_490;

/// The noise of neighbouring pixels may be alike by the splat filter, which hides a part of it: so it is assumed to be this many times as large.
const HIDDEN: f64 = 2.0;

/// Variance of each channel of each pixel, cautiously: rather too large.
///
/// The residual of a mask that no plane and no straight edge along an axis passes (Immerkær, *Fast Noise Variance Estimation*, CVIU 64,
/// 1996) is taken by its median over 7×7 pixels, which fireflies do not move, and doubled. A pixel that stands out from its neighbours
/// is taken to be noise as a whole. Pixels that are not finite get NaN.
pub fn estimated_variance(picture: &Grid<[f32; 3]>) -> Vec<[f32; 3]> {
    let (width, height) = (picture.width() as isize, picture.height() as isize);
    let at = |x: isize, y: isize| picture.at(x.clamp(0, width - 1) as usize, y.clamp(0, height - 1) as usize);
    let places = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let residuals: Vec<[f64; 3]> = places()
        .map(|(x, y)| {
            let mut sum = [0.0; 3];
            for (dy, row) in [1.0, -2.0, 1.0].into_iter().enumerate() {
                for (dx, column) in [1.0, -2.0, 1.0].into_iter().enumerate() {
                    let pixel = at(x + dx as isize - 1, y + dy as isize - 1);
                    sum = std::array::from_fn(|c| sum[c] + row * column * f64::from(pixel[c]));
                }
            }
            sum.map(f64::abs)
        })
        .collect();
    let mut values = Vec::new();
    let mut around = |(x, y): (isize, isize), value: &dyn Fn(isize, isize) -> f64| {
        values.clear();
        for ny in (y - REACH).max(0)..=(y + REACH).min(height - 1) {
            let row = ((x - REACH).max(0)..=(x + REACH).min(width - 1)).map(|nx| value(nx, ny));
            values.extend(row.filter(|value| value.is_finite()));
        }
        values.sort_unstable_by(f64::total_cmp);
        nearest_rank(&values, 0.5).unwrap_or(0.0)
    };
    places()
        .map(|(x, y)| {
            std::array::from_fn(|c| {
                let own = f64::from(at(x, y)[c]);
                if !own.is_finite() {
                    return f32::NAN;
                }
                let residual = around((x, y), &|nx, ny| residuals[(ny * width + nx) as usize][c]);
                // The squares of the mask's weights add to 36.
                let error = residual / 6.0 * MEDIAN_TO_ERROR * HIDDEN;
                let distance = (own - around((x, y), &|nx, ny| f64::from(at(nx, ny)[c]))).abs();
                let error = if distance > OUTLIER * error { distance } else { error };
                (error * error) as f32
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    /// Planes have no noise, and that of noisy pixels is found within a factor of 3 and not below.
    #[test]
    fn the_noise_of_a_plane_is_found_and_rather_too_large() {
        let mut random = Random(4);
        let mut normal = || (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
        let plane = |noise: f64, normal: &mut dyn FnMut() -> f64| {
            let pixels = (0..64 * 64).map(|i| {
                let value = 1.0 + 0.01 * f64::from(i % 64) + noise * normal();
                [value as f32; 3]
            });
            Grid::from_rows(64, 64, pixels.collect()).expect("64 rows")
        };
        let mut median = |noise: f64| {
            let mut found: Vec<f32> =
                estimated_variance(&plane(noise, &mut normal)).iter().map(|v| v[0]).collect();
            found.sort_by(f32::total_cmp);
            f64::from(found[found.len() / 2]).sqrt()
        };
        assert!(median(0.0) < 1e-6);
        let found = median(0.1);
        assert!((0.1..0.3).contains(&found), "{found}");
    }

    #[test]
    fn a_firefly_is_noise_of_its_own_pixel_and_nan_is_told() {
        let mut picture = Grid::try_filled(16, 16, [1.0; 3]).expect("memory");
        picture.row_mut(8)[8] = [101.0; 3];
        picture.row_mut(2)[2] = [f32::NAN; 3];
        let variance = estimated_variance(&picture);
        assert!(variance[8 * 16 + 8][0] >= 9_999.0, "{:?}", variance[8 * 16 + 8]);
        assert!(variance[2 * 16 + 2][0].is_nan());
        assert_eq!(variance[14 * 16 + 14], [0.0; 3]);
    }
}
