//! Adaptive filtering of the light stream (Suykens and Willems, *Adaptive Filtering for Progressive Monte Carlo Image Rendering*,
//! WSCG 2000, the paper's \[21\]): every sample is shown through a kernel as wide as the density of light around it requires.
//!
//! # Why the sums stay as they are
//!
//! Suykens and Willems choose the width of a sample's kernel when the sample arrives, so that early samples stay wide for good, and the
//! picture depends on the order of batches. The sums of the film hold every sample within its own pixel filter, which is below all of
//! these widths. Here a repaint chooses the widths and spreads the sums, so that *all* samples have the width of the present density.
//! Files, states, merged shards and the stated error keep the unbiased sums; the picture is a function of the sums alone, the same for any
//! number of threads; and the cost of a repaint does not depend on the number of samples.
//!
//! # The kernel
//!
//! A pyramid bounds the cost of wide kernels. From the finest level on, each level of the light keeps the share `s` of every texel and
//! passes `1 − s` on to the next, of half the resolution. From the coarsest level back, what a level has kept is added to the coarser
//! levels' sum, interpolated by quadratic B-splines. With downsampling as a matrix `D` of polyphase averages
//! ([`polyphase`](crate::client::reference::mips::polyphase)), interpolation is `U = B·Dᵀ·m/n` ([`interpolation`]) for `m` fine and `n`
//! coarse texels along an axis, and `B` the filter (1, 2, 1)/4 with reflection at both ends. `D` has rows that sum to 1 and columns that sum to `n/m`, and `B` is symmetric with
//! sums of 1: thus the columns of `U` sum to `m/n`, so that energy is kept, and its rows to 1, so that a constant stays constant, at
//! borders and corners and for odd sizes too, up to rounding. The film's overscan is left out: light of the picture stays in the picture.
//!
//! # The width
//!
//! Let ρ be the effective number of samples per pixel around a texel, `(ΣY)²/ΣY²`, where `ΣY²` is the mean over texels of `Y²/W`: as long
//! as samples are sparse, that is the sum of their squares; where they are dense, it is at most that, and the width is smaller. A texel of
//! level ℓ has the width `h = 2^ℓ` pixels. The kernel's area is
//!
//! `h² = K·ρ^−α`, K = [`SAMPLES`] and α = [`RATE`] < 1,
//!
//! fractional levels being shared between two. ρ is read on the next coarser level, so that the width does not follow the noise of the
//! texel itself. With n samples in all, ρ ∝ n; the expectation of the picture is the light convolved with a kernel of second moment
//! O(h²), so its bias is O(h²) = O(n^−α) where the light is twice differentiable; the relative variance is O(1/(ρh²)) = O(n^(α−1)). Both
//! vanish: the estimate is consistent. Where ρ ≥ K^(1/α) (126) on all of a texel's neighbours the kernel is below one pixel, and the
//! texel is the film's, bit for bit: from there on the error is that of the unfiltered picture.
//!
//! # Edges
//!
//! At a silhouette or the border of a caustic the light is not differentiable, and a wide kernel would carry it across. A level keeps the
//! light where the next one, to which it would pass on, has a significant gradient: let `g` be the difference
//! between the columns on both sides of a texel, weighted (1, 2, 1), and `v` its variance, which the sums `ΣY²` of the six texels give. `z² = g²/v`, horizontal plus vertical, follows a χ² distribution of two
//! degrees of freedom where the light is even. Shares rise from 0 to 1 between the [`EDGE`] values, by the largest z² of
//! the 3×3 coarser texels around, which is what the wider kernel reaches.
//! The z² of n samples is n at most (Cauchy–Schwarz), so that a few samples in the dark are no edge. Edges only make kernels
//! narrower: the rate of the bias holds as a bound.
//!
//! # Which streams
//!
//! FLIP of particle tracing at 1 sample per pixel falls to .60 (`caustic.xml`) and .62 (`cove.xml`) of the plain display's, and noise masking,
//! which blurs both sides of an edge, is worse on caustics: the filter is the light stream's default. The camera stream shows a mean, whose
//! noise does not come from density. There the same kernels, by the variance, win over noise masking and lose to wavelets
//! (`tools/README.md` has the numbers), so that they are not offered.

