//! Noise filter for the display: an undecimated wavelet transform whose bands are kept where two independent halves agree.
//!
//! Two halves of the samples, each of a randomisation of its own, share the signal and not the noise: the mean product of their wavelet
//! coefficients is the power of the signal in a band, without a model of the noise. With S that mean and N the power of the noise in the mean
//! of both, a band is multiplied by max(0, S − N) / (S + N): Wiener's gain, with the noise subtracted once more because S is itself noisy.
//! Where the features of first hits change (albedo, normal, distance) the transform does not mix pixels, so that edges stay edges; and what
//! features do not know, such as shadows and caustics, comes back because both halves contain it (paper [21], Suykens and Willems 2000; the
//! à-trous scheme is that of Dammertz et al. 2010).
//!
//! Nothing is stored and no statistics are changed: the filter works on what is shown. With more samples N vanishes, and so does the filter.
//!
//! Rows are `[height][channel][width]`, so that a row of all channels is one piece of memory, with a border of zeros that counts for nothing.

use glam::Vec3;
use rayon::prelude::*;

use crate::image::Grid;

/// Levels of the transform; level l has steps of 2^l pixels.
const LEVELS: u32 = 5;

/// Pixels around the picture that are read and count for nothing.
const BORDER: usize = 1 << (LEVELS - 1);

/// Pixels that are computed together.
const LANES: usize = 8;

/// What one half has seen alone is set aside above this many times the other half's largest luminance around.
const FIREFLY: f32 = 8.0;

/// The reach of that neighbourhood, pixels.
const AROUND: usize = 2;

/// Tolerances of albedo and normal, and of the distance relative to itself and to what it changes by from pixel to pixel.
const ALBEDO: f32 = 0.05;
const NORMAL: f32 = 0.15;
const DISTANCE: f32 = 0.02;
const SLOPE: f32 = 2.0;

/// One half: in every pixel the mean X, Y and Z of its samples, and their number, 0 where there is none.
pub type HalfPicture = Grid<glam::Vec4>;

/// What a camera ray meets first, in one pixel: zero where that is nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelFeatures {
    /// Diffuse reflectance, linear Rec.709.
    pub albedo: Vec3,
    /// Unit shading normal, or a mean of several.
    pub normal: Vec3,
    /// Distance from the camera, world units.
    pub distance: f32,
}

/// Channels of the two halves: sums X, Y, Z and counts, and again.
const SUMS: usize = 8;
/// Channels of features with their tolerances: albedo, normal, distance, three tolerances.
const FEATURES: usize = 10;
/// Weights to the neighbours to the right, below right, below, below left; those to the others are theirs.
const WEIGHTS: usize = 4;
/// Channels of the result: X, Y, Z, and the gain of the last band.
const RESULT: usize = 4;
/// Channels of a band: the mean of both halves, the product of their luminances, the noise.
const BAND: usize = 5;

type PixelBlock = [f32; LANES];

#[inline(always)]
fn each(f: impl Fn(usize) -> f32) -> PixelBlock {
    std::array::from_fn(f)
}

/// Rows of several channels with a border.
struct PlanarRows {
    channels: usize,
    stride: usize,
    data: Vec<f32>,
}

impl PlanarRows {
    fn new(width: usize, height: usize, channels: usize) -> Option<Self> {
        let stride = 2 * BORDER + width.next_multiple_of(LANES);
        let mut data = Vec::new();
        data.try_reserve_exact(stride * channels * (height + 2 * BORDER)).ok()?;
        data.resize(stride * channels * (height + 2 * BORDER), 0.0);
        Some(Self { channels, stride, data })
    }

    /// All channels of row `y`, counted from the top of the border.
    #[inline(always)]
    fn row(&self, y: usize) -> &[f32] {
        let length = self.channels * self.stride;
        &self.data[y * length..][..length]
    }

    /// The rows of the picture, without the border.
    fn inner(&mut self, height: usize) -> impl IndexedParallelIterator<Item = &mut [f32]> {
        let length = self.channels * self.stride;
        self.data[BORDER * length..][..height * length].par_chunks_mut(length)
    }
}

/// Eight numbers of a channel of a row.
#[inline(always)]
fn load(row: &[f32], stride: usize, channel: usize, x: usize) -> PixelBlock {
    let at = channel * stride + x;
    row[at..at + LANES].try_into().unwrap_or_default()
}

#[inline(always)]
fn store(row: &mut [f32], stride: usize, channel: usize, x: usize, values: PixelBlock) {
    row[channel * stride + x..][..LANES].copy_from_slice(&values);
}

