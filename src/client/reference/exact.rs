//! A film whose sums do not depend on the order of samples, used for states on disk, shards and merged pictures.
//!
//! Every tap of every sample is rounded individually and then added in [fixed point](ExactSum). Hence the sums over a range of the sample
//! sequence equal the sum over its parts, whatever the parts and the order of merging. Batches need no fold, and threads and bands do not
//! affect the result.

use std::any::Any;

use glam::Vec4;
use rayon::prelude::*;

use crate::client::Film;
use crate::client::error::ClientError;
use crate::client::reference::ReferenceFilm;
use crate::client::reference::accumulator::{Accumulator, ExactTexel};
use crate::client::reference::splat::{BAND_ROWS, Band, Bins, Sprite, draw};
use crate::client::reference::sums::HostSums;
use crate::client::settings::{CHUNK_SAMPLES, DisplayImage, FilmCounts, FilmData, FilmSpec, Settings};
use crate::client::state::FilmState;
use crate::image::Grid;
use crate::math::exact_sum::ExactSum;
use crate::stream::{PathCounts, Sample};

/// A film with exact sums. Its pictures equal those of a [`ReferenceFilm`] with the same sums, rounded.
pub struct ExactFilm {
    /// Counts, threads, and display of the rounded sums.
    film: ReferenceFilm,
    luminance_scale: f32,
    streams: [ExactStream; 2],
}

/// Batch of one stream, and its sums over the padded film, allocated with the first sample.
#[derive(Default)]
struct ExactStream {
    batch: Vec<Sample>,
    bins: Bins,
    sums: Option<Grid<ExactTexel>>,
}

impl ExactFilm {
    /// An empty film with its own `threads` threads; 0 for one per core. `luminance_scale`, a power of two, is the unit of colours; unlike
    /// in other films it must not depend on which samples come first.
    ///
    /// # Errors
    /// Those of [`ReferenceFilm::new`].
    pub fn new(spec: FilmSpec, threads: usize, luminance_scale: f32) -> Result<Self, ClientError> {
        let mut film = ReferenceFilm::new(spec, threads)?;
        film.state.set_scale(luminance_scale);
        // The 64-bit sums have no room for larger batches.
        film.state.take_small_batches();
        Ok(Self { film, luminance_scale, streams: Default::default() })
    }

    /// `film`, if its sums do not depend on the order of samples, so that they can be kept in a file.
    pub fn of(film: &mut dyn Film) -> Option<&mut Self> {
        film.as_any()?.downcast_mut()
    }

    /// The specification of the film.
    pub fn spec(&self) -> &FilmSpec {
        self.film.state.spec()
    }

    /// Sums of the camera stream (0) or the light stream (1); `None` before its first sample.
    pub fn sums(&self, stream: usize) -> Option<&Grid<ExactTexel>> {
        self.streams[stream].sums.as_ref()
    }

    /// Mutable sums, to which another film's are added.
    ///
    /// # Errors
    /// [`ClientError::Memory`].
    pub fn sums_mut(&mut self, stream: usize) -> Result<&mut Grid<ExactTexel>, ClientError> {
        self.streams[stream].sums_mut(self.film.state.spec())
    }

    /// Counts the samples and paths of another film whose sums are added.
    pub fn add_counts(&mut self, counts: FilmCounts) {
        self.film.state.add_counts(counts);
    }

    /// Updates the displayed film from the sums.
    fn round(&mut self) -> Result<(), ClientError> {
        self.flush()?;
        let Self { film, luminance_scale, streams } = self;
        let mut rounded = [None, None];
        for (stream, rounded) in streams.iter().zip(&mut rounded) {
            if let Some(sums) = &stream.sums {
                let accumulator = film.pool.install(|| Accumulator::rounded(sums, *luminance_scale));
                *rounded = Some(
                    accumulator
                        .ok_or_else(|| Accumulator::out_of_memory("the picture", film.state.spec()))?,
                );
            }
        }
        film.sums = HostSums::of(rounded);
        Ok(())
    }
}

impl ExactStream {
    fn sums_mut(&mut self, spec: &FilmSpec) -> Result<&mut Grid<ExactTexel>, ClientError> {
        if self.sums.is_none() {
            let [width, height] = spec.padded_extent().map(|n| n as usize);
            self.sums = Grid::try_filled(width, height, ExactTexel::default());
        }
        let bytes =
            size_of::<ExactTexel>() as u64 * spec.padded_extent().map(u64::from).iter().product::<u64>();
        self.sums.as_mut().ok_or(ClientError::Memory { what: "the exact sums of the film", bytes })
    }

    /// Rasterises the batch in the current thread pool, and empties it.
    fn raster(&mut self, state: &FilmState) -> Result<(), ClientError> {
        if self.batch.is_empty() {
            return Ok(());
        }
        let (spec, inverse_scale) = (state.spec(), state.scale().recip());
        let batch = std::mem::take(&mut self.batch);
        self.bins.fill(spec, batch.iter().filter_map(|sample| Sprite::place(spec, sample)));
        self.sums_mut(spec)?;
        let Self { bins, sums: Some(sums), .. } = self else { return Ok(()) };
        let width = sums.width();
        let bands = sums.pixels_mut().par_chunks_mut(width * BAND_ROWS).enumerate();
        bands.for_each_init(BandSums::default, |sums, (i, texels)| {
            let band = Band { first_row: i * BAND_ROWS, rows: texels.len() / width, width };
            sums.splat(spec, band, bins.band(i), inverse_scale, texels);
        });
        self.batch = batch;
        self.batch.clear();
        Ok(())
    }
}

