//! The windowed Gaussian of the reconstruction on one mip level (paper §4.3): [`gaussian`] is the paper's, in lanes;
//! [`windowed_gaussian`] has any radius and window, to compare it with.
//!
//! `exp(−σd²)·(1 − smoothstep(0, R, d)^E)` over the 5×5 texels within R = 2.5 per axis. The exponential
//! is separable and comes from a polynomial, so that a row of weights is computed in lanes. From σ = 4 on
//! (level 0 well below LoD 0) the window does not matter, and is left out: weights
//! differ by 4e-6 of the peak at most, a texel's share of the mean by 4e-5.

use std::ops::Range;

use glam::Vec4;

use crate::client::filter::RECONSTRUCTION_RADIUS;
use crate::client::settings::ReconstructionKernel;
use crate::image::Grid;

/// Taps along one axis: texel centres within `R` on both sides.
pub const TAPS: usize = 5;

/// Taps rounded up to whole vector registers.
const LANES: usize = 8;

/// From this `σ` on the narrow kernel is used.
pub const NARROW_SIGMA: f32 = 4.0;

/// `Σ g T / Σ g` of one level at `p`, in texels of that level; texels outside do not count.
#[inline]
pub fn gaussian(level: &Grid<Vec4>, p: [f32; 2], sigma: f32) -> Vec4 {
    if sigma >= NARROW_SIGMA { narrow(level, p, sigma) } else { wide(level, p, sigma) }
}

/// The kernel without its window, separable, for σ ≥ 4.
fn narrow(level: &Grid<Vec4>, p: [f32; 2], sigma: f32) -> Vec4 {
    let (x0, y0) = (first_tap(p[0]), first_tap(p[1]));
    let (columns, rows) = (inside(x0, level.width()), inside(y0, level.height()));
    let mut gx = exponentials(&squared_distances(x0, p[0]), sigma);
    let gy = exponentials(&squared_distances(y0, p[1]), sigma);
    gx[..columns.start].fill(0.0);
    gx[columns.end..].fill(0.0);

    let (mut sum, mut down) = (Vec4::ZERO, 0.0);
    for k in rows {
        let row = level.row((y0 + k as i32) as usize);
        let mut across = Vec4::ZERO;
        if columns.len() == TAPS {
            let taps = &row[x0 as usize..][..TAPS];
            across +=
                (taps[0] * gx[0] + taps[1] * gx[1]) + (taps[2] * gx[2] + taps[3] * gx[3]) + taps[4] * gx[4];
        } else {
            for i in columns.clone() {
                across += row[(x0 + i as i32) as usize] * gx[i];
            }
        }
        sum += across * gy[k];
        down += gy[k];
    }
    let across = (gx[0] + gx[1]) + (gx[2] + gx[3]) + gx[4];
    sum * (across * down).recip()
}

/// The windowed kernel over 5×5 texels.
fn wide(level: &Grid<Vec4>, p: [f32; 2], sigma: f32) -> Vec4 {
    let (x0, y0) = (first_tap(p[0]), first_tap(p[1]));
    let (columns, rows) = (inside(x0, level.width()), inside(y0, level.height()));
    let (dx2, dy2) = (squared_distances(x0, p[0]), squared_distances(y0, p[1]));
    let (mut gx, gy) = (exponentials(&dx2, sigma), exponentials(&dy2, sigma));
    gx[..columns.start].fill(0.0);
    gx[columns.end..].fill(0.0);

    // Sums of even and odd columns and of each lane: short chains of additions, the same on every machine.
    let (mut even, mut odd, mut totals) = (Vec4::ZERO, Vec4::ZERO, [0.0; LANES]);
    for k in rows {
        let weights = row_weights(&dx2, dy2[k], &gx, gy[k]);
        for (total, weight) in totals.iter_mut().zip(&weights) {
            *total += weight;
        }
        let row = level.row((y0 + k as i32) as usize);
        if columns.len() == TAPS {
            let taps = &row[x0 as usize..][..TAPS];
            even += taps[0] * weights[0] + taps[2] * weights[2] + taps[4] * weights[4];
            odd += taps[1] * weights[1] + taps[3] * weights[3];
        } else {
            for i in columns.clone() {
                even += row[(x0 + i as i32) as usize] * weights[i];
            }
        }
    }
    let total: f32 = totals[..TAPS].iter().sum();
    (even + odd) * total.recip()
}

/// First texel whose centre is within `R` of `p`: `ceil(p − R − 0.5)`.
#[inline]
fn first_tap(p: f32) -> i32 {
    let q = p - (RECONSTRUCTION_RADIUS + 0.5);
    let i = q as i32;
    i + i32::from((i as f32) < q)
}

