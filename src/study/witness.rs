//! Light that a render has not found, estimated from witness paths and from its own rare samples.
//!
//! The replicates of a render show the scatter of its samples, but nothing of light that no sample has found. If rare samples carry much of
//! the light, such as caustics seen through glass in bidirectional path tracing, nearly every tile of the picture lacks that light and
//! states a small error. [`Witnesses`] are a few paths of other methods. They find all light with high noise and, from photons, caustics
//! with less noise. Light that they find and the picture lacks is *unfound*, and included in the stated error:
//!
//! - **Single hits.** If single samples carry much of the light of some tiles, other tiles have received none of theirs. In expectation, as
//!   much light as was found by exactly one sample of a tile has not been found by any (Good 1953, *The population frequencies of species
//!   and the estimation of population parameters*), and the numbers of tiles with one and with two such samples estimate the number of
//!   tiles that lack theirs (Chao 1984). Which tiles these are is unknown.
//! - **Caustics.** Let T be all light found by the witnesses, C the light of caustics, and P that of the picture without single samples
//!   that carry much of a tile's light. The fraction β of the caustics missing from the picture is found by regression of T − P on C over
//!   the tiles of the picture; T and C come from different halves of the witnesses, so that their noise is not correlated. β counts fully
//!   from three standard errors on, in part from two on. A tile then lacks β C minus the light of its few large samples. The upper end of
//!   the interval includes the largest possible β. The missing light counts in the fraction of the pixels where it falls, and in relMSE by
//!   its colours; where it falls is known up to the noise of photons.
//! - **Highlights** ([`highlights`](crate::study::highlights)): small lamps in mirrors and glass.
//! - **All other light.** If T exceeds the picture by more than four standard errors, in squares from a sixteenth of the picture down to
//!   2×2 tiles, the difference is unfound.
//!
//! In a pixel that lacks a light of mean luminance u the error is u, so that u² is added to the mean square error estimated from the
//! replicates: [`unfound`](crate::study::unfound) computes it.

use std::fmt;

use crate::stream::Witnessed;
use crate::study::error_tile::{ReplicatePixel, TILE};
use crate::study::highlights::lacked_highlights;
use crate::study::largest::LargestSamples;
use crate::study::picture_tile::PictureTile;
use crate::study::summed_areas::SummedAreas;
use crate::study::unfound::UnfoundLight;
use crate::study::witness_comparison::WitnessComparison;

/// Traces at least this many paths in total over a picture of this size in pixels; returns what two independent witnesses have found in
/// each of its tiles of 8×8 pixels since the render began.
pub type Witnesses = Box<dyn FnMut(u64, [u32; 2]) -> Witnessed + Send>;

/// Paths of the render per witness path, which costs about twice as much.
const PATHS_PER_WITNESS: f64 = 128.0;

/// Numbers of witness paths: least, number up to which they get twice their fraction, and most. They are traced by the observer's thread,
/// which must not be blocked for long.
const WITNESS_PATHS: [f64; 3] = [256.0, 2048.0, 131_072.0];

/// Growth of the render between two updates of the witnesses.
const GROWTH: f64 = 1.5;

