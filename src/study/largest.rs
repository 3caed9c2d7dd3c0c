//! The largest samples of each tile of a picture: how much of its light they carry, and where that light belongs.

use crate::study::error_tile::TILE;

/// Number of samples kept per tile.
pub const KEPT: usize = 8;

/// Width and height, in tiles, of the regions in which single samples are compared with the total light.
const REGION: usize = 12;

/// A sample carrying more than this fraction of its region's light dominates the region's mean, and hence its error estimate.
const LARGE: f64 = 0.02;

/// The luminances of the largest samples of each tile, largest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LargestSamples {
    columns: usize,
    tiles: Vec<[f32; KEPT]>,
}

/// Fractions of a picture's light carried by single samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct LargestShares {
    /// Fraction of the picture's luminance in its largest sample.
    pub one: f64,
    /// Fraction of the luminance in the largest samples of all tiles of 8×8 pixels.
    pub one_per_tile: f64,
    /// Fraction of the picture in regions of 96×96 pixels where a single sample carries more than 2 % of the light.
    pub large_in: f64,
}

/// Inserts a luminance if it is among the largest.
#[inline]
fn keep(kept: &mut [f32; KEPT], luminance: f32) {
    // False for nearly all samples, and for NaN.
    if luminance > kept[KEPT - 1] {
        let place = kept.partition_point(|other| *other >= luminance);
        kept.copy_within(place..KEPT - 1, place + 1);
        kept[place] = luminance;
    }
}

impl LargestSamples {
    /// No samples of a picture of `size` pixels.
    pub fn new(size: [usize; 2]) -> Self {
        let [columns, rows] = size.map(|n| n.div_ceil(TILE));
        Self { columns, tiles: vec![[0.0; KEPT]; columns * rows] }
    }

    /// Adds a sample of this luminance in the pixel `[x, y]`, which lies in the picture.
    #[inline]
    pub fn add(&mut self, [x, y]: [usize; 2], luminance: f32) {
        keep(&mut self.tiles[y / TILE * self.columns + x / TILE], luminance);
    }

    /// The luminances of each tile, row by row.
    pub fn tiles(&self) -> &[[f32; KEPT]] {
        &self.tiles
    }

    /// Merges the luminances kept by another part of the picture for tile `tile`; the result does not depend on the order of parts.
    pub fn merge(&mut self, tile: usize, luminances: [f32; KEPT]) {
        if let Some(kept) = self.tiles.get_mut(tile) {
            luminances.into_iter().for_each(|luminance| keep(kept, luminance));
        }
    }

    /// Luminance of the largest samples of each tile in excess of the smallest kept one, row-major. Zero for samples of nearly equal
    /// luminance.
    pub fn excess(&self) -> Vec<f64> {
        let excess = |kept: &[f32; KEPT]| kept.iter().map(|x| f64::from(x - kept[KEPT - 1])).sum();
        self.tiles.iter().map(excess).collect()
    }

    /// The shares of the largest samples in `sums`, the luminance of all samples of each tile, row by row.
    pub fn shares(&self, sums: &[f64]) -> LargestShares {
        let (columns, rows) = (self.columns.max(1), self.tiles.len() / self.columns.max(1));
        let [across, down] = [columns, rows].map(|n| (n / REGION).max(1));
        let mut regions = vec![(0.0, 0.0, 0.0); across * down];
        for (i, (kept, sum)) in self.tiles.iter().zip(sums).enumerate() {
            let (x, y) = (i % columns * across / columns, i / columns * down / rows);
            let (largest, total, tiles) = &mut regions[y * across + x];
            *largest = f64::max(*largest, f64::from(kept[0]));
            (*total, *tiles) = (*total + sum, *tiles + 1.0);
        }
        let total: f64 = regions.iter().map(|region| region.1).sum();
        if total.is_nan() || total <= 0.0 {
            return LargestShares::default();
        }
        let large = regions.iter().filter(|(largest, total, _)| *largest > LARGE * total);
        LargestShares {
            one: regions.iter().map(|region| region.0).fold(0.0, f64::max) / total,
            one_per_tile: self.tiles.iter().map(|kept| f64::from(kept[0])).sum::<f64>() / total,
            // `fold`, because `sum` of nothing is −0.
            large_in: large.fold(0.0, |sum, region| sum + region.2) / self.tiles.len() as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_are_kept_in_order() {
        let mut all = LargestSamples::new([16, 8]);
        for i in [3, 9, 1, 4, 12, 7, 5, 11, 2, 10, 6, 8] {
            all.add([12, 3], i as f32);
        }
        all.add([12, 3], f32::NAN);
        all.add([0, 0], 5.0);
        assert_eq!(all.tiles[1], [12.0, 11.0, 10.0, 9.0, 8.0, 7.0, 6.0, 5.0]);
        assert_eq!(all.excess(), [5.0, 28.0]);
        let shares = all.shares(&[5.0, 245.0]);
        assert_eq!((shares.one, shares.one_per_tile), (12.0 / 250.0, 17.0 / 250.0));
        assert_eq!(shares.large_in, 1.0);
        assert_eq!(all.shares(&[5e3, 245e3]).large_in, 0.0);
        assert_eq!(all.shares(&[0.0, 0.0]), LargestShares::default());
        assert_eq!(LargestSamples::new([0, 0]).shares(&[]), LargestShares::default());
    }
}
