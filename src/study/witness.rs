//! Light that a render has not found, as witnesses and its own rare samples tell.
//!
//! The replicates of a render tell how far its samples scatter, and nothing of what no sample has met. Where rare samples bring much light,
//! as caustics seen through glass do in bidirectional path tracing, nearly every tile of the picture lacks that light and
//! states a small error. [`Witnesses`] are a few paths of other methods. They know all light coarsely, and with less noise that of caustics, from
//! photons. What they find and the picture lacks is *unfound* light, which the stated error counts:
//!
//! - **What was met once.** Where single samples carry much of the light of some tiles, others have met none of theirs. As much light as was found
//!   by one sample of a tile is, in expectation, not found by any (Good 1953, *The population frequencies of species and the estimation of
//!   population parameters*), and the number of tiles that have met one sample and two estimates that of those which lack theirs (Chao 1984). Nobody
//!   knows where they are.
//! - **Caustics.** Let T be all light that the witnesses find, C the light of caustics, and P that of the picture without
//!   single samples that carry much of a tile's light. The share β of the caustics that the picture lacks is found by
//!   regression of T − P on C over the tiles of the picture; T and C are of different halves of the witnesses, so that their noise
//!   does not look like light. A tile then lacks β C less the light of its few large samples.
//! - **Highlights** ([`highlights`](crate::study::highlights)): small lamps in mirrors and glass.
//! - **All other light.** Where T is above the picture by more than four standard errors, in squares from a sixteenth of the picture down to 2×2 tiles,
//!   the difference is unfound.
//!
//! In a pixel that has not met a light of mean luminance u the error is u, so that u² adds to the mean square error that the replicates state.

use std::fmt;

use crate::math::bits::mix;
use crate::stream::{Witnessed, WitnessedArea};
use crate::study::error::{ReplicatePixel, TILE};
use crate::study::highlights::{LackedHighlights, lacked_highlights};
use crate::study::largest::LargestSamples;
use crate::study::picture_tile::PictureTile;
use crate::study::summed_areas::{Subtract, SummedAreas, tiles_around};

/// Goes on to at least so many paths over a picture of this size in pixels; returns what two independent witnesses have found in each of
/// its tiles of 8×8 pixels since the render began.
pub type Witnesses = Box<dyn FnMut(u64, [u32; 2]) -> Witnessed + Send>;

/// Paths of the render for each one of the witnesses, which cost about twice as much.
const PATHS_PER_WITNESS: f64 = 128.0;

/// Paths of the witnesses: the least, up to how many they have twice their share, and the most. The thread that watches the error traces them,
/// and must not stand still for long.
const WITNESS_PATHS: [f64; 3] = [256.0, 2048.0, 131_072.0];

/// Growth of the render from one look at the witnesses to the next.
const GROWTH: f64 = 1.5;

/// Samples from which the means of a tile and its surroundings are taken.
const SAMPLES: f64 = 32.0;

/// Up to this share of two rare samples of a tile lie in one place by chance.
const BY_CHANCE: f64 = 0.25;

/// Number of standard errors from which other light counts.
const SIGNIFICANT: f64 = 4.0;

/// Up to the first number of standard errors β counts as 0, from the second on as what it is.
const SIGNIFICANT_SHARE: [f64; 2] = [2.0, 3.0];

/// Tiles darker than this share of the mean luminance weigh as much as those that have it.
const DARK: f64 = 0.1;

/// The largest squares along either side of the picture.
const BLOCKS: usize = 4;

/// Tiles along a side of the smallest squares.
const SMALLEST: usize = 2;

/// Light that some tiles lack, nobody knows which.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScatteredLight {
    /// As many tiles as lack it, ascending; any that have met no rare sample.
    pub tiles: Vec<usize>,
    /// Mean luminance that each of them lacks.
    pub light: f64,
    /// Root mean square of the luminance that its pixels lack: more than the mean where all of it belongs into few of them, as highlights do.
    pub rms: f64,
    /// Relative standard deviation of both.
    pub deviation: f64,
}