use std::ops::{Add, Mul};

use glam::{Vec2, Vec4};
use rayon::prelude::*;

use crate::client::reference::mips::{downsample, pyramid};
use crate::image::Grid;

/// K: effective samples within the kernel where there is one per pixel.
pub const SAMPLES: f32 = 48.0;

/// α: the exponent at which the kernel's area falls with the number of samples.
pub const RATE: f32 = 0.8;

/// Values of z² from which on a level keeps some of the light, and all of it.
pub const EDGE: [f32; 2] = [9.0, 18.0];

/// Weights of texels beside each other in a gradient.
const ACROSS: [f32; 3] = [1.0, 2.0, 1.0];

/// The light stream's sums with every sample spread as far as the density around it requires, `[height][width]`; `None` if memory runs out.
/// Runs in the current thread pool.
///
/// `sums` are those of the picture, `[X, Y, Z, W]` per texel, without overscan. `inverse_scale` is 1 / luminance scale. Kernels are at least
/// as wide as a texel of level `finest`, for pictures of larger pixels.
///
/// The total of each channel stays the same, up to rounding. Finite sums have a finite result.
pub fn adaptive_filter(sums: Grid<Vec4>, inverse_scale: f32, finest: usize) -> Option<Grid<Vec4>> {
    let statistics = pyramid(map(&sums, |[x, y]| statistics_of(sums.at(x, y), inverse_scale))?)?;
    let mut kept = Vec::with_capacity(statistics.len());
    let mut passed = sums;
    for level in 0..statistics.len() - 1 {
        let coarse = &statistics[level + 1];
        let extent = [passed.width(), passed.height()];
        let area = (2.0 * (level + 1) as f32).exp2();
        let edges = map(coarse, |at| edge(coarse, at, area))?;
        let keeps = |at| if level < finest { 0.0 } else { share(coarse, &edges, extent, at, level) };
        let here = map(&passed, |at| passed.at(at[0], at[1]) * keeps(at))?;
        passed = downsample(&map(&passed, |[x, y]| passed.at(x, y) - here.at(x, y))?)?;
        kept.push(here);
    }
    // The coarsest level keeps what has come to it.
    let mut result = passed;
    while let Some(mut level) = kept.pop() {
        let width = level.width();
        let extent = [width, level.height()];
        level.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            row.iter_mut().enumerate().for_each(|(x, sum)| *sum += interpolated(&result, extent, [x, y]));
        });
        result = level;
    }
    Some(result)
}

/// `[Y, Y²/W]` of a texel, luminance by its scale.
fn statistics_of(sum: Vec4, inverse_scale: f32) -> Vec2 {
    let y = sum.y * inverse_scale;
    let square = if sum.w > 0.0 { (y * (y / sum.w)).min(LARGEST) } else { 0.0 };
    Vec2::new(y, square)
}

/// Upper bound of squares, so that their sums are finite.
const LARGEST: f32 = 1e34;

/// z² of the gradient of luminance at a texel of a level, whose texels have this `area` in texels of level 0.
fn edge(level: &Grid<Vec2>, at: [usize; 2], area: f32) -> f32 {
    let size = [level.width(), level.height()];
    let texel = |i, j| level.at(beside(at[0], i, size[0]), beside(at[1], j, size[1]));
    let rows: [[Vec2; 3]; 3] = std::array::from_fn(|j| std::array::from_fn(|i| texel(i, j)));
    (0..2).fold(0.0, |sum, axis| {
        let (mut gradient, mut squares) = (0.0, 0.0);
        for (k, weight) in ACROSS.into_iter().enumerate() {
            let (before, after) = if axis == 0 { (rows[k][0], rows[k][2]) } else { (rows[0][k], rows[2][k]) };
            gradient += (after.x - before.x) * weight;
            squares += (before.y + after.y) * (weight * weight);
        }
        if squares > 0.0 { sum + gradient * (gradient / squares) * area } else { sum }
    })
}

