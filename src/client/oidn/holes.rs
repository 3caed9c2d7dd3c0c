//! Fills pixels without samples with the mean of a nearby pixel of the same surface.
//!
//! The network distinguishes noise from detail by pixel-to-pixel variation. Averages over neighbours would be smooth among noisy pixels and
//! look like detail, as would copies of the nearest sample; copies from random places are as noisy as real samples.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::image::{Grid, push_pull};
use crate::math::random::Random;

/// Approximate number of candidate samples.
const CHOICE: f32 = 30.0;
/// Largest distance of a candidate along each axis, pixels.
const REACH: f32 = 16.0;
/// Number of candidate positions tried.
const TRIES: usize = 64;
/// Squared differences of albedo and normal below which two pixels count as the same surface.
const ALIKE: [f32; 2] = [0.01, 0.1];

/// Albedo and normal of every pixel.
pub type OidnFeatures<'a> = [&'a [[f32; 3]]; 2];

/// The means of `sums` (values with their weight). Where the weight is 0: the mean of a nearby pixel of the same surface or, if there is
/// none, of the surroundings; zero if those are empty too. `None` if memory runs out.
pub(super) fn fill(sums: &Grid<Vec4>, features: OidnFeatures<'_>) -> Option<Grid<Vec3>> {
    let seen = sums.pixels().par_iter().filter(|sum| sum.w > 0.0).count();
    let around = if seen < sums.pixels().len() {
        Some(push_pull::fill(sums.clone(), f32::MIN_POSITIVE)?)
    } else {
        None
    };
    let share = seen as f32 / sums.pixels().len() as f32;
    let reach = (0.5 * (CHOICE / share).sqrt()).clamp(1.0, REACH) as usize;
    let width = sums.width();
    let mut filled = Grid::try_filled(width, sums.height(), Vec3::ZERO)?;
    filled.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, value) in row.iter_mut().enumerate() {
            let sum = sums.at(x, y);
            let sum = if sum.w > 0.0 { Some(sum) } else { neighbour(sums, features, [x, y], reach) };
            let around = || around.as_ref().map_or(Vec3::ZERO, |means| means.at(x, y));
            *value = sum.map_or_else(around, |sum| sum.truncate() / sum.w);
        }
    });
    Some(filled)
}

/// A pixel with samples within `reach` on the same surface.
fn neighbour(
    sums: &Grid<Vec4>,
    features: OidnFeatures<'_>,
    [x, y]: [usize; 2],
    reach: usize,
) -> Option<Vec4> {
    let (width, height) = (sums.width(), sums.height());
    let mut random = Random((y * width + x) as u64);
    let span = (2 * reach + 1) as f32;
    (0..TRIES).find_map(|_| {
        let [x2, y2] = [x, y].map(|at| at + (random.f32() * span) as usize).map(|at| at.wrapping_sub(reach));
        let is_alike = || {
            let [here, there] = [y * width + x, y2 * width + x2];
            features.iter().zip(ALIKE).all(|(feature, most)| {
                Vec3::from(feature[here]).distance_squared(Vec3::from(feature[there])) <= most
            })
        };
        let sum = (x2 < width && y2 < height).then(|| sums.at(x2, y2)).filter(|sum| sum.w > 0.0)?;
        is_alike().then_some(sum)
    })
}
