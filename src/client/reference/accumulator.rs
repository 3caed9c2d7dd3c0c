//! The four images of one stream (paper §4.2), each as two floats, and the passes that feed them.
//!
//! A band goes through splat, fold, variance splat and variance fold while its texels are in the cache;
//! texels depend on nothing outside their band, so the result is that of whole-image passes.

use std::ops::Range;

use glam::Vec4;
use rayon::prelude::*;

use crate::client::error::ClientError;
use crate::client::reference::fold::fold;
use crate::client::reference::splat::{BAND_ROWS, Band, Bins, Sprite, splat_color, touched};
use crate::client::reference::variance::{Means, VarianceParameters, splat_variance};
use crate::client::settings::{FilmSpec, Summation};
use crate::image::Grid;
use crate::math::exact_sum::ExactSum;

/// Sums of one stream over the padded film.
pub struct Accumulator {
    /// The next batch initialises the sums to zero.
    cleared: bool,
    width: usize,
    hi: Vec<Vec4>,
    lo: Vec<Vec4>,
    /// Empty if no variance is accumulated.
    variance_hi: Vec<f32>,
    variance_lo: Vec<f32>,
}

/// The exact sums of one texel: X, Y and Z in units of the luminance scale, weights, and squared luminance in units of that scale squared.
pub type ExactTexel = [ExactSum; 5];

/// Scratch buffers reused between bands. Only texels touched by a band's sprites are defined.
#[derive(Default)]
struct BandScratch {
    runs: Vec<bool>,
    touched: Vec<Range<usize>>,
    color: Vec<Vec4>,
    variance: Vec<f32>,
    means: Means,
}

/// The sums of a band.
struct AccumulatorBand<'a> {
    hi: &'a mut [Vec4],
    lo: &'a mut [Vec4],
    /// Empty if no variance is accumulated.
    variance_hi: &'a mut [f32],
    variance_lo: &'a mut [f32],
}

impl AccumulatorBand<'_> {
    fn clear(&mut self) {
        self.hi.fill(Vec4::ZERO);
        self.lo.fill(Vec4::ZERO);
        self.variance_hi.fill(0.0);
        self.variance_lo.fill(0.0);
    }
}

impl BandScratch {
    /// Adds the sprites of a band to its sums: the variance of `sprites`, and the colour of `colors`, which are the same sprites with those
    /// of dense cells merged; merging touches no further texels.
    fn add(
        &mut self,
        p: VarianceParameters,
        band: Band,
        sprites: &[Sprite],
        colors: &[Sprite],
        sums: &mut AccumulatorBand<'_>,
    ) {
        self.touched.clear();
        touched(p.filter, band, sprites, &mut self.runs, &mut self.touched);
        if self.touched.is_empty() {
            return;
        }
        if sums.variance_hi.is_empty() {
            return self.add_color(p, band, colors, sums);
        }
        self.means.resize(sums.hi.len());
        for texels in &self.touched {
            self.means.set_old(texels.clone(), sums.hi, sums.lo);
        }
        self.add_color(p, band, colors, sums);
        for texels in &self.touched {
            self.means.set_new(texels.clone(), sums.hi, sums.lo);
        }
        self.variance.resize(sums.hi.len(), 0.0);
        for part in sprites.chunks(p.samples_per_sum) {
            self.touched.iter().for_each(|texels| self.variance[texels.clone()].fill(0.0));
            splat_variance(p, band, part, &self.means, &mut self.variance);
            for texels in self.touched.iter().cloned() {
                let (hi, lo) = (&mut sums.variance_hi[texels.clone()], &mut sums.variance_lo[texels.clone()]);
                fold(Summation::TwoFloat, hi, lo, &self.variance[texels]);
            }
        }
    }

    /// Splats and folds the colour of a band.
    fn add_color(
        &mut self,
        p: VarianceParameters,
        band: Band,
        sprites: &[Sprite],
        sums: &mut AccumulatorBand<'_>,
    ) {
        self.color.resize(sums.hi.len(), Vec4::ZERO);
        for part in sprites.chunks(p.samples_per_sum) {
            self.touched.iter().for_each(|texels| self.color[texels.clone()].fill(Vec4::ZERO));
            splat_color(p.filter, band, part, &mut self.color);
            for texels in self.touched.iter().cloned() {
                let (hi, lo) = (&mut sums.hi[texels.clone()], &mut sums.lo[texels.clone()]);
                fold(p.sums, hi, lo, &self.color[texels]);
            }
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
        Ok(Self {
            cleared: false,
            width,
            hi: colors()?,
            lo: colors()?,
            variance_hi: floats()?,
            variance_lo: floats()?,
        })
    }

    /// Sums read from a film of this specification, including overscan; the remainders are zero.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn restored(spec: &FilmSpec, color: &[[f32; 4]], variance: &[f32]) -> Result<Self, ClientError> {
        let mut sums = Self::new(spec)?;
        sums.hi.iter_mut().zip(color).for_each(|(sum, color)| *sum = Vec4::from(*color));
        sums.variance_hi.iter_mut().zip(variance).for_each(|(sum, variance)| *sum = *variance);
        Ok(sums)
    }

