//! The reference of `bilateral`: noise masking that preserves features (paper §4.2, bilateral filtering guided by the variance).
//!
//! Three stages of 5×5 texels, 1, 2 and 4 apart (the à-trous scheme; Dammertz et al. 2010). The weight of a neighbour
//! falls with the number of standard errors between it and the centre; each stage passes the remaining error on. The
//! (fractional) number of stages of a texel is the number of levels by which low-pass masking would raise its blur.

use glam::{Vec3, Vec4, Vec4Swizzles};
use rayon::prelude::*;

use crate::client::lod::{LUMINANCE_FLOOR, StreamLod};
use crate::client::reference::reconstruct::{ReconstructParameters, StreamView};
use crate::image::Grid;

/// Number of stages.
pub const STAGES: u32 = 3;

/// Twice the square of the number of standard errors at which a neighbour counts 60 %.
const TOLERANCE: f32 = 8.0;

/// Squared difference that always passes, in units of the luminance scale.
const LEAST_ERROR: f32 = 1e-6;

/// Binomial coefficients: a spline.
const TAPS: [f32; 5] = [1.0 / 16.0, 4.0 / 16.0, 6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0];

/// Sums of level 0 with noise averaged; `None` if memory runs out, or if the stream has no variance.
pub fn bilateral(p: &ReconstructParameters, stream: &StreamView<'_>) -> Option<Grid<Vec4>> {
    stream.variance?;
    let (width, height) = (stream.color[0].width(), stream.color[0].height());
    let mut known = Grid::try_filled(width, height, [0.0; 2])?;
    known.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        row.iter_mut().enumerate().for_each(|(x, out)| *out = error_and_level(p, stream, [x, y]));
    });
    let mut sums = Grid::try_filled(width, height, Vec4::ZERO)?;
    sums.pixels_mut().copy_from_slice(stream.color[0].pixels());
    for stage in 0..STAGES {
        let mut next = Grid::try_filled(width, height, Vec4::ZERO)?;
        let mut next_known = Grid::try_filled(width, height, [0.0; 2])?;
        let rows = next.pixels_mut().par_chunks_mut(width).zip(next_known.pixels_mut().par_chunks_mut(width));
        let input = BilateralStage {
            sums: &sums,
            known: &known,
            stage,
            summed: stream.summed,
            scale: p.luminance_scale,
        };
        rows.enumerate().for_each(|(y, (row, row_known))| {
            for (x, (out, out_known)) in row.iter_mut().zip(row_known).enumerate() {
                (*out, *out_known) = input.texel(x, y);
            }
        });
        (sums, known) = (next, next_known);
    }
    Some(sums)
}

/// Squared standard error of a texel's displayed value, in units of the luminance scale, and the additional levels of blur it requires.
fn error_and_level(p: &ReconstructParameters, stream: &StreamView<'_>, at: [usize; 2]) -> [f32; 2] {
    let extent = p.spec.padded_extent();
    let uv = [0, 1].map(|i| (at[i] as f32 + 0.5) / extent[i] as f32);
    let (color, r) = stream.relative_variance(p, uv, 0.0).unwrap_or_default();
    let lod = StreamLod { base: 0.0, ..stream.lod };
    let y = if color.w > 0.0 { color.y / color.w / p.luminance_scale } else { 0.0 };
    let error = r * (y * y + LUMINANCE_FLOOR * LUMINANCE_FLOOR);
    [if stream.summed { error * color.w * color.w } else { error }, lod.masked(r, p.vm)]
}

/// The inputs of one stage.
struct BilateralStage<'a> {
    sums: &'a Grid<Vec4>,
    /// Squared error, levels of blur.
    known: &'a Grid<[f32; 2]>,
    stage: u32,
    summed: bool,
    scale: f32,
}

