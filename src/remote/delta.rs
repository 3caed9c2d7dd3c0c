//! Film deltas: what was traced while a link was busy, as sums on a grid, coarse at first and finer with every delta.
//!
//! A link that is slower than the tracer would let it wait. Instead it goes on, and its samples are added up by the cells of a grid. When the
//! link is free the sums leave as samples of the usual stream: one for each cell that was hit, at the mean position of its samples, with their
//! sum and the sum of their weights. So a film that knows nothing of this becomes what all of the samples would have made of it, at the
//! resolution of the grid. Each delta has a grid of twice the resolution of the one before and takes about four times as long to send and to
//! gather, so that the last ones, which are as fine as the picture, soon outweigh the coarse ones.
//!
//! The cells of a delta leave in a scattered order, so that a part of it covers the picture evenly, with the paths of the delta in proportion.

use std::collections::VecDeque;

use crate::color::Xyz;
use crate::stream::{BLOCK_SAMPLES, Block, CHUNK, Epoch, Header, PathCounts, REPLICATES, Sample, replicate};

/// Fewest and most cells along each axis. The finest grid takes 60 MB for each stream and replicate.
const COARSEST: u32 = 16;
const FINEST: u32 = 1024;

/// The first delta has as many cells as the link carries in this time.
const FIRST: f64 = 0.5;

/// Bytes of a cell on its way, in each replicate.
const CELL_BYTES: f64 = 16.0;

/// The grid reaches so far beyond the picture on every side, in units of the picture. What lies beyond belongs to the cells at the border.
const MARGIN: f32 = 0.125;

/// A delta that has more than this share of the samples that it stands for saves nothing.
const USEFUL: f64 = 0.7;

/// Sums of the samples in a cell, of one stream and one replicate.
#[derive(Clone, Copy, Default)]
struct GridCell {
    uv: [f64; 2],
    xyz: [f64; 3],
    weight: f64,
    count: u32,
}

impl GridCell {
    fn add(&mut self, sample: &Sample) {
        let Sample { uv, xyz: Xyz { x, y, z }, w } = *sample;
        for (sum, value) in self.uv.iter_mut().zip(uv) {
            *sum += f64::from(value);
        }
        for (sum, value) in self.xyz.iter_mut().zip([x, y, z]) {
            *sum += f64::from(value);
        }
        self.weight += f64::from(w.max(0.0));
        self.count += 1;
    }

    /// The sums as a sample; `None` without samples.
    fn sample(&self) -> Option<Sample> {
        (self.count > 0).then(|| {
            let uv = self.uv.map(|sum| (sum / f64::from(self.count)) as f32);
            let [x, y, z] = self.xyz.map(|sum| sum as f32);
            let w = if self.weight > 0.0 { self.weight as f32 } else { -1.0 };
            Sample { uv, xyz: Xyz { x, y, z }, w }
        })
    }
}

/// Sums of the samples of one replicate since the last delta.
#[derive(Default)]
struct Gathered {
    /// Cells of the camera stream and of the light stream, row by row; empty before the first sample of a stream.
    cells: [Vec<GridCell>; 2],
    index_count: u64,
    paths: PathCounts,
    rejected: u64,
}

/// Gathers samples between two deltas of a render.
pub(super) struct FilmDeltas {
    /// Cells along each axis of the finest grid that is wanted; 0 if none is.
    finest: u32,
    /// Cells along each axis now.
    side: u32,
    replicates: [Gathered; REPLICATES],
    samples: u64,
    gathers: bool,
}

impl FilmDeltas {
    /// No deltas yet, for a picture whose longer side has `finest` pixels; 0 is never any.
    pub fn new(finest: u32) -> Self {
        let finest = if finest == 0 { 0 } else { finest.next_power_of_two().clamp(COARSEST, FINEST) };
        Self { finest, side: COARSEST, replicates: Default::default(), samples: 0, gathers: false }
    }

    /// Whether samples are gathered now.
    pub fn gathers(&self) -> bool {
        self.gathers
    }

