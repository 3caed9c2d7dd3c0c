//! The passes of a level, row by row, compiled for AVX2 beside the instructions that every processor has: the same arithmetic, the same bits.

use rayon::prelude::*;

use super::rows::{
    BORDER, FEATURES, LANES, NEIGHBOURS, PixelBlock, PlanarRows, RESULT, RowTap, SUMS, WEIGHTS, each, load,
    store,
};

/// A level of the transform.
pub(super) struct Level<'a> {
    pub(super) weights: &'a PlanarRows,
    /// Width of the picture.
    pub(super) width: usize,
    /// Pixels between neighbours.
    pub(super) step: usize,
}

/// Compiles a function of a row for processors with AVX2 as well, and calls what fits the present one.
macro_rules! on_this_processor {
    ($name:ident => $body:ident($($argument:ident: $type:ty),*)) => {
        fn $name($($argument: $type),*) {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2")]
                fn avx2($($argument: $type),*) {
                    $body($($argument),*);
                }
                if is_x86_feature_detected!("avx2") {
                    // SAFETY: the processor has these instructions.
                    return unsafe { avx2($($argument),*) };
                }
            }
            $body($($argument),*);
        }
    };
}

on_this_processor!(weigh_row => weigh_pixels(grid: WeightGrid, features: Option<&PlanarRows>, y: usize, row: &mut [f32]));
on_this_processor!(smooth_row => smooth_pixels(level: &Level<'_>, sums: &PlanarRows, y: usize, out: SmoothedRow<'_>));
on_this_processor!(average_row => average_pixels(level: &Level<'_>, band: &PlanarRows, y: usize, out: &mut [f32]));
on_this_processor!(shrink_row => shrink_pixels(level: &Level<'_>, means: &PlanarRows, band: &[f32], y: usize, out: &mut [f32]));

/// Pixels whose weights to neighbours are computed.
#[derive(Clone, Copy)]
struct WeightGrid {
    size: [usize; 2],
    /// Pixels between neighbours.
    step: usize,
    stride: usize,
}

/// The weights between pixels `step` apart: (1 − d/4)⁴ of the squared difference of their features in units of the tolerances, 0 out of the
/// picture, and between pixels with different shares of lights.
pub(super) fn weigh(weights: &mut PlanarRows, features: Option<&PlanarRows>, size: [usize; 2], step: usize) {
    let grid = WeightGrid { size, step, stride: weights.stride };
    weights.inner().enumerate().for_each(|(y, row)| weigh_row(grid, features, y, row));
}

#[inline(always)]
fn weigh_pixels(grid: WeightGrid, features: Option<&PlanarRows>, y: usize, row: &mut [f32]) {
    let WeightGrid { size: [width, height], step, stride } = grid;
    for neighbour in &NEIGHBOURS[..WEIGHTS] {
        let below = y + neighbour.dy as usize * step;
        let (there_y, _) = neighbour.place(y + BORDER, BORDER, step);
        let rows = features.filter(|_| below < height);
        let rows = rows.map(|features| (features.row(y + BORDER), features.row(there_y)));
        for x in (0..width).step_by(LANES) {
            let inside = |i: usize| {
                let column = (x + i) as isize + neighbour.dx * step as isize;
                below < height && x + i < width && (0..width as isize).contains(&column)
            };
            let mut w = each(|i| if inside(i) { 1.0 } else { 0.0 });
            if let Some((here, there)) = rows {
                let (_, there_x) = neighbour.place(y + BORDER, x + BORDER, step);
                let p: [PixelBlock; FEATURES] = std::array::from_fn(|c| load(here, stride, c, x + BORDER));
                let q: [PixelBlock; FEATURES] = std::array::from_fn(|c| load(there, stride, c, there_x));
                w = each(|i| {
                    let square = |c: usize| (p[c][i] - q[c][i]) * (p[c][i] - q[c][i]);
                    let tolerance = |c: usize| p[c][i] + q[c][i];
                    let albedo = (square(0) + square(1) + square(2)) / tolerance(7);
                    let normal = (square(3) + square(4) + square(5)) / tolerance(8);
                    let d = albedo + normal + square(6) / tolerance(9);
                    let rest = (1.0 - 0.5 * d).max(0.0);
                    let square = rest * rest;
                    let alike = if p[10][i] == q[10][i] { w[i] } else { 0.0 };
                    alike * square * square
                });
            }
            store(row, stride, neighbour.weight, x + BORDER, w);
        }
    }
}

/// What a row of [`smooth`] writes.
struct SmoothedRow<'a> {
    coarser: &'a mut [f32],
    band: &'a mut [f32],
    result: &'a mut [f32],
}

/// One level: the smoothed sums, and the band between them and those before. Where a half has nothing the result is what is around.
pub(super) fn smooth(
    level: &Level<'_>,
    sums: &PlanarRows,
    coarser: &mut PlanarRows,
    band: &mut PlanarRows,
    result: &mut PlanarRows,
) {
    let rows = coarser.inner().zip(band.inner()).zip(result.inner()).enumerate();
    rows.for_each(|(y, ((coarser, band), result))| {
        smooth_row(level, sums, y + BORDER, SmoothedRow { coarser, band, result });
    });
}

#[inline(always)]
fn smooth_pixels(level: &Level<'_>, sums: &PlanarRows, y: usize, out: SmoothedRow<'_>) {
    let stride = sums.stride;
    let (here, neighbours) = (sums.row(y), RowTap::of_row(sums, level.weights, y, level.step));
    let SmoothedRow { coarser, band, result } = out;
    for x in (BORDER..BORDER + level.width).step_by(LANES) {
        let here: [PixelBlock; SUMS] = std::array::from_fn(|c| load(here, stride, c, x));
        let mut total: [PixelBlock; SUMS] = std::array::from_fn(|c| each(|i| 4.0 * here[c][i]));
        let mut weight: PixelBlock = [4.0; LANES];
        for neighbour in &neighbours {
            let w = neighbour.weight(x);
            let w = each(|i| neighbour.tap * w[i]);
            for (c, total) in total.iter_mut().enumerate() {
                let value = neighbour.value(stride, c, x);
                *total = each(|i| total[i] + w[i] * value[i]);
            }
            weight = each(|i| weight[i] + w[i]);
        }
        let inverse = each(|i| 1.0 / weight[i]);
        for (c, total) in total.iter_mut().enumerate() {
            *total = each(|i| total[i] * inverse[i]);
            store(coarser, stride, c, x, *total);
        }
        let (here_a, here_b) = (each(|i| 1.0 / here[3][i]), each(|i| 1.0 / here[7][i]));
        let (near_a, near_b) = (each(|i| 1.0 / total[3][i]), each(|i| 1.0 / total[7][i]));
        let (known_a, known_b) = (each(|i| is_above(here[3][i], 0.0)), each(|i| is_above(here[7][i], 0.0)));
        let known = each(|i| known_a[i] * known_b[i]);
        let mut luminance = [[0.0; LANES]; 2];
        for c in 0..3 {
            let before = load(result, stride, c, x);
            let (own_a, own_b) = (each(|i| total[c][i] * near_a[i]), each(|i| total[4 + c][i] * near_b[i]));
            let a = each(|i| if total[3][i] > 0.0 { own_a[i] } else { own_b[i] });
            let b = each(|i| if total[7][i] > 0.0 { own_b[i] } else { own_a[i] });
            let da = each(|i| if known[i] > 0.0 { here[c][i] * here_a[i] - a[i] } else { 0.0 });
            let db = each(|i| if known[i] > 0.0 { here[4 + c][i] * here_b[i] - b[i] } else { 0.0 });
            let around = each(|i| total[3][i] + total[7][i]);
            let after =
                each(|i| if known[i] > 0.0 || around[i] <= 0.0 { before[i] } else { 0.5 * (a[i] + b[i]) });
            if c == 1 {
                luminance = [da, db];
            }
            store(band, stride, c, x, each(|i| 0.5 * (da[i] + db[i])));
            store(result, stride, c, x, after);
        }
        let [da, db] = luminance;
        store(band, stride, 3, x, each(|i| da[i] * db[i]));
        store(band, stride, 4, x, each(|i| 0.25 * (da[i] - db[i]) * (da[i] - db[i])));
    }
}

/// 1 where `x` is above `limit`, and otherwise 0.
#[inline(always)]
fn is_above(x: f32, limit: f32) -> f32 {
    if x > limit { 1.0 } else { 0.0 }
}

/// Weighted means of two channels of row `here` over the neighbours, all of them alike.
#[inline(always)]
fn mean_of_two(
    here: &[f32],
    neighbours: &[RowTap<'_>; 8],
    stride: usize,
    first: usize,
    x: usize,
) -> [PixelBlock; 2] {
    let mut total: [PixelBlock; 2] = std::array::from_fn(|c| load(here, stride, first + c, x));
    let mut weight: PixelBlock = [1.0; LANES];
    for neighbour in neighbours {
        let w = neighbour.weight(x);
        for (c, total) in total.iter_mut().enumerate() {
            let value = neighbour.value(stride, first + c, x);
            *total = each(|i| total[i] + w[i] * value[i]);
        }
        weight = each(|i| weight[i] + w[i]);
    }
    std::array::from_fn(|c| each(|i| total[c][i] / weight[i]))
}

/// Means of signal and noise of the band over 3×3 pixels.
pub(super) fn average(level: &Level<'_>, band: &PlanarRows, means: &mut PlanarRows) {
    means.inner().enumerate().for_each(|(y, out)| average_row(level, band, y + BORDER, out));
}

#[inline(always)]
fn average_pixels(level: &Level<'_>, band: &PlanarRows, y: usize, out: &mut [f32]) {
    let stride = band.stride;
    let (here, neighbours) = (band.row(y), RowTap::of_row(band, level.weights, y, level.step));
    for x in (BORDER..BORDER + level.width).step_by(LANES) {
        let [signal, noise] = mean_of_two(here, &neighbours, stride, 3, x);
        store(out, stride, 0, x, signal);
        store(out, stride, 1, x, noise);
    }
}

/// The same once more, the gain that follows, and what it takes from the result.
pub(super) fn shrink(level: &Level<'_>, means: &PlanarRows, band: &PlanarRows, result: &mut PlanarRows) {
    let rows = result.inner().enumerate();
    rows.for_each(|(y, out)| shrink_row(level, means, band.row(y + BORDER), y + BORDER, out));
}

#[inline(always)]
fn shrink_pixels(level: &Level<'_>, means: &PlanarRows, band: &[f32], y: usize, out: &mut [f32]) {
    let stride = means.stride;
    let (here, neighbours) = (means.row(y), RowTap::of_row(means, level.weights, y, level.step));
    for x in (BORDER..BORDER + level.width).step_by(LANES) {
        let [signal, noise] = mean_of_two(here, &neighbours, stride, 0, x);
        let gain = each(|i| (signal[i] - noise[i]).max(0.0) / (signal[i] + noise[i] + f32::MIN_POSITIVE));
        for c in 0..3 {
            let (before, mean) = (load(out, stride, c, x), load(band, stride, c, x));
            store(out, stride, c, x, each(|i| before[i] - (1.0 - gain[i]) * mean[i]));
        }
        store(out, stride, RESULT - 1, x, gain);
    }
}
