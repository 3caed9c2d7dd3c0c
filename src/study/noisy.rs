//! Noisy values per tile of a picture, and their means over neighbouring tiles.

use crate::study::summed_areas::tiles_around;

/// A value and its variance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noisy {
    pub(super) value: f64,
    pub(super) variance: f64,
}

impl Noisy {
    /// Number of standard deviations above 0.
    pub(super) fn deviations(&self) -> f64 {
        self.value / self.variance.sqrt().max(f64::MIN_POSITIVE)
    }

    /// Mean of the known values of the tiles within `reach` of tile `i` of a grid; 0 if there are none.
    pub(super) fn mean_around(tiles: &[Option<Self>], grid: [usize; 2], i: usize, reach: usize) -> Self {
        let (from, to) = tiles_around(i, grid, reach);
        let places = (from[1]..to[1]).flat_map(|y| (from[0]..to[0]).map(move |x| y * grid[0] + x));
        let [value, variance, count] = places
            .filter_map(|j| tiles[j])
            .fold([0.0; 3], |sum, tile| [sum[0] + tile.value, sum[1] + tile.variance, sum[2] + 1.0]);
        let count = f64::max(count, 1.0);
        Self { value: value / count, variance: variance / (count * count) }
    }
}