/// The neighbours: offset in steps, and where the weight to them stands: the channel, and whether it is their own weight to here.
const NEIGHBOURS: [FilterTap; 8] = [
    FilterTap { dx: 1, dy: 0, weight: 0, theirs: false },
    FilterTap { dx: 1, dy: 1, weight: 1, theirs: false },
    FilterTap { dx: 0, dy: 1, weight: 2, theirs: false },
    FilterTap { dx: -1, dy: 1, weight: 3, theirs: false },
    FilterTap { dx: -1, dy: 0, weight: 0, theirs: true },
    FilterTap { dx: -1, dy: -1, weight: 1, theirs: true },
    FilterTap { dx: 0, dy: -1, weight: 2, theirs: true },
    FilterTap { dx: 1, dy: -1, weight: 3, theirs: true },
];

struct FilterTap {
    dx: isize,
    dy: isize,
    weight: usize,
    theirs: bool,
}

impl FilterTap {
    /// Binomial coefficient over that of the corner; the centre has 4.
    #[inline(always)]
    fn tap(&self) -> f32 {
        if self.dx == 0 || self.dy == 0 { 2.0 } else { 1.0 }
    }

    /// The row of this neighbour of row `y`, and its first column for column `x`.
    #[inline(always)]
    fn place(&self, y: usize, x: usize, step: usize) -> (usize, usize) {
        let step = step as isize;
        (y.wrapping_add_signed(self.dy * step), x.wrapping_add_signed(self.dx * step))
    }

    /// The weight to this neighbour.
    #[inline(always)]
    fn weight(&self, weights: &PlanarRows, y: usize, x: usize, step: usize) -> PixelBlock {
        let (row, column) = if self.theirs { self.place(y, x, step) } else { (y, x) };
        load(weights.row(row), weights.stride, self.weight, column)
    }
}

/// A filtered picture.
pub struct Filtered {
    /// XYZ.
    pub picture: Grid<Vec3>,
    /// What differs from pixel to pixel, edges of features among it: 0 where that is noise, 1 where the halves agree on it.
    pub finest: Grid<f32>,
}

/// Filters a picture; `None` without memory. The halves and the features of both halves must be of one size.
pub fn filtered(halves: [&HalfPicture; 2], features: Option<[&Grid<PixelFeatures>; 2]>) -> Option<Filtered> {
    let (width, height) = (halves[0].width(), halves[0].height());
    let rows = |channels| PlanarRows::new(width, height, channels);
    let mut aside = Grid::try_filled(width, height, Vec3::ZERO)?;
    let (mut sums, mut coarser) = (rows(SUMS)?, rows(SUMS)?);
    separate_fireflies(halves, &mut aside, &mut sums)?;
    let mut result = rows(RESULT)?;
    result.inner(height).zip(sums.inner(height)).for_each(|(result, sums)| begin(result, sums));
    let known = match features {
        Some(halves) => Some(tolerances(halves)?),
        None => None,
    };
    let (mut weights, mut band, mut means) = (rows(WEIGHTS)?, rows(BAND)?, rows(2)?);
    let mut finest = Grid::try_filled(width, height, 0.0f32)?;
    // Across edges of features as well: there the bands of the filter are empty.
    let mut across = rows(RESULT)?;
    weigh(&mut weights, None, [width, height], 1);
    smooth(&sums, &weights, &mut coarser, &mut band, &mut across, [width, height], 1);
    average(&band, &weights, &mut means, height, 1);
    shrink(&means, &weights, &band, &mut across, height, 1);
    read_gain(&across, &mut finest);
    drop(across);
    for level in 0..LEVELS {
        let step = 1 << level;
        weigh(&mut weights, known.as_ref(), [width, height], step);
        smooth(&sums, &weights, &mut coarser, &mut band, &mut result, [width, height], step);
        average(&band, &weights, &mut means, height, step);
        shrink(&means, &weights, &band, &mut result, height, step);
        std::mem::swap(&mut sums, &mut coarser);
    }
    let mut picture = aside;
    picture.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let row = result.row(y + BORDER);
        for (x, out) in out.iter_mut().enumerate() {
            *out += Vec3::from_array([0, 1, 2].map(|c| row[c * result.stride + BORDER + x]));
        }
    });
    Some(Filtered { picture, finest })
}

