//! From samples to mapped vertex memory: the batch, and the two buffers that frames in flight read.

use std::ops::Range;
use std::sync::Arc;

use crate::client::error::ClientError;
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
    /// Bucket of every sample: its tile, those of the light stream after those of the camera stream.
    buckets: Vec<u32>,
    /// Start of every bucket in the sorted order.
    starts: Vec<u32>,
}

/// The ranges of the two streams in a vertex buffer: camera at the front, light at the back.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Partition {
    /// Vertices of the camera stream.
    pub camera: Range<u32>,
    /// Vertices of the light stream.
    pub light: Range<u32>,
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
        let outside = 2 * tiles;
        self.starts.clear();
        self.starts.resize(outside as usize + 2, 0);
        self.buckets.clear();
        for sample in &self.samples {
            let p = spec.texel_position(sample.uv);
            // False for NaN as well.
            let inside = p[0] >= 0.0 && p[1] >= 0.0 && p[0] < width && p[1] < height;
            let tile = (p[1] * TILE.recip()) as u32 * columns + (p[0] * TILE.recip()) as u32;
            let bucket = match (inside, sample.w > 0.0) {
                (false, _) => outside,
                (true, true) => tile,
                (true, false) => tiles + tile,
            };
            self.buckets.push(bucket);
            self.starts[bucket as usize + 1] += 1;
        }
        for i in 1..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        let (camera, drawn) = (self.starts[tiles as usize], self.starts[outside as usize]);
        let gap = vertices.len() as u32 - drawn;
        for start in &mut self.starts[tiles as usize..outside as usize] {
            *start += gap;
        }
        for (sample, bucket) in self.samples.drain(..).zip(&self.buckets) {
            if *bucket < outside {
                let place = &mut self.starts[*bucket as usize];
                vertices[*place as usize] = sample;
                *place += 1;
            }
        }
        Partition { camera: 0..camera, light: camera + gap..drawn + gap }
    }
}

/// Two mapped buffers: one is written while the GPU may still read the other.
pub struct VertexBuffers {
    gpu: Arc<Gpu>,
    buffers: [(Buffer, FrameNumber); 2],
    next: usize,
}

impl VertexBuffers {
    /// Buffers for [`BATCH_CAPACITY`] samples each.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] when there is no memory.
    pub fn new(gpu: &Arc<Gpu>) -> Result<Self, ClientError> {
        let make = |name| Buffer::new(gpu, name, BufferUse::Vertices, BATCH_CAPACITY * STRIDE);
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
    use crate::color::Xyz;

    /// Camera at the front, light at the back, stable within a tile, the outside left out.
    #[test]
    fn partition_is_stable() {
        let spec = FilmSpec {
            width: 100,
            height: 70,
            filter: Default::default(),
            variance: Some(Default::default()),
            sums: Default::default(),
        };
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
        assert_eq!((parts.camera.start, parts.light.end), (0, 512));

        let [w, h] = spec.padded_extent().map(|n| n as f32);
        let inside = |s: &Sample| {
            let p = spec.texel_position(s.uv);
            p[0] < w && p[1] < h
        };
        let tile = |s: &Sample| spec.texel_position(s.uv).map(|x| (x / 64.0) as i32);
        for (range, sign) in [(parts.camera, 1.0), (parts.light, -1.0)] {
            let got = &vertices[range.start as usize..range.end as usize];
            let mut wanted: Vec<Sample> = (0..300).map(sample).filter(|s| s.w == sign && inside(s)).collect();
            wanted.sort_by_key(|s| (tile(s)[1], tile(s)[0]));
            assert_eq!(got, wanted);
        }
        assert!((0..300).map(sample).any(|s| !inside(&s)), "case too easy: nothing lies outside");
    }
}