    /// The error for images of this film's size that do not fit into memory.
    pub fn out_of_memory(what: &'static str, spec: &FilmSpec) -> ClientError {
        let [width, height] = spec.padded_extent().map(u64::from);
        let bytes_per_texel = 2 * (size_of::<Vec4>() + size_of::<f32>()) as u64;
        ClientError::Memory { what, bytes: width * height * bytes_per_texel }
    }

    /// Read-only rounding of [exact sums](ExactTexel), with colours in units of `luminance_scale`; runs in the current thread pool. Nothing
    /// can be added to the result. `None` if memory runs out.
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
        Some(Self { cleared: false, width, hi, lo: Vec::new(), variance_hi, variance_lo: Vec::new() })
    }

    /// Clears the sums lazily: the next batch initialises them band by band, and until then they must not be read.
    pub fn clear(&mut self) {
        self.cleared = true;
    }

    /// Whether there was no batch since [`clear`](Self::clear).
    pub fn is_cleared(&self) -> bool {
        self.cleared
    }

    /// Adds one batch, taking the colour from `colors`; runs in the current thread pool.
    pub fn add_batch(&mut self, p: VarianceParameters, bins: &Bins, colors: &Bins) {
        let (width, texels) = (self.width, self.width * BAND_ROWS);
        let cleared = std::mem::take(&mut self.cleared);
        let color = self.hi.par_chunks_mut(texels).zip(self.lo.par_chunks_mut(texels));
        let add = |scratch: &mut BandScratch, i: usize, mut sums: AccumulatorBand<'_>| {
            if cleared {
                sums.clear();
            }
            let band = Band { first_row: i * BAND_ROWS, rows: sums.hi.len() / width, width };
            scratch.add(p, band, bins.band(i), colors.band(i), &mut sums);
        };
        if self.variance_hi.is_empty() {
            color.enumerate().for_each_init(BandScratch::default, |scratch, (i, (hi, lo))| {
                add(scratch, i, AccumulatorBand { hi, lo, variance_hi: &mut [], variance_lo: &mut [] });
            });
            return;
        }
        let variance = self.variance_hi.par_chunks_mut(texels).zip(self.variance_lo.par_chunks_mut(texels));
        color.zip(variance).enumerate().for_each_init(
            BandScratch::default,
            |scratch, (i, ((hi, lo), (variance_hi, variance_lo)))| {
                add(scratch, i, AccumulatorBand { hi, lo, variance_hi, variance_lo });
            },
        );
    }

    /// A copy of the rounded sums, level 0 of the mips; `None` without memory.
    pub fn color(&self, spec: &FilmSpec) -> Option<Grid<Vec4>> {
        copy(&self.hi, spec)
    }

    /// A copy of the rounded sums without the overscan; `None` without memory.
    pub fn picture(&self, spec: &FilmSpec) -> Option<Grid<Vec4>> {
        let mut grid = Grid::try_filled(spec.width as usize, spec.height as usize, Vec4::ZERO)?;
        grid.pixels_mut().iter_mut().zip(self.crop(&self.hi, spec.pad())).for_each(|(to, sum)| *to = sum);
        Some(grid)
    }

    /// A copy of the rounded variance sums; `None` without memory.
    pub fn variance(&self, spec: &FilmSpec) -> Option<Grid<f32>> {
        copy(&self.variance_hi, spec)
    }

    /// The rounded sums, row by row of the padded film.
    pub fn color_sums(&self) -> &[Vec4] {
        &self.hi
    }

    /// Rounded variance sums, row-major over the padded film; empty if none are accumulated.
    pub fn variance_sums(&self) -> &[f32] {
        &self.variance_hi
    }

    /// The rounded sums without the outermost `pad` texels on every side, row by row.
    pub fn color_rows(&self, pad: u32) -> Vec<[f32; 4]> {
        self.crop(&self.hi, pad).map(|v| v.to_array()).collect()
    }

    /// The sums X, Y, Z and weight of one texel.
    pub fn color_at(&self, [x, y]: [u32; 2]) -> Option<[f32; 4]> {
        self.hi.get(y as usize * self.width + x as usize).map(|v| v.to_array())
    }

    /// Rounded variance sums without the outermost `pad` texels on every side, row-major.
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

