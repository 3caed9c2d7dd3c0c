//! The stated error of pictures in which few samples bring much of the light.

use pointillist::color::Xyz;
use pointillist::math::bits::mix;
use pointillist::stream::{CHUNK, PathCounts, Sample};
use pointillist::study::{ErrorField, ErrorMonitor, Replicates, TileSubset};

use crate::Row;

const SIDE: usize = 256;

/// Adds a grey picture of 8 samples per pixel, 512 per tile, each 1 or, of one in `rare`, 1000.
fn trace(seed: u64, rare: f32, mut add: impl FnMut(u64, PathCounts, &[Sample])) {
    for chunk in 0..(8 * SIDE * SIDE) as u64 / CHUNK {
        let sample = |i: u64| {
            let index = (chunk * CHUNK + i) ^ seed << 40;
            let uniform = |k: u64| (mix(3 * index + k) >> 40) as f32 / (1 << 24) as f32;
            let y = if uniform(2) < 1.0 / rare { 1000.0 } else { 1.0 };
            Sample { uv: [uniform(0), uniform(1)], xyz: Xyz::new(0.9505 * y, y, 1.089 * y), w: 1.0 }
        };
        let samples: Vec<Sample> = (0..CHUNK).map(sample).collect();
        add(chunk * CHUNK, PathCounts { camera: CHUNK, light: 0 }, &samples);
    }
}

/// Of a picture with one rare sample in each tile on average: the error that 95 % of the picture stay below, true, as stated, and as stated
/// relative to the luminance that each tile shows.
fn errors(seed: u64) -> [f64; 3] {
    let mut sums = Replicates::new([SIDE as u32; 2], 1.0);
    trace(seed, 512.0, |first, paths, samples| sums.add(first, paths, samples));
    let pixels = sums.pixels().unwrap();
    let picture: Vec<[f32; 3]> = pixels.iter().map(|pixel| pixel.mean).collect();
    let truth =
        ErrorField::against(&picture, &vec![[1.0 + 999.0 / 512.0; 3]; SIDE * SIDE], [SIDE; 2]).unwrap();
    let (stated, _) = sums.error(&pixels).unwrap();
    let as_shown = ErrorField::new(&pixels, [SIDE; 2]).unwrap();
    [truth, stated, as_shown].map(|field| field.estimate(TileSubset::All).relative[1].value)
}

/// A tile that a rare sample has hit is brighter than it is, by that very sample: relative to what it shows its error seems
/// small.
#[test]
fn stated_error_of_rare_light() {
    let [truth, stated, as_shown] =
        (0..8).map(errors).fold([0.0; 3], |sum, e| [0, 1, 2].map(|i| sum[i] + e[i].ln() / 8.0));
    Row {
        case: "stated error where one sample in 512 brings two thirds of the light",
        measure: "logarithm of true over stated error of 95 %",
        figure: (truth - stated).abs(),
        naive: ("relative to each tile as it is shown", (truth - as_shown).abs()),
        bound: 0.2,
    }
    .check();
}

/// Where one tile in five has met a rare sample, the others lack the light of a quarter of one, and no two of their own samples
/// differ.
#[test]
fn stated_error_of_light_that_most_tiles_have_not_met() {
    let errors = |seed: u64| {
        let mut monitor = ErrorMonitor::new([SIDE as u32; 2], 1.0, None);
        trace(seed, 2048.0, |first, paths, samples| monitor.add(first, paths, samples));
        monitor.take_checkpoint(1.0);
        let stated = monitor.status().estimate;
        let pixels = monitor.replicates().pixels().unwrap();
        let picture: Vec<[f32; 3]> = pixels.iter().map(|pixel| pixel.mean).collect();
        let truth = vec![[1.0 + 999.0 / 2048.0; 3]; SIDE * SIDE];
        let truth = ErrorField::against(&picture, &truth, [SIDE; 2]).unwrap().estimate(TileSubset::All);
        let (replicates, _) = monitor.replicates().error(&pixels).unwrap();
        [truth, stated, replicates.estimate(TileSubset::All)].map(|e| e.relative[0].value.max(1e-6).ln())
    };
    let [truth, stated, replicates] =
        (0..8).map(errors).fold([0.0; 3], |sum, e| [0, 1, 2].map(|i| sum[i] + e[i] / 8.0));
    Row {
        case: "stated error where one sample in 2048 brings a third of the light, and 4 of 5 tiles have met none",
        measure: "logarithm of true over stated median error",
        figure: (truth - stated).abs(),
        naive: ("what the replicates alone tell", (truth - replicates).abs()),
        bound: 0.4,
    }
    .check();
}
