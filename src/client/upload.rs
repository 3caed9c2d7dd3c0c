//! From samples to mapped vertex memory: the batch, and the two buffers that frames in flight read.

use std::ops::Range;
use std::sync::Arc;

use crate::client::error::ClientError;
use crate::client::merge::{MAX_MERGED, Merger};
use crate::client::settings::{BATCH_CAPACITY, FilmSpec};
use crate::gpu::{Buffer, BufferUse, FrameNumber, Gpu};
use crate::stream::Sample;

/// Texels on a side of the squares by which a batch is sorted. lavapipe rasterises in tiles of this size and gains
/// 18 to 36 %; other devices gain from locality.
const TILE: f32 = 64.0;

/// Bytes of a vertex.
pub const STRIDE: usize = size_of::<Sample>();

/// Samples that wait for the next flush, in the order in which they came.
#[derive(Default)]
pub struct SampleBatch {
    samples: Vec<Sample>,
    /// Bucket of every sample: its tile, then the same for samples of dense cells, then both for the light stream.
    buckets: Vec<u32>,
    /// Start of every bucket in the sorted order.
    starts: Vec<u32>,
    /// Those of the camera and of the light stream.
    mergers: [Merger; 2],
}

/// The samples of one stream in a vertex buffer.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StreamVertices {
    /// All of them.
    pub all: Range<u32>,
    /// Those outside of dense cells: the front of `all`.
    pub single: Range<u32>,
    /// What the others were merged to, at positions in padded texels.
    pub merged: Range<u32>,
}

/// The two streams in a vertex buffer: camera at the front, light behind it, merged samples at the end.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Partition {
    /// Vertices of the camera stream.
    pub camera: StreamVertices,
    /// Vertices of the light stream.
    pub light: StreamVertices,
}

impl SampleBatch {
    /// Adds one valid sample; [`BATCH_CAPACITY`] at most.
    #[inline]
    pub fn push(&mut self, sample: Sample) {
        self.samples.push(sample);
    }

    /// Forgets all samples.
    pub fn clear(&mut self) {
        self.samples.clear();
    }

    /// Writes the samples to `vertices` and forgets them.
    ///
    /// Stable within a tile of a stream, so the order depends on nothing but the order of arrival. Samples
    /// outside the padded target are left out.
    fn write(&mut self, spec: &FilmSpec, vertices: &mut [Sample]) -> Partition {
        let [width, height] = spec.padded_extent().map(|n| n as f32);
        let columns = (width / TILE).ceil() as u32;
        let tiles = columns * (height / TILE).ceil() as u32;
        let outside = 4 * tiles;
        self.starts.clear();
        self.starts.resize(outside as usize + 2, 0);
        self.buckets.clear();
        self.mergers.iter_mut().for_each(|merger| merger.begin(spec));
        for sample in &self.samples {
            let p = spec.texel_position(sample.uv);
            let inside = spec.holds(p);
            let tile = (p[1] * TILE.recip()) as u32 * columns + (p[0] * TILE.recip()) as u32;
            let bucket = match (inside, sample.w > 0.0) {
                (false, _) => outside,
                (true, true) => tile,
                (true, false) => 2 * tiles + tile,
            };
            if inside {
                self.mergers[usize::from(bucket >= 2 * tiles)].count(p);
            }
            self.buckets.push(bucket);
            self.starts[bucket as usize + 1] += 1;
        }
        if self.mergers.iter().any(Merger::found) {
            self.merge(spec, tiles);
        }
        for i in 1..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        let start = |bucket: u32| self.starts[bucket as usize];
        let stream = |first: u32| StreamVertices {
            all: start(first)..start(first + 2 * tiles),
            single: start(first)..start(first + tiles),
            merged: 0..0,
        };
        let mut parts = [stream(0), stream(2 * tiles)];
        for (sample, bucket) in self.samples.drain(..).zip(&self.buckets) {
            if *bucket < outside {
                let place = &mut self.starts[*bucket as usize];
                vertices[*place as usize] = sample;
                *place += 1;
            }
        }
        let mut end = vertices.len();
        for (part, merger) in parts.iter_mut().zip(&mut self.mergers) {
            let merged = merger.take();
            let first = end - merged.len();
            vertices[first..end].copy_from_slice(&merged);
            part.merged = first as u32..end as u32;
            end = first;
        }
        let [camera, light] = parts;
        Partition { camera, light }
    }

