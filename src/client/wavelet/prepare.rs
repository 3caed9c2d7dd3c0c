//! Preprocessing: separates fireflies that only one half contains, and derives tolerances of the features.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::rows::{BORDER, FEATURES, LIGHTS, PlanarRows, RESULT, SUMS, TOLERANCES, channels_mut};
use super::{HalfPicture, PixelFeatures};
use crate::image::Grid;

/// Luminance in one half above this multiple of the other half's maximum in the neighbourhood counts as a firefly.
const FIREFLY: f32 = 8.0;

/// Radius of that neighbourhood, pixels.
const AROUND: usize = 2;

/// Tolerances of albedo, normal and distance; that of the distance is relative to the distance and to its change between pixels.
const ALBEDO: f32 = 0.05;
const NORMAL: f32 = 0.15;
const DISTANCE: f32 = 0.02;
const SLOPE: f32 = 2.0;

/// Share of lights assigned to a pixel whose neighbours see both lights and other surfaces. Pixels of different shares are not mixed: a
/// light is many times brighter than its surroundings, and its edge lies between.
const EDGE_OF_LIGHT: f32 = 0.5;

/// Writes the halves as sums, their mean as the first result, and half of each firefly to `aside`, where it keeps its place and is not
/// spread.
pub(super) fn separate_fireflies(
    halves: [&HalfPicture; 2],
    aside: &mut Grid<Vec3>,
    sums: &mut PlanarRows,
    result: &mut PlanarRows,
) -> Option<()> {
    let (width, height) = (aside.width(), aside.height());
    let across = [largest_across(halves[0])?, largest_across(halves[1])?];
    let around = |y: usize| y.saturating_sub(AROUND)..(y + AROUND + 1).min(height);
    let rows = sums.inner_parallel().zip(result.inner_parallel());
    let rows = rows.zip(aside.pixels_mut().par_chunks_mut(width)).enumerate();
    let limits = || [vec![0.0f32; width], vec![0.0f32; width]];
    rows.for_each_init(limits, |limits, (y, ((sums, result), aside))| {
        for (limits, across) in limits.iter_mut().zip(&across) {
            limits.fill(0.0);
            for row in around(y).map(|y| across.row(y)) {
                limits.iter_mut().zip(row).for_each(|(most, v)| *most = most.max(*v));
            }
        }
        // The limits of each half come from the other half.
        let [limits_b, limits_a] = limits;
        let (mut sums, result) = (channels_mut::<SUMS>(sums), channels_mut::<RESULT>(result));
        let (a, b) = sums.split_at_mut(SUMS / 2);
        write_means(halves[0].row(y), a);
        write_means(halves[1].row(y), b);
        limits_to_shares(a, b, limits_a, limits_b);
        let (kept_a, kept_b) = (limits_a, limits_b);
        for (x, aside) in aside.iter_mut().enumerate() {
            for (half, kept) in [(&*a, kept_a[x]), (&*b, kept_b[x])] {
                if kept < 1.0 {
                    *aside += 0.5 * (1.0 - kept) * Vec3::new(half[0][x], half[1][x], half[2][x]);
                }
            }
        }
        for (channel, result) in result.into_iter().enumerate() {
            for x in 0..width {
                let (n_a, n_b) = (a[3][x], b[3][x]);
                let (mean_a, mean_b) = (a[channel][x] * kept_a[x], b[channel][x] * kept_b[x]);
                let share = if (n_a > 0.0) & (n_b > 0.0) { 0.5 } else { 1.0 };
                result[x] = share * (mean_a + mean_b);
                a[channel][x] = mean_a * n_a;
                b[channel][x] = mean_b * n_b;
            }
        }
    });
    Some(())
}

/// Writes a row of a half as X, Y, Z and count; zero without samples.
fn write_means(half: &[Vec4], row: &mut [&mut [f32]]) {
    let [x, y, z, n] = row else { return };
    let width = half.len();
    let (x, y, z, n) = (&mut x[..width], &mut y[..width], &mut z[..width], &mut n[..width]);
    for (i, mean) in half.iter().enumerate() {
        let [mean_x, mean_y, mean_z, count] = mean.to_array();
        let is_finite = mean_x.is_finite() & mean_y.is_finite() & mean_z.is_finite() & count.is_finite();
        let or_zero = |value: f32| if is_finite & (count > 0.0) { value } else { 0.0 };
        (x[i], y[i], z[i], n[i]) = (or_zero(mean_x), or_zero(mean_y), or_zero(mean_z), or_zero(count));
    }
}

