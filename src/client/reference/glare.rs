//! The reference of `glare`: convolution with the eye's point-spread function, in XYZ (paper §4.2, step 5).

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;
use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlanner};

use crate::client::glare::fourier::zeros;
use crate::client::glare::{FourierAxis, GlareKernel, spectrum};
use crate::client::settings::Glare;
use crate::image::Grid;

/// Input is scaled by this, 2⁻³⁰, so that no sum of a transform overflows; output is scaled back. What is below 10⁻²⁹
/// becomes 0.
pub const SCALE: f32 = 1.0 / (1 << 30) as f32;

/// Glare of pictures of one extent; set up anew when extent or settings change.
#[derive(Default)]
pub struct ReferenceGlare {
    made: Option<ReferenceConvolution>,
}

/// Kernel and transforms for pictures of one extent.
struct ReferenceConvolution {
    extent: [usize; 2],
    glare: Glare,
    kernel: GlareKernel,
    axes: [FourierAxis; 2],
    spectrum: Vec<f32>,
}

impl ReferenceGlare {
    /// The picture with glare, or `None` when there is no memory. NaN counts as 0, infinity as the largest number.
    pub fn apply(&mut self, picture: &Grid<Vec3>, glare: &Glare) -> Option<Grid<Vec3>> {
        let extent = [picture.width(), picture.height()];
        if extent.contains(&0) {
            return Some(picture.clone());
        }
        if !self.made.as_ref().is_some_and(|made| made.extent == extent && made.glare == *glare) {
            self.made = None;
            let kernel = GlareKernel::new(extent, glare)?;
            let axes = extent.map(FourierAxis::new);
            let spectrum = spectrum(&kernel, [&axes[0], &axes[1]])?;
            self.made = Some(ReferenceConvolution { extent, glare: *glare, kernel, axes, spectrum });
        }
        self.made.as_ref()?.convolve(picture)
    }
}

impl ReferenceConvolution {
    /// All three channels, one after the other.
    fn convolve(&self, picture: &Grid<Vec3>) -> Option<Grid<Vec3>> {
        let [columns, rows] = [self.axes[0].half + 1, self.axes[1].half + 1];
        let height = picture.height();
        let mut result = Grid::try_filled(picture.width(), height, Vec3::ZERO)?;
        let mut by_row = zeros(2 * columns * height.div_ceil(2))?;
        let mut by_column = zeros(columns * height)?;
        for channel in 0..3 {
            let plane = if self.kernel.chromatic { channel } else { 0 };
            let spectrum = &self.spectrum[plane * columns * rows..][..columns * rows];
            self.rows_forward(picture, channel, &mut by_row);
            self.columns(&by_row, spectrum, &mut by_column);
            self.rows_back(&by_column, channel, &mut result);
        }
        Some(result)
    }

    /// Transforms pairs of rows, one as the real and the other as the imaginary part: `[y][kx]`.
    fn rows_forward(&self, picture: &Grid<Vec3>, channel: usize, by_row: &mut [Complex32]) {
        let (length, columns) = (self.axes[0].length(), self.axes[0].half + 1);
        let fft = FftPlanner::new().plan_fft_forward(length);
        let value = |x: usize, y: usize| {
            let v = if y < picture.height() { picture.at(x, y)[channel] } else { 0.0 };
            let v = if v.is_nan() { 0.0 } else { v.clamp(f32::MIN, f32::MAX) };
            let gain = self.kernel.gain_at(x, y.min(picture.height() - 1))[channel];
            v * SCALE * gain
        };
        by_row.par_chunks_mut(2 * columns).enumerate().for_each_init(
            || FftLine::new(&fft),
            |line, (pair, out)| {
                line.fill(picture.width(), |x| Complex32::new(value(x, 2 * pair), value(x, 2 * pair + 1)));
                line.run(&fft);
                for k in 0..columns {
                    let (a, b) = (line.data[k], line.data[(length - k) % length].conj());
                    out[k] = (a + b) * 0.5;
                    out[columns + k] = (a - b) * Complex32::new(0.0, -0.5);
                }
            },
        );
    }

    /// Convolves along columns: `[kx][y]`.
    fn columns(&self, by_row: &[Complex32], spectrum: &[f32], by_column: &mut [Complex32]) {
        let (length, rows) = (self.axes[1].length(), self.axes[1].half + 1);
        let (columns, height) = (self.axes[0].half + 1, self.axes[1].pixels);
        let mut planner = FftPlanner::new();
        let (forward, back) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
        by_column.par_chunks_mut(height).enumerate().for_each_init(
            || FftLine::new(&forward),
            |line, (kx, out)| {
                line.fill(height, |y| by_row[y * columns + kx]);
                line.run(&forward);
                for (ky, value) in line.data.iter_mut().enumerate() {
                    *value *= spectrum[kx * rows + ky.min(length - ky)];
                }
                line.run(&back);
                out.copy_from_slice(&line.data[..height]);
            },
        );
    }

    /// Transforms pairs of rows back into the picture.
    fn rows_back(&self, by_column: &[Complex32], channel: usize, result: &mut Grid<Vec3>) {
        let (length, half, height) = (self.axes[0].length(), self.axes[0].half, self.axes[1].pixels);
        let fft = FftPlanner::new().plan_fft_inverse(length);
        let width = result.width();
        result.pixels_mut().par_chunks_mut(2 * width).enumerate().for_each_init(
            || FftLine::new(&fft),
            |line, (pair, out)| {
                let at = |kx: usize, y: usize| {
                    if y < height { by_column[kx * height + y] } else { Complex32::ZERO }
                };
                line.fill(length, |k| {
                    let read = |y| if k <= half { at(k, y) } else { at(length - k, y).conj() };
                    read(2 * pair) + Complex32::I * read(2 * pair + 1)
                });
                line.run(&fft);
                let limit = |v: f32| (v / SCALE).clamp(f32::MIN, f32::MAX);
                for (i, out) in out.iter_mut().enumerate() {
                    out[channel] = limit(if i < width { line.data[i].re } else { line.data[i - width].im });
                }
            },
        );
    }
}

/// A line to be transformed in place.
struct FftLine {
    data: Vec<Complex32>,
    scratch: Vec<Complex32>,
}

impl FftLine {
    fn new(fft: &Arc<dyn Fft<f32>>) -> Self {
        let scratch = vec![Complex32::ZERO; fft.get_inplace_scratch_len()];
        Self { data: vec![Complex32::ZERO; fft.len()], scratch }
    }

    /// Sets the first `count` values, zeros after them.
    fn fill(&mut self, count: usize, value: impl Fn(usize) -> Complex32) {
        self.data[..count].iter_mut().enumerate().for_each(|(i, v)| *v = value(i));
        self.data[count..].fill(Complex32::ZERO);
    }

    /// Scratch was made for a transform of this length; another direction may want more of it.
    fn run(&mut self, fft: &Arc<dyn Fft<f32>>) {
        self.scratch.resize(self.scratch.len().max(fft.get_inplace_scratch_len()), Complex32::ZERO);
        fft.process_with_scratch(&mut self.data, &mut self.scratch);
    }
}