    /// Adds up the samples of dense cells and moves them to the buckets of such.
    #[cold]
    fn merge(&mut self, spec: &FilmSpec, tiles: u32) {
        let stream = |bucket: u32| usize::from(bucket >= 2 * tiles);
        let drawn = || self.samples.iter().zip(&self.buckets).filter(|(_, bucket)| **bucket < 4 * tiles);
        for (sample, bucket) in drawn() {
            self.mergers[stream(*bucket)].confirm(spec.texel_position(sample.uv));
        }
        for (sample, bucket) in self.samples.iter().zip(&mut self.buckets) {
            let (p, from) = (spec.texel_position(sample.uv), *bucket);
            if from < 4 * tiles && self.mergers[stream(from)].is_dense(p) {
                self.mergers[stream(from)].add(p, sample);
                *bucket += tiles;
                self.starts[from as usize + 1] -= 1;
                self.starts[*bucket as usize + 1] += 1;
            }
        }
    }
}

/// Two mapped buffers: one is written while the GPU may still read the other.
pub struct VertexBuffers {
    gpu: Arc<Gpu>,
    buffers: [(Buffer, FrameNumber); 2],
    next: usize,
}

impl VertexBuffers {
    /// Buffers for [`BATCH_CAPACITY`] samples each, and for what is merged of them.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] when there is no memory.
    pub fn new(gpu: &Arc<Gpu>) -> Result<Self, ClientError> {
        let bytes = (BATCH_CAPACITY + MAX_MERGED) * STRIDE;
        let make = |name| Buffer::new(gpu, name, BufferUse::Vertices, bytes);
        let pair = [make("samples 0")?, make("samples 1")?];
        let buffers = pair.map(|buffer| (buffer, FrameNumber::default()));
        Ok(Self { gpu: gpu.clone(), buffers, next: 0 })
    }

    /// Moves a batch into the next buffer, as soon as the GPU has finished with it.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] when the device was lost.
    pub fn upload(
        &mut self,
        batch: &mut SampleBatch,
        spec: &FilmSpec,
    ) -> Result<(&Buffer, Partition), ClientError> {
        let (buffer, frame) = &mut self.buffers[self.next];
        if *frame > FrameNumber::default() {
            self.gpu.wait(*frame)?;
        }
        let partition = batch.write(spec, bytemuck::cast_slice_mut(buffer.mapped_mut()));
        Ok((buffer, partition))
    }

