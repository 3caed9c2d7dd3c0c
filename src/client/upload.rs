//! From samples to vertex buffers: chunks of a batch, sorted and copied as they come, and the buffers that frames in flight read.

use std::ops::Range;
use std::sync::Arc;

use crate::client::error::ClientError;
use crate::client::merge::Merger;
use crate::client::settings::{CHUNK_SAMPLES, FilmSpec};
use crate::gpu::{Buffer, BufferUse, FrameNumber, Gpu};
use crate::stream::Sample;

/// Texels on a side of the squares by which a chunk is sorted. lavapipe rasterises in tiles of this size and gains
/// 18 to 36 %; other devices gain from locality.
const TILE: f32 = 64.0;

/// Bytes of a vertex.
pub const STRIDE: usize = size_of::<Sample>();

/// Samples that wait, in the order in which they came, and how they are sorted.
#[derive(Default)]
struct SampleSorter {
    samples: Vec<Sample>,
    /// Bucket of every sample: its tile, then the same for samples of dense cells, then both for the light stream.
    buckets: Vec<u32>,
    /// Start of every bucket in the sorted order.
    starts: Vec<u32>,
    /// The samples in that order. Vertex memory may be slow to write anywhere but in one go.
    sorted: Vec<Sample>,
    /// Those of the camera and of the light stream.
    mergers: [Merger; 2],
}

/// The samples of one stream in a sorted chunk.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct StreamRange {
    /// All of them.
    all: Range<u32>,
    /// Those outside of dense cells: the front of `all`.
    single: Range<u32>,
}

impl SampleSorter {
    /// Begins a batch.
    fn begin(&mut self, spec: &FilmSpec) {
        self.mergers.iter_mut().for_each(|merger| merger.begin(spec));
    }

    /// Sorts the samples and forgets them: camera at the front, light behind it.
    ///
    /// Stable within a tile of a stream, so the order depends on nothing but the order of arrival. Samples
    /// outside the padded target are left out.
    fn sort(&mut self, spec: &FilmSpec) -> (&[Sample], [StreamRange; 2]) {
        let [width, height] = spec.padded_extent().map(|n| n as f32);
        let columns = (width / TILE).ceil() as u32;
        let tiles = columns * (height / TILE).ceil() as u32;
        let outside = 4 * tiles;
        self.buckets.clear();
        for sample in &self.samples {
            let p = spec.texel_position(sample.uv);
            let tile = (p[1] * TILE.recip()) as u32 * columns + (p[0] * TILE.recip()) as u32;
            self.buckets.push(match (spec.holds(p), sample.w > 0.0) {
                (false, _) => outside,
                (true, true) => tile,
                (true, false) => 2 * tiles + tile,
            });
        }
        let mut streams = self.scatter(tiles);
        // Tile by tile, so that neighbours find the counts of a cell in the cache: a table of a large film is larger than that.
        for (merger, StreamRange { all, .. }) in self.mergers.iter_mut().zip(&streams) {
            for sample in &self.sorted[all.start as usize..all.end as usize] {
                merger.count(spec.texel_position(sample.uv));
            }
        }
        if self.mergers.iter().any(Merger::found) {
            self.merge(spec, tiles);
            streams = self.scatter(tiles);
        }
        self.samples.clear();
        (&self.sorted[..streams[1].all.end as usize], streams)
    }

    /// Puts the samples in the order of their buckets: two for each of so many tiles of the camera stream, two of the light stream, and what
    /// lies outside.
    fn scatter(&mut self, tiles: u32) -> [StreamRange; 2] {
        let starts = &mut self.starts;
        starts.clear();
        starts.resize(4 * tiles as usize + 2, 0);
        for bucket in &self.buckets {
            starts[*bucket as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let start = |bucket: u32| starts[bucket as usize];
        let stream = |first: u32| StreamRange {
            all: start(first)..start(first + 2 * tiles),
            single: start(first)..start(first + tiles),
        };
        let streams = [stream(0), stream(2 * tiles)];
        self.sorted.resize(self.samples.len(), Sample::default());
        for (sample, bucket) in self.samples.iter().zip(&self.buckets) {
            let place = &mut starts[*bucket as usize];
            self.sorted[*place as usize] = *sample;
            *place += 1;
        }
        streams
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
            }
        }
    }