/// Light that a picture lacks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnfoundLight {
    /// Mean luminance that each tile lacks, row by row.
    pub light: Vec<f64>,
    /// Luminance that each tile has and lacks.
    pub brightness: Vec<f64>,
    /// Relative standard deviation of `light`.
    pub deviation: f64,
    /// Caustics that each tile may lack, mean luminance at one standard deviation, also where they are not significant; empty without witnesses.
    pub possible: Vec<f64>,
    /// Highlights that each tile lacks on top of it; empty where there are none.
    pub highlights: Vec<LackedHighlights>,
    /// What some of the tiles lack on top of that.
    pub scattered: ScatteredLight,
    /// What witnesses have found and the picture lacks, as a share of all light; `None` without witnesses.
    pub share: Option<f64>,
    /// The part of it that is caustics.
    pub caustics: f64,
    /// The part of it that is highlights.
    pub in_highlights: f64,
}

/// [`Witnesses`] and what they have found.
pub(super) struct WitnessState {
    witnesses: Witnesses,
    paths: f64,
    found: Witnessed,
}

impl fmt::Debug for WitnessState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("WitnessState").field("paths", &self.paths).finish_non_exhaustive()
    }
}

impl WitnessState {
    pub(super) fn new(witnesses: Witnesses) -> Self {
        Self { witnesses, paths: 0.0, found: Witnessed::default() }
    }

    /// The witnesses, for another picture of the same render.
    pub(super) fn into_witnesses(self) -> Witnesses {
        self.witnesses
    }

    /// Has the witnesses go on where the `paths` of the render of a picture of `size` pixels have grown. They are `thorough` where the
    /// render is to stop by what they say: then they have enough paths from the beginning.
    pub(super) fn update(&mut self, paths: f64, size: [usize; 2], thorough: bool) {
        // What they have traced follows from the render's paths alone, so that a render that is resumed states the same.
        let [least, enough, most] = WITNESS_PATHS;
        let first = if thorough { enough } else { (2.0 * paths / PATHS_PER_WITNESS).min(enough) };
        let share = (paths / PATHS_PER_WITNESS).max(first);
        let steps = (share / least).log(GROWTH).floor().max(0.0);
        let wanted = (least * GROWTH.powf(steps)).round().min(most);
        if wanted > self.paths {
            (self.paths, self.found) = (wanted, (self.witnesses)(wanted as u64, size.map(|n| n as u32)));
        }
    }
}

/// What a picture lacks that has `per_pixel` samples in each pixel, on a film whose filter has this energy.
pub(super) fn unfound(
    witnesses: Option<&WitnessState>,
    pixels: &[ReplicatePixel],
    size: [usize; 2],
    largest: &LargestSamples,
    per_pixel: f64,
    energy: f64,
) -> UnfoundLight {
    let picture = PictureTile::all(pixels, size, largest, per_pixel);
    let grid = size.map(|n| n.div_ceil(TILE));
    let pictures = SummedAreas::new(&picture, grid);
    let found = witnesses.map(|w| &w.found);
    let areas = found.map(|found| &found.areas);
    let areas = areas.filter(|halves| !picture.is_empty() && halves.iter().all(|h| h.len() == picture.len()));
    let mut unfound = match areas {
        Some(halves) => WitnessComparison {
            grid,
            witnesses: halves.each_ref().map(|h| SummedAreas::new(h, grid)),
            picture: &picture,
            pictures: &pictures,
        }
        .unfound(),
        None => UnfoundLight {
            light: vec![0.0; picture.len()],
            brightness: picture.iter().map(|tile| tile.light - tile.rare).collect(),
            ..UnfoundLight::default()
        },
    };
    if let Some(Witnessed { highlights, .. }) = found {
        unfound.add_highlights(lacked_highlights(highlights, &picture, size, per_pixel, energy), &picture);
    }
    unfound.scattered = scattered(&picture, &unfound);
    unfound
}

impl UnfoundLight {
    fn add_highlights(&mut self, highlights: Vec<LackedHighlights>, picture: &[PictureTile]) {
        for (brightness, lacked) in self.brightness.iter_mut().zip(&highlights) {
            *brightness += lacked.light;
        }
        let light: f64 = highlights.iter().map(|lacked| lacked.light).sum();
        let known: f64 = self.light.iter().sum();
        let shown: f64 = picture.iter().map(|tile| tile.light).sum();
        if light > 0.0 && shown > 0.0 {
            let before = if known > 0.0 { self.caustics * (shown + known) } else { 0.0 };
            let all = shown + known + light;
            self.share = Some((known + light) / all);
            (self.caustics, self.in_highlights) = (before / all, light / all);
        }
        self.share = self.share.or(Some(0.0));
        self.highlights = highlights;
    }