    /// The link carries `bytes_per_second` and is slower than the tracer: samples are to be gathered from now on, if that is wanted.
    pub fn begin(&mut self, bytes_per_second: f64) {
        if self.gathers || self.finest == 0 {
            return;
        }
        self.gathers = true;
        let cells = FIRST * bytes_per_second / (CELL_BYTES * REPLICATES as f64);
        let side = (1u32 << cells.max(1.0).sqrt().log2().min(30.0) as u32).clamp(COARSEST, self.finest);
        self.side = self.side.max(side);
    }

    /// Whether nothing was gathered since the last delta.
    pub fn is_empty(&self) -> bool {
        self.replicates
            .iter()
            .all(|gathered| gathered.index_count == 0 && gathered.cells.iter().all(Vec::is_empty))
    }

    /// Adds the samples of a block.
    pub fn add(&mut self, block: &Block) {
        let Header { first_index, index_count, paths, rejected, .. } = block.header;
        let (side, gathered) = (self.side, &mut self.replicates[replicate(first_index).0]);
        gathered.index_count += index_count;
        gathered.paths.camera += paths.camera;
        gathered.paths.light += paths.light;
        gathered.rejected += rejected;
        for sample in block.samples() {
            let cells = &mut gathered.cells[usize::from(sample.w < 0.0)];
            if cells.is_empty() {
                cells.resize((side * side) as usize, GridCell::default());
            }
            let [column, row] = sample.uv.map(|c| {
                let cell = (c + MARGIN) / (1.0 + 2.0 * MARGIN) * side as f32;
                (cell.max(0.0) as usize).min(side as usize - 1)
            });
            cells[row * side as usize + column].add(sample);
        }
        self.samples += block.samples().len() as u64;
    }

    /// Makes blocks of what was gathered, and begins the next delta, which is finer.
    pub fn take(&mut self, epoch: Epoch) -> VecDeque<Block> {
        let (mut blocks, mut sent) = (VecDeque::new(), 0);
        for (place, gathered) in std::mem::take(&mut self.replicates).into_iter().enumerate() {
            let all = scattered(&gathered.cells);
            sent += all.len() as u64;
            append(&mut blocks, epoch, place, &gathered, &all);
        }
        let saves = sent as f64 <= USEFUL * self.samples as f64;
        self.gathers = self.samples > 0 && (saves || self.side < self.finest);
        (self.side, self.samples) = ((2 * self.side).min(self.finest.max(COARSEST)), 0);
        blocks
    }
}

/// The samples of all cells, in an order in which every stretch covers the picture.
fn scattered(streams: &[Vec<GridCell>; 2]) -> Vec<Sample> {
    /// Odd, and so a step that visits every cell of a grid whose number of cells is a power of two.
    const STEP: usize = 0x9e37_79b1;
    let cells = streams.iter().map(Vec::len).max().unwrap_or(0);
    let order = (0..cells).map(|i| i.wrapping_mul(STEP) & (cells - 1));
    order.flat_map(|i| streams.iter().filter_map(move |stream| stream.get(i)?.sample())).collect()
}

