//! The passes of a level, row by row, compiled for AVX2 as well as for the baseline: same arithmetic, same bits.

use rayon::prelude::*;

use super::rows::{
    AlignedFloats, BAND, BORDER, COUNT, FEATURES, HALVES, INVERSES, LIGHTS, MEANS, NEIGHBOURS, PlanarRows,
    RESULT, RowNeighbours, SHRUNK, SIGNAL, SUMS, TOLERANCES, WEIGHTS, channel, channels_mut,
};

/// A level of the transform.
pub(super) struct Level<'a> {
    pub(super) weights: &'a PlanarRows,
    /// Width and height of the picture, pixels.
    pub(super) size: [usize; 2],
    /// Pixels between neighbouring taps.
    pub(super) step: usize,
}

/// Compiles a row function for AVX2 as well and dispatches to the version that the CPU supports.
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

on_this_processor!(weigh_row => weigh_pixels(features: &PlanarRows, width: usize, step: usize, y: usize, row: &mut [f32]));
on_this_processor!(transform_strip => transform_rows(level: &Level<'_>, sums: &PlanarRows, strip: Strip<'_>, ring: &mut RowRing));

/// Weights between pixels `step` apart: (1 − d/4)⁴ of the squared feature difference d in units of the tolerances; 0 outside the picture,
/// and between pixels with different shares of lights.
pub(super) fn weigh(weights: &mut PlanarRows, features: &PlanarRows, width: usize, step: usize) {
    let rows = weights.inner_parallel().enumerate();
    rows.for_each(|(y, row)| weigh_row(features, width, step, y + BORDER, row));
}

#[inline(always)]
fn weigh_pixels(features: &PlanarRows, width: usize, step: usize, y: usize, row: &mut [f32]) {
    let weights: [&mut [f32]; WEIGHTS] = channels_mut(row);
    let taps = NEIGHBOURS.iter().filter(|neighbour| !neighbour.theirs);
    for (weights, neighbour) in weights.into_iter().zip(taps) {
        let p = feature_rows(features, y, 0, width);
        let q = feature_rows(features, y + neighbour.dy as usize * step, neighbour.dx * step as isize, width);
        for (x, weight) in weights[..width].iter_mut().enumerate() {
            let square = |c: usize| (p[c][x] - q[c][x]) * (p[c][x] - q[c][x]);
            let tolerance = |i: usize| p[TOLERANCES.start + i][x] + q[TOLERANCES.start + i][x];
            let albedo = (square(0) + square(1) + square(2)) / tolerance(0);
            let normal = (square(3) + square(4) + square(5)) / tolerance(1);
            let d = albedo + normal + square(6) / tolerance(2);
            let rest = (1.0 - 0.5 * d).max(0.0);
            *weight = if p[LIGHTS][x] == q[LIGHTS][x] { rest * rest * (rest * rest) } else { 0.0 };
        }
    }
}

/// Features of a row, shifted by `dx` pixels.
#[inline(always)]
fn feature_rows(features: &PlanarRows, y: usize, dx: isize, width: usize) -> [&[f32]; FEATURES] {
    let mut rows: [&[f32]; FEATURES] = [&[]; FEATURES];
    for (c, row) in rows.iter_mut().enumerate() {
        *row = &channel(features.row(y), features.stride, c, dx)[..width];
    }
    rows
}

/// Output of a row of the picture.
pub(super) enum RowOutput<'a> {
    /// Smoothed sums, and the result, from which the band's noise is subtracted.
    Smoothed { coarser: &'a mut [f32], result: &'a mut [f32] },
    /// Only the gain of the band, without a border.
    Gain(&'a mut [f32]),
}

/// Rows of the picture that are one step apart. Rows with another remainder modulo the step are never read for them.
struct Strip<'a> {
    /// Index of the first row in the picture.
    first: usize,
    rows: Vec<RowOutput<'a>>,
}

/// Ring buffers with the last three rows of a strip after each pass of a level, so that the next pass finds them in the core's cache.
struct RowRing {
    band: [AlignedFloats; 3],
    means: [AlignedFloats; 3],
    inverses: AlignedFloats,
    /// Means over the means, and the resulting gain.
    shrunk: AlignedFloats,
    /// Scratch for rows around the strip, whose results belong to other strips.
    coarser: AlignedFloats,
    result: AlignedFloats,
}

