//! Comparison of witnesses with a picture: the caustics and the other light missing from it.

use crate::stream::WitnessedArea;
use crate::study::interval::Z90;
use crate::study::picture_tile::PictureTile;
use crate::study::summed_areas::{Subtract, SummedAreas, tiles_around};
use crate::study::unfound::{CausticSpots, UnfoundLight};

/// Number of samples needed for the means of a tile and its surroundings.
const SAMPLES: f64 = 32.0;

/// Number of standard errors from which on other light is significant.
const SIGNIFICANT: f64 = 4.0;

/// Number of standard errors up to which β counts as 0, and from which on it counts fully.
const SIGNIFICANT_SHARE: [f64; 2] = [2.0, 3.0];

/// Tiles darker than this fraction of the mean luminance get the same weight as those at it.
const DARK: f64 = 0.1;

/// Number of the largest squares along each side of the picture.
const BLOCKS: usize = 4;

/// Tiles along a side of the smallest squares.
const SMALLEST: usize = 2;

impl Subtract for WitnessedArea {
    fn minus(self, other: Self) -> Self {
        let pair = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
        Self {
            areas: self.areas - other.areas,
            samples: self.samples - other.samples,
            camera: pair(self.camera, other.camera),
            light: pair(self.light, other.light),
            caustics: self.caustics - other.caustics,
            caustic_squares: pair(self.caustic_squares, other.caustic_squares),
            caustic_pairs: self.caustic_pairs - other.caustic_pairs,
        }
    }
}

/// Witness results and picture, for comparison.
pub(super) struct WitnessComparison<'a> {
    /// Columns and rows of tiles.
    pub(super) grid: [usize; 2],
    pub(super) picture: &'a [PictureTile],
    /// The same as summed-area table.
    pub(super) pictures: &'a SummedAreas<PictureTile>,
    pub(super) witnesses: [SummedAreas<WitnessedArea>; 2],
}

/// Fraction of the caustics missing from a picture.
#[derive(Clone, Copy, Debug, Default)]
struct MissingShare {
    /// Estimate; 0 if insignificant.
    share: f64,
    /// Its relative standard deviation.
    deviation: f64,
    /// Upper end of its 90 % interval.
    upper: f64,
}

/// Means around one tile.
struct Around {
    /// Mean luminance of caustics, per witness.
    caustics: [f64; 2],
    /// Variance of the mean luminance of one tile, per witness.
    variance: [f64; 2],
    spots: CausticSpots,
}