/// Writes the halves as sums, and half of what only one of them has seen to `aside`: it stays where it is and does not spread.
fn separate_fireflies(
    halves: [&HalfPicture; 2],
    aside: &mut Grid<Vec3>,
    sums: &mut PlanarRows,
) -> Option<()> {
    let (width, height, stride) = (aside.width(), aside.height(), sums.stride);
    let limits = [largest_around(halves[0])?, largest_around(halves[1])?];
    let rows = sums.inner(height).zip(aside.pixels_mut().par_chunks_mut(width)).enumerate();
    rows.for_each(|(y, (row, aside))| {
        for (x, aside) in aside.iter_mut().enumerate() {
            let seen =
                halves.map(|half| half.at(x, y)).map(|v| if v.is_finite() { v } else { glam::Vec4::ZERO });
            let both = seen.iter().all(|v| v.w > 0.0);
            for (half, value) in seen.into_iter().enumerate() {
                let (mut xyz, n) = (value.truncate(), value.w.max(0.0));
                let limit = FIREFLY * limits[1 - half].at(x, y);
                if both && xyz.y > limit {
                    let kept = xyz * (limit / xyz.y);
                    *aside += 0.5 * (xyz - kept);
                    xyz = kept;
                }
                let sum = if n > 0.0 { xyz * n } else { Vec3::ZERO };
                for (channel, value) in [sum.x, sum.y, sum.z, n].into_iter().enumerate() {
                    row[(4 * half + channel) * stride + BORDER + x] = value;
                }
            }
        }
    });
    Some(())
}

/// The largest luminance in the square around every pixel.
fn largest_around(half: &HalfPicture) -> Option<Grid<f32>> {
    let (width, height) = (half.width(), half.height());
    let window = |at: usize, size: usize| at.saturating_sub(AROUND)..(at + AROUND + 1).min(size);
    let mut across = Grid::try_filled(width, height, 0.0f32)?;
    across.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let row = half.row(y);
        for (x, out) in out.iter_mut().enumerate() {
            *out = row[window(x, width)]
                .iter()
                .fold(0.0, |most, v| if v.w > 0.0 { v.y.max(most) } else { most });
        }
    });
    let mut largest = Grid::try_filled(width, height, 0.0f32)?;
    largest.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        for row in window(y, height).map(|y| across.row(y)) {
            out.iter_mut().zip(row).for_each(|(out, v)| *out = out.max(*v));
        }
    });
    Some(largest)
}

/// The result at first: the mean of both halves, of one where the other has nothing.
fn begin(result: &mut [f32], sums: &[f32]) {
    let stride = result.len() / RESULT;
    for x in 0..stride {
        let n = [3, 7].map(|c| sums[c * stride + x]);
        for c in 0..3 {
            let [a, b] = [0, 1].map(|i| sums[(4 * i + c) * stride + x] / n[i]);
            result[c * stride + x] = match [n[0] > 0.0, n[1] > 0.0] {
                [true, true] => 0.5 * (a + b),
                [true, false] => a,
                [false, true] => b,
                [false, false] => 0.0,
            };
        }
    }
}

/// Means of the features over both halves, with the tolerances of their differences.
fn tolerances(halves: [&Grid<PixelFeatures>; 2]) -> Option<PlanarRows> {
    let (width, height) = (halves[0].width(), halves[0].height());
    let mut rows = PlanarRows::new(width, height, FEATURES)?;
    let stride = rows.stride;
    let pair = |x: usize, y: usize| halves.map(|half| half.at(x, y));
    let distance = |x: usize, y: usize| {
        let [a, b] = pair(x, y);
        0.5 * (a.distance + b.distance)
    };
    // The smaller of the changes to either side: the larger one may be across an edge.
    let slope = |here: f32, before: Option<f32>, after: Option<f32>| {
        let change = |to: Option<f32>| to.map_or(f32::INFINITY, |to| (to - here).abs());
        let least = change(before).min(change(after));
        if least.is_finite() { least } else { 0.0 }
    };
    rows.inner(height).enumerate().for_each(|(y, row)| {
        for x in 0..width {
            // Variance of the mean, from the halves, over the pixel and its neighbours.
            let (mut spread, mut count) = ([0f32; 3], 0.0);
            for y in y.saturating_sub(1)..(y + 2).min(height) {
                for x in x.saturating_sub(1)..(x + 2).min(width) {
                    let [a, b] = pair(x, y);
                    spread[0] += 0.25 * (a.albedo - b.albedo).length_squared();
                    spread[1] += 0.25 * (a.normal - b.normal).length_squared();
                    spread[2] += 0.25 * (a.distance - b.distance).powi(2);
                    count += 1.0;
                }
            }
            let [a, b] = pair(x, y);
            let (albedo, normal, z) =
                (0.5 * (a.albedo + b.albedo), 0.5 * (a.normal + b.normal), distance(x, y));
            let across = slope(
                z,
                x.checked_sub(1).map(|x| distance(x, y)),
                (x + 1 < width).then(|| distance(x + 1, y)),
            );
            let down = slope(
                z,
                y.checked_sub(1).map(|y| distance(x, y)),
                (y + 1 < height).then(|| distance(x, y + 1)),
            );
            let [va, vn, vz] = spread.map(|sum| sum / count);
            let tz = (DISTANCE * z).powi(2) + (SLOPE * (across + down)).powi(2) + vz + f32::MIN_POSITIVE;
            let values = [albedo.x, albedo.y, albedo.z, normal.x, normal.y, normal.z, z];
            let all = values.into_iter().chain([ALBEDO * ALBEDO + va, NORMAL * NORMAL + vn, tz]);
            for (channel, value) in all.enumerate() {
                row[channel * stride + BORDER + x] = value;
            }
        }
    });
    Some(rows)
}

