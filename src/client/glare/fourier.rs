//! The discrete Fourier transform behind the convolution: lengths, orders, and the spectrum of a kernel.
//!
//! A picture of `n` pixels along an axis is convolved without wrap-around in a transform of length `2m ≥ 2n − 1`. Half
//! of its input is zero, so it falls apart into two of length `m`: the even frequencies are the transform of `x_j`, the
//! odd ones that of `x_j e^(−πij/m)`.

use std::sync::Arc;

use rayon::prelude::*;
use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlanner};

use crate::client::glare::kernel::GlareKernel;

/// The transform along one axis.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FourierAxis {
    /// Pixels of the picture.
    pub pixels: usize,
    /// Length `m` of each half of the transform: at least `pixels`, a product of 2, 3 and 5.
    pub half: usize,
    /// Radices in the order of the stages, their product is `half`.
    pub radices: Vec<u32>,
}

impl FourierAxis {
    /// The shortest transform for this many pixels, at least 1.
    pub fn new(pixels: usize) -> Self {
        let lengths = [1, 3, 5, 9, 15].map(|odd| odd * pixels.div_ceil(odd).next_power_of_two());
        let half = lengths.into_iter().min().unwrap_or(pixels);
        let mut radices = Vec::new();
        let mut rest = half;
        for radix in [3, 3, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 2] {
            if rest % radix == 0 {
                radices.push(radix as u32);
                rest /= radix;
            }
        }
        debug_assert_eq!(rest, 1);
        Self { pixels, half, radices }
    }

    /// Length of the whole transform.
    pub fn length(&self) -> usize {
        2 * self.half
    }

    /// `e^(−2πik/length)` for `k = 0 … length − 1`, as real and imaginary part.
    pub fn twiddles(&self) -> Vec<[f32; 2]> {
        let step = -std::f64::consts::TAU / self.length() as f64;
        (0..self.length()).map(|k| (step * k as f64).sin_cos()).map(|(s, c)| [c as f32, s as f32]).collect()
    }

    /// The frequency that lies at each place after the stages ran in place, each leaving output `s` of its butterflies
    /// in part `s` of its span: the first digit of the place is the last of the frequency.
    pub fn frequencies(&self) -> Vec<u32> {
        let frequency = |place: usize| {
            let (mut span, mut rest, mut unit, mut frequency) = (self.half, place, 1, 0);
            for radix in &self.radices {
                span /= *radix as usize;
                frequency += unit * (rest / span);
                rest %= span;
                unit *= *radix as usize;
            }
            frequency as u32
        };
        (0..self.half).map(frequency).collect()
    }
}

/// The spectrum of a kernel, divided by the number of values of the transform that brings the product back.
///
/// It is real and even, so the frequencies `0 ..= half` of either axis are kept: `[plane][kx][ky]`, with one plane
/// where all channels are equal and three otherwise. `None` without memory for it.
pub fn spectrum(kernel: &GlareKernel, [across, down]: [&FourierAxis; 2]) -> Option<Vec<f32>> {
    let planes = if kernel.chromatic { 3 } else { 1 };
    let (columns, rows) = (across.half + 1, down.half + 1);
    let mut planner = FftPlanner::new();
    let [fft_x, fft_y] = [across, down].map(|axis| planner.plan_fft_forward(axis.length()));
    let mut by_row = zeros(columns * kernel.quadrant.height())?;
    let mut result = zeros(planes * columns * rows)?;
    let scale = 1.0 / (across.length() as f32 * down.length() as f32);
    for (plane, result) in result.chunks_exact_mut(columns * rows).enumerate() {
        let value = |x: usize, y: usize| kernel.quadrant.at(x, y)[plane];
        even_pairs(&mut by_row, columns, across.pixels, &fft_x, value);
        let value = |y: usize, kx: usize| by_row[y * columns + kx] * scale;
        even_pairs(result, rows, down.pixels, &fft_y, value);
    }
    Some(result)
}

/// Transforms many even sequences, given by `value(place, sequence)` for the places `0 .. pixels`; the frequencies of
/// each, `count` of them, lie one after the other in `out`. Two at a time: the transforms are real, so one is the real
/// part and the other the imaginary part.
fn even_pairs(
    out: &mut [f32],
    count: usize,
    pixels: usize,
    fft: &Arc<dyn Fft<f32>>,
    value: impl Fn(usize, usize) -> f32 + Sync,
) {
    let length = fft.len();
    let buffers = || (vec![Complex32::ZERO; length], vec![Complex32::ZERO; fft.get_inplace_scratch_len()]);
    out.par_chunks_mut(2 * count).enumerate().for_each_init(buffers, |(line, scratch), (pair, out)| {
        line.fill(Complex32::ZERO);
        let two = out.len() > count;
        for i in 0..pixels {
            let other = if two { value(i, 2 * pair + 1) } else { 0.0 };
            line[i] = Complex32::new(value(i, 2 * pair), other);
            line[(length - i) % length] = line[i];
        }
        fft.process_with_scratch(line, scratch);
        for (k, out) in out.iter_mut().enumerate() {
            *out = if k < count { line[k].re } else { line[k - count].im };
        }
    });
}

/// Zeros, or `None` when the memory is not to be had.
pub fn zeros<T: Clone + Default>(len: usize) -> Option<Vec<T>> {
    let mut data = Vec::new();
    data.try_reserve_exact(len).ok()?;
    data.resize(len, T::default());
    Some(data)
}