impl RowRing {
    /// `None` if memory runs out.
    fn new(stride: usize) -> Option<Self> {
        let row = |channels| AlignedFloats::new(channels * stride);
        Some(Self {
            band: [row(BAND)?, row(BAND)?, row(BAND)?],
            means: [row(MEANS)?, row(MEANS)?, row(MEANS)?],
            inverses: row(INVERSES)?,
            shrunk: row(SHRUNK)?,
            coarser: row(SUMS)?,
            result: row(RESULT)?,
        })
    }
}

/// Least number of rows of a strip, since each strip also smooths two extra rows on either side and averages one.
const STRIP_ROWS: usize = 16;

/// One level of the transform. `outputs`: rows of the picture from top to bottom. `None` if memory runs out.
pub(super) fn transform<'a>(
    level: &Level<'_>,
    sums: &PlanarRows,
    outputs: impl Iterator<Item = RowOutput<'a>>,
) -> Option<()> {
    let rows = level.size[1].div_ceil(level.step);
    let most = (4 * rayon::current_num_threads()).div_ceil(level.step);
    let length = rows.div_ceil((rows / STRIP_ROWS).clamp(1, most));
    let strips_below = rows.div_ceil(length);
    let strip =
        |i: usize| Strip { first: i / strips_below + i % strips_below * length * level.step, rows: vec![] };
    let mut strips: Vec<Strip<'_>> = (0..level.step * strips_below).map(strip).collect();
    for (y, output) in outputs.enumerate() {
        strips[y % level.step * strips_below + y / level.step / length].rows.push(output);
    }
    let strips = strips.into_par_iter().filter(|strip| !strip.rows.is_empty());
    strips.try_for_each_init(
        || RowRing::new(sums.stride),
        |ring, strip| {
            transform_strip(level, sums, strip, ring.as_mut()?);
            Some(())
        },
    )
}

#[inline(always)]
fn transform_rows(level: &Level<'_>, sums: &PlanarRows, strip: Strip<'_>, ring: &mut RowRing) {
    let Strip { first, mut rows } = strip;
    let RowRing { band, means, inverses, shrunk, coarser: coarser_around, result: result_around } = ring;
    let count = rows.len() as isize;
    let slot = |row: isize| row.rem_euclid(3) as usize;
    // Index of a row including the border; `None` outside the picture.
    let place = |row: isize| {
        let y = first as isize + row * level.step as isize;
        (0..level.size[1] as isize).contains(&y).then(|| y as usize + BORDER)
    };
    // Three consecutive rows of the strip, centred on `row`.
    macro_rules! around {
        ($ring:ident, $row:expr) => {
            [-1, 0, 1].map(|by| &*$ring[slot($row + by)])
        };
    }
    for last in -2..count + 2 {
        let (band_row, output) = (&mut band[slot(last)], usize::try_from(last).ok());
        match place(last) {
            Some(y) => {
                let (coarser, result) = match output.and_then(|row| rows.get_mut(row)) {
                    Some(RowOutput::Smoothed { coarser, result }) => (&mut **coarser, &mut **result),
                    _ => (&mut **coarser_around, &mut **result_around),
                };
                smooth(level, sums, y, SmoothedRow { coarser, band: band_row, result, inverses });
            }
            None => band_row.fill(0.0),
        }
        if last > -1 {
            let means = &mut means[slot(last - 1)];
            match place(last - 1) {
                Some(y) => average(level, around!(band, last - 1), y, means),
                None => means.fill(0.0),
            }
        }
        let row = last - 2;
        let (Some(y), Ok(index)) = (place(row), usize::try_from(row)) else { continue };
        let (means, band) = (around!(means, row), &band[slot(row)]);
        let gain = shrink(level, means, y, shrunk);
        match &mut rows[index] {
            RowOutput::Smoothed { result, .. } => take_noise(gain, band, result),
            RowOutput::Gain(out) => out.copy_from_slice(gain),
        }
    }
}

/// Outputs of a row of [`smooth`].
struct SmoothedRow<'a> {
    coarser: &'a mut [f32],
    band: &'a mut [f32],
    result: &'a mut [f32],
    /// Reciprocals of the sums of weights, and of the counts of both halves before and after smoothing.
    inverses: &'a mut [f32],
}

