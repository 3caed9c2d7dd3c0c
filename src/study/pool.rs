//! The reference that a study pools from its own pictures.
//!
//! All pictures of unbiased methods are pooled, weighted by the inverse of their relative variance. A picture is judged against the
//! pool of the *others*, so that its own noise is not in its reference. The variance of the pool is known, pixel by pixel, from the
//! replicates of its pictures, and it is subtracted from squared differences: for independent x and r of the same expectation,
//! E\[(x − r)²\] = var x + var r, plus the squared bias of x if it has any.
//!
//! A method that has not found some of the light yet states too small a variance. Its pictures must not dominate the pool: where
//! the pool of the other methods shows significantly more light in a part of the picture, the method is left out (`PoolPart::missing`).

use crate::image::compare::luminance;
use crate::study::error::{ErrorField, TileSubset};
use crate::study::error_tile::PixelError;
use crate::study::error_tile::ReplicatePixel;

/// Grid of blocks in which methods are compared: columns and rows.
const BLOCKS: usize = 8;

/// Number of standard errors from which on a difference of a block's mean is significant.
const SIGNIFICANT: f64 = 4.0;

/// Fraction of the light that a method may miss before it is excluded from the pool, its replicates are distrusted, and a warning is given.
pub const LACKING: f64 = 0.005;

/// A pixel of a reference: mean and variance of the mean, linear Rec.709.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NoisyPixel {
    /// Mean.
    pub mean: [f32; 3],
    /// Variance of the mean by channel, and of its luminance.
    pub variance: [f32; 4],
}

/// One picture of a study.
#[derive(Clone, Copy, Debug)]
pub struct PooledPicture<'a> {
    /// Paths per pixel.
    pub samples: f64,
    /// Its pixels.
    pub rgb: &'a [[f32; 3]],
    /// Mean and difference of its replicates.
    pub replicates: &'a [ReplicatePixel],
}

/// Pooled pictures of one method.
#[derive(Clone, Debug)]
struct PoolPart {
    method: String,
    /// Paths per pixel.
    samples: f64,
    /// Sums of `samples · mean` and `samples² · variance`.
    sums: Vec<NoisyPixel>,
    /// Relative error of the mean at 95 % of the picture, from the variance.
    error: f64,
    /// Fraction of the light missing relative to the other methods.
    missing: f64,
}

/// Pooled pictures of all unbiased methods.
#[derive(Clone, Debug)]
pub struct ReferencePool {
    size: [usize; 2],
    parts: Vec<PoolPart>,
}

