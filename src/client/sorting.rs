//! The order in which the samples of a chunk are drawn: camera before light, tile by tile, dense cells apart.

use std::ops::Range;

use crate::client::dense_cells::Merger;
use crate::client::settings::FilmSpec;
use crate::stream::Sample;

/// Texels on a side of the squares by which a chunk is sorted. lavapipe rasterises in tiles of this size and gains
/// 18 to 36 %; other devices gain from locality.
const TILE: f32 = 64.0;

/// Sorts the chunks of consecutive batches.
#[derive(Default)]
pub struct SampleSorter {
    /// Bucket of every sample: by tile, first single samples, then those of dense cells; the light stream's buckets follow the camera's.
    buckets: Vec<u32>,
    /// Start of every bucket in the sorted order.
    starts: Vec<u32>,
    /// The chunk in sorted order. Vertex memory may be slow to write except sequentially.
    sorted: Vec<Sample>,
    /// Mergers of camera and light stream.
    mergers: [Merger; 2],
}

/// The samples of one stream in a sorted chunk.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StreamRange {
    /// All of them.
    pub all: Range<u32>,
    /// Samples outside of dense cells, at the front of `all`.
    pub single: Range<u32>,
}

impl SampleSorter {
    /// Begins a batch.
    pub fn begin(&mut self, spec: &FilmSpec) {
        self.mergers.iter_mut().for_each(|merger| merger.begin(spec));
    }

    /// Sorts the next chunk of the batch: camera samples in front, light samples behind.
    ///
    /// Stable within a tile of a stream, so the order depends on nothing but the order of arrival. Samples
    /// outside the padded target are left out.
    pub fn sort(&mut self, spec: &FilmSpec, samples: &[Sample]) -> (&[Sample], [StreamRange; 2]) {
        let [width, height] = spec.padded_extent().map(|n| n as f32);
        let columns = (width / TILE).ceil() as u32;
        let tiles = columns * (height / TILE).ceil() as u32;
        let outside = 4 * tiles;
        self.buckets.clear();
        for sample in samples {
            let p = spec.texel_position(sample.uv);
            let tile = (p[1] * TILE.recip()) as u32 * columns + (p[0] * TILE.recip()) as u32;
            self.buckets.push(match (spec.holds(p), sample.w > 0.0) {
                (false, _) => outside,
                (true, true) => tile,
                (true, false) => 2 * tiles + tile,
            });
        }
        let mut streams = self.scatter(samples, tiles);
        // Tile by tile, so that neighbouring samples find the counts of a cell in the cache, which the table of a large film exceeds.
        for (merger, StreamRange { all, .. }) in self.mergers.iter_mut().zip(&streams) {
            for sample in &self.sorted[all.start as usize..all.end as usize] {
                merger.count(spec.texel_position(sample.uv));
            }
        }
        if self.mergers.iter().any(Merger::found) {
            self.merge(spec, samples, tiles);
            streams = self.scatter(samples, tiles);
        }
        (&self.sorted[..streams[1].all.end as usize], streams)
    }

    /// Sorts the samples into buckets: two per tile of the camera stream, two per tile of the light stream, and one for samples outside.
    fn scatter(&mut self, samples: &[Sample], tiles: u32) -> [StreamRange; 2] {
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
        self.sorted.resize(samples.len(), Sample::default());
        for (sample, bucket) in samples.iter().zip(&self.buckets) {
            let place = &mut starts[*bucket as usize];
            self.sorted[*place as usize] = *sample;
            *place += 1;
        }
        streams
    }

    /// Sums up the samples of dense cells and moves them to the buckets for such.
    #[cold]
    fn merge(&mut self, spec: &FilmSpec, samples: &[Sample], tiles: u32) {
        let stream = |bucket: u32| usize::from(bucket >= 2 * tiles);
        let drawn = || samples.iter().zip(&self.buckets).filter(|(_, bucket)| **bucket < 4 * tiles);
        for (sample, bucket) in drawn() {
            self.mergers[stream(*bucket)].confirm(spec.texel_position(sample.uv));
        }
        for (sample, bucket) in samples.iter().zip(&mut self.buckets) {
            let (p, from) = (spec.texel_position(sample.uv), *bucket);
            if from < 4 * tiles && self.mergers[stream(from)].is_dense(p) {
                self.mergers[stream(from)].add(p, sample);
                *bucket += tiles;
            }
        }
    }

    /// Merged samples of the dense cells of both streams, at positions in padded texels.
    pub fn merged(&mut self) -> [Vec<Sample>; 2] {
        self.mergers.each_mut().map(Merger::take)
    }

    /// Whether the batch must end with this chunk before it is full, because its samples are too dense.
    pub fn is_too_dense(&self) -> bool {
        self.mergers.iter().any(Merger::is_full)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::settings::{CHUNK_SAMPLES, ScaledFilter, SplatFilter};
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
        let (sorted, ranges) = sorter.sort(spec, samples);
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

    /// Samples of a dense cell become samples at the surrounding texel centres, with the same total and centre of gravity. All others, and
    /// all samples of non-linear filters, stay unchanged.
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

    /// A cell that becomes dense over several chunks is merged from that chunk on, into few samples for the whole batch.
    #[test]
    fn cells_grow_dense_from_chunk_to_chunk() {
        let spec = FilmSpec { width: 1_000, height: 800, ..spec(SplatFilter::Gaussian) };
        assert!(spec.batch_capacity() > CHUNK_SAMPLES && spec.batch_slots() == 1);
        let samples = dense(&spec, 5 * 12);
        let mut sorter = SampleSorter::default();
        sorter.begin(&spec);
        let mut drawn = Vec::new();
        for chunk in samples.chunks(5) {
            let (sorted, [camera, _]) = sorter.sort(&spec, chunk);
            assert_eq!(camera.all.len(), 5);
            drawn.extend_from_slice(of(sorted, &camera.single));
        }
        // The second chunk exceeds the limit of 8, from which on the cell is counted exactly; the third one makes it dense.
        assert_eq!(drawn.len(), 10);
        let merged = sorter.merged();
        assert_eq!(merged.each_ref().map(Vec::len), [4, 0]);
        drawn.extend(&merged[0]);
        for f in [|s: &Sample| s.w, |s: &Sample| s.xyz.x] {
            assert!((total(&drawn, &f) / total(&samples, &f) - 1.0).abs() < 1e-6);
        }
        assert!(!sorter.is_too_dense());
        sorter.sort(&spec, &dense(&spec, CHUNK_SAMPLES as u32));
        assert!(sorter.is_too_dense(), "the deviations of a batch take no more");
    }
}
