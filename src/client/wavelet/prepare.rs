//! What stands before the transform: what only one half has seen is set aside, and features get tolerances.

use glam::Vec3;
use rayon::prelude::*;

use super::rows::{BORDER, PlanarRows, RESULT, SUMS};
use super::{HalfPicture, PixelFeatures};
use crate::image::Grid;

/// What one half has seen alone is set aside above this many times the other half's largest luminance around.
const FIREFLY: f32 = 8.0;

/// The reach of that neighbourhood, pixels.
const AROUND: usize = 2;

/// Tolerances of albedo and normal, and of the distance relative to itself and to what it changes by from pixel to pixel.
const ALBEDO: f32 = 0.05;
const NORMAL: f32 = 0.15;
const DISTANCE: f32 = 0.02;
const SLOPE: f32 = 2.0;

/// The share of lights in a pixel whose neighbours see both lights and other surfaces. Pixels of another share are not mixed with it: a light
/// is many times as bright as what is around it, and its edge is in between.
const EDGE_OF_LIGHT: f32 = 0.5;

/// Writes the halves as sums, and half of what only one of them has seen to `aside`: it stays where it is and does not spread.
pub(super) fn separate_fireflies(
    halves: [&HalfPicture; 2],
    aside: &mut Grid<Vec3>,
    sums: &mut PlanarRows,
) -> Option<()> {
    let (width, stride) = (aside.width(), sums.stride);
    let limits = [largest_around(halves[0])?, largest_around(halves[1])?];
    let rows = sums.inner().zip(aside.pixels_mut().par_chunks_mut(width)).enumerate();
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

/// The result at first: the mean of both halves.
pub(super) fn begin(result: &mut [f32], sums: &[f32]) {
    let stride = result.len() / RESULT;
    for x in 0..stride {
        for (c, value) in mean_of_halves(sums, x).to_array().into_iter().enumerate() {
            result[c * stride + x] = value;
        }
    }
}

/// The mean of both halves in column `x` of a row of sums; that of one where the other has nothing, and zero where there is neither.
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

/// Writes means of the features over both halves, with the tolerances of their differences.
pub(super) fn tolerances(halves: [&Grid<PixelFeatures>; 2], rows: &mut PlanarRows) {
    let (width, height) = (halves[0].width(), halves[0].height());
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
    rows.inner().enumerate().for_each(|(y, row)| {
        for x in 0..width {
            // Variance of the mean, from the halves, over the pixel and its neighbours.
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
