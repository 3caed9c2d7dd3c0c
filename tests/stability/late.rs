//! The stated error of pictures in which few samples bring much of the light.

use pointillist::color::Xyz;
use pointillist::math::bits::mix;
use pointillist::stream::{CHUNK, PathCounts, Sample};
use pointillist::study::error_tile::ReplicatePixel;
use pointillist::study::{AccumulatedSamples, ErrorField, ErrorMonitor, Replicates, TileSubset};

use crate::Row;

const SIDE: usize = 256;

/// Adds a grey picture of 8 samples per pixel, 512 per tile, each 1 or, of one in `rare`, 1000.
fn trace(seed: u64, rare: f32, add: impl FnMut(u64, PathCounts, &[Sample])) {
    trace_with(seed, |_, chance| if chance < 1.0 / rare { 1000.0 } else { 1.0 }, add);
}

/// The same of samples as `luminance` makes them of their place and of a number in [0, 1).
fn trace_with(
    seed: u64,
    luminance: impl Fn([f32; 2], f32) -> f32,
    mut add: impl FnMut(u64, PathCounts, &[Sample]),
) {
    for chunk in 0..(8 * SIDE * SIDE) as u64 / CHUNK {
        let sample = |i: u64| {
            let index = (chunk * CHUNK + i) ^ seed << 40;
            let uniform = |k: u64| (mix(3 * index + k) >> 40) as f32 / (1 << 24) as f32;
            let uv = [uniform(0), uniform(1)];
            let y = luminance(uv, uniform(2));
            Sample { uv, xyz: Xyz::new(0.9505 * y, y, 1.089 * y), w: 1.0 }
        };
        let samples: Vec<Sample> = (0..CHUNK).map(sample).collect();
        add(chunk * CHUNK, PathCounts { camera: CHUNK, light: 0 }, &samples);
    }
}

/// The error that 95 % of a picture stay below and its relMSE, logarithms: true, as stated, and as stated relative to the luminance that it
/// shows.
fn logs(seed: u64, luminance: impl Fn([f32; 2], f32) -> f32, truth: impl Fn(usize) -> f32) -> [[f64; 2]; 3] {
    let mut sums = Replicates::new([SIDE as u32; 2], 1.0);
    trace_with(seed, luminance, |first, paths, samples| sums.add(first, paths, samples));
    let pixels = sums.pixels().unwrap();
    let picture: Vec<[f32; 3]> = pixels.iter().map(|pixel| pixel.mean).collect();
    let truth: Vec<[f32; 3]> = (0..SIDE * SIDE).map(|i| [truth(i); 3]).collect();
    let truth = ErrorField::against(&picture, &truth, [SIDE; 2]).unwrap();
    let (stated, _) = sums.error(&pixels).unwrap();
    let as_shown = ErrorField::new(&pixels, [SIDE; 2]).unwrap();
    [truth, stated, as_shown].map(|field| {
        let estimate = field.estimate(TileSubset::All);
        [estimate.relative[1].value, estimate.rel_mse.value].map(f64::ln)
    })
}

/// The means of eight pictures.
fn mean_logs(luminance: impl Fn([f32; 2], f32) -> f32, truth: impl Fn(usize) -> f32) -> [[f64; 2]; 3] {
    let all = (0..8).map(|seed| logs(seed, &luminance, &truth));
    all.fold([[0.0; 2]; 3], |sum, e| [0, 1, 2].map(|i| [0, 1].map(|k| sum[i][k] + e[i][k] / 8.0)))
}

/// A tile that a rare sample has hit is brighter than it is, by that very sample: relative to what it shows its error seems
/// small.
#[test]
fn stated_error_of_rare_light() {
    let rare = |_: [f32; 2], chance: f32| if chance < 1.0 / 512.0 { 1000.0 } else { 1.0 };
    let [truth, stated, as_shown] = mean_logs(rare, |_| 1.0 + 999.0 / 512.0);
    // relMSE rests on the pixels with the largest samples, a few of which both replicates seem to have met.
    let measures =
        [("logarithm of true over stated error of 95 %", 0.2), ("logarithm of true over stated relMSE", 0.5)];
    for (i, (measure, bound)) in measures.into_iter().enumerate() {
        Row {
            case: "stated error where one sample in 512 brings two thirds of the light",
            measure,
            figure: (truth[i] - stated[i]).abs(),
            naive: ("relative to each tile as it is shown", (truth[i] - as_shown[i]).abs()),
            bound,
        }
        .check();
    }
}

/// Half of the samples of some pixels are bright, as on the edge of a lamp: these pixels are as bright as they are shown, and not as dark as their
/// surroundings.
#[test]
fn stated_error_of_small_lamps() {
    let is_lamp = |x: usize, y: usize| x % 8 == 3 && y % 8 == 3;
    let lamps = |uv: [f32; 2], chance: f32| {
        let [x, y] = uv.map(|at| (at * SIDE as f32) as usize);
        if is_lamp(x, y) && chance < 0.5 { 1000.0 } else { 1.0 }
    };
    let [truth, stated, _] = mean_logs(lamps, |i| if is_lamp(i % SIDE, i / SIDE) { 500.5 } else { 1.0 });
    let mut sums = Replicates::new([SIDE as u32; 2], 1.0);
    trace_with(0, lamps, |first, paths, samples| sums.add(first, paths, samples));
    let pixels = sums.pixels().unwrap();
    let near = |i: usize| {
        let (x, y) = (i % SIDE / 4 * 4, i / SIDE / 4 * 4);
        let block = (0..16).map(|k| f64::from(pixels[(y + k / 4) * SIDE + x + k % 4].mean[1]));
        block.sum::<f64>() / 16.0
    };
    let relative = |(i, pixel): (usize, &ReplicatePixel)| {
        f64::from(pixel.difference[1]).powi(2) * f64::from(pixel.factor) / (near(i).powi(2) + 0.01)
    };
    let surroundings = pixels.iter().enumerate().map(relative).sum::<f64>() / (SIDE * SIDE) as f64;
    Row {
        case: "stated error of pixels on the edge of a lamp",
        measure: "logarithm of true over stated relMSE",
        figure: (truth[1] - stated[1]).abs(),
        naive: ("relative to their surroundings", (truth[1] - surroundings.ln()).abs()),
        bound: 0.7,
    }
    .check();
}

/// Where one tile in five has met a rare sample, the others lack the light of a quarter of one, and no two of their own samples
/// differ.
#[test]
fn stated_error_of_light_that_most_tiles_have_not_met() {
    let errors = |seed: u64| {
        let mut accumulated = AccumulatedSamples::new([SIDE as u32; 2], 1.0);
        trace(seed, 2048.0, |first, paths, samples| accumulated.add(first, paths, samples));
        let mut monitor = ErrorMonitor::new([SIDE as u32; 2], None);
        monitor.take_checkpoint(&accumulated, 1.0);
        let stated = monitor.status().estimate;
        let pixels = accumulated.replicates().pixels().unwrap();
        let picture: Vec<[f32; 3]> = pixels.iter().map(|pixel| pixel.mean).collect();
        let truth = vec![[1.0 + 999.0 / 2048.0; 3]; SIDE * SIDE];
        let truth = ErrorField::against(&picture, &truth, [SIDE; 2]).unwrap().estimate(TileSubset::All);
        let (replicates, _) = accumulated.replicates().error(&pixels).unwrap();
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