/// Replaces luminance limits by the fractions of the means that lie within them.
fn limits_to_shares(a: &[&mut [f32]], b: &[&mut [f32]], limits_a: &mut [f32], limits_b: &mut [f32]) {
    let width = limits_a.len();
    let (y_a, n_a, y_b, n_b) = (&a[1][..width], &a[3][..width], &b[1][..width], &b[3][..width]);
    let limits_b = &mut limits_b[..width];
    for x in 0..width {
        let both = (n_a[x] > 0.0) & (n_b[x] > 0.0);
        let kept = |y: f32, limit: f32| if both & (y > FIREFLY * limit) { FIREFLY * limit / y } else { 1.0 };
        (limits_a[x], limits_b[x]) = (kept(y_a[x], limits_a[x]), kept(y_b[x], limits_b[x]));
    }
}

/// Largest luminance within [`AROUND`] pixels along the row.
fn largest_across(half: &HalfPicture) -> Option<Grid<f32>> {
    let (width, height) = (half.width(), half.height());
    let mut largest = Grid::try_filled(width, height, 0.0f32)?;
    let rows = largest.pixels_mut().par_chunks_mut(width).enumerate();
    let luminance = || vec![0.0f32; width + 2 * AROUND];
    rows.for_each_init(luminance, |luminance, (y, out)| {
        let inner = luminance[AROUND..].iter_mut();
        inner.zip(half.row(y)).for_each(|(out, v)| *out = if v.w > 0.0 { v.y } else { 0.0 });
        for by in 0..=2 * AROUND {
            out.iter_mut().zip(&luminance[by..]).for_each(|(most, v)| *most = most.max(*v));
        }
    });
    Some(largest)
}

/// Mean of both halves in column `x` of a row of sums; that of one half if the other is empty, and zero if both are.
#[inline(always)]
pub(super) fn mean_of_halves(sums: &[f32], x: usize) -> Vec3 {
    let stride = sums.len() / SUMS;
    let half = |first: usize| {
        let [x, y, z, n] = [0, 1, 2, 3].map(|c| sums[(first + c) * stride + x]);
        (n > 0.0).then(|| Vec3::new(x, y, z) / n)
    };
    match (half(0), half(4)) {
        (Some(a), Some(b)) => 0.5 * (a + b),
        (a, b) => a.or(b).unwrap_or(Vec3::ZERO),
    }
}

/// Share of lights outside the picture, which no pixel has, so that nothing mixes with it.
const OUTSIDE: f32 = -1.0;

/// Sets equal features in all pixels.
pub(super) fn no_features(rows: &mut PlanarRows, width: usize) {
    rows.fill(LIGHTS, OUTSIDE);
    for row in rows.inner() {
        for (channel, row) in channels_mut::<FEATURES>(row).into_iter().enumerate() {
            row[..width].fill(if TOLERANCES.contains(&channel) { 1.0 } else { 0.0 });
        }
    }
}

/// Writes the mean features of both halves, and the tolerances of their differences.
pub(super) fn tolerances(halves: [&Grid<PixelFeatures>; 2], rows: &mut PlanarRows) {
    let (width, height) = (halves[0].width(), halves[0].height());
    let stride = rows.stride;
    let pair = |x: usize, y: usize| halves.map(|half| half.at(x, y));
    let distance = |x: usize, y: usize| {
        let [a, b] = pair(x, y);
        0.5 * (a.distance + b.distance)
    };
    // The smaller change of the two sides, since the larger may be across an edge.
    let slope = |here: f32, before: Option<f32>, after: Option<f32>| {
        let change = |to: Option<f32>| to.map_or(f32::INFINITY, |to| (to - here).abs());
        let least = change(before).min(change(after));
        if least.is_finite() { least } else { 0.0 }
    };
    rows.inner_parallel().enumerate().for_each(|(y, row)| {
        for x in 0..width {
            // Variance of the mean, estimated from the halves over the pixel and its neighbours.
            let (mut spread, mut lights, mut count) = ([0f32; 3], 0.0, 0.0);
            for y in y.saturating_sub(1)..(y + 2).min(height) {
                for x in x.saturating_sub(1)..(x + 2).min(width) {
                    let [a, b] = pair(x, y);
                    spread[0] += 0.25 * (a.albedo - b.albedo).length_squared();
                    spread[1] += 0.25 * (a.normal - b.normal).length_squared();
                    spread[2] += 0.25 * (a.distance - b.distance).powi(2);
                    lights += f32::from(u8::from(a.emits) + u8::from(b.emits));
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
            let lights = match lights / (2.0 * count) {
                share if share == 0.0 || share == 1.0 => share,
                _ => EDGE_OF_LIGHT,
            };
            let all = values.into_iter().chain([ALBEDO * ALBEDO + va, NORMAL * NORMAL + vn, tz, lights]);
            for (channel, value) in all.enumerate() {
                row[channel * stride + BORDER + x] = value;
            }
        }
    });
}