/// Smoothed sums of a row, and the band: the difference to the sums before. If a half has no samples the result is the surrounding mean.
#[inline(always)]
fn smooth(level: &Level<'_>, sums: &PlanarRows, y: usize, out: SmoothedRow<'_>) {
    let stride = sums.stride;
    let rows = [sums.row(y - level.step), sums.row(y), sums.row(y + level.step)];
    let neighbours = RowNeighbours::new(rows, level.weights, y, level.step);
    let (width, here) = (level.size[0], sums.row(y));
    let [of_weights, before_a, before_b, after_a, after_b] = channels_mut::<INVERSES>(out.inverses);
    inverse_weight_sums(&mut of_weights[..width], neighbours.weights, [4.0, 2.0]);
    for (c, after) in channels_mut::<SUMS>(out.coarser).into_iter().enumerate() {
        let (here, values) = (channel(here, stride, c, 0), neighbours.values(stride, c));
        weighted_mean(&mut after[..width], here, neighbours.weights, values, of_weights, [4.0, 2.0]);
    }
    let [a, b] = HALVES;
    let after = &*out.coarser;
    invert(&mut before_a[..width], channel(here, stride, a + COUNT, 0));
    invert(&mut before_b[..width], channel(here, stride, b + COUNT, 0));
    invert(&mut after_a[..width], channel(after, stride, a + COUNT, 0));
    invert(&mut after_b[..width], channel(after, stride, b + COUNT, 0));
    let [band @ .., signal, noise] = channels_mut::<BAND>(out.band);
    let (signal, noise) = (&mut signal[..width], &mut noise[..width]);
    for (c, (band, result)) in band.into_iter().zip(channels_mut::<RESULT>(out.result)).enumerate() {
        let (band, result) = (&mut band[..width], &mut result[..width]);
        let before_a = HalfRow::new(here, stride, a, c, &before_a[..width]);
        let before_b = HalfRow::new(here, stride, b, c, &before_b[..width]);
        let after_a = HalfRow::new(after, stride, a, c, &after_a[..width]);
        let after_b = HalfRow::new(after, stride, b, c, &after_b[..width]);
        let is_luminance = c == 1;
        for x in 0..width {
            let (near_a, near_b) = (after_a.mean(x), after_b.mean(x));
            let (some_a, some_b) = (after_a.counts[x] > 0.0, after_b.counts[x] > 0.0);
            let a = if some_a { near_a } else { near_b };
            let b = if some_b { near_b } else { near_a };
            let (da, db) = (before_a.mean(x) - a, before_b.mean(x) - b);
            let known = (before_a.counts[x] > 0.0) & (before_b.counts[x] > 0.0);
            let (da, db) = if known { (da, db) } else { (0.0, 0.0) };
            band[x] = 0.5 * (da + db);
            result[x] = if known | !(some_a | some_b) { result[x] } else { 0.5 * (a + b) };
            if is_luminance {
                signal[x] = da * db;
                noise[x] = 0.25 * (da - db) * (da - db);
            }
        }
    }
}

/// A channel of a half in one row: sums, the common counts of all channels, and reciprocals of the counts. All slices have the same length,
/// which the compiler needs to vectorise the loops.
struct HalfRow<'a> {
    sums: &'a [f32],
    counts: &'a [f32],
    inverses: &'a [f32],
}

impl<'a> HalfRow<'a> {
    /// Channel `c` of the half whose first channel is `half`.
    #[inline(always)]
    fn new(row: &'a [f32], stride: usize, half: usize, c: usize, inverses: &'a [f32]) -> Self {
        let width = inverses.len();
        let sums = &channel(row, stride, half + c, 0)[..width];
        Self { sums, counts: &channel(row, stride, half + COUNT, 0)[..width], inverses }
    }

    #[inline(always)]
    fn mean(&self, x: usize) -> f32 {
        self.sums[x] * self.inverses[x]
    }
}

/// Reciprocals of the counts.
#[inline(always)]
fn invert(inverses: &mut [f32], counts: &[f32]) {
    inverses.iter_mut().zip(counts).for_each(|(inverse, count)| *inverse = 1.0 / count);
}