impl WitnessComparison<'_> {
    /// Light found by witnesses and missing from the picture.
    pub(super) fn unfound(&self) -> UnfoundLight {
        let around: Vec<Around> = (0..self.picture.len()).map(|i| self.around(i)).collect();
        let MissingShare { share: beta, deviation, upper } = self.missing_caustics(&around);
        let mean = |around: &Around| 0.5 * (around.caustics[0] + around.caustics[1]);
        let caustics_of = |beta: f64| -> Vec<f64> {
            let tiles = around.iter().zip(self.picture);
            tiles.map(|(around, tile)| (beta * mean(around) - tile.rare).max(0.0)).collect()
        };
        let (mut caustic_light, possible) = (caustics_of(beta), caustics_of(upper));
        let total = |light: &[f64]| light.iter().sum::<f64>();
        let mut light = caustic_light.clone();
        self.add_other_light(&mut light);
        for (caustics, all) in caustic_light.iter_mut().zip(&light) {
            *caustics = caustics.min(*all);
        }
        let brightness = around
            .iter()
            .zip(self.picture)
            .zip(&light)
            .map(|((around, tile), lacks)| {
                (tile.light - tile.rare + beta * mean(around)).max(tile.light.min(*lacks))
            })
            .collect();
        // Photons of the two witnesses are independent.
        let [mut scatter, mut square] = [0.0; 2];
        for around in &around {
            scatter += (around.caustics[0] - around.caustics[1]).powi(2) / 4.0;
            square += mean(around).powi(2);
        }
        let noise = if square > 0.0 { scatter / square } else { 0.0 };
        let all = total(&light) + self.picture.iter().map(|tile| tile.light).sum::<f64>();
        let share = |light: f64| if all > 0.0 { light / all } else { 0.0 };
        UnfoundLight {
            deviation: (deviation.powi(2) + noise).sqrt().min(1.0),
            share: Some(share(total(&light))),
            caustics: share(total(&caustic_light)),
            caustic_light,
            brightness,
            light,
            possible,
            spots: around.iter().map(|around| around.spots).collect(),
            ..UnfoundLight::default()
        }
    }

    /// Means around tile `i`, over the smallest square with enough samples.
    fn around(&self, i: usize) -> Around {
        let most = self.grid[0].max(self.grid[1]);
        let window = |reach: usize| tiles_around(i, self.grid, reach);
        let found = |reach: usize| {
            let (from, to) = window(reach);
            self.witnesses.each_ref().map(|areas| areas.sum(from, to))
        };
        let enough = |reach: &usize| found(*reach).iter().all(|half| 2.0 * half.samples >= SAMPLES);
        let reach = (0..most).find(enough).unwrap_or(most);
        let (halves, (from, to)) = (found(reach), window(reach));
        let shown = self.pictures.sum(from, to);
        let shown = (shown.light - shown.rare) / shown.tiles.max(1.0);
        let means = halves.each_ref().map(WitnessedArea::mean);
        let mut both = halves[0];
        both += halves[1];
        // Rounding error of differences of sums over the grid, where there is nothing.
        let everywhere =
            self.witnesses.each_ref().map(|areas| areas.sum([0, 0], self.grid).caustic_squares[0]);
        let rounding = 1e-9 * everywhere.iter().sum::<f64>();
        // A few samples may be equal by chance.
        let least = (0.05 * shown).powi(2) + f64::MIN_POSITIVE;
        Around {
            caustics: halves.each_ref().map(WitnessedArea::mean_caustics),
            variance: means.map(|[_, variance]| halves[0].areas * variance + least),
            spots: CausticSpots::of(&both, rounding),
        }
    }

    /// Fraction β of the caustics missing from the picture, from single tiles: a caustic may lie in few of them, where means over their
    /// surroundings would hide it.
    fn missing_caustics(&self, around: &[Around]) -> MissingShare {
        let mean = self.picture.iter().map(|tile| tile.light.abs()).sum::<f64>() / self.picture.len() as f64;
        let (mut above, mut below, mut noise) = (0.0, 0.0, 0.0);
        // Sums of squares and products of the contributions of single tiles to `above` and `below`.
        let [mut above2, mut both, mut below2] = [0.0; 3];
        for (i, (around, tile)) in around.iter().zip(self.picture).enumerate() {
            let (from, to) = tiles_around(i, self.grid, 0);
            let halves = self.witnesses.each_ref().map(|areas| areas.sum(from, to));
            if halves.iter().any(|half| half.samples < 1.0) {
                continue;
            }
            let caustics = halves.each_ref().map(WitnessedArea::mean_caustics);
            let shown = tile.light - tile.rare;
            let (gap, variance) = (halves.map(|half| half.mean()[0] - shown), around.variance);
            // Weighted by luminance rather than by variance, which is small where a witness has found nothing.
            let weight = 1.0 / (shown.abs() + DARK * mean).powi(2).max(f64::MIN_POSITIVE);
            let a = weight * (caustics[0] * gap[1] + caustics[1] * gap[0]);
            let b = weight * 2.0 * caustics[0] * caustics[1];
            (above, below) = (above + a, below + b);
            (above2, both, below2) = (above2 + a * a, both + a * b, below2 + b * b);
            let of = |a: usize, b: usize| caustics[a].powi(2) * variance[b];
            noise += weight * weight * (of(0, 1) + of(1, 0));
        }
        if below <= 0.0 {
            return MissingShare::default();
        }
        let (beta, sigma) = (above / below, noise.sqrt() / below);
        // The largest fraction that the tiles do not refute; if few of them contain all the caustics, they refute little (Fieller 1954).
        let is_possible = |share: f64| {
            let scatter = (above2 - 2.0 * share * both + share * share * below2).max(noise);
            above - share * below >= -Z90 * scatter.sqrt()
        };
        let steps = 64;
        let upper =
            (0..=steps).rev().map(|i| f64::from(i) / f64::from(steps)).find(|share| is_possible(*share));
        let upper = upper.unwrap_or(0.0).max(beta.min(1.0));
        let [none, all] = SIGNIFICANT_SHARE;
        let counts = ((beta / sigma - none) / (all - none)).clamp(0.0, 1.0);
        match counts > 0.0 {
            true => MissingShare { share: (beta * counts).min(1.0), deviation: sigma / beta, upper },
            false => MissingShare { upper, ..MissingShare::default() },
        }
    }

    /// Adds to `light` what the witnesses find in excess, in squares of decreasing size.
    fn add_other_light(&self, light: &mut [f64]) {
        let [columns, rows] = self.grid;
        let mut parts = BLOCKS;
        while columns / parts >= SMALLEST && rows / parts >= SMALLEST {
            for (row, column) in (0..parts).flat_map(|row| (0..parts).map(move |column| (row, column))) {
                let from = [column * columns / parts, row * rows / parts];
                let to = [(column + 1) * columns / parts, (row + 1) * rows / parts];
                let mut all = self.witnesses[0].sum(from, to);
                all += self.witnesses[1].sum(from, to);
                let shown = self.pictures.sum(from, to);
                // Both witnesses trace light paths for the same tiles.
                if all.samples < SAMPLES {
                    continue;
                }
                let [mean, variance] = all.mean();
                let places = || (from[1]..to[1]).flat_map(|y| (from[0]..to[0]).map(move |x| y * columns + x));
                let lacks = places().map(|i| light[i]).sum::<f64>() / shown.tiles;
                let more = mean - shown.light / shown.tiles - lacks;
                // A few samples may be equal by chance.
                let least = (0.05 * shown.light / shown.tiles).powi(2);
                let noise = variance + shown.variance / (shown.tiles * shown.tiles) + least;
                if more > SIGNIFICANT * noise.sqrt() || lacks > 0.0 && more < -SIGNIFICANT * noise.sqrt() {
                    places().for_each(|i| light[i] = (light[i] + more).max(0.0));
                }
            }
            parts *= 2;
        }
    }
}