impl ReferencePool {
    /// A pool without pictures, of `size` pixels.
    pub fn new(size: [usize; 2]) -> Self {
        Self { size, parts: Vec::new() }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Paths per pixel over all pictures.
    pub fn samples(&self) -> f64 {
        self.parts.iter().map(|part| part.samples).sum()
    }

    /// Methods that contribute to the reference, in descending order of weight.
    pub fn methods(&self) -> Vec<&str> {
        let mut used: Vec<&PoolPart> = self.trusted().collect();
        used.sort_by(|a, b| a.error.total_cmp(&b.error));
        used.iter().map(|part| part.method.as_str()).collect()
    }

    /// Fraction of the light that a method misses relative to the others, as far as significant; 0 for an unknown method.
    pub fn missing(&self, method: &str) -> f64 {
        self.parts.iter().find(|part| part.method == method).map_or(0.0, |part| part.missing)
    }

    /// Adds a picture by an unbiased method. Returns false unless it has samples in every pixel in both replicates.
    pub fn add(&mut self, method: &str, picture: PooledPicture<'_>) -> bool {
        let PooledPicture { samples, rgb, replicates } = picture;
        let count = self.size[0] * self.size[1];
        let complete = rgb.len() == count && replicates.len() == count && replicates.iter().all(|p| p.seen);
        if !complete || samples.is_nan() || samples <= 0.0 {
            return false;
        }
        let at = self.parts.iter().position(|part| part.method == method).unwrap_or_else(|| {
            let sums = vec![NoisyPixel::default(); count];
            let method = method.to_string();
            self.parts.push(PoolPart { method, samples: 0.0, sums, error: f64::INFINITY, missing: 0.0 });
            self.parts.len() - 1
        });
        let part = &mut self.parts[at];
        part.samples += samples;
        for (sum, (rgb, pixel)) in part.sums.iter_mut().zip(rgb.iter().zip(replicates)) {
            add(sum, samples, *rgb, variance(pixel));
        }
        part.error = part.own_error(self.size);
        self.compare();
        true
    }

    /// Adds the mean and variance of an earlier run with this many paths per pixel.
    pub fn add_earlier(&mut self, method: &str, samples: f64, pixels: &[NoisyPixel]) -> bool {
        let known = self.parts.iter().any(|part| part.method == method);
        if pixels.len() != self.size[0] * self.size[1] || known || samples.is_nan() || samples <= 0.0 {
            return false;
        }
        let scaled = |pixel: &NoisyPixel| {
            let mut sum = NoisyPixel::default();
            add(&mut sum, samples, pixel.mean, pixel.variance);
            sum
        };
        let sums = pixels.iter().map(scaled).collect();
        let mut part = PoolPart { method: method.to_string(), samples, sums, error: 0.0, missing: 0.0 };
        part.error = part.own_error(self.size);
        self.parts.push(part);
        self.compare();
        true
    }

    /// Mean and variance of every method's pictures: name, paths per pixel, pixels.
    pub fn parts(&self) -> impl Iterator<Item = (&str, f64, Vec<NoisyPixel>)> {
        self.parts.iter().map(|part| {
            let mean = |sum: &NoisyPixel| scale(sum, part.samples);
            (part.method.as_str(), part.samples, part.sums.iter().map(mean).collect())
        })
    }

    /// The reference, excluding the picture to be judged if that is in the pool. `None` if nothing remains.
    pub fn reference(&self, without: Option<(&str, PooledPicture<'_>)>) -> Option<Vec<NoisyPixel>> {
        let mut whole = vec![NoisyPixel::default(); self.size[0] * self.size[1]];
        let mut total = 0.0;
        for part in self.trusted() {
            let own = without.filter(|(method, _)| *method == part.method).map(|(_, picture)| picture);
            let samples = part.samples - own.map_or(0.0, |own| own.samples);
            // Only rounding errors remain.
            if samples <= 1e-6 * part.samples {
                continue;
            }
            let precision = part.error.max(1e-9).powi(-2) * samples / part.samples;
            total += precision;
            for (i, (sum, of)) in whole.iter_mut().zip(&part.sums).enumerate() {
                let mut of = *of;
                if let Some(own) = own {
                    add(&mut of, -own.samples, own.rgb[i], variance(&own.replicates[i]).map(|v| -v));
                }
                let mean = scale(&of, samples);
                add(sum, precision, mean.mean, mean.variance.map(|v| v.max(0.0)));
            }
        }
        whole.iter_mut().for_each(|pixel| *pixel = scale(pixel, total));
        (total > 0.0).then_some(whole)
    }

    /// Parts that contribute to the reference: those without missing light, or else the one that misses least.
    fn trusted(&self) -> impl Iterator<Item = &PoolPart> {
        let least = self.parts.iter().map(|part| part.missing).fold(f64::INFINITY, f64::min);
        self.parts.iter().filter(move |part| part.missing <= least.max(LACKING))
    }

    /// Determines the missing light of each method.
    fn compare(&mut self) {
        let blocks: Vec<Vec<[f64; 2]>> = self.parts.iter().map(|part| part.blocks(self.size)).collect();
        for (i, own) in blocks.iter().enumerate() {
            let (mut gap, mut light) = (0.0, 0.0);
            for (block, own) in own.iter().enumerate() {
                let gaps = blocks.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, other)| {
                    let [mean, variance] = other[block];
                    let gap = mean - own[0];
                    if gap > SIGNIFICANT * (variance + own[1]).sqrt() { gap } else { 0.0 }
                });
                let most = gaps.fold(0.0, f64::max);
                (gap, light) = (gap + most, light + own[0].max(0.0) + most);
            }
            self.parts[i].missing = if light > 0.0 { gap / light } else { 0.0 };
        }
    }
}

