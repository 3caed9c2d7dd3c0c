//! The reference of `downsample`: the chain of averages down to one texel.
//!
//! Odd sizes take three inputs with polyphase weights, so that every level has the same mean; a plain
//! 2×2 average would drop the last row and column.

use std::ops::{Add, Mul};

use rayon::prelude::*;

use crate::image::Grid;

/// Levels of a film: level 0 is the full resolution; each other halves both sides, rounded down, to at least 1; the last is 1×1.
pub type Pyramid<T> = Vec<Grid<T>>;

/// Inputs of output `i` along one axis of `size` inputs: the first, and the weights of up to three.
///
/// Size 2n: two halves. Size 2n+1: `(n−i, n, i+1)/(2n+1)`. Size 1: itself.
pub fn polyphase(size: usize, i: usize) -> (usize, [f32; 3]) {
    let n = size / 2;
    if size == 1 {
        (0, [1.0, 0.0, 0.0])
    } else if size.is_multiple_of(2) {
        (2 * i, [0.5, 0.5, 0.0])
    } else {
        let total = size as f32;
        (2 * i, [(n - i) as f32 / total, n as f32 / total, (i + 1) as f32 / total])
    }
}

/// All levels of `base`, which becomes level 0; `None` when the memory is not to be had.
pub fn pyramid<T>(base: Grid<T>) -> Option<Pyramid<T>>
where
    T: Copy + Default + Send + Sync + Add<Output = T> + Mul<f32, Output = T>,
{
    let mut levels = vec![base];
    loop {
        let last = levels.last().expect("starts with one level");
        if last.width() == 1 && last.height() == 1 {
            return Some(levels);
        }
        levels.push(downsample(last)?);
    }
}

/// The next level: weighted averages of 2×2 texels, 3 along odd sides.
pub fn downsample<T>(from: &Grid<T>) -> Option<Grid<T>>
where
    T: Copy + Default + Send + Sync + Add<Output = T> + Mul<f32, Output = T>,
{
    let (width, height) = ((from.width() / 2).max(1), (from.height() / 2).max(1));
    let mut to = Grid::try_filled(width, height, T::default())?;
    to.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let (y0, wy) = polyphase(from.height(), y);
        for (x, out) in row.iter_mut().enumerate() {
            let (x0, wx) = polyphase(from.width(), x);
            let mut sum = T::default();
            for (dy, &wy) in wy.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                for (dx, &wx) in wx.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                    sum = sum + from.at(x0 + dx, y0 + dy) * (wx * wy);
                }
            }
            *out = sum;
        }
    });
    Some(to)
}

/// A trilinear read of a pyramid: `uv` in 0…1 over the padded film, clamped to the edge.
pub fn trilinear<T>(levels: &[Grid<T>], uv: [f32; 2], lod: f32) -> T
where
    T: Copy + Add<Output = T> + Mul<f32, Output = T>,
{
    let lod = lod.clamp(0.0, (levels.len() - 1) as f32);
    let level = lod as usize;
    let f = lod - level as f32;
    let near = bilinear(&levels[level], uv);
    if f > 0.0 { near * (1.0 - f) + bilinear(&levels[level + 1], uv) * f } else { near }
}

/// A bilinear read with clamping to the edge.
pub fn bilinear<T>(grid: &Grid<T>, uv: [f32; 2]) -> T
where
    T: Copy + Add<Output = T> + Mul<f32, Output = T>,
{
    bilinear_at(grid, [uv[0] * grid.width() as f32, uv[1] * grid.height() as f32])
}

/// As [`bilinear`], at a position in texels; the texel as it is at its centre.
pub fn bilinear_at<T>(grid: &Grid<T>, p: [f32; 2]) -> T
where
    T: Copy + Add<Output = T> + Mul<f32, Output = T>,
{
    let axis = |p: f32, size: usize| {
        let p = (p - 0.5).clamp(0.0, (size - 1) as f32);
        let i = p as usize;
        (i, (i + 1).min(size - 1), p - i as f32)
    };
    let (x0, x1, fx) = axis(p[0], grid.width());
    let (y0, y1, fy) = axis(p[1], grid.height());
    let (top, bottom) = (grid.row(y0), grid.row(y1));
    let across = |row: &[T]| row[x0] * (1.0 - fx) + row[x1] * fx;
    across(top) * (1.0 - fy) + across(bottom) * fy
}