/// The weights between pixels `step` apart: (1 − d/4)⁴ of the squared difference of their features in units of the tolerances, 0 out of the
/// picture.
fn weigh(weights: &mut PlanarRows, features: Option<&PlanarRows>, [width, height]: [usize; 2], step: usize) {
    let stride = weights.stride;
    weights.inner(height).enumerate().for_each(|(y, row)| {
        for neighbour in &NEIGHBOURS[..WEIGHTS] {
            let below = y + neighbour.dy as usize * step;
            for x in (0..width).step_by(LANES) {
                let inside = |i: usize| {
                    let column = (x + i) as isize + neighbour.dx * step as isize;
                    below < height && x + i < width && (0..width as isize).contains(&column)
                };
                let mut w = each(|i| if inside(i) { 1.0 } else { 0.0 });
                if let Some(features) = features.filter(|_| below < height) {
                    let (there_y, there_x) = neighbour.place(y + BORDER, x + BORDER, step);
                    let (here, there) = (features.row(y + BORDER), features.row(there_y));
                    let p = |c: usize| load(here, stride, c, x + BORDER);
                    let q = |c: usize| load(there, stride, c, there_x);
                    let square = |c: usize| {
                        let (p, q) = (p(c), q(c));
                        each(|i| (p[i] - q[i]) * (p[i] - q[i]))
                    };
                    let sum = |c: usize| {
                        let s = [square(c), square(c + 1), square(c + 2)];
                        each(|i| s[0][i] + s[1][i] + s[2][i])
                    };
                    let tolerance = |c: usize| {
                        let (p, q) = (p(c), q(c));
                        each(|i| p[i] + q[i])
                    };
                    let (albedo, normal, distance) = (sum(0), sum(3), square(6));
                    let (ta, tn, tz) = (tolerance(7), tolerance(8), tolerance(9));
                    w = each(|i| {
                        let d = albedo[i] / ta[i] + normal[i] / tn[i] + distance[i] / tz[i];
                        let rest = (1.0 - 0.5 * d).max(0.0);
                        let square = rest * rest;
                        w[i] * square * square
                    });
                }
                store(row, stride, neighbour.weight, x + BORDER, w);
            }
        }
    });
}

