//! Noise filter for the display: an undecimated wavelet transform whose bands are kept where two independent halves agree.
//!
//! Two halves of the samples, each of a randomisation of its own, share the signal and not the noise: the mean product of their wavelet
//! coefficients is the power of the signal in a band, without a model of the noise. With S that mean and N the power of the noise in the mean
//! of both, a band is multiplied by max(0, S − N) / (S + N): Wiener's gain, with the noise subtracted once more because S is itself noisy.
//! Where the features of first hits change (albedo, normal, distance) the transform does not mix pixels, so that edges stay edges; and what
//! features do not know, such as shadows and caustics, comes back because both halves contain it (paper [21], Suykens and Willems 2000; the
//! à-trous scheme is that of Dammertz et al. 2010).
//!
//! [`WaveletFilter`] is the filter on the processor, [`WaveletPass`](crate::client::pass::wavelet::WaveletPass) the same on a device.
//!
//! Nothing is stored and no statistics are changed: the filter works on what is shown. With more samples N vanishes, and so does the filter.

mod bands;
mod prepare;
mod rows;

use glam::Vec3;
use rayon::prelude::*;

use self::bands::{Level, RowOutput, transform, weigh};
use self::prepare::{mean_of_halves, no_features, separate_fireflies, tolerances};
use self::rows::{BORDER, FEATURES, PlanarRows, RESULT, SUMS, WEIGHTS};
use crate::client::ClientError;
use crate::image::Grid;

/// Levels of the transform; level l has steps of 2^l pixels.
pub const LEVELS: u32 = 5;

/// One half: in every pixel the mean X, Y and Z of its samples, and their number, 0 where there is none.
pub type HalfPicture = Grid<glam::Vec4>;

/// What a camera ray meets first, in one pixel: zero where that is nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelFeatures {
    /// Reflectance for red, green and blue light.
    pub albedo: Vec3,
    /// Unit shading normal, or a mean of several.
    pub normal: Vec3,
    /// Distance from the camera, world units.
    pub distance: f32,
    /// It is a light: nothing around it is as bright, nor are the pixels that its edge divides.
    pub emits: bool,
}

/// The error where there was no memory for a filter of pictures of this size.
pub fn out_of_memory(size: [usize; 2]) -> ClientError {
    let bytes = 340 * (size[0] * size[1]) as u64;
    ClientError::Memory { what: "the noise filter", bytes }
}

/// Features with their tolerances as the device wants them, row by row: albedo and distance; normal and the share of lights; tolerances of
/// albedo, normal and distance, and a number that is not used.
pub type FeatureTexels = [Vec<[f32; 4]>; 3];

/// The features of both halves for the device; `None` without memory.
pub fn feature_texels(halves: [&Grid<PixelFeatures>; 2]) -> Option<FeatureTexels> {
    let [width, height] = [halves[0].width(), halves[0].height()];
    let mut rows = PlanarRows::new(width, height, FEATURES)?;
    tolerances(halves, &mut rows);
    // The channels of the rows, by texel.
    let texels = [[0, 1, 2, 6], [3, 4, 5, 10], [7, 8, 9, 10]].map(|channels| {
        let row = |y: usize| rows.row(y + BORDER);
        let texel = move |i: usize| {
            channels.map(|channel| row(i / width)[channel * rows.stride + BORDER + i % width])
        };
        let mut texels = Vec::new();
        texels.try_reserve_exact(width * height).ok()?;
        texels.extend((0..width * height).map(texel));
        Some(texels)
    });
    let [albedo, normal, tolerances] = texels;
    Some([albedo?, normal?, tolerances?])
}

/// A filtered picture.
pub struct Filtered {
    /// XYZ.
    pub picture: Grid<Vec3>,
    /// What differs from pixel to pixel, edges of features among it: 0 where that is noise, 1 where the halves agree on it.
    pub finest: Grid<f32>,
}