/// The taps `first ..` that lie within `0..size`.
#[inline]
fn inside(first: i32, size: usize) -> Range<usize> {
    let skip = (-first).clamp(0, TAPS as i32);
    let keep = (size as i64 - i64::from(first)).clamp(i64::from(skip), TAPS as i64);
    skip as usize..keep as usize
}

#[inline]
fn squared_distances(first: i32, p: f32) -> [f32; LANES] {
    // Plain loops: the compiler makes vectors of them, which it does not always of `array::from_fn`.
    let mut d2 = [0.0; LANES];
    for (k, d2) in d2.iter_mut().enumerate() {
        let d = (first + k as i32) as f32 + 0.5 - p;
        *d2 = d * d;
    }
    d2
}

/// `exp(−σ d²)` in every lane.
#[inline]
fn exponentials(d2: &[f32; LANES], sigma: f32) -> [f32; LANES] {
    let scale = -sigma * std::f32::consts::LOG2_E;
    let mut g = [0.0; LANES];
    for (g, d2) in g.iter_mut().zip(d2) {
        *g = exp2(d2 * scale);
    }
    g
}

/// One row of weights at squared row distance `dy2`.
#[inline]
fn row_weights(dx2: &[f32; LANES], dy2: f32, gx: &[f32; LANES], gy: f32) -> [f32; LANES] {
    const INVERSE_R2: f32 = 1.0 / (RECONSTRUCTION_RADIUS * RECONSTRUCTION_RADIUS);
    std::array::from_fn(|k| {
        let u = (dx2[k] + dy2) * INVERSE_R2;
        let u = if u < 1.0 { u } else { 1.0 };
        let step = u * (3.0 - 2.0 * u.sqrt()); // smoothstep of √u
        let s2 = step * step;
        let s4 = s2 * s2;
        (1.0 - s4 * s4) * (gx[k] * gy)
    })
}

/// `2^x` for `x ≤ 0`, relative error below 3e-7; 0 is reached as 2^−126.
#[inline]
fn exp2(x: f32) -> f32 {
    // Adding 1.5·2^23 rounds to an integer that stands in the low bits.
    const ROUND: f32 = 12_582_912.0;
    let x = if x > -126.0 { x } else { -126.0 };
    let rounded = x + ROUND;
    let f = x - (rounded - ROUND);
    // Taylor series of 2^f for |f| ≤ 1/2.
    let p = 1.0
        + f * (std::f32::consts::LN_2
            + f * (0.240_226_5
                + f * (0.055_504_11 + f * (0.009_618_129 + f * (0.001_333_355_8 + f * 1.540_353e-4)))));
    f32::from_bits(p.to_bits().wrapping_add(rounded.to_bits() << 23))
}

/// `Σ g w T / Σ g w` of one level at `p`, in texels of that level, over the `2R × 2R` texels around it; texels outside do not
/// count. The same as [`gaussian`] for R = 2.5 and E = 8.
pub fn windowed_gaussian(kernel: ReconstructionKernel, level: &Grid<Vec4>, p: [f32; 2], sigma: f32) -> Vec4 {
    let radius = kernel.radius();
    let first = p.map(|p| (p - radius - 0.5).ceil() as i32);
    let (mut sum, mut total) = (Vec4::ZERO, 0.0);
    let taps = |first: i32, size: usize| {
        let inside = first.max(0)..(first + kernel.taps as i32).min(size as i32);
        inside.map(|i| i as usize)
    };
    for y in taps(first[1], level.height()) {
        let dy = y as f32 + 0.5 - p[1];
        for x in taps(first[0], level.width()) {
            let dx = x as f32 + 0.5 - p[0];
            let weight = weight(kernel, dx * dx + dy * dy, sigma);
            sum += level.at(x, y) * weight;
            total += weight;
        }
    }
    sum / total
}