/// Index of the texel `k − 1` after texel `i`, clamped to the ends.
fn beside(i: usize, k: usize, size: usize) -> usize {
    (i + k).saturating_sub(1).min(size - 1)
}

/// Share of the light that a `level` of this extent keeps at a texel: as the density at the coarser level asks for, or all of it at an edge
/// there.
fn share(coarse: &Grid<Vec2>, edges: &Grid<f32>, extent: [usize; 2], at: [usize; 2], level: usize) -> f32 {
    let around = interpolated(coarse, extent, at);
    let density = if around.y > 0.0 { around.x * (around.x / around.y) } else { 0.0 };
    let wanted = 0.5 * (SAMPLES.log2() - RATE * density.log2());
    let by_density = (1.0 + level as f32 - wanted).clamp(0.0, 1.0);
    let mut largest = 0.0f32;
    for j in 0..3 {
        let row = edges.row(beside(at[1] / 2, j, edges.height()));
        for i in 0..3 {
            largest = largest.max(row[beside(at[0] / 2, i, edges.width())]);
        }
    }
    by_density.max(((largest - EDGE[0]) / (EDGE[1] - EDGE[0])).clamp(0.0, 1.0))
}

/// `U`: a level at texel `at` of the next finer one, which has this extent.
fn interpolated<T>(coarse: &Grid<T>, extent: [usize; 2], at: [usize; 2]) -> T
where
    T: Copy + Default + Add<Output = T> + Mul<f32, Output = T>,
{
    let [(x0, wx), (y0, wy)] = [0, 1].map(|i| interpolation(extent[i], at[i]));
    let mut sum = T::default();
    for (j, wy) in wy.into_iter().enumerate() {
        let row = coarse.row(beside(y0, j, coarse.height()));
        let texel = |k| row[beside(x0, k, coarse.width())];
        sum = sum + (texel(0) * wx[0] + texel(1) * wx[1] + texel(2) * wx[2]) * wy;
    }
    sum
}

/// A grid of the size of `like`, of the values at `[x, y]`.
fn map<T, U>(like: &Grid<T>, value: impl Fn([usize; 2]) -> U + Sync) -> Option<Grid<U>>
where
    T: Copy + Sync,
    U: Copy + Default + Send,
{
    let width = like.width();
    let mut grid = Grid::try_filled(width, like.height(), U::default())?;
    grid.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        row.iter_mut().enumerate().for_each(|(x, out)| *out = value([x, y]));
    });
    Some(grid)
}

/// Weights of `U = B·Dᵀ·m/n` along one axis: for texel `j` of `m` fine ones the texels `i − 1`, `i` and `i + 1` of the `n = ⌊m/2⌋` coarse ones
/// (1 of 1), clamped to the ends; returns `i` and the weights, which sum to 1.
pub fn interpolation(m: usize, j: usize) -> (usize, [f32; 3]) {
    let (i, n) = (j / 2, (m / 2) as f32);
    let left = i as f32;
    match (m, j % 2) {
        (1, _) => (0, [0.0, 1.0, 0.0]),
        (_, 0) if m.is_multiple_of(2) => (i, [0.25, 0.75, 0.0]),
        (..) if m.is_multiple_of(2) => (i, [0.0, 0.75, 0.25]),
        (_, 0) => (i, [0.25 + 0.5 * left / n, 0.25 + 0.5 * (n - left) / n, 0.0]),
        (..) => (i, [0.25 * left / n, 0.5 + 0.25 * (n + 1.0) / n, 0.25 * (n - left - 1.0) / n]),
    }
}