    /// Mean luminance that a tile is known to lack.
    fn known(&self, tile: usize) -> f64 {
        self.light[tile] + self.highlights.get(tile).map_or(0.0, |lacked| lacked.light)
    }
}

/// Light that an unknown part of the tiles lacks, by what was found in exactly one sample (Good 1953): in expectation, as much is not found at
/// all. The number of these tiles is that of Chao (1984).
fn scattered(picture: &[PictureTile], unfound: &UnfoundLight) -> ScatteredLight {
    let met = |n: f64| picture.iter().filter(move |tile| tile.count == n);
    let [once, twice] = [1.0, 2.0].map(|n| met(n).count() as f64);
    let mut tiles: Vec<usize> =
        (0..picture.len()).filter(|&i| picture[i].count == 0.0 && unfound.known(i) == 0.0).collect();
    let number = (once * (once - 1.0) / (2.0 * (twice + 1.0))).round();
    // What witnesses tell of tiles that have met nothing is a part of it.
    let known: f64 = (0..picture.len()).filter(|&i| picture[i].count == 0.0).map(|i| unfound.known(i)).sum();
    let light = (met(1.0).map(|tile| tile.rare).sum::<f64>() - known) / number;
    if number < 1.0 || light <= 0.0 {
        return ScatteredLight::default();
    }
    // Nobody knows which: any of them.
    tiles.sort_unstable_by_key(|&i| mix(i as u64));
    tiles.truncate(number as usize);
    tiles.sort_unstable();
    // Two samples in one place bring four times the square of one, in two places twice.
    let [one, two] =
        [1.0, 2.0].map(|n| met(n).map(|tile| tile.peak).sum::<f64>() / met(n).count().max(1) as f64);
    let points = if one > 0.0 { 2.0 * two / one - 1.0 } else { 0.0 };
    let points = ((points - BY_CHANCE) / (1.0 - BY_CHANCE)).clamp(0.0, 1.0);
    let rms = light * (points * one + 1.0 - points).max(1.0).sqrt();
    ScatteredLight { tiles, light, rms, deviation: 1.0 / once.sqrt() }
}

impl Subtract for WitnessedArea {
    fn minus(self, other: Self) -> Self {
        let pair = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
        Self {
            areas: self.areas - other.areas,
            samples: self.samples - other.samples,
            camera: pair(self.camera, other.camera),
            light: pair(self.light, other.light),
            caustics: self.caustics - other.caustics,
        }
    }
}

/// The witnesses beside the picture.
struct WitnessComparison<'a> {
    grid: [usize; 2],
    picture: &'a [PictureTile],
    pictures: &'a SummedAreas<PictureTile>,
    witnesses: [SummedAreas<WitnessedArea>; 2],
}

/// The share of the caustics that a picture lacks.
#[derive(Clone, Copy, Debug, Default)]
struct MissingShare {
    /// 0 where it may be noise.
    share: f64,
    /// Its relative standard deviation.
    deviation: f64,
    /// One standard deviation above what it is.
    most: f64,
}

/// What is found around one tile.
struct Around {
    /// Mean luminance of caustics, by either witness.
    caustics: [f64; 2],
    /// The variance of the mean luminance of one tile, by either.
    variance: [f64; 2],
}

