//! The four images of one stream (paper §4.2), each as two floats, and the passes that feed them.
//!
//! A band goes through splat, fold, variance splat and variance fold while its texels are in the cache;
//! texels depend on nothing outside their band, so the result is that of whole-image passes.

use glam::Vec4;
use rayon::prelude::*;

use crate::client::error::ClientError;
use crate::client::reference::exact::ExactTexel;
use crate::client::reference::fold::fold;
use crate::client::reference::splat::{BAND_ROWS, Band, Bins, Sprite, splat_color};
use crate::client::reference::variance::{Means, VarianceParameters, splat_variance};
use crate::client::settings::{FilmSpec, Summation};
use crate::image::Grid;

/// Sums of one stream over the padded film.
pub struct Accumulator {
    width: usize,
    hi: Vec<Vec4>,
    lo: Vec<Vec4>,
    /// Empty where no variance is kept.
    variance_hi: Vec<f32>,
    variance_lo: Vec<f32>,
}

/// Buffers that a thread reuses from band to band.
#[derive(Default)]
struct BandScratch {
    color: Vec<Vec4>,
    variance: Vec<f32>,
    means: Means,
}

impl BandScratch {
    /// Splats and folds the colour of a band.
    fn add_color(
        &mut self,
        p: VarianceParameters,
        band: Band,
        sprites: &[Sprite],
        hi: &mut [Vec4],
        lo: &mut [Vec4],
    ) {
        for part in sprites.chunks(p.samples_per_sum) {
            reset(&mut self.color, hi.len(), Vec4::ZERO);
            splat_color(p.filter, band, part, &mut self.color);
            fold(p.sums, hi, lo, &self.color);
        }
    }
}

impl Accumulator {
    /// Images of zeros.
    ///
    /// # Errors
    /// [`ClientError::Memory`] when they do not fit.
    pub fn new(spec: &FilmSpec) -> Result<Self, ClientError> {
        let [width, height] = spec.padded_extent().map(|n| n as usize);
        let no_memory = || Self::out_of_memory("the film", spec);
        let colors =
            || Grid::try_filled(width, height, Vec4::ZERO).map(Grid::into_pixels).ok_or_else(no_memory);
        let floats = || match spec.variance {
            Some(_) => Grid::try_filled(width, height, 0.0).map(Grid::into_pixels).ok_or_else(no_memory),
            None => Ok(Vec::new()),
        };
        Ok(Self { width, hi: colors()?, lo: colors()?, variance_hi: floats()?, variance_lo: floats()? })
    }

    /// The error for images of this film's size that did not fit.
    pub fn out_of_memory(what: &'static str, spec: &FilmSpec) -> ClientError {
        let [width, height] = spec.padded_extent().map(u64::from);
        let bytes_per_texel = 2 * (size_of::<Vec4>() + size_of::<f32>()) as u64;
        ClientError::Memory { what, bytes: width * height * bytes_per_texel }
    }

    /// What [exact sums](ExactTexel) come to, with colours in units of `luminance_scale`; runs in the current thread pool. To be read only:
    /// nothing can be added to it. `None` without memory.
    pub fn rounded(sums: &Grid<ExactTexel>, luminance_scale: f32) -> Option<Self> {
        let (width, height) = (sums.width(), sums.height());
        let mut hi = Grid::try_filled(width, height, Vec4::ZERO)?.into_pixels();
        let mut variance_hi = Grid::try_filled(width, height, 0.0)?.into_pixels();
        let texels = hi.par_iter_mut().zip(&mut variance_hi).zip(sums.pixels());
        texels.for_each(|((color, variance), [x, y, z, w, squares])| {
            let [sx, sy, sz] = [x, y, z].map(|sum| sum.to_f32() * luminance_scale);
            *color = Vec4::new(sx, sy, sz, w.to_f32());
            let (y, w) = (y.to_f64(), w.to_f64());
            let spread = if w > 0.0 { squares.to_f64() - y * y / w } else { 0.0 };
            *variance = spread.max(0.0) as f32;
        });
        Some(Self { width, hi, lo: Vec::new(), variance_hi, variance_lo: Vec::new() })
    }

