//! The sums of each replicate, pixel by pixel, from which the error of a picture is estimated while it is rendered.
//!
//! A sample is added to the one pixel it lies in, which is a single addition to memory. The effect of the film's wider filter is
//! computed from these sums when an estimate is due (`smooth`).

use std::ops::Range;

use crate::color::{Profile, Xyz};
use crate::stream::{PathCounts, REPLICATES, Sample, replicate};
use crate::study::error::ErrorField;
use crate::study::error_tile::ReplicatePixel;
use crate::study::largest::{LargestSamples, LargestShares};
use crate::study::smooth::SmoothingKernel;

/// Sums `[X, Y, Z, W]` of the camera stream and `[X, Y, Z]` of the light stream per pixel, for each replicate.
#[derive(Clone, Debug)]
pub struct Replicates {
    size: [usize; 2],
    kernel: SmoothingKernel,
    pub(super) parts: [ReplicateSums; REPLICATES],
    pub(super) largest: LargestSamples,
    /// Whether weights of camera samples are the inverse of their density on the screen. Otherwise a sample of weight n represents n
    /// samples.
    density_weights: bool,
}

/// Sums of one replicate; those of a stream are empty before its first sample.
#[derive(Clone, Debug, Default)]
pub(super) struct ReplicateSums {
    pub(super) camera: Vec<[f32; 4]>,
    pub(super) light: Vec<[f32; 4]>,
    pub(super) paths: PathCounts,
}

/// Pixel that contains a sample; `None` outside of the picture.
#[inline]
pub(super) fn pixel_of([width, height]: [usize; 2], uv: [f32; 2]) -> Option<[usize; 2]> {
    let [x, y] = [uv[0] * width as f32, uv[1] * height as f32];
    // False for NaN as well.
    let inside = x >= 0.0 && y >= 0.0 && x < width as f32 && y < height as f32;
    inside.then_some([x as usize, y as usize])
}

impl Replicates {
    /// Empty sums of a picture of `size` pixels, whose film has a filter of this
    /// [energy](crate::client::SplatFilter::energy) (1 for the box).
    pub fn new(size: [u32; 2], energy: f32) -> Self {
        let size = size.map(|n| n as usize);
        Self {
            size,
            kernel: SmoothingKernel::of_energy(energy),
            parts: Default::default(),
            largest: LargestSamples::new(size),
            density_weights: false,
        }
    }

    /// From now on weights of camera samples are the inverse of their density on the screen.
    pub fn set_density_weights(&mut self) {
        self.density_weights = true;
    }