impl PoolPart {
    /// The relative error at 95 % of the picture, by its own variance.
    fn own_error(&self, size: [usize; 2]) -> f64 {
        let pixels: Vec<NoisyPixel> = self.sums.iter().map(|sum| scale(sum, self.samples)).collect();
        own_error(&pixels, size)[1]
    }

    /// Mean luminance and its variance in each block, row by row.
    fn blocks(&self, [width, height]: [usize; 2]) -> Vec<[f64; 2]> {
        let mut sums = vec![[0.0; 3]; BLOCKS * BLOCKS];
        for (i, pixel) in self.sums.iter().enumerate() {
            let [x, y] = [i % width * BLOCKS / width, i / width * BLOCKS / height];
            let pixel = scale(pixel, self.samples);
            let sum = &mut sums[y * BLOCKS + x];
            let more = [luminance(pixel.mean), f64::from(pixel.variance[3]), 1.0];
            *sum = std::array::from_fn(|c| sum[c] + more[c]);
        }
        // The variance of a block's mean exceeds what its pixels' variances suggest, because a filter spreads each sample over several
        // pixels: at most by the factor by which it reduces the variance of a pixel, which is bounded by this.
        let shared = 8.0;
        sums.iter().map(|[sum, var, n]| [sum / n.max(1.0), shared * var / (n * n).max(1.0)]).collect()
    }
}

fn add(sum: &mut NoisyPixel, weight: f64, mean: [f32; 3], variance: [f32; 4]) {
    for (sum, mean) in sum.mean.iter_mut().zip(mean) {
        *sum += (weight * f64::from(mean)) as f32;
    }
    for (sum, variance) in sum.variance.iter_mut().zip(variance) {
        *sum += (weight * weight * f64::from(variance)) as f32;
    }
}

fn scale(sum: &NoisyPixel, weight: f64) -> NoisyPixel {
    NoisyPixel {
        mean: sum.mean.map(|sum| (f64::from(sum) / weight) as f32),
        variance: sum.variance.map(|sum| (f64::from(sum) / (weight * weight)) as f32),
    }
}

/// Variance of the mean of a pixel's replicates by channel, and of its luminance.
fn variance(pixel: &ReplicatePixel) -> [f32; 4] {
    let [r, g, b] = pixel.difference.map(|d| d * d * pixel.factor);
    let y = luminance(pixel.difference);
    [r, g, b, (y * y) as f32 * pixel.factor]
}

/// Relative errors of a reference at median, 95 % and 99 % of the picture, from its variance; the last number is its relMSE.
pub fn own_error(reference: &[NoisyPixel], size: [usize; 2]) -> [f64; 4] {
    let error = |pixel: &NoisyPixel| {
        let [r, g, b, y] = pixel.variance.map(f64::from);
        let own = luminance(pixel.mean);
        Some(PixelError {
            luminance: own,
            relative_to: Some(own),
            difference: 0.0,
            squares: [r, g, b],
            square: y,
        })
    };
    let estimate = ErrorField::of(reference.iter().map(error), size).map(|f| f.estimate(TileSubset::All));
    let [a, b, c] = estimate.unwrap_or_default().relative.map(|i| i.value);
    [a, b, c, estimate.unwrap_or_default().rel_mse.value]
}

/// Error of a picture of `size` pixels against a reference, after subtracting the reference's own.
pub fn error_against(rgb: &[[f32; 3]], reference: &[NoisyPixel], size: [usize; 2]) -> Option<ErrorField> {
    let error = |(x, r): (&[f32; 3], &NoisyPixel)| {
        let difference: [f32; 3] = std::array::from_fn(|c| x[c] - r.mean[c]);
        let [vr, vg, vb, vy] = r.variance.map(f64::from);
        let [dr, dg, db] = difference.map(|d| f64::from(d).powi(2));
        let square = luminance(difference).powi(2) - vy;
        let own = luminance(r.mean);
        let squares = [dr - vr, dg - vg, db - vb];
        Some(PixelError { luminance: own, relative_to: Some(own), difference: 0.0, squares, square })
    };
    (rgb.len() == reference.len())
        .then(|| ErrorField::of(rgb.iter().zip(reference).map(error), size))
        .flatten()
}
