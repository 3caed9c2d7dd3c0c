//! Light of each tile of a picture, and the part carried by single samples.

use std::ops::AddAssign;

use crate::image::compare::luminance;
use crate::study::error_tile::{ReplicatePixel, TILE};
use crate::study::largest::{KEPT, LargestSamples};
use crate::study::summed_areas::Subtract;

/// A sample carrying more than this fraction of its tile's light counts as rare.
const RARE: f64 = 0.125;

/// Light of one tile, or sums over several.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PictureTile {
    pub(super) tiles: f64,
    /// Luminance.
    pub(super) light: f64,
    /// Luminance carried by rare samples, and their number.
    pub(super) rare: f64,
    pub(super) count: f64,
    /// Mean square over pixels of their excess over the tile without rare samples, relative to the square of `rare`.
    pub(super) peak: f64,
    /// Variance of the luminance.
    pub(super) variance: f64,
}

impl AddAssign for PictureTile {
    fn add_assign(&mut self, other: Self) {
        self.tiles += other.tiles;
        self.light += other.light;
        self.rare += other.rare;
        self.count += other.count;
        self.peak += other.peak;
        self.variance += other.variance;
    }
}

impl PictureTile {
    /// All tiles of a picture, row-major.
    pub(super) fn all(
        pixels: &[ReplicatePixel],
        size: [usize; 2],
        largest: &LargestSamples,
        per_pixel: f64,
    ) -> Vec<Self> {
        let [columns, rows] = size.map(|n| n.div_ceil(TILE));
        let place = |i: usize| i / size[0] / TILE * columns + i % size[0] / TILE;
        let mut sums = vec![[0.0; 3]; columns * rows];
        for (i, pixel) in pixels.iter().enumerate().filter(|(_, pixel)| pixel.seen) {
            let sum = &mut sums[place(i)];
            let difference = luminance(pixel.difference) * f64::from(pixel.factor).sqrt();
            for (sum, value) in sum.iter_mut().zip([1.0, luminance(pixel.mean), difference]) {
                *sum += value;
            }
        }
        let tile = |([n, light, difference], kept): (&[f64; 3], &[f32; KEPT])| {
            let pixels = n.max(1.0);
            let light = light / pixels;
            // As sums over samples, from the largest on, while one carries a large part of what the others leave.
            let samples = pixels * per_pixel;
            let (mut rare, mut count) = (0.0, 0.0);
            for sample in kept.iter().map(|sample| f64::from(*sample)) {
                // The film's filter spreads part of the largest samples to neighbouring tiles.
                let rest = light * samples - rare;
                if rest <= 0.0 || sample <= RARE * rest {
                    break;
                }
                (rare, count) = (rare + sample, count + 1.0);
            }
            let variance = (difference / pixels).powi(2);
            let rare = (rare / samples).min(light.max(0.0));
            Self { tiles: 1.0, light, rare, count, peak: 0.0, variance }
        };
        let mut tiles: Vec<Self> = sums.iter().zip(largest.tiles()).map(tile).collect();
        for (i, pixel) in pixels.iter().enumerate().filter(|(_, pixel)| pixel.seen) {
            let at = place(i);
            let tile = &mut tiles[at];
            if tile.rare > 0.0 {
                let more = (luminance(pixel.mean) - (tile.light - tile.rare)) / tile.rare;
                tile.peak += more * more / sums[at][0];
            }
        }
        tiles
    }
}

impl Subtract for PictureTile {
    fn minus(self, other: Self) -> Self {
        Self {
            tiles: self.tiles - other.tiles,
            light: self.light - other.light,
            rare: self.rare - other.rare,
            count: self.count - other.count,
            peak: self.peak - other.peak,
            variance: self.variance - other.variance,
        }
    }
}