    /// Sets all sums to zero; runs in the current thread pool.
    pub fn clear(&mut self) {
        let texels = self.width * BAND_ROWS;
        for sums in [&mut self.hi, &mut self.lo] {
            sums.par_chunks_mut(texels).for_each(|band| band.fill(Vec4::ZERO));
        }
        for sums in [&mut self.variance_hi, &mut self.variance_lo] {
            sums.par_chunks_mut(texels).for_each(|band| band.fill(0.0));
        }
    }

    /// Adds one batch, for the colour as it is in `colors`; runs in the current thread pool.
    pub fn add_batch(&mut self, p: VarianceParameters, bins: &Bins, colors: &Bins) {
        let (width, texels) = (self.width, self.width * BAND_ROWS);
        let color = self.hi.par_chunks_mut(texels).zip(self.lo.par_chunks_mut(texels));
        let band =
            |i: usize, rows: &[Vec4]| Band { first_row: i * BAND_ROWS, rows: rows.len() / width, width };
        if self.variance_hi.is_empty() {
            color.enumerate().for_each_init(BandScratch::default, |scratch, (i, (hi, lo))| {
                scratch.add_color(p, band(i, hi), colors.band(i), hi, lo);
            });
            return;
        }
        let variance = self.variance_hi.par_chunks_mut(texels).zip(self.variance_lo.par_chunks_mut(texels));
        color.zip(variance).enumerate().for_each_init(
            BandScratch::default,
            |scratch, (i, ((hi, lo), (variance_hi, variance_lo)))| {
                let (band, sprites) = (band(i, hi), bins.band(i));
                if sprites.is_empty() {
                    return;
                }
                scratch.means.set_old(hi, lo);
                scratch.add_color(p, band, colors.band(i), hi, lo);
                scratch.means.set_new(hi, lo);
                for part in sprites.chunks(p.samples_per_sum) {
                    reset(&mut scratch.variance, hi.len(), 0.0);
                    splat_variance(p, band, part, &scratch.means, &mut scratch.variance);
                    fold(Summation::TwoFloat, variance_hi, variance_lo, &scratch.variance);
                }
            },
        );
    }

    /// A copy of the rounded sums, level 0 of the mips; `None` without memory.
    pub fn color(&self, spec: &FilmSpec) -> Option<Grid<Vec4>> {
        copy(&self.hi, spec)
    }

    /// A copy of the rounded variance sums; `None` without memory.
    pub fn variance(&self, spec: &FilmSpec) -> Option<Grid<f32>> {
        copy(&self.variance_hi, spec)
    }

    /// The rounded sums, row by row of the padded film.
    pub fn color_sums(&self) -> &[Vec4] {
        &self.hi
    }

    /// The rounded variance sums, row by row of the padded film; empty where none are kept.
    pub fn variance_sums(&self) -> &[f32] {
        &self.variance_hi
    }

    /// The rounded sums without the outermost `pad` texels on every side, row by row.
    pub fn color_rows(&self, pad: u32) -> Vec<[f32; 4]> {
        self.crop(&self.hi, pad).map(|v| v.to_array()).collect()
    }

    /// The same of the variance.
    pub fn variance_rows(&self, pad: u32) -> Vec<f32> {
        self.crop(&self.variance_hi, pad).collect()
    }

    fn crop<'a, T: Copy>(&self, from: &'a [T], pad: u32) -> impl Iterator<Item = T> + 'a {
        let (pad, width) = (pad as usize, self.width);
        let height = from.len() / width;
        let rows = from.chunks_exact(width).skip(pad).take(height.saturating_sub(2 * pad));
        rows.flat_map(move |row| row[pad..width - pad].iter().copied())
    }
}

fn reset<T: Clone>(texels: &mut Vec<T>, len: usize, zero: T) {
    texels.clear();
    texels.resize(len, zero);
}

fn copy<T: Copy>(from: &[T], spec: &FilmSpec) -> Option<Grid<T>> {
    let [width, height] = spec.padded_extent().map(|n| n as usize);
    let mut texels = Vec::new();
    texels.try_reserve_exact(from.len()).ok()?;
    texels.extend_from_slice(from);
    Grid::from_rows(width, height, texels)
}