/// Weighted means over pixels and their neighbours. `inverses`: reciprocals of the sums of weights. `factors`: of the pixel itself and of
/// its edge neighbours; corner neighbours have factor 1.
#[inline(always)]
fn weighted_mean(
    out: &mut [f32],
    here: &[f32],
    weights: [&[f32]; 8],
    values: [&[f32]; 8],
    inverses: &[f32],
    [centre, beside]: [f32; 2],
) {
    let width = out.len();
    let (here, inverses) = (&here[..width], &inverses[..width]);
    let (w, v) = (cut(weights, width), cut(values, width));
    for x in 0..width {
        let product = |i: usize| w[i][x] * v[i][x];
        let straight = (product(0) + product(1)) + (product(2) + product(3));
        let diagonal = (product(4) + product(5)) + (product(6) + product(7));
        out[x] = (centre * here[x] + (beside * straight + diagonal)) * inverses[x];
    }
}

/// Cuts rows to equal length, so that the compiler vectorises the loops.
#[inline(always)]
fn cut(mut rows: [&[f32]; 8], width: usize) -> [&[f32]; 8] {
    for row in &mut rows {
        *row = &row[..width];
    }
    rows
}

/// Reciprocals of the sums of weights over pixels and their neighbours, with the factors of [`weighted_mean`].
#[inline(always)]
fn inverse_weight_sums(out: &mut [f32], weights: [&[f32]; 8], [centre, beside]: [f32; 2]) {
    let width = out.len();
    let w = cut(weights, width);
    for x in 0..width {
        let straight = (w[0][x] + w[1][x]) + (w[2][x] + w[3][x]);
        let diagonal = (w[4][x] + w[5][x]) + (w[6][x] + w[7][x]);
        out[x] = 1.0 / (centre + (beside * straight + diagonal));
    }
}

/// Means of the band's signal and noise over 3×3 pixels around row `y`, the second of three.
#[inline(always)]
fn average(level: &Level<'_>, band: [&[f32]; 3], y: usize, out: &mut [f32]) {
    let (width, stride) = (level.size[0], band[1].len() / BAND);
    let neighbours = RowNeighbours::new(band, level.weights, y, level.step);
    let [signal, noise, inverse] = channels_mut::<MEANS>(out);
    inverse_weight_sums(&mut inverse[..width], neighbours.weights, [1.0, 1.0]);
    for (c, out) in [signal, noise].into_iter().enumerate() {
        let (here, values) = (channel(band[1], stride, SIGNAL + c, 0), neighbours.values(stride, SIGNAL + c));
        weighted_mean(&mut out[..width], here, neighbours.weights, values, inverse, [1.0, 1.0]);
    }
}

/// Averages the means once more; returns the resulting gain.
#[inline(always)]
fn shrink<'a>(level: &Level<'_>, means: [&[f32]; 3], y: usize, shrunk: &'a mut [f32]) -> &'a [f32] {
    let (width, stride) = (level.size[0], means[1].len() / MEANS);
    let neighbours = RowNeighbours::new(means, level.weights, y, level.step);
    let [signal, noise, gain] = channels_mut::<SHRUNK>(shrunk);
    let (signal, noise, gain) = (&mut signal[..width], &mut noise[..width], &mut gain[..width]);
    let inverse = &channel(means[1], stride, MEANS - 1, 0)[..width];
    for (c, mean) in [&mut *signal, &mut *noise].into_iter().enumerate() {
        let (here, values) = (channel(means[1], stride, c, 0), neighbours.values(stride, c));
        weighted_mean(mean, here, neighbours.weights, values, inverse, [1.0, 1.0]);
    }
    for x in 0..width {
        gain[x] = (signal[x] - noise[x]).max(0.0) / (signal[x] + noise[x] + f32::MIN_POSITIVE);
    }
    gain
}

/// Subtracts from the result what the gain removes of the band.
#[inline(always)]
fn take_noise(gain: &[f32], band: &[f32], result: &mut [f32]) {
    let (width, stride) = (gain.len(), band.len() / BAND);
    for (c, result) in channels_mut::<RESULT>(result).into_iter().enumerate() {
        let (result, band) = (&mut result[..width], &channel(band, stride, c, 0)[..width]);
        for x in 0..width {
            result[x] -= (1.0 - gain[x]) * band[x];
        }
    }
}