fn copy<T: Copy>(from: &[T], spec: &FilmSpec) -> Option<Grid<T>> {
    let [width, height] = spec.padded_extent().map(|n| n as usize);
    let mut texels = Vec::new();
    texels.try_reserve_exact(from.len()).ok()?;
    texels.extend_from_slice(from);
    Grid::from_rows(width, height, texels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::dense_cells::Merger;
    use crate::client::settings::SplatFilter;
    use crate::color::Xyz;
    use crate::math::random::Random;
    use crate::stream::Sample;

    /// Samples of a batch that lie in a few cells.
    const CLUSTER: usize = 90;

    /// Sparse batches, dense ones and some with all samples in a few cells, the first of them after a clear, yield the same bits as passes
    /// over the whole film. One thread processes all bands, so that scratch buffers are reused.
    #[test]
    fn batches_equal_passes_over_the_whole_film() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
        pool.install(compare_batches);
    }

    fn compare_batches() {
        for filter in [SplatFilter::Gaussian, SplatFilter::Tent, SplatFilter::Box] {
            let spec = FilmSpec {
                width: 90,
                height: 200,
                filter,
                variance: Some(Default::default()),
                sums: Summation::TwoFloat,
            };
            let [width, rows] = spec.padded_extent().map(|n| n as usize);
            let p = VarianceParameters {
                filter,
                sums: spec.sums,
                form: Default::default(),
                inverse_scale: 0.5,
                samples_per_sum: 10_000,
            };
            let whole = Band { first_row: 0, rows, width };
            let (mut random, mut bins, mut merged) = (Random(3), Bins::default(), Bins::default());
            let mut merger = Merger::default();
            let mut sums = Accumulator::new(&spec).expect("a small film");
            for counts in [[2500, 30, 12, CLUSTER], [9, CLUSTER, 1, 2500]] {
                sums.clear();
                let (mut hi, mut lo) = (vec![Vec4::ZERO; width * rows], vec![Vec4::ZERO; width * rows]);
                let (mut variance_hi, mut variance_lo) = (vec![0.0; width * rows], vec![0.0; width * rows]);
                for count in counts {
                    // Positions extend beyond the borders, or lie within two texels.
                    let (size, first) = if count == CLUSTER { (0.01, 0.5) } else { (1.2, -0.1) };
                    let mut sample = |_| Sample {
                        uv: [0, 1].map(|_| random.f32() * size + first),
                        xyz: Xyz::new(random.f32(), random.f32(), random.f32()),
                        w: 1.0,
                    };
                    let samples: Vec<Sample> = (0..count).map(&mut sample).collect();
                    let sprites: Vec<Sprite> =
                        samples.iter().filter_map(|s| Sprite::place(&spec, s)).collect();
                    bins.fill(&spec, sprites.iter().copied());
                    let mut colors = sprites.clone();
                    if let Some([single, together]) = merger.split(&spec, &samples) {
                        colors = single.iter().filter_map(|s| Sprite::place(&spec, s)).collect();
                        colors.extend(together.iter().map(Sprite::merged));
                    }
                    assert_eq!(colors.len() < sprites.len(), count == CLUSTER);
                    merged.fill(&spec, colors.iter().copied());
                    sums.add_batch(p, &bins, &merged);

                    let mut means = Means::default();
                    means.resize(width * rows);
                    means.set_old(0..width * rows, &hi, &lo);
                    let mut batch = vec![Vec4::ZERO; width * rows];
                    splat_color(filter, whole, &colors, &mut batch);
                    fold(p.sums, &mut hi, &mut lo, &batch);
                    means.set_new(0..width * rows, &hi, &lo);
                    let mut batch = vec![0.0; width * rows];
                    splat_variance(p, whole, &sprites, &means, &mut batch);
                    fold(Summation::TwoFloat, &mut variance_hi, &mut variance_lo, &batch);
                }
                let bits = |texels: &[Vec4]| -> Vec<[u32; 4]> {
                    texels.iter().map(|t| t.to_array().map(f32::to_bits)).collect()
                };
                assert!(bits(&sums.hi) == bits(&hi) && bits(&sums.lo) == bits(&lo), "{filter:?} {counts:?}");
                let bits = |texels: &[f32]| -> Vec<u32> { texels.iter().map(|t| t.to_bits()).collect() };
                assert!(bits(&sums.variance_hi) == bits(&variance_hi), "{filter:?} {counts:?}");
                assert!(bits(&sums.variance_lo) == bits(&variance_lo), "{filter:?} {counts:?}");
                assert!(variance_hi.iter().any(|v| *v > 0.0));
            }
        }
    }
}