/// [`Witnesses`] and their results.
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

    /// Takes the witnesses, for another picture of the same render.
    pub(super) fn into_witnesses(self) -> Witnesses {
        self.witnesses
    }

    /// Continues the witnesses if the `paths` of the render of a picture of `size` pixels have grown. They are `thorough`, with enough
    /// paths from the beginning, if the render will stop by their results.
    pub(super) fn update(&mut self, paths: f64, size: [usize; 2], thorough: bool) {
        // The number of witness paths depends only on the render's paths, so that a resumed render states the same error.
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

/// Light missing from a picture with `per_pixel` samples per pixel, on a film whose filter has this energy.
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
    unfound.add_scattered(&picture);
    unfound
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;
    use crate::stream::{Highlight, WitnessedArea};
    use crate::study::highlights::LackedHighlights;
    use crate::study::unfound::CausticSpots;
    use crate::study::{ErrorField, TileSubset};

    const SIZE: [usize; 2] = [128, 96];
    const SAMPLES_PER_PIXEL: f64 = 16.0;

    fn tiles() -> usize {
        SIZE[0] * SIZE[1] / (TILE * TILE)
    }

    /// Caustics of luminance .5 within a disc in the middle.
    fn caustic(tile: usize) -> f64 {
        let columns = SIZE[0] / TILE;
        let [x, y] = [tile % columns, tile / columns].map(|n| n as f64);
        if (x - 7.5).hypot(y - 5.5) < 4.0 { 0.5 } else { 0.0 }
    }

    /// Witnesses with this many samples per tile, for a picture of luminance 1 and caustics; the samples scatter by 50 %.
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
                    area.caustic_squares = area.caustic_squares.map(|square| square + shown * shown);
                    area.caustic_pairs += shown * shown;
                }
                area
            };
            (0..tiles()).map(tile).collect()
        })
    }

    /// A picture of luminance 1 and this fraction of the caustics in each tile, with noise of 10 % in every pixel.
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
        // With one sample per tile it is uncertain whether the picture has the caustics; with many it is certain.
        let few = unfound(7, 1, |_| 1.0, &nothing);
        let many = unfound(7, 64, |_| 1.0, &nothing);
        assert!(mean(&few.possible) > 2.0 * mean(&many.possible), "{few:?}, {many:?}");
        assert!(mean(&many.possible) < 0.1 && few.light.iter().all(|lacks| *lacks < 0.25));
        // If they are certainly missing, the possible missing light is the same, or slightly more.
        let missing = unfound(7, 64, |_| 0.0, &nothing);
        let ratio = mean(&missing.possible) / mean(&missing.light);
        assert!((1.0..1.2).contains(&ratio), "{ratio}");
    }

    #[test]
    fn missing_caustics_count_where_they_lie_and_by_their_colours() {
        // One sample in four shows four times the luminance, in a saturated colour.
        let mut area = WitnessedArea { areas: 1.0, samples: 400.0, ..Default::default() };
        for _ in 0..100 {
            area.caustics += 2.0;
            area.caustic_squares = [area.caustic_squares[0] + 4.0, area.caustic_squares[1] + 12.0];
            // From many photons each time.
            area.caustic_pairs += 4.0;
        }
        let spots = CausticSpots::of(&area, 1e-9);
        assert_eq!((spots.part, spots.least_part, spots.colors), (0.25, 0.25, 3.0));
        // From two photons each time, half of the pixels is possible as well.
        let noisy = CausticSpots::of(&WitnessedArea { caustic_pairs: 200.0, ..area }, 1e-9);
        assert_eq!((noisy.part, noisy.least_part), (0.5, 0.25));
        // Rounding errors of an empty area are ignored.
        let squares = [1e-13, -1e-13];
        let residue =
            WitnessedArea { caustics: 1e-14, caustic_squares: squares, caustic_pairs: 1e-13, ..area };
        assert_eq!(CausticSpots::of(&residue, 1e-9), CausticSpots::default());
        let same = ReplicatePixel { mean: [1.0; 3], difference: [0.0; 3], factor: 0.25, seen: true };
        let stated = |spots: CausticSpots, caustics: f64| {
            let mut field = ErrorField::new(&vec![same; SIZE[0] * SIZE[1]], SIZE).expect("all are seen");
            let of_all = |value: f64| vec![value; tiles()];
            field.add_unfound(UnfoundLight {
                light: of_all(0.5),
                caustic_light: of_all(caustics),
                brightness: of_all(1.5),
                spots: vec![spots; tiles()],
                ..UnfoundLight::default()
            });
            let estimate = field.estimate(TileSubset::All);
            [estimate.rel_mse.value, estimate.relative[0].value]
        };
        // A quarter of the pixels lacks 2 of 3; or all lack .5 of 1.5. The remainder is light other than caustics.
        let [in_spots, even] = [spots, CausticSpots::default()].map(|spots| stated(spots, 0.5));
        assert_eq!(stated(spots, 0.0), even);
        assert!((in_spots[0] - 0.25 * 3.0 * 4.0 / 9.01).abs() < 1e-6, "{in_spots:?}");
        assert!((even[0] - 0.25 / 2.26).abs() < 1e-6, "{even:?}");
        // Ratio of root mean squares over the tile; the means are equal.
        assert!((in_spots[1] / even[1] - 2.0).abs() < 1e-6, "{in_spots:?}, {even:?}");
    }

    /// The relative error of caustics is largest where they are as bright as other light, not at the smallest fraction of the pixels.
    #[test]
    fn the_interval_of_relmse_has_the_worst_part_of_the_pixels() {
        let same = ReplicatePixel { mean: [1.0; 3], difference: [0.0; 3], factor: 0.25, seen: true };
        let of_all = |value: f64| vec![value; tiles()];
        let stated = |part: f64, least_part: f64| {
            let mut field = ErrorField::new(&vec![same; SIZE[0] * SIZE[1]], SIZE).expect("all are seen");
            field.add_unfound(UnfoundLight {
                light: of_all(0.5),
                caustic_light: of_all(0.5),
                brightness: of_all(1.5),
                spots: vec![CausticSpots { part, least_part, colors: 1.0 }; tiles()],
                // A tiny deviation marks the interval as uncertain.
                deviation: 1e-6,
                ..UnfoundLight::default()
            });
            field.estimate(TileSubset::All).rel_mse
        };
        let certain = stated(0.25, 0.25);
        let (narrow, wide) = (stated(0.25, 0.05), stated(0.8, 0.05));
        assert!(narrow.high >= certain.high && narrow.low < certain.value, "{narrow:?}, {certain:?}");
        // Half of the pixels would lack as much as they show.
        assert!(wide.high > 0.5 / 4.02 && wide.value < 0.12, "{wide:?}");
    }

    #[test]
    fn tiles_that_have_met_a_rare_sample_lack_nothing() {
        let mut largest = LargestSamples::new(SIZE);
        // A single sample carries all the caustic light of its tile.
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
        // Samples that hit one of them once and twice on average, and a tenth of that.
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
        // A tile that has been hit lacks nothing.
        let mut largest = nothing;
        largest.add([tile % 16 * TILE, tile / 16 * TILE], (area * SAMPLES_PER_PIXEL) as f32);
        assert_eq!(lacks(&largest).highlights[tile], LackedHighlights::default());
        assert!(lacks(&largest).highlights[tile + 1].light > 0.0);
    }

    #[test]
    fn what_was_met_once_tells_what_was_not_met() {
        // Each of 100 tiles receives .7 rare samples on average.
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
        // If every other tile has received one sample of .5, those without lack about .35.
        assert!((0.2..0.6).contains(&scattered.light), "{}", scattered.light);
        // It is spread over all pixels of a tile.
        assert!(scattered.rms < 1.3 * scattered.light, "{scattered:?}");
        assert!(scattered.tiles.iter().all(|tile| met[*tile] == 0));
    }
}