/// `exp(−σd²)` times the window at the squared distance `d2`.
fn weight(kernel: ReconstructionKernel, d2: f32, sigma: f32) -> f32 {
    let gaussian = (-sigma * d2).exp();
    if kernel.exponent == 0 {
        return gaussian;
    }
    let t = (d2.sqrt() / kernel.radius()).min(1.0);
    let step = t * t * (3.0 - 2.0 * t);
    gaussian * (1.0 - step.powi(kernel.exponent as i32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exact(d2: f64, sigma: f64) -> f64 {
        let t = (d2.sqrt() / f64::from(RECONSTRUCTION_RADIUS)).min(1.0);
        (-sigma * d2).exp() * (1.0 - (t * t * (3.0 - 2.0 * t)).powi(8))
    }

    #[test]
    fn weights_follow_the_formula() {
        for step in 0..200 {
            let (px, py) = (7.0 + step as f32 * 0.017, 9.0 + step as f32 * 0.041);
            for sigma in [1.0f32, 2.3, 3.99] {
                let (x0, y0) = (first_tap(px), first_tap(py));
                let (dx2, dy2) = (squared_distances(x0, px), squared_distances(y0, py));
                let (gx, gy) = (exponentials(&dx2, sigma), exponentials(&dy2, sigma));
                for j in 0..TAPS {
                    let row = row_weights(&dx2, dy2[j], &gx, gy[j]);
                    for i in 0..TAPS {
                        let wanted = exact(f64::from(dx2[i]) + f64::from(dy2[j]), f64::from(sigma));
                        assert!((f64::from(row[i]) - wanted).abs() < 1e-6, "σ {sigma} tap {i},{j}");
                    }
                }
                // No texel within R is missed.
                assert!((x0 as f32 - 0.5 - px) < -2.5 && (x0 as f32 + 5.5 - px) >= 2.5);
            }
        }
    }

    /// The mean over a level with one bright texel is that texel's normalised weight: both kernels
    /// are within 4e-5 of the exact one, at every place around it.
    #[test]
    fn both_kernels_are_the_exact_kernel() {
        let (size, centre) = (11, 5);
        let mut level = Grid::try_filled(size, size, Vec4::ZERO).expect("memory");
        level.pixels_mut()[centre * size + centre] = Vec4::ONE;
        for sigma in [1.0f32, 1.7, 3.9, 4.0, 9.0, 16.0] {
            for step in 0..900 {
                let p = [3.0 + (step % 30) as f32 * 0.167, 3.0 + (step / 30) as f32 * 0.167];
                let weight = |x: usize, y: usize| {
                    let d = |p: f32, i: usize| f64::from(i as f32 + 0.5 - p);
                    exact(d(p[0], x).powi(2) + d(p[1], y).powi(2), f64::from(sigma))
                };
                let all: f64 = (0..size * size).map(|i| weight(i % size, i / size)).sum();
                let error = f64::from(gaussian(&level, p, sigma).x) - weight(centre, centre) / all;
                assert!(error.abs() < 4e-5, "σ {sigma} at {p:?}: {error:e}");
            }
        }
    }

    #[test]
    fn constant_stays_constant_to_the_corner() {
        for (w, h) in [(1, 1), (3, 2), (9, 9)] {
            let level = Grid::try_filled(w, h, Vec4::splat(0.7)).expect("memory");
            for i in 0..50 {
                let t = i as f32 / 49.0;
                let mean = gaussian(&level, [t * w as f32, t * t * h as f32], 4.0);
                assert!((mean - Vec4::splat(0.7)).abs().max_element() < 2e-7, "{w}×{h} at {t}: {mean}");
            }
        }
    }

    fn noise() -> Grid<Vec4> {
        let texel = |i: u32| Vec4::splat((i.wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0);
        Grid::from_rows(12, 9, (0..108).map(texel).collect()).expect("12×9 texels")
    }

    /// Also at the corners, where taps are left out.
    #[test]
    fn the_paper_s_kernel_is_one_of_them() {
        let level = noise();
        for i in 0..300 {
            let p = [(i % 20) as f32 * 0.63, (i / 20) as f32 * 0.64];
            for sigma in [1.0, 2.5, 3.9] {
                let (a, b) = (
                    windowed_gaussian(ReconstructionKernel::default(), &level, p, sigma),
                    gaussian(&level, p, sigma),
                );
                assert!((a - b).abs().max_element() < 1e-6, "{p:?} σ {sigma}: {a} {b}");
            }
        }
    }

    #[test]
    fn small_ones_see_less() {
        let level = noise();
        let p = [6.5, 4.5];
        let at =
            |taps, exponent| windowed_gaussian(ReconstructionKernel { taps, exponent }, &level, p, 1.0).x;
        let middle = level.at(6, 4).x;
        assert!((at(3, 0) - middle).abs() > 1e-3 && (at(3, 0) - at(5, 0)).abs() > 1e-4);
        // A window that closes early: hardly more than the texel itself.
        assert!((at(3, 1) - middle).abs() < (at(3, 0) - middle).abs());
        // Beyond 2.5 texels a Gaussian of σ = 1 has nothing left.
        assert!((at(8, 0) - at(7, 0)).abs() < 1e-4);
    }
}