impl BilateralStage<'_> {
    /// The displayed value of a texel, in units of the luminance scale.
    fn shown(&self, sum: Vec4) -> Vec3 {
        match self.summed {
            true => sum.xyz() / self.scale,
            false if sum.w > 0.0 => sum.xyz() / sum.w / self.scale,
            false => Vec3::ZERO,
        }
    }

    fn texel(&self, x: usize, y: usize) -> (Vec4, [f32; 2]) {
        let (here, [error, level]) = (self.sums.at(x, y), self.known.at(x, y));
        let strength = (level - self.stage as f32).clamp(0.0, 1.0);
        if strength <= 0.0 {
            return (here, [error, level]);
        }
        let value = self.shown(here);
        let inside = |at: usize, k: usize, size: usize| {
            let at = at as i64 + ((k as i64 - 2) << self.stage);
            (0..size as i64).contains(&at).then_some(at as usize)
        };
        let (mut total, mut weights, mut errors) = (Vec4::ZERO, 0.0, 0.0);
        for (ky, tap_y) in TAPS.into_iter().enumerate() {
            let Some(ty) = inside(y, ky, self.sums.height()) else { continue };
            for (kx, tap_x) in TAPS.into_iter().enumerate() {
                let Some(tx) = inside(x, kx, self.sums.width()) else { continue };
                let (there, [error_there, _]) = (self.sums.at(tx, ty), self.known.at(tx, ty));
                let d = self.shown(there) - value;
                // Difference in luminance, and in chromaticity at a quarter of the weight.
                let d2 = d.y * d.y + 0.25 * ((d.x - d.y).powi(2) + (d.z - d.y).powi(2));
                let mut w = tap_x * tap_y;
                // A texel without samples has no value: it accepts all neighbours, and contributes to none.
                if self.summed || (here.w > 0.0 && there.w > 0.0) {
                    w *= (-d2 / (TOLERANCE * (error + error_there + LEAST_ERROR))).exp();
                }
                // False for NaN, which results from overflow.
                if w > 0.0 {
                    total += there * w;
                    weights += w;
                    errors += w * w * error_there;
                }
            }
        }
        if weights > 0.0 {
            let deviation = error.sqrt() + (errors.sqrt() / weights - error.sqrt()) * strength;
            (here.lerp(total / weights, strength), [deviation * deviation, level])
        } else {
            (here, [error, level])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One stage over values and squared errors of X, Y and Z in a 5×5 neighbourhood; returns value and error of its centre.
    fn centre(value: impl Fn(usize) -> f32, error: impl Fn(usize) -> f32) -> (f32, f32) {
        let grid = |at: &dyn Fn(usize) -> [f32; 2]| {
            let mut grid = Grid::try_filled(5, 5, [0.0; 2]).expect("memory");
            grid.pixels_mut().iter_mut().enumerate().for_each(|(i, out)| *out = at(i));
            grid
        };
        let known = grid(&|i| [error(i), 1.0]);
        let mut sums = Grid::try_filled(5, 5, Vec4::ONE).expect("memory");
        sums.pixels_mut()
            .iter_mut()
            .enumerate()
            .for_each(|(i, out)| *out = Vec3::splat(value(i)).extend(1.0));
        let stage = BilateralStage { sums: &sums, known: &known, stage: 0, summed: false, scale: 1.0 };
        let (sum, [error, _]) = stage.texel(2, 2);
        (sum.y / sum.w, error)
    }

    /// Among equal values the weights are the taps, and variances add up by their squares.
    #[test]
    fn means_have_the_error_of_means() {
        let (value, error) = centre(|_| 3.0, |_| 0.5);
        let squares: f32 = TAPS.iter().map(|tap| tap * tap).sum();
        assert!(
            (value - 3.0).abs() < 1e-6 && (error / (0.5 * squares * squares) - 1.0).abs() < 1e-5,
            "{value} {error}"
        );
    }

    /// A neighbour is judged by both errors: noise in either of the two pixels explains a difference.
    #[test]
    fn neighbours_count_by_both_errors() {
        let neighbour = 7;
        for (own, other) in [(0.1, 0.3), (0.3, 0.1), (0.2, 0.2), (1e-9, 0.4)] {
            let (value, _) = centre(
                |i| if i == neighbour { 2.0 } else { 1.0 },
                |i| if i == neighbour { other } else { own },
            );
            let tap = TAPS[1] * TAPS[2] * (-1.0 / (TOLERANCE * (own + other + LEAST_ERROR))).exp();
            let expected = 1.0 + tap / (1.0 - TAPS[1] * TAPS[2] + tap);
            assert!((value - expected).abs() < 1e-6, "{own} {other}: {value} instead of {expected}");
        }
    }

    /// Differences below visibility pass even between values without error.
    #[test]
    fn invisible_differences_pass() {
        let (value, _) = centre(|i| if i == 7 { 1.001 } else { 1.0 }, |_| 0.0);
        let tap = TAPS[1] * TAPS[2] * (-1e-6 / (TOLERANCE * LEAST_ERROR)).exp();
        let expected = 1e-3 * tap / (1.0 - TAPS[1] * TAPS[2] + tap);
        assert!((value - 1.0 - expected).abs() < 2e-7, "{value}: more by {expected} expected");
    }

    /// If values overflow no neighbour gets a weight, and the texel stays unchanged.
    #[test]
    fn nothing_comes_from_no_neighbours() {
        let (value, error) = centre(|_| f32::INFINITY, |_| 0.5);
        assert!(value == f32::INFINITY && error == 0.5, "{value} {error}");
    }
}