impl WitnessComparison<'_> {
    fn unfound(&self) -> UnfoundLight {
        let around: Vec<Around> = (0..self.picture.len()).map(|i| self.around(i)).collect();
        let MissingShare { share: beta, deviation, most } = self.missing_caustics(&around);
        let mean = |around: &Around| 0.5 * (around.caustics[0] + around.caustics[1]);
        let lacks = |beta: f64| -> Vec<f64> {
            let tiles = around.iter().zip(self.picture);
            tiles.map(|(around, tile)| (beta * mean(around) - tile.rare).max(0.0)).collect()
        };
        let (mut light, possible) = (lacks(beta), lacks(most));
        let total = |light: &[f64]| light.iter().sum::<f64>();
        let caustics = total(&light);
        self.add_other_light(&mut light);
        let brightness = around
            .iter()
            .zip(self.picture)
            .zip(&light)
            .map(|((around, tile), lacks)| {
                (tile.light - tile.rare + beta * mean(around)).max(tile.light.min(*lacks))
            })
            .collect();
        // Photons of the two witnesses scatter independently.
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
            caustics: share(caustics),
            brightness,
            light,
            possible,
            ..UnfoundLight::default()
        }
    }

    /// Means around tile `i`, in the smallest square that has enough samples.
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
        // A few samples may be alike by chance.
        let least = (0.05 * shown).powi(2) + f64::MIN_POSITIVE;
        Around {
            caustics: halves.each_ref().map(WitnessedArea::mean_caustics),
            variance: means.map(|[_, variance]| halves[0].areas * variance + least),
        }
    }

    /// The share β of the caustics that the picture lacks. It is that of single tiles: a caustic may lie in few of them, where means of their
    /// surroundings would hide it.
    fn missing_caustics(&self, around: &[Around]) -> MissingShare {
        let mean = self.picture.iter().map(|tile| tile.light.abs()).sum::<f64>() / self.picture.len() as f64;
        let (mut above, mut below, mut noise) = (0.0, 0.0, 0.0);
        for (i, (around, tile)) in around.iter().zip(self.picture).enumerate() {
            let (from, to) = tiles_around(i, self.grid, 0);
            let halves = self.witnesses.each_ref().map(|areas| areas.sum(from, to));
            if halves.iter().any(|half| half.samples < 1.0) {
                continue;
            }
            let caustics = halves.each_ref().map(WitnessedArea::mean_caustics);
            let shown = tile.light - tile.rare;
            let (gap, variance) = (halves.map(|half| half.mean()[0] - shown), around.variance);
            // By luminance, and not by variances: those are small where a witness has met nothing.
            let weight = 1.0 / (shown.abs() + DARK * mean).powi(2).max(f64::MIN_POSITIVE);
            above += weight * (caustics[0] * gap[1] + caustics[1] * gap[0]);
            below += weight * 2.0 * caustics[0] * caustics[1];
            let of = |a: usize, b: usize| caustics[a].powi(2) * variance[b];
            noise += weight * weight * (of(0, 1) + of(1, 0));
        }
        if below <= 0.0 {
            return MissingShare::default();
        }
        let (beta, sigma) = (above / below, noise.sqrt() / below);
        let most = (beta.max(0.0) + sigma).min(1.0);
        let [none, all] = SIGNIFICANT_SHARE;
        let counts = ((beta / sigma - none) / (all - none)).clamp(0.0, 1.0);
        match counts > 0.0 {
            true => MissingShare { share: (beta * counts).min(1.0), deviation: sigma / beta, most },
            false => MissingShare { most, ..MissingShare::default() },
        }
    }

    /// Adds to `light` what the witnesses find on top of it in squares that become smaller.
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
                // A few samples may be alike by chance.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;
    use crate::stream::Highlight;

    const SIZE: [usize; 2] = [128, 96];
    const SAMPLES_PER_PIXEL: f64 = 16.0;

    fn tiles() -> usize {
        SIZE[0] * SIZE[1] / (TILE * TILE)
    }

    /// Caustics of luminance .5 lie in a disc in the middle.
    fn caustic(tile: usize) -> f64 {
        let columns = SIZE[0] / TILE;
        let [x, y] = [tile % columns, tile / columns].map(|n| n as f64);
        if (x - 7.5).hypot(y - 5.5) < 4.0 { 0.5 } else { 0.0 }
    }

    /// Witnesses with so many samples in a tile, of a picture of luminance 1 and caustics; the samples scatter by 50 %.
    fn witnesses(random: &mut Random, samples: usize) -> [Vec<WitnessedArea>; 2] {
        [0, 1].map(|_| {
            let tile = |tile: usize| {
                let mut area = WitnessedArea { areas: 1.0, samples: samples as f64, ..Default::default() };
                for _ in 0..samples {
                    let spread = |random: &mut Random| 1.0 + 1.7 * (f64::from(random.f32()) - 0.5);
                    let shown = caustic(tile) * spread(random);
                    let y = spread(random) + shown;
                    area.camera = [area.camera[0] + y, area.camera[1] + y * y];
                    area.caustics += shown;
                }
                area
            };
            (0..tiles()).map(tile).collect()
        })
    }

    /// The picture of luminance 1 and this share of the caustics in each tile, with noise of 10 % in every pixel.
    fn picture(random: &mut Random, found: impl Fn(usize) -> f64) -> Vec<ReplicatePixel> {
        let pixel = |i: usize| {
            let tile = i / SIZE[0] / TILE * (SIZE[0] / TILE) + i % SIZE[0] / TILE;
            let [a, b] = [0.0; 2].map(|_| 0.48 * (random.f32() - 0.5));
            let mean = 1.0 + (caustic(tile) * found(tile)) as f32 + 0.5 * (a + b);
            ReplicatePixel { mean: [mean; 3], difference: [a - b; 3], factor: 0.25, seen: true }
        };
        (0..SIZE[0] * SIZE[1]).map(pixel).collect()
    }

    fn unfound(
        seed: u64,
        samples: usize,
        found: impl Fn(usize) -> f64,
        largest: &LargestSamples,
    ) -> UnfoundLight {
        let mut random = Random(seed);
        let halves = witnesses(&mut random, samples);
        let pixels = picture(&mut random, found);
        let found = Witnessed { areas: halves, ..Witnessed::default() };
        let state = WitnessState { found, ..WitnessState::new(Box::new(|_, _| Default::default())) };
        super::unfound(Some(&state), &pixels, SIZE, largest, SAMPLES_PER_PIXEL, 1.0)
    }

    #[test]
    fn caustics_that_are_not_in_the_picture_are_unfound() {
        let nothing = LargestSamples::new(SIZE);
        let UnfoundLight { light, brightness, share, caustics, deviation, .. } =
            unfound(1, 8, |_| 0.0, &nothing);
        let count = (0..tiles()).filter(|tile| caustic(*tile) > 0.0).count() as f64;
        let mean =
            (0..tiles()).filter(|tile| caustic(*tile) > 0.0).map(|tile| light[tile]).sum::<f64>() / count;
        // Means of 3×3 tiles are smaller at the rim.
        assert!((mean - 0.5).abs() < 0.15, "{mean}");
        let share = share.expect("there are witnesses");
        let truth = 0.5 * count / (tiles() as f64 + 0.5 * count);
        assert!(
            (share / truth - 1.0).abs() < 0.25 && caustics > 0.8 * share,
            "{share}, {caustics} of {truth}"
        );
        assert!(brightness[5 * 16 + 7] > 1.3 && deviation > 0.0 && deviation < 0.5, "{deviation}");
        // Far from the caustic nothing is missing.
        assert!(light[0] < 0.05 && light[tiles() - 1] < 0.05);
    }

    #[test]
    fn caustics_that_few_paths_cannot_judge_may_be_missing() {
        let nothing = LargestSamples::new(SIZE);
        let here = |tile: &usize| caustic(*tile) > 0.0;
        let mean = |of: &[f64]| {
            let inside: Vec<f64> = (0..tiles()).filter(here).map(|tile| of[tile]).collect();
            inside.iter().sum::<f64>() / inside.len() as f64
        };
        // With one sample in a tile nobody knows whether the picture has them; with many it is known to have them.
        let few = unfound(7, 1, |_| 1.0, &nothing);
        let many = unfound(7, 64, |_| 1.0, &nothing);
        assert!(mean(&few.possible) > 2.0 * mean(&many.possible), "{few:?}, {many:?}");
        assert!(mean(&many.possible) < 0.1 && few.light.iter().all(|lacks| *lacks < 0.25));
        // Where they are missing for sure, that is what may be missing, or a little more.
        let missing = unfound(7, 64, |_| 0.0, &nothing);
        let ratio = mean(&missing.possible) / mean(&missing.light);
        assert!((1.0..1.2).contains(&ratio), "{ratio}");
    }

    #[test]
    fn tiles_that_have_met_a_rare_sample_lack_nothing() {
        let mut largest = LargestSamples::new(SIZE);
        // One sample brings all the caustic of its tile.
        let all = 0.5 * (TILE * TILE) as f64 * SAMPLES_PER_PIXEL;
        largest.add([7 * TILE, 5 * TILE], all as f32);
        let hit = 5 * 16 + 7;
        let UnfoundLight { light, .. } = unfound(2, 8, |tile| f64::from(u8::from(tile == hit)), &largest);
        assert!(light[hit] < 0.1 && light[hit + 1] > 0.3, "{}, {}", light[hit], light[hit + 1]);
    }

    #[test]
    fn a_complete_picture_lacks_nothing() {
        let nothing = LargestSamples::new(SIZE);
        for samples in [2, 8, 32] {
            let shares: Vec<f64> = (0..40)
                .map(|seed| unfound(100 + seed, samples, |_| 1.0, &nothing).share.unwrap_or(1.0))
                .collect();
            let alarms = shares.iter().filter(|share| **share > 0.01).count();
            assert!(alarms <= 1, "{samples} samples: {shares:?}");
        }
    }

    #[test]
    fn highlights_that_no_sample_has_met_are_unfound() {
        let nothing = LargestSamples::new(SIZE);
        let mut random = Random(6);
        let pixels = picture(&mut random, |_| 0.0);
        // As many samples as meet one of them once, twice, and a tenth of that.
        let (once, tile) = (1.0 / SAMPLES_PER_PIXEL, 40);
        let of = |area, chance| Highlight { area, light: 32.0, pixels: 0.01, chance };
        let highlights = [of(tile, once), of(tile + 1, 2.0 * once), of(tile + 2, 0.1 * once)];
        let found = Witnessed { highlights: highlights.to_vec().into(), ..Witnessed::default() };
        let state = WitnessState { found, ..WitnessState::new(Box::new(|_, _| Default::default())) };
        let lacks = |largest: &LargestSamples| {
            super::unfound(Some(&state), &pixels, SIZE, largest, SAMPLES_PER_PIXEL, 0.25)
        };
        let unfound = lacks(&nothing);
        let area = (TILE * TILE) as f64;
        for (i, met) in [1.0, 2.0, 0.1f64].into_iter().enumerate() {
            let LackedHighlights { light, square, relative } = unfound.highlights[tile + i];
            let part = (-met).exp();
            assert!((light - part * 32.0 / area).abs() < 1e-9, "{light}");
            // The filter spreads it over four pixels, 8 in each.
            assert!((square - part * 4.0 * 64.0 / area).abs() < 1e-9, "{square}");
            // The picture has about 1 there.
            assert!((relative - part * 4.0 * 64.0 / 81.0 / area).abs() < 0.1 * relative, "{relative}");
        }
        let share = unfound.share.expect("highlights are known");
        assert!(share > 0.0 && (unfound.in_highlights - share).abs() < 1e-12 && unfound.caustics == 0.0);
        // A tile that has met one lacks nothing.
        let mut largest = nothing;
        largest.add([tile % 16 * TILE, tile / 16 * TILE], (area * SAMPLES_PER_PIXEL) as f32);
        assert_eq!(lacks(&largest).highlights[tile], LackedHighlights::default());
        assert!(lacks(&largest).highlights[tile + 1].light > 0.0);
    }

    #[test]
    fn what_was_met_once_tells_what_was_not_met() {
        // Each of 100 tiles meets .7 rare samples on average.
        let (mut largest, mut random) = (LargestSamples::new(SIZE), Random(5));
        let all = (0.5 * (TILE * TILE) as f64 * SAMPLES_PER_PIXEL) as f32;
        let mut met = vec![0; tiles()];
        for _ in 0..70 {
            let tile = (random.f32() * 100.0) as usize;
            met[tile] += 1;
            largest.add([tile % 16 * TILE, tile / 16 * TILE], all);
        }
        let pixels = picture(&mut random, |_| 0.0);
        let pixel = |i: usize| i / SIZE[0] / TILE * 16 + i % SIZE[0] / TILE;
        let pixels: Vec<ReplicatePixel> = pixels
            .iter()
            .enumerate()
            .map(|(i, p)| ReplicatePixel { mean: p.mean.map(|y| y + 0.5 * met[pixel(i)] as f32), ..*p })
            .collect();
        let UnfoundLight { light, share, scattered, .. } =
            super::unfound(None, &pixels, SIZE, &largest, SAMPLES_PER_PIXEL, 1.0);
        let unmet = met[..100].iter().filter(|n| **n == 0).count() as f64;
        assert!(share.is_none() && light.iter().all(|y| *y == 0.0));
        let ratio = scattered.tiles.len() as f64 / unmet;
        assert!((0.5..1.6).contains(&ratio), "{} of {unmet}", scattered.tiles.len());
        // Where one of two tiles has met one sample of .5, those that have met none lack about .35.
        assert!((0.2..0.6).contains(&scattered.light), "{}", scattered.light);
        // It is spread over all pixels of a tile.
        assert!(scattered.rms < 1.3 * scattered.light, "{scattered:?}");
        assert!(scattered.tiles.iter().all(|tile| met[*tile] == 0));
    }
}