/// Sums of one band over a batch, for samples of ordinary size: X, Y, Z, W and, separately, the squares, in units of 2^−[`UNIT_BITS`].
#[derive(Default)]
struct BandSums {
    colors: Vec<[i64; 4]>,
    squares: Vec<i64>,
}

/// Taps of ordinary samples are rounded to multiples of 2^−36 of the luminance scale.
const UNIT_BITS: u32 = 36;

/// Upper bound on the values of ordinary samples, so that the sum over a chunk of 2^16 samples fits into 64 bits.
const ORDINARY: f32 = 1024.0;

const _: () = assert!(CHUNK_SAMPLES as f64 * ORDINARY as f64 * (1u64 << UNIT_BITS) as f64 <= i64::MAX as f64);

/// Magic number for numbers below 2^51: adding it rounds to an integer, held in the low bits of the mantissa.
const ROUNDING: f64 = 1.5 * (1u64 << 52) as f64;

/// The nearest integer.
#[inline]
fn rounded(value: f32) -> i64 {
    (f64::from(value) + ROUNDING).to_bits() as i64 - ROUNDING.to_bits() as i64
}

impl BandSums {
    /// Adds `f · [x/s, y/s, z/s, |w|, (y/s)²]` of every sprite to the band's texels.
    fn splat(
        &mut self,
        spec: &FilmSpec,
        band: Band,
        sprites: &[Sprite],
        inverse_scale: f32,
        texels: &mut [ExactTexel],
    ) {
        if sprites.is_empty() {
            return;
        }
        let Self { colors, squares } = self;
        colors.clear();
        colors.resize(texels.len(), [0; 4]);
        squares.clear();
        squares.resize(texels.len(), 0);
        let scales = Vec4::new(inverse_scale, inverse_scale, inverse_scale, 1.0);
        draw(spec.filter, band, sprites, |sprite, at, f| {
            // Clamped, because an infinite value times a tap of weight 0 would be NaN.
            let color = (sprite.value * scales).min(Vec4::splat(f32::MAX));
            let square = ((color.y / color.w) * (color.y / color.w)).min(f32::MAX);
            if color.max_element() >= ORDINARY || square >= ORDINARY {
                return add_exactly(&mut texels[at..][..f.len()], color, square, f);
            }
            let (color, square) = (color * UNITS, square * UNITS);
            for (sums, f) in colors[at..][..f.len()].iter_mut().zip(f) {
                let taps = (color * *f).to_array();
                for (sum, tap) in sums.iter_mut().zip(taps) {
                    *sum += rounded(tap);
                }
            }
            for (sum, f) in squares[at..][..f.len()].iter_mut().zip(f) {
                *sum += rounded(square * f);
            }
        });
        for ((texel, color), square) in texels.iter_mut().zip(colors).zip(squares) {
            let [x, y, z, w] = *color;
            for (sum, units) in texel.iter_mut().zip([x, y, z, w, *square]) {
                sum.merge(ExactSum::from_bits((units as u128) << (64 - UNIT_BITS)));
            }
        }
    }
}

/// Number of units in 1.
const UNITS: f32 = (1u64 << UNIT_BITS) as f32;

/// As [`splat`](BandSums::splat), for a sample that is not ordinary.
#[cold]
fn add_exactly(texels: &mut [ExactTexel], color: Vec4, square: f32, f: &[f32]) {
    let [x, y, z, w] = color.to_array();
    for (texel, f) in texels.iter_mut().zip(f) {
        for (sum, value) in texel.iter_mut().zip([x, y, z, w, square]) {
            sum.add(value * f);
        }
    }
}

impl Film for ExactFilm {
    fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError> {
        for sample in samples {
            if self.film.state.take(sample) {
                self.streams[usize::from(sample.w < 0.0)].batch.push(*sample);
                if self.film.state.is_full() {
                    self.flush()?;
                }
            }
        }
        Ok(())
    }

    fn count_paths(&mut self, paths: PathCounts) {
        self.film.state.count_paths(paths);
    }

    fn flush(&mut self) -> Result<(), ClientError> {
        if !self.film.state.start_raster() {
            return Ok(());
        }
        let Self { film: ReferenceFilm { state, pool, .. }, streams, .. } = self;
        pool.install(|| streams.iter_mut().try_for_each(|stream| stream.raster(state)))
    }

    fn clear(&mut self) {
        self.film.clear();
        self.film.state.set_scale(self.luminance_scale);
        self.streams = Default::default();
    }

    fn counts(&self) -> FilmCounts {
        self.film.counts()
    }

    fn display(&mut self, settings: &Settings) -> Result<DisplayImage, ClientError> {
        self.round()?;
        self.film.display(settings)
    }

    fn develop(&mut self) -> Result<FilmData, ClientError> {
        self.round()?;
        let mut data = self.film.develop()?;
        if self.spec().variance.is_none() {
            (data.camera_variance, data.light_variance) = (Vec::new(), Vec::new());
        }
        Ok(data)
    }

    fn as_any(&mut self) -> Option<&mut dyn Any> {
        Some(self)
    }
}