    /// These sums, with weights that mean the same as those of `other`.
    pub(super) fn weighted_as(self, other: &Self) -> Self {
        Self { density_weights: other.density_weights, ..self }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Paths so far, in all replicates.
    pub fn paths(&self) -> u64 {
        self.paths_of_parts().into_iter().sum()
    }

    /// Empty sums for the same picture.
    pub(super) fn empty(&self) -> Self {
        Self { parts: Default::default(), largest: LargestSamples::new(self.size), ..*self }
    }

    /// One replicate as a picture with two replicates: its samples in `some`, which was given part of the blocks, and its others.
    pub(super) fn divided(&self, some: &Self, replicate: usize) -> Self {
        let (all, some) = (&self.parts[replicate], &some.parts[replicate]);
        Self { parts: [some.clone(), all.without(some)], ..self.empty() }
    }

    /// Paths of each replicate.
    pub(super) fn paths_of_parts(&self) -> [u64; REPLICATES] {
        self.parts.each_ref().map(|part| part.paths.camera.max(part.paths.light))
    }

    /// Error of the picture of these [`pixels`](Self::pixels), and fractions of its light in the largest samples. `None` while both
    /// replicates have reached too few pixels.
    pub fn error(&self, pixels: &[ReplicatePixel]) -> Option<(ErrorField, LargestShares)> {
        self.error_with(pixels, self.per_pixel())
    }

    /// As [`error`](Self::error), for pixels with this many samples each, some of which are not in these sums.
    pub(super) fn error_with(
        &self,
        pixels: &[ReplicatePixel],
        per_pixel: f64,
    ) -> Option<(ErrorField, LargestShares)> {
        let mut field = ErrorField::new(pixels, self.size)?;
        let sums: Vec<f64> = field.luminances().map(|sum| sum * per_pixel).collect();
        let excess: Vec<f64> = self.largest.excess().iter().map(|excess| excess / per_pixel).collect();
        field.spread(&excess);
        Some((field, self.largest.shares(&sums)))
    }

    /// Samples per pixel, by which the luminances of the [largest](LargestSamples) samples are divided.
    pub(super) fn per_pixel(&self) -> f64 {
        let samples = match self.density_weights {
            true => self.parts.iter().flat_map(|part| &part.camera).map(|sum| f64::from(sum[3])).sum(),
            false => self.paths() as f64,
        };
        // Positive, to avoid dividing by zero: without samples there are no large ones either.
        (samples / (self.size[0] * self.size[1]) as f64).max(f64::MIN_POSITIVE)
    }

    /// Adds a block that begins at path `first_index`; no block spans two chunks.
    pub fn add(&mut self, first_index: u64, paths: PathCounts, samples: &[Sample]) {
        let [width, height] = self.size;
        let part = &mut self.parts[replicate(first_index).0];
        part.paths.camera = part.paths.camera.saturating_add(paths.camera);
        part.paths.light = part.paths.light.saturating_add(paths.light);
        for sample in samples {
            let Some([x, y]) = pixel_of(self.size, sample.uv) else { continue };
            let sums = if sample.w > 0.0 { &mut part.camera } else { &mut part.light };
            if sums.is_empty() {
                sums.resize(width * height, [0.0; 4]);
            }
            let Xyz { x: sx, y: sy, z: sz } = sample.xyz;
            // A sample that represents several counts as their mean.
            let count = if self.density_weights { 1.0 } else { sample.w.max(1.0) };
            self.largest.add([x, y], sy / count);
            let sum = &mut sums[y * width + x];
            for (sum, value) in sum.iter_mut().zip([sx, sy, sz, sample.w]) {
                *sum += value;
            }
        }
    }

    /// Mean X, Y, Z and sample count per pixel of these rows of one replicate, without the film's filter. The count is 0 without samples,
    /// and 1 everywhere if there are only light paths.
    pub fn half(&self, replicate: usize, rows: Range<usize>) -> Vec<[f32; 4]> {
        self.half_through(&SmoothingKernel::of_energy(1.0), replicate, rows)
    }

    /// As [`half`](Self::half), with the film's filter, and weights instead of counts.
    pub fn half_on_film(&self, replicate: usize, rows: Range<usize>) -> Vec<[f32; 4]> {
        self.half_through(&self.kernel, replicate, rows)
    }

    fn half_through(&self, kernel: &SmoothingKernel, replicate: usize, rows: Range<usize>) -> Vec<[f32; 4]> {
        let part = &self.parts[replicate];
        let half = part.xyz(self.size, kernel, rows, part.light_scale(self.size));
        self.weighted(half, part.paths.light)
    }

    /// Sums X, Y, Z over all replicates of the samples in one pixel, without the film's filter, and their number, which is 1 per replicate
    /// if there are only light paths.
    pub fn pixel(&self, x: usize, y: usize) -> [f32; 4] {
        let i = y * self.size[0] + x;
        let is_light_alone = self.is_light_alone();
        let mut all = [0.0; 4];
        for part in &self.parts {
            let seen = part.camera.get(i).copied().unwrap_or_default();
            let count = if is_light_alone && part.paths.light > 0 { 1.0 } else { seen[3] };
            let arrives = part.light.get(i).copied().unwrap_or_default();
            let scale = count * part.light_scale(self.size);
            all = std::array::from_fn(|c| all[c] + if c < 3 { seen[c] + arrives[c] * scale } else { count });
        }
        all
    }

    /// Whether there are only light paths: no camera sample has been added.
    fn is_light_alone(&self) -> bool {
        self.parts.iter().all(|part| part.camera.is_empty())
    }

    /// Sets the weight of all pixels to 1 if there are only light paths, and any of those.
    fn weighted(&self, mut pixels: Vec<[f32; 4]>, light: u64) -> Vec<[f32; 4]> {
        if light > 0 && self.is_light_alone() {
            pixels.iter_mut().for_each(|pixel| pixel[3] = 1.0);
        }
        pixels
    }

    /// Mean X, Y, Z and weight over all replicates per pixel of these rows, with the film's filter applied. The weight is 1 everywhere if
    /// there are only light paths.
    pub fn whole(&self, rows: Range<usize>) -> Vec<[f32; 4]> {
        let [width, height] = self.size;
        let near = SmoothingKernel::near(&rows, height);
        let pixels = near.start * width..near.end * width;
        let mut whole = ReplicateSums::default();
        for part in &self.parts {
            whole.paths.light += part.paths.light;
            for (sums, more) in [(&mut whole.camera, &part.camera), (&mut whole.light, &part.light)] {
                let Some(more) = more.get(pixels.clone()) else { continue };
                sums.resize(more.len(), [0.0; 4]);
                for (sum, more) in sums.iter_mut().flatten().zip(more.iter().flatten()) {
                    *sum += more;
                }
            }
        }
        let scale = whole.light_scale(self.size);
        let inside = rows.start - near.start..rows.end - near.start;
        let (pixels, light) =
            (whole.xyz([width, near.len()], &self.kernel, inside, scale), whole.paths.light);
        self.weighted(pixels, light)
    }

    /// The film's filter as applied to per-pixel sums.
    pub fn kernel(&self) -> &SmoothingKernel {
        &self.kernel
    }

    /// Mean and difference of the replicates in every pixel, linear Rec.709, with the film's filter applied. `None` before each
    /// replicate has traced a path.
    pub fn pixels(&self) -> Option<Vec<ReplicatePixel>> {
        if self.parts.iter().any(|part| part.paths == PathCounts::default()) {
            return None;
        }
        let pictures = self.parts.each_ref().map(|part| part.picture(self.size, &self.kernel));
        Some(self.compared(&pictures))
    }

    /// As [`pixels`](Self::pixels), with the difference of the camera stream alone.
    pub(super) fn camera_pixels(&self) -> Option<Vec<ReplicatePixel>> {
        let mut pixels = self.pixels()?;
        let alone = self
            .parts
            .each_ref()
            .map(|part| ReplicateSums { light: Vec::new(), ..part.clone() }.picture(self.size, &self.kernel));
        for (pixel, alone) in pixels.iter_mut().zip(self.compared(&alone)) {
            pixel.difference = alone.difference;
        }
        Some(pixels)
    }

    /// Mean and difference of the pictures of both replicates.
    fn compared(&self, pictures: &[Vec<[f32; 4]>; REPLICATES]) -> Vec<ReplicatePixel> {
        let camera = self.parts.iter().any(|part| !part.camera.is_empty());
        let total: f64 = self.parts.iter().map(|part| part.paths.light as f64).sum();
        let share = (self.parts[0].paths.light as f64 / total.max(1.0)) as f32;
        let [a, b] = pictures;
        let pixel = |(a, b): (&[f32; 4], &[f32; 4])| {
            let weight = a[3] + b[3];
            let (seen, first) = match camera {
                true => (a[3] > 0.0 && b[3] > 0.0, if weight > 0.0 { a[3] / weight } else { 0.5 }),
                false => (true, share),
            };
            let mix = |i: usize| a[i] * first + b[i] * (1.0 - first);
            ReplicatePixel {
                mean: [mix(0), mix(1), mix(2)],
                difference: [a[0] - b[0], a[1] - b[1], a[2] - b[2]],
                factor: first * (1.0 - first),
                seen,
            }
        };
        a.iter().zip(b).map(pixel).collect()
    }
}

impl ReplicateSums {
    /// These sums minus those of some of their samples.
    fn without(&self, some: &Self) -> Self {
        let rest = |all: &[[f32; 4]], some: &[[f32; 4]]| -> Vec<[f32; 4]> {
            let some = some.iter().copied().chain(std::iter::repeat([0.0; 4]));
            let pixel = |(all, some): (&[f32; 4], [f32; 4])| std::array::from_fn(|i| all[i] - some[i]);
            all.iter().zip(some).map(pixel).collect()
        };
        Self {
            camera: rest(&self.camera, &some.camera),
            light: rest(&self.light, &some.light),
            paths: PathCounts {
                camera: self.paths.camera.saturating_sub(some.paths.camera),
                light: self.paths.light.saturating_sub(some.paths.light),
            },
        }
    }