/// One level: the smoothed sums, and the band between them and those before. Where a half has nothing the result is what is around.
fn smooth(
    sums: &PlanarRows,
    weights: &PlanarRows,
    coarser: &mut PlanarRows,
    band: &mut PlanarRows,
    result: &mut PlanarRows,
    [width, height]: [usize; 2],
    step: usize,
) {
    let stride = sums.stride;
    let rows = coarser.inner(height).zip(band.inner(height)).zip(result.inner(height)).enumerate();
    rows.for_each(|(y, ((coarser, band), result))| {
        let y = y + BORDER;
        for x in (BORDER..BORDER + width).step_by(LANES) {
            let here: [PixelBlock; SUMS] = std::array::from_fn(|c| load(sums.row(y), stride, c, x));
            let mut total = here.map(|v| v.map(|v| 4.0 * v));
            let mut weight: PixelBlock = [4.0; LANES];
            for neighbour in &NEIGHBOURS {
                let w = neighbour.weight(weights, y, x, step).map(|w| neighbour.tap() * w);
                let (row, column) = neighbour.place(y, x, step);
                let there = sums.row(row);
                for (c, total) in total.iter_mut().enumerate() {
                    let value = load(there, stride, c, column);
                    *total = each(|i| total[i] + w[i] * value[i]);
                }
                weight = each(|i| weight[i] + w[i]);
            }
            let inverse = weight.map(|w| 1.0 / w);
            let total = total.map(|total| each(|i| total[i] * inverse[i]));
            for (c, total) in total.iter().enumerate() {
                store(coarser, stride, c, x, *total);
            }
            let has = |n: &PixelBlock| n.map(|n| n > 0.0);
            let (known_a, known_b) = (has(&here[3]), has(&here[7]));
            let (near_a, near_b) = (has(&total[3]), has(&total[7]));
            let mut luminance = [[0.0; LANES]; 2];
            for c in 0..3 {
                let before = load(result, stride, c, x);
                let (mut mean, mut after) = ([0.0; LANES], before);
                for i in 0..LANES {
                    let a = total[c][i] / total[3][i];
                    let b = total[4 + c][i] / total[7][i];
                    let (a, b) = (if near_a[i] { a } else { b }, if near_b[i] { b } else { a });
                    if known_a[i] && known_b[i] {
                        let da = here[c][i] / here[3][i] - a;
                        let db = here[4 + c][i] / here[7][i] - b;
                        mean[i] = 0.5 * (da + db);
                        if c == 1 {
                            (luminance[0][i], luminance[1][i]) = (da, db);
                        }
                    } else if near_a[i] || near_b[i] {
                        after[i] = 0.5 * (a + b);
                    }
                }
                store(band, stride, c, x, mean);
                store(result, stride, c, x, after);
            }
            let [da, db] = luminance;
            store(band, stride, 3, x, each(|i| da[i] * db[i]));
            store(band, stride, 4, x, each(|i| 0.25 * (da[i] - db[i]) * (da[i] - db[i])));
        }
    });
}

/// Weighted means of two channels over the neighbours, all of them alike.
#[inline(always)]
fn mean_of_two(
    from: &PlanarRows,
    first: usize,
    weights: &PlanarRows,
    y: usize,
    x: usize,
    step: usize,
) -> [PixelBlock; 2] {
    let stride = from.stride;
    let mut total = [first, first + 1].map(|c| load(from.row(y), stride, c, x));
    let mut weight: PixelBlock = [1.0; LANES];
    for neighbour in &NEIGHBOURS {
        let w = neighbour.weight(weights, y, x, step);
        let (row, column) = neighbour.place(y, x, step);
        for (c, total) in total.iter_mut().enumerate() {
            let value = load(from.row(row), stride, first + c, column);
            *total = each(|i| total[i] + w[i] * value[i]);
        }
        weight = each(|i| weight[i] + w[i]);
    }
    total.map(|total| each(|i| total[i] / weight[i]))
}

/// Means of signal and noise of the band over 3×3 pixels.
fn average(band: &PlanarRows, weights: &PlanarRows, means: &mut PlanarRows, height: usize, step: usize) {
    let stride = band.stride;
    means.inner(height).enumerate().for_each(|(y, row)| {
        for x in (BORDER..stride - BORDER).step_by(LANES) {
            let [signal, noise] = mean_of_two(band, 3, weights, y + BORDER, x, step);
            store(row, stride, 0, x, signal);
            store(row, stride, 1, x, noise);
        }
    });
}

/// Copies the gain of the last band.
fn read_gain(result: &PlanarRows, gain: &mut Grid<f32>) {
    let width = gain.width();
    for (y, out) in gain.pixels_mut().chunks_mut(width).enumerate() {
        out.copy_from_slice(&result.row(y + BORDER)[(RESULT - 1) * result.stride + BORDER..][..width]);
    }
}

/// The same once more, the gain that follows, and what it takes from the result.
fn shrink(
    means: &PlanarRows,
    weights: &PlanarRows,
    band: &PlanarRows,
    result: &mut PlanarRows,
    height: usize,
    step: usize,
) {
    let stride = means.stride;
    result.inner(height).enumerate().for_each(|(y, row)| {
        let y = y + BORDER;
        for x in (BORDER..stride - BORDER).step_by(LANES) {
            let [signal, noise] = mean_of_two(means, 0, weights, y, x, step);
            let taken = each(|i| {
                let gain = (signal[i] - noise[i]).max(0.0) / (signal[i] + noise[i] + f32::MIN_POSITIVE);
                1.0 - gain
            });
            for c in 0..3 {
                let (before, mean) = (load(row, stride, c, x), load(band.row(y), stride, c, x));
                store(row, stride, c, x, each(|i| before[i] - taken[i] * mean[i]));
            }
            store(row, stride, RESULT - 1, x, taken.map(|taken| 1.0 - taken));
        }
    });
}