    /// What the samples of the camera's and the light's dense cells were merged to, at positions in padded texels.
    fn merged(&mut self) -> [Vec<Sample>; 2] {
        self.mergers.each_mut().map(Merger::take)
    }
}

/// Vertices in one of the buffers of a batch.
#[derive(Clone, Debug)]
struct VertexRange {
    buffer: usize,
    range: Range<u32>,
}

/// Vertices of one stream of a batch; none of the ranges is empty.
#[derive(Debug, Default)]
struct StreamVertices {
    /// All samples.
    all: Vec<VertexRange>,
    /// Those outside of dense cells.
    single: Vec<VertexRange>,
    /// What the others were merged to, at positions in padded texels.
    merged: Vec<VertexRange>,
}

/// The part of a stream's samples that a draw takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexPart {
    /// All samples.
    All,
    /// Those outside of dense cells.
    Single,
    /// What the others were merged to, at positions in padded texels.
    Merged,
}

/// The samples of a batch: those that wait for their chunk, and the chunks in mapped buffers.
pub struct BatchVertices {
    gpu: Arc<Gpu>,
    sorter: SampleSorter,
    /// Each holds a chunk, and has the last frame that reads it; those of the batch come first.
    buffers: Vec<(Buffer, FrameNumber)>,
    /// Number of buffers that the batch has filled, and that the last one had.
    filled: usize,
    filled_before: usize,
    /// Whether the batch has begun.
    begun: bool,
    /// Camera and light.
    streams: [StreamVertices; 2],
}

impl BatchVertices {
    /// No samples; buffers are made when they are needed.
    pub fn new(gpu: &Arc<Gpu>) -> Self {
        Self {
            gpu: gpu.clone(),
            sorter: SampleSorter::default(),
            buffers: Vec::new(),
            filled: 0,
            filled_before: 0,
            begun: false,
            streams: Default::default(),
        }
    }

    /// Adds one valid sample; when the chunk [is full](Self::is_chunk_full), [`store`](Self::store) must be next.
    #[inline]
    pub fn push(&mut self, sample: Sample) {
        self.sorter.samples.push(sample);
    }

    /// Whether the chunk is full.
    #[inline]
    pub fn is_chunk_full(&self) -> bool {
        self.sorter.samples.len() >= CHUNK_SAMPLES
    }

    /// Forgets the batch.
    pub fn clear(&mut self) {
        self.sorter.samples.clear();
        self.streams = Default::default();
        (self.filled, self.begun) = (0, false);
    }

    /// Moves the waiting samples into a buffer.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] when there is no memory or the device was lost; the samples are lost.
    pub fn store(&mut self, spec: &FilmSpec) -> Result<(), ClientError> {
        if self.sorter.samples.is_empty() {
            return Ok(());
        }
        if !std::mem::replace(&mut self.begun, true) {
            self.sorter.begin(spec);
        }
        let buffer = self.filled;
        // Sorted first: the device goes on meanwhile.
        let (sorted, ranges) = self.sorter.sort(spec);
        if sorted.is_empty() {
            return Ok(());
        }
        let spare = self.filled_before;
        copy(&self.gpu, &mut self.buffers, buffer, spare, sorted)?;
        self.filled += 1;
        for (stream, StreamRange { all, single }) in self.streams.iter_mut().zip(ranges) {
            let part = |range: Range<u32>| (!range.is_empty()).then_some(VertexRange { buffer, range });
            stream.all.extend(part(all));
            stream.single.extend(part(single));
        }
        Ok(())
    }

    /// Whether the batch must end although it is not full: its samples are too dense.
    pub fn is_too_dense(&self) -> bool {
        self.begun && self.sorter.mergers.iter().any(Merger::is_full)
    }

    /// Moves the last chunk, and what samples were merged to, into buffers: the batch can be drawn.
    ///
    /// # Errors
    ///
    /// As [`store`](Self::store).
    pub fn finish(&mut self, spec: &FilmSpec) -> Result<(), ClientError> {
        self.store(spec)?;
        for (stream, merged) in self.sorter.merged().into_iter().enumerate() {
            for samples in merged.chunks(CHUNK_SAMPLES) {
                let buffer = self.filled;
                copy(&self.gpu, &mut self.buffers, buffer, self.filled_before, samples)?;
                self.filled += 1;
                let range = 0..samples.len() as u32;
                self.streams[stream].merged.push(VertexRange { buffer, range });
            }
        }
        Ok(())
    }