    /// Factor that converts sums of the light stream to a picture of `size` pixels; 0 without light paths.
    pub(super) fn light_scale(&self, size: [usize; 2]) -> f32 {
        if self.paths.light == 0 { 0.0 } else { (size[0] * size[1]) as f32 / self.paths.light as f32 }
    }

    /// X, Y, Z and camera weight per pixel of these rows, for sums of `size` pixels.
    pub(super) fn xyz(
        &self,
        size: [usize; 2],
        kernel: &SmoothingKernel,
        rows: Range<usize>,
        light_scale: f32,
    ) -> Vec<[f32; 4]> {
        let mut picture = match self.camera.is_empty() {
            true => vec![[0.0; 4]; size[0] * rows.len()],
            false => kernel.rows(&self.camera, size, rows.clone()),
        };
        for sum in &mut picture {
            let [x, y, z, w] = *sum;
            *sum = if w > 0.0 { [x / w, y / w, z / w, w] } else { [0.0; 4] };
        }
        if !self.light.is_empty() && light_scale > 0.0 {
            // Light beyond the border is unknown, which must not darken the pixels within.
            let [columns, lines] =
                size.map(|len| (0..len).map(|at| kernel.share(at, len)).collect::<Vec<_>>());
            let light = kernel.rows(&self.light, size, rows.clone());
            for (i, (out, sum)) in picture.iter_mut().zip(light).enumerate() {
                let scale = light_scale / (columns[i % size[0]] * lines[rows.start + i / size[0]]);
                for (out, sum) in out[..3].iter_mut().zip(sum) {
                    *out += sum * scale;
                }
            }
        }
        picture
    }

    /// As [`xyz`](Self::xyz) over the whole picture, in linear Rec.709.
    fn picture(&self, size: [usize; 2], kernel: &SmoothingKernel) -> Vec<[f32; 4]> {
        let mut picture = self.xyz(size, kernel, 0..size[1], self.light_scale(size));
        let from_xyz = Profile::srgb().from_xyz;
        for out in &mut picture {
            let rgb = from_xyz * glam::Vec3::new(out[0], out[1], out[2]);
            out[..3].copy_from_slice(&rgb.to_array());
        }
        picture
    }
}
