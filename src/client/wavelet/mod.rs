//! Noise filter for the display: an undecimated wavelet transform whose bands are kept where two independent halves agree.
//!
//! Two halves of the samples, each of a randomisation of its own, share the signal and not the noise: the mean product of their wavelet
//! coefficients is the power of the signal in a band, without a model of the noise. With S that mean and N the power of the noise in the mean
//! of both, a band is multiplied by max(0, S − N) / (S + N): Wiener's gain, with the noise subtracted once more because S is itself noisy.
//! If the features of first hits change (albedo, normal, distance) the transform does not mix pixels, so that edges are preserved. Detail
//! that features do not show, such as shadows and caustics, is restored because both halves contain it (paper, reference 21: Suykens and Willems
//! 2000; the à-trous scheme is that of Dammertz et al. 2010).
//!
//! [`WaveletFilter`] runs on the CPU, [`WaveletPass`](crate::client::pass::wavelet::WaveletPass) on a device.
//!
//! The filter changes only the displayed picture, not the sums or statistics. With more samples N vanishes, and so does its effect.

mod bands;
mod prepare;
mod rows;

use glam::Vec3;
use rayon::prelude::*;

use self::bands::{Level, RowOutput, transform, weigh};
use self::prepare::{mean_of_halves, no_features, separate_fireflies, tolerances};
pub use self::rows::LEVELS;
use self::rows::{BORDER, FEATURES, PlanarRows, RESULT, SUMS, WEIGHTS};
use crate::client::ClientError;
use crate::image::Grid;

/// One half: per pixel the mean X, Y and Z of its samples, and their number, which may be 0.
pub type HalfPicture = Grid<glam::Vec4>;

/// First-hit features of a pixel; zero without a hit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelFeatures {
    /// Reflectance for red, green and blue light.
    pub albedo: Vec3,
    /// Unit shading normal, or a mean of several.
    pub normal: Vec3,
    /// Distance from the camera, world units.
    pub distance: f32,
    /// The hit is a light source. Neither its surroundings nor the pixels along its edge are as bright.
    pub emits: bool,
}

/// The error if memory does not suffice to filter pictures of this size.
pub fn out_of_memory(size: [usize; 2]) -> ClientError {
    let bytes = 340 * (size[0] * size[1]) as u64;
    ClientError::Memory { what: "the noise filter", bytes }
}

/// Features and tolerances in the layout of the device, row-major: albedo and distance; normal and share of lights; tolerances of albedo,
/// normal and distance, and an unused number.
pub type FeatureTexels = [Vec<[f32; 4]>; 3];

/// Features of both halves in the layout of the device; `None` if memory runs out.
pub fn feature_texels(halves: [&Grid<PixelFeatures>; 2]) -> Option<FeatureTexels> {
    let [width, height] = [halves[0].width(), halves[0].height()];
    let mut rows = PlanarRows::new(width, height, FEATURES)?;
    tolerances(halves, &mut rows);
    // Channels of the rows, per texel component.
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

/// A denoised picture.
pub struct Filtered {
    /// XYZ.
    pub picture: Grid<Vec3>,
    /// Pixel-to-pixel detail, including feature edges: 0 where it is noise, 1 where the halves agree on it.
    pub finest: Grid<f32>,
}

/// Filter for pictures of one size with the same features; memory and weights are reused between pictures.
pub struct WaveletFilter {
    size: [usize; 2],
    features: PlanarRows,
    /// Weights of every level.
    weights: Vec<PlanarRows>,
    /// Weights of the finest level ignoring features.
    alike: PlanarRows,
    sums: PlanarRows,
    coarser: PlanarRows,
    result: PlanarRows,
}

impl WaveletFilter {
    /// A filter for pictures of `size` pixels, with the features of both halves; `None` if memory runs out. Reuses the memory of another
    /// view's filter if that has the same size: fresh memory takes longer than the computation.
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

    /// Denoises a picture of this size; `None` if memory runs out.
    pub fn filtered(&mut self, halves: [&HalfPicture; 2]) -> Option<Filtered> {
        let (size @ [width, height], Self { weights, alike, sums, coarser, result, .. }) = (self.size, self);
        let mut picture = Grid::try_filled(width, height, Vec3::ZERO)?;
        let mut finest = Grid::try_filled(width, height, 0.0f32)?;
        separate_fireflies(halves, &mut picture, sums, result)?;
        // The gain of the finest band ignores features, because across feature edges the bands of the filter are empty.
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
                    // Next to a bright sample, a band that is kept may make the result negative. The pixel's mean or that of its
                    // surroundings is then more likely.
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