    /// Whether a stream, 0 of the camera and 1 of light, has no samples to be drawn.
    pub fn is_empty(&self, stream: usize) -> bool {
        self.streams[stream].all.is_empty()
    }

    /// Buffers and ranges of vertices of a part of a stream.
    pub fn ranges(&self, stream: usize, part: VertexPart) -> impl Iterator<Item = (&Buffer, &Range<u32>)> {
        let vertices = &self.streams[stream];
        let ranges = match part {
            VertexPart::All => &vertices.all,
            VertexPart::Single => &vertices.single,
            VertexPart::Merged => &vertices.merged,
        };
        ranges.iter().map(|VertexRange { buffer, range }| (&self.buffers[*buffer].0, range))
    }

    /// Notes the frame that reads the batch, and begins the next one.
    pub fn submitted(&mut self, frame: FrameNumber) {
        for (_, last) in &mut self.buffers[..self.filled] {
            *last = frame;
        }
        // The next batch takes those that have rested longest.
        self.buffers.rotate_left(self.filled);
        let filled = self.filled;
        self.clear();
        self.filled_before = filled;
    }
}

/// Copies samples into the buffer of this index, once the device has finished with it. There is one buffer more than the `busy` ones of the
/// last batch, where there is memory: it is filled while the device reads those.
fn copy(
    gpu: &Arc<Gpu>,
    buffers: &mut Vec<(Buffer, FrameNumber)>,
    index: usize,
    busy: usize,
    samples: &[Sample],
) -> Result<(), ClientError> {
    if index >= buffers.len() || buffers.len() <= busy {
        let name = format!("samples {}", buffers.len());
        match Buffer::new(gpu, &name, BufferUse::Vertices, CHUNK_SAMPLES * STRIDE) {
            Ok(buffer) => buffers.insert(index, (buffer, FrameNumber::default())),
            Err(error) if index >= buffers.len() => return Err(error.into()),
            Err(_) => {}
        }
    }
    let (buffer, frame) = &mut buffers[index];
    if *frame > FrameNumber::default() {
        gpu.wait(*frame)?;
    }
    buffer.mapped_mut()[..size_of_val(samples)].copy_from_slice(bytemuck::cast_slice(samples));
    Ok(())
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

    /// Sorts samples as one batch; returns them with the ranges of camera and light, and what is merged of each.
    fn sort(spec: &FilmSpec, samples: &[Sample]) -> (Vec<Sample>, [StreamRange; 2], [Vec<Sample>; 2]) {
        let mut sorter = SampleSorter::default();
        sorter.begin(spec);
        sorter.samples.extend(samples);
        let (sorted, ranges) = sorter.sort(spec);
        let sorted = sorted.to_vec();
        (sorted, ranges, sorter.merged())
    }

    fn of<'s>(samples: &'s [Sample], range: &Range<u32>) -> &'s [Sample] {
        &samples[range.start as usize..range.end as usize]
    }

    /// Camera at the front, light behind it, stable within a tile, the outside left out.
    #[test]
    fn partition_is_stable() {
        let spec = spec(SplatFilter::Gaussian);
        let sample = |i: u32| Sample {
            uv: [(i * 37 % 101) as f32 / 100.0, (i * 53 % 97) as f32 / 80.0],
            xyz: Xyz::new(i as f32, 1.0, 1.0),
            w: if i.is_multiple_of(3) { -1.0 } else { 1.0 },
        };
        let samples: Vec<Sample> = (0..300).map(sample).collect();
        let (sorted, [camera, light], merged) = sort(&spec, &samples);
        assert!(camera.all == (0..light.all.start) && merged.iter().all(Vec::is_empty));

        let inside = |s: &Sample| spec.holds(spec.texel_position(s.uv));
        let tile = |s: &Sample| spec.texel_position(s.uv).map(|x| (x / 64.0) as i32);
        for (part, sign) in [(camera, 1.0), (light, -1.0)] {
            assert_eq!(part.single, part.all);
            let mut wanted: Vec<Sample> =
                samples.iter().copied().filter(|s| s.w == sign && inside(s)).collect();
            wanted.sort_by_key(|s| (tile(s)[1], tile(s)[0]));
            assert_eq!(of(&sorted, &part.all), wanted);
        }
        assert!(samples.iter().any(|s| !inside(s)), "case too easy: nothing lies outside");
    }

    /// The sum of a part of samples in `f64`.
    fn total(samples: &[Sample], f: &dyn Fn(&Sample) -> f32) -> f64 {
        samples.iter().map(|s| f64::from(f(s))).sum::<f64>()
    }

    /// Samples in the cell between (and for the box, right below) the centres of texels 40 and 41.
    fn dense(spec: &FilmSpec, count: u32) -> Vec<Sample> {
        let sample = |i: u32| {
            let t = [(i % 7) as f32 * 0.05, (i % 11) as f32 * 0.04];
            let p = [40.52 + t[0], 40.52 + t[1]].map(|p| p - spec.pad() as f32);
            let (x, w) = ((i % 13) as f32, 1.0 + (i % 3) as f32);
            let uv = [p[0] / spec.width as f32, p[1] / spec.height as f32];
            Sample { uv, xyz: Xyz::new(x, 2.0, 3.0), w }
        };
        (0..count).map(sample).collect()
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
            let dense = dense(&spec, limit + 1);
            let lone = Sample { uv: [0.9, 0.9], xyz: Xyz::new(1.0, 1.0, 1.0), w: 1.0 };
            let samples: Vec<Sample> = dense.iter().copied().chain([lone]).collect();
            let (sorted, [part, _], [merged, _]) = sort(&spec, &samples);
            assert_eq!(part.all.len(), dense.len() + 1);
            assert_eq!(merged.len(), centres, "{filter:?}");
            if centres == 0 {
                assert_eq!(part.single, part.all);
                continue;
            }
            assert_eq!(of(&sorted, &part.single), &[lone]);
            for f in [|s: &Sample| s.w, |s: &Sample| s.xyz.x, |s: &Sample| s.xyz.y, |s: &Sample| s.xyz.z] {
                assert!((total(&merged, &f) / total(&dense, &f) - 1.0).abs() < 1e-6, "{filter:?}");
            }
            for i in 0..2usize {
                assert!(merged.iter().all(|s| s.uv[i].fract() == 0.5));
                let weights = |s: &Sample| s.w;
                let place = total(&merged, &|s: &Sample| s.w * s.uv[i]) / total(&merged, &weights);
                let wanted = total(&dense, &|s: &Sample| s.w * spec.texel_position(s.uv)[i]);
                let wanted = wanted / total(&dense, &weights);
                assert!(filter == SplatFilter::Box || (place - wanted).abs() < 1e-5, "{filter:?}");
            }
        }
    }

    /// A cell that becomes dense over several chunks is merged from the chunk on in which it does, into few samples for the whole batch.
    #[test]
    fn cells_grow_dense_from_chunk_to_chunk() {
        let spec = FilmSpec { width: 1_000, height: 800, ..spec(SplatFilter::Gaussian) };
        assert!(spec.batch_capacity() > CHUNK_SAMPLES && spec.batch_slots() == 1);
        let samples = dense(&spec, 5 * 12);
        let mut sorter = SampleSorter::default();
        sorter.begin(&spec);
        let mut drawn = Vec::new();
        for chunk in samples.chunks(5) {
            sorter.samples.extend(chunk);
            let (sorted, [camera, _]) = sorter.sort(&spec);
            assert_eq!(camera.all.len(), 5);
            drawn.extend_from_slice(of(sorted, &camera.single));
        }
        // The second chunk exceeds the limit of 8, from which on the cell itself is counted; with the third one it is dense.
        assert_eq!(drawn.len(), 10);
        let merged = sorter.merged();
        assert_eq!(merged.each_ref().map(Vec::len), [4, 0]);
        drawn.extend(&merged[0]);
        for f in [|s: &Sample| s.w, |s: &Sample| s.xyz.x] {
            assert!((total(&drawn, &f) / total(&samples, &f) - 1.0).abs() < 1e-6);
        }
        assert!(!sorter.mergers[0].is_full());
        sorter.samples.extend(dense(&spec, CHUNK_SAMPLES as u32));
        sorter.sort(&spec);
        assert!(sorter.mergers[0].is_full(), "the deviations of a batch take no more");
    }
}