    /// Notes the frame that reads the buffer of the last [`upload`](Self::upload).
    pub fn submitted(&mut self, frame: FrameNumber) {
        self.buffers[self.next].1 = frame;
        self.next = 1 - self.next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::settings::{ScaledFilter, SplatFilter};
    use crate::color::Xyz;

    fn spec(filter: SplatFilter) -> FilmSpec {
        FilmSpec {
            width: 100,
            height: 70,
            filter,
            variance: Some(Default::default()),
            sums: Default::default(),
        }
    }

    /// Camera at the front, light behind it, stable within a tile, the outside left out.
    #[test]
    fn partition_is_stable() {
        let spec = spec(SplatFilter::Gaussian);
        let mut batch = SampleBatch::default();
        let sample = |i: u32| Sample {
            uv: [(i * 37 % 101) as f32 / 100.0, (i * 53 % 97) as f32 / 80.0],
            xyz: Xyz::new(i as f32, 1.0, 1.0),
            w: if i.is_multiple_of(3) { -1.0 } else { 1.0 },
        };
        (0..300).for_each(|i| batch.push(sample(i)));
        let mut vertices = vec![Sample::default(); 512];
        let parts = batch.write(&spec, &mut vertices);
        assert!(batch.samples.is_empty());
        assert_eq!((parts.camera.all.start, parts.camera.all.end), (0, parts.light.all.start));

        let inside = |s: &Sample| spec.holds(spec.texel_position(s.uv));
        let tile = |s: &Sample| spec.texel_position(s.uv).map(|x| (x / 64.0) as i32);
        for (part, sign) in [(parts.camera, 1.0), (parts.light, -1.0)] {
            assert!(part.single == part.all && part.merged.is_empty());
            let got = &vertices[part.all.start as usize..part.all.end as usize];
            let mut wanted: Vec<Sample> = (0..300).map(sample).filter(|s| s.w == sign && inside(s)).collect();
            wanted.sort_by_key(|s| (tile(s)[1], tile(s)[0]));
            assert_eq!(got, wanted);
        }
        assert!((0..300).map(sample).any(|s| !inside(&s)), "case too easy: nothing lies outside");
    }

    /// Samples of a dense cell become those at the centres around it, with the same total and centre of gravity; the others, and all
    /// those of filters that are not linear, stay as they are.
    #[test]
    fn dense_cells_are_merged() {
        let scaled = SplatFilter::Scaled(ScaledFilter::Gaussian { stddev: 500 });
        for (filter, centres) in
            [(SplatFilter::Gaussian, 4), (SplatFilter::Tent, 4), (SplatFilter::Box, 1), (scaled, 0)]
        {
            let spec = spec(filter);
            let limit = 8 * spec.batch_slots();
            let mut batch = SampleBatch::default();
            // In the cell between (and for the box, right below) the centres of texels 40 and 41.
            let dense: Vec<Sample> = (0..limit + 1)
                .map(|i| {
                    let t = [(i % 7) as f32 * 0.05, (i % 11) as f32 * 0.04];
                    let p = [40.52 + t[0], 40.52 + t[1]].map(|p| p - spec.pad() as f32);
                    let (x, w) = ((i % 13) as f32, 1.0 + (i % 3) as f32);
                    Sample { uv: [p[0] / 100.0, p[1] / 70.0], xyz: Xyz::new(x, 2.0, 3.0), w }
                })
                .collect();
            let lone = Sample { uv: [0.9, 0.9], xyz: Xyz::new(1.0, 1.0, 1.0), w: 1.0 };
            dense.iter().for_each(|s| batch.push(*s));
            batch.push(lone);
            let mut vertices = vec![Sample::default(); dense.len() + 1 + MAX_MERGED];
            let part = batch.write(&spec, &mut vertices).camera;
            let range = |r: &Range<u32>| r.start as usize..r.end as usize;
            assert_eq!(part.all.len(), dense.len() + 1);
            let merged = &vertices[range(&part.merged)];
            assert_eq!(merged.len(), centres, "{filter:?}");
            if centres == 0 {
                assert_eq!(part.single, part.all);
                continue;
            }
            assert_eq!(&vertices[range(&part.single)], &[lone]);
            let total = |samples: &[Sample], f: &dyn Fn(&Sample) -> f32| {
                samples.iter().map(|s| f64::from(f(s))).sum::<f64>()
            };
            for f in [|s: &Sample| s.w, |s: &Sample| s.xyz.x, |s: &Sample| s.xyz.y, |s: &Sample| s.xyz.z] {
                assert!((total(merged, &f) / total(&dense, &f) - 1.0).abs() < 1e-6, "{filter:?}");
            }
            for i in 0..2usize {
                assert!(merged.iter().all(|s| s.uv[i].fract() == 0.5));
                let weights = |s: &Sample| s.w;
                let place = total(merged, &|s: &Sample| s.w * s.uv[i]) / total(merged, &weights);
                let wanted = total(&dense, &|s: &Sample| s.w * spec.texel_position(s.uv)[i]);
                let wanted = wanted / total(&dense, &weights);
                assert!(filter == SplatFilter::Box || (place - wanted).abs() < 1e-5, "{filter:?}");
            }
        }
    }

    /// As many dense cells as a batch can have fit.
    #[test]
    fn the_densest_batch_fits() {
        let spec = FilmSpec { width: 16_000, height: 16_000, ..spec(SplatFilter::Gaussian) };
        let mut batch = SampleBatch::default();
        for i in 0..BATCH_CAPACITY as u32 {
            let cell = i / 9;
            let uv = [(cell % 100) as f32 * 0.008 + 0.1, (cell / 100) as f32 * 0.01 + 0.1];
            batch.push(Sample { uv, xyz: Xyz::new(1.0, 1.0, 1.0), w: 1.0 });
        }
        let mut vertices = vec![Sample::default(); BATCH_CAPACITY + MAX_MERGED];
        let part = batch.write(&spec, &mut vertices).camera;
        assert!(part.merged.len() > MAX_MERGED / 2 && part.merged.start >= part.all.end, "{part:?}");
    }
}
