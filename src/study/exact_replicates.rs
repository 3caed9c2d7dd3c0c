//! Sums of each replicate in fixed point: bit-identical for any order of samples and parts of a render.

use crate::image::Grid;
use crate::math::exact_sum::ExactSum;
use crate::stream::{PathCounts, REPLICATES, Sample, replicate};
use crate::study::largest::LargestSamples;
use crate::study::replicates::{ReplicateSums, Replicates, pixel_of};

/// Sums of the samples in one pixel: X, Y and Z in units of the luminance scale, and weights.
pub type ExactPixel = [ExactSum; 4];

/// Exact counterpart of [`Replicates`].
#[derive(Clone, Debug)]
pub struct ExactReplicates {
    size: [usize; 2],
    energy: f32,
    luminance_scale: f32,
    /// The parts of the picture.
    pub parts: [ExactPart; REPLICATES],
    /// The largest samples of each tile.
    pub largest: LargestSamples,
}

/// Exact sums of one replicate.
#[derive(Clone, Debug, Default)]
pub struct ExactPart {
    /// Sums of the camera stream and of the light stream; `None` before its first sample.
    pub streams: [Option<Grid<ExactPixel>>; 2],
    /// Paths so far.
    pub paths: PathCounts,
}

impl ExactReplicates {
    /// Empty sums, as [`Replicates::new`], with colours in units of `luminance_scale`, a power of two.
    pub fn new(size: [u32; 2], energy: f32, luminance_scale: f32) -> Self {
        let size = size.map(|n| n as usize);
        Self { size, energy, luminance_scale, parts: Default::default(), largest: LargestSamples::new(size) }
    }

    /// Paths so far, in all replicates.
    pub fn paths(&self) -> u64 {
        self.parts.iter().map(|part| part.paths.camera.max(part.paths.light)).sum()
    }

    /// Adds a block; see [`Replicates::add`].
    pub fn add(&mut self, first_index: u64, paths: PathCounts, samples: &[Sample]) {
        let part = &mut self.parts[replicate(first_index).0];
        part.count_paths(paths);
        for sample in samples {
            let Some([x, y]) = pixel_of(self.size, sample.uv) else { continue };
            self.largest.add([x, y], sample.xyz.y / sample.w.max(1.0));
            let Some(sums) = part.stream(usize::from(sample.w < 0.0), self.size) else { continue };
            let unit = |value: f32| (value / self.luminance_scale).min(f32::MAX);
            let [sx, sy, sz] = [sample.xyz.x, sample.xyz.y, sample.xyz.z].map(unit);
            for (sum, value) in sums.row_mut(y)[x].iter_mut().zip([sx, sy, sz, sample.w.abs()]) {
                sum.add(value);
            }
        }
    }

    /// Sums rounded to single precision, for the error estimate.
    pub fn rounded(&self) -> Replicates {
        let mut rounded = Replicates::new(self.size.map(|n| n as u32), self.energy);
        rounded.largest = self.largest.clone();
        for (part, rounded) in self.parts.iter().zip(&mut rounded.parts) {
            let round = |stream: &Option<Grid<ExactPixel>>| -> Vec<[f32; 4]> {
                let pixels = stream.iter().flat_map(Grid::pixels);
                let colour = |sum: ExactSum| sum.to_f32() * self.luminance_scale;
                pixels.map(|&[x, y, z, w]| [colour(x), colour(y), colour(z), w.to_f32()]).collect()
            };
            let [camera, light] = part.streams.each_ref().map(round);
            *rounded = ReplicateSums { camera, light, paths: part.paths };
        }
        rounded
    }
}

impl ExactPart {
    /// Sums of the camera stream (0) or the light stream (1) of a picture of `size` pixels, created if absent; `None` if memory runs out.
    pub fn stream(&mut self, stream: usize, size: [usize; 2]) -> Option<&mut Grid<ExactPixel>> {
        let sums = &mut self.streams[stream];
        if sums.is_none() {
            *sums = Grid::try_filled(size[0], size[1], ExactPixel::default());
        }
        sums.as_mut()
    }

    /// Counts paths.
    pub fn count_paths(&mut self, paths: PathCounts) {
        self.paths.camera = self.paths.camera.saturating_add(paths.camera);
        self.paths.light = self.paths.light.saturating_add(paths.light);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Xyz;
    use crate::math::random::Random;
    use crate::stream::CHUNK;

    /// Exact sums in two orders have the same bits, and agree with the plain ones within their rounding.
    #[test]
    fn exact_sums_are_the_plain_ones_in_any_order() {
        let mut random = Random(3);
        let mut next = || random.f32();
        let blocks: Vec<Vec<Sample>> = (0..40)
            .map(|i| {
                let w = if i % 5 == 4 { -1.0 } else { 1.0 };
                let sample = |_| Sample {
                    uv: [1.2 * next() - 0.1, 1.2 * next() - 0.1],
                    xyz: Xyz::new(next(), 8.0 * next(), next()),
                    w,
                };
                (0..CHUNK).map(sample).collect()
            })
            .collect();
        let paths = |samples: &[Sample]| match samples[0].w > 0.0 {
            true => PathCounts { camera: CHUNK, light: 0 },
            false => PathCounts { camera: 0, light: CHUNK },
        };
        let [mut there, mut back] = [0; 2].map(|_| ExactReplicates::new([40, 24], 1.0, 0.5));
        let mut plain = Replicates::new([40, 24], 1.0);
        for (i, samples) in blocks.iter().enumerate() {
            there.add(i as u64 * CHUNK, paths(samples), samples);
            plain.add(i as u64 * CHUNK, paths(samples), samples);
        }
        for (i, samples) in blocks.iter().enumerate().rev() {
            back.add(i as u64 * CHUNK, paths(samples), samples);
        }
        for (a, b) in there.parts.iter().zip(&back.parts) {
            assert_eq!((&a.streams, a.paths), (&b.streams, b.paths));
        }
        assert_eq!(there.largest, back.largest);
        assert_eq!(there.paths(), plain.paths());
        let [exact, plain] = [there.rounded(), plain].map(|sums| sums.pixels().expect("both have paths"));
        for (exact, plain) in exact.iter().zip(&plain) {
            for (a, b) in exact.mean.iter().zip(plain.mean) {
                assert!((a - b).abs() <= 1e-4 * (1.0 + b.abs()), "{exact:?} {plain:?}");
            }
        }
    }
}