/// Appends the samples of a replicate as blocks, each with its share of the paths.
fn append(blocks: &mut VecDeque<Block>, epoch: Epoch, place: usize, gathered: &Gathered, all: &[Sample]) {
    let Gathered { index_count, paths, rejected, .. } = *gathered;
    if index_count == 0 && all.is_empty() {
        return;
    }
    let count = all.len().div_ceil(BLOCK_SAMPLES).max(1) as u64;
    for k in 0..count {
        let share = |n: u64| n * (k + 1) / count - n * k / count;
        let mut block = Block::default();
        // An index of the replicate: its chunks alternate.
        block.restart(epoch, place as u64 * CHUNK);
        let paths = PathCounts { camera: share(paths.camera), light: share(paths.light) };
        block.header =
            Header { index_count: share(index_count), paths, rejected: share(rejected), ..block.header };
        let from = (k as usize * BLOCK_SAMPLES).min(all.len());
        let to = (from + BLOCK_SAMPLES).min(all.len());
        all[from..to].iter().for_each(|sample| _ = block.push(*sample));
        blocks.push_back(block);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::bits::mix;

    fn block(chunk: u64) -> Block {
        let mut block = Block::default();
        block.restart(Epoch(1), chunk * CHUNK);
        for i in 0..BLOCK_SAMPLES as u64 {
            let r = |k: u64| (mix(chunk << 20 | i << 4 | k) >> 40) as f32 / (1u64 << 24) as f32;
            let w = if i % 3 == 0 { -1.0 } else { 1.0 };
            block.push(Sample {
                uv: [1.2 * r(0) - 0.1, r(1)],
                xyz: Xyz { x: r(2), y: r(3), z: 9.0 * r(4) },
                w,
            });
        }
        let paths = PathCounts { camera: 683, light: 2000 };
        block.header = Header { index_count: CHUNK, paths, rejected: 2, ..block.header };
        block
    }

    /// Sums of weights and colours of both streams of both replicates, and the counts.
    fn sums(blocks: impl Iterator<Item = Block>) -> ([[[f64; 4]; 2]; REPLICATES], [u64; 4]) {
        let (mut sums, mut counts) = ([[[0.0; 4]; 2]; REPLICATES], [0; 4]);
        for block in blocks {
            let Header { first_index, index_count, paths, rejected, .. } = block.header;
            for (sum, n) in counts.iter_mut().zip([index_count, paths.camera, paths.light, rejected]) {
                *sum += n;
            }
            for Sample { xyz, w, .. } in block.samples() {
                let sum = &mut sums[replicate(first_index).0][usize::from(*w < 0.0)];
                let values = [xyz.x, xyz.y, xyz.z, w.max(0.0)];
                sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += f64::from(value));
            }
        }
        (sums, counts)
    }

    /// Whatever the grid, nothing is lost: weights, colours and paths of each replicate and stream.
    #[test]
    fn deltas_have_the_sums_of_their_samples() {
        let mut deltas = FilmDeltas::new(500);
        let (mut taken, mut sent) = (Vec::new(), 0);
        for chunk in 0..600 {
            deltas.add(&block(chunk));
            if chunk % 150 == 149 {
                let blocks = deltas.take(Epoch(1));
                sent += blocks.iter().map(|block| block.samples().len()).sum::<usize>();
                taken.extend(blocks);
                assert!(deltas.is_empty());
            }
        }
        assert_eq!(deltas.side, 256);
        assert!(sent < 600 * BLOCK_SAMPLES / 2, "{sent} samples");
        let ((sums, counts), (exact, exact_counts)) =
            (self::sums(taken.into_iter()), self::sums((0..600).map(block)));
        assert_eq!(counts, exact_counts);
        for (sum, exact) in sums.as_flattened().as_flattened().iter().zip(exact.as_flattened().as_flattened())
        {
            assert!((sum - exact).abs() <= 1e-6 * exact, "{sum} for {exact}");
        }
    }

    /// Samples are within half a cell of their sum, and every stretch of a delta covers the picture.
    #[test]
    fn deltas_keep_places() {
        let mut deltas = FilmDeltas::new(64);
        (0..400).for_each(|chunk| deltas.add(&block(chunk)));
        for (k, block) in deltas.take(Epoch(1)).iter().enumerate() {
            let quarters = block.samples().iter().fold([0; 4], |mut quarters, sample| {
                quarters[usize::from(sample.uv[0] > 0.5) + 2 * usize::from(sample.uv[1] > 0.5)] += 1;
                quarters
            });
            let least = block.samples().len() / 8;
            assert!(quarters.iter().all(|n| *n >= least), "block {k}: {quarters:?}");
            assert!(
                block
                    .samples()
                    .iter()
                    .all(|s| (-0.1..=1.1).contains(&s.uv[0]) && (0.0..=1.0).contains(&s.uv[1]))
            );
        }
    }

    #[test]
    fn a_delta_that_saves_nothing_is_the_last() {
        let mut deltas = FilmDeltas::new(64);
        deltas.begin(100.0);
        assert!(deltas.gathers() && deltas.side == COARSEST);
        deltas.add(&block(0));
        (0..3).for_each(|_| _ = deltas.take(Epoch(1)));
        assert!(!deltas.gathers(), "nothing was gathered");
        (0..400).for_each(|chunk| deltas.add(&block(chunk)));
        deltas.take(Epoch(1));
        assert!(deltas.gathers());
        let mut never = FilmDeltas::new(0);
        never.begin(1e6);
        assert!(!never.gathers());
        let mut fast = FilmDeltas::new(500);
        fast.begin(10e6);
        assert_eq!(fast.side, 256);
    }
}