/// The filter for pictures of one size with the same features; its memory and the weights are kept from picture to picture.
pub struct WaveletFilter {
    size: [usize; 2],
    features: PlanarRows,
    /// Weights of every level.
    weights: Vec<PlanarRows>,
    /// Weights of the finest level without features.
    alike: PlanarRows,
    sums: PlanarRows,
    coarser: PlanarRows,
    result: PlanarRows,
}

impl WaveletFilter {
    /// A filter for pictures of `size` pixels, with the features of both halves; `None` without memory.
    pub fn new(size: [usize; 2], features: Option<[&Grid<PixelFeatures>; 2]>) -> Option<Self> {
        Self::after(None, size, features)
    }

    /// The same in the memory of the filter of another view, if that has the same size: memory that is new costs more time than what is
    /// computed.
    pub fn after(
        last: Option<Self>,
        size: [usize; 2],
        features: Option<[&Grid<PixelFeatures>; 2]>,
    ) -> Option<Self> {
        let mut filter = match last.filter(|last| last.size == size) {
            Some(last) => last,
            None => Self::empty(size)?,
        };
        match features {
            Some(halves) => tolerances(halves, &mut filter.features),
            None => no_features(&mut filter.features, size[0]),
        }
        for (level, weights) in filter.weights.iter_mut().enumerate() {
            weigh(weights, &filter.features, size[0], 1 << level);
        }
        Some(filter)
    }

    fn empty(size: [usize; 2]) -> Option<Self> {
        let rows = |channels| PlanarRows::new(size[0], size[1], channels);
        let (mut features, mut alike) = (rows(FEATURES)?, rows(WEIGHTS)?);
        no_features(&mut features, size[0]);
        weigh(&mut alike, &features, size[0], 1);
        Some(Self {
            size,
            features,
            weights: (0..LEVELS).map(|_| rows(WEIGHTS)).collect::<Option<_>>()?,
            alike,
            sums: rows(SUMS)?,
            coarser: rows(SUMS)?,
            result: rows(RESULT)?,
        })
    }

    /// Filters a picture of this size; `None` without memory.
    pub fn filtered(&mut self, halves: [&HalfPicture; 2]) -> Option<Filtered> {
        let (size @ [width, height], Self { weights, alike, sums, coarser, result, .. }) = (self.size, self);
        let mut picture = Grid::try_filled(width, height, Vec3::ZERO)?;
        let mut finest = Grid::try_filled(width, height, 0.0f32)?;
        separate_fireflies(halves, &mut picture, sums, result)?;
        // The gain of the finest band is measured without features, because across their edges the bands of the filter are empty.
        let gains = finest.pixels_mut().chunks_exact_mut(width).map(RowOutput::Gain);
        transform(&Level { weights: alike, size, step: 1 }, sums, gains)?;
        for (level, weights) in weights.iter().enumerate() {
            let level = Level { weights, size, step: 1 << level };
            let rows = coarser.inner().zip(result.inner());
            transform(&level, sums, rows.map(|(coarser, result)| RowOutput::Smoothed { coarser, result }))?;
            std::mem::swap(sums, coarser);
        }
        picture.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            let row = result.row(y + BORDER);
            for (x, out) in out.iter_mut().enumerate() {
                let mut filtered = Vec3::from_array([0, 1, 2].map(|c| row[c * result.stride + BORDER + x]));
                if filtered.y < 0.0 {
                    // Beside a bright sample a kept band may take more than there is. What is seen there, or what is around, is more likely.
                    let around = mean_of_halves(sums.row(y + BORDER), BORDER + x);
                    let seen = halves.map(|half| half.at(x, y)).map(|half| half.truncate() * half.w);
                    let count: f32 = halves.iter().map(|half| half.at(x, y).w).sum();
                    let seen = (seen[0] + seen[1]) / count;
                    filtered = if seen.y < around.y { seen } else { around };
                }
                *out += filtered;
            }
        });
        Some(Filtered { picture, finest })
    }
}
