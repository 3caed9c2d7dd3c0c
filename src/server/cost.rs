//! The cost map: the time that paths take, by the region of the picture where they begin.
//!
//! One path of 512 is timed by two clocks. Wall time would include the milliseconds during which the operating system runs
//! another thread, where paths take microseconds. CPU time does not include these, but reading it takes a microsecond that is
//! no part of the path. So the smaller of both is used. Neither notices time that a hypervisor takes away. Therefore the
//! times of a cell are added to five sums in turn: one outlier by a factor of a thousand does not change the median of means.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::math::bits::GOLDEN;
use crate::server::stats::thread_cpu_time;
use crate::stream::BlockSink;

/// Number of cells along each axis of a [`CostMap`].
pub const COST_CELLS: usize = 24;

/// One path of 2^9 is timed. More of them would cost more than a few nanoseconds per path.
const TIMED_BITS: u32 = 9;

/// Number of sums per cell.
const BATCHES: usize = 5;

/// The cost of paths by cell, row by row from the top left. The cells cover the picture without overscan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CostMap {
    /// Seconds per index on one thread, as a median of means, without the time of other programs. 0 where `counts` is 0.
    pub seconds: Vec<f64>,
    /// Number of indices that were timed.
    pub counts: Vec<u64>,
}

impl CostMap {
    /// Fraction of each cell in the total time, if equally many paths begin in each cell. 0 where nothing was timed.
    pub fn shares(&self) -> Vec<f64> {
        let sum: f64 = self.seconds.iter().sum();
        self.seconds.iter().map(|seconds| if sum > 0.0 { seconds / sum } else { 0.0 }).collect()
    }
}

/// Nanoseconds and counts of one worker by cell. Only that worker writes them.
#[derive(Debug)]
pub(super) struct CostGrid(Vec<[[AtomicU64; 2]; BATCHES]>);

impl Default for CostGrid {
    fn default() -> Self {
        Self(std::iter::repeat_with(Default::default).take(COST_CELLS * COST_CELLS).collect())
    }
}

impl CostGrid {
    /// The cell that contains `uv`. `None` outside the picture and for NaN.
    fn cell(uv: [f32; 2]) -> Option<usize> {
        let inside = uv.iter().all(|x| (0.0..1.0).contains(x));
        let [x, y] = uv.map(|x| ((x * COST_CELLS as f32) as usize).min(COST_CELLS - 1));
        inside.then_some(y * COST_CELLS + x)
    }

    fn add(&self, cell: usize, time: Duration) {
        let nanoseconds = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        let batches = &self.0[cell];
        let before: u64 = batches.iter().map(|[_, count]| count.load(Ordering::Relaxed)).sum();
        for (sum, by) in batches[before as usize % BATCHES].iter().zip([nanoseconds, 1]) {
            sum.store(sum.load(Ordering::Relaxed).saturating_add(by), Ordering::Relaxed);
        }
    }

    /// The cost map of several workers.
    pub(super) fn read(grids: &[Self]) -> CostMap {
        let cell = |i: usize| {
            let sum = |batch: usize, k: usize| -> u64 {
                grids.iter().map(|grid| grid.0[i][batch][k].load(Ordering::Relaxed)).sum()
            };
            let batches: [(u64, u64); BATCHES] = std::array::from_fn(|batch| (sum(batch, 0), sum(batch, 1)));
            let mean = |(time, count): (u64, u64)| (count > 0).then(|| time as f64 * 1e-9 / count as f64);
            let means: Vec<f64> = batches.into_iter().filter_map(mean).collect();
            (median(means), batches.iter().map(|(_, count)| count).sum::<u64>())
        };
        let cells = if grids.is_empty() { 0 } else { COST_CELLS * COST_CELLS };
        let (seconds, counts) = (0..cells).map(cell).unzip();
        CostMap { seconds, counts }
    }
}

/// The median, 0 for no values.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 { 0.0 } else { 0.5 * (values[n / 2] + values[(n - 1) / 2]) }
}

/// Times some paths of a worker. Without a grid it does nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Probe<'a>(Option<&'a CostGrid>);

/// The start of a path in CPU time and wall time.
#[derive(Clone, Copy)]
pub(super) struct StartedPath {
    cpu: Option<Duration>,
    wall: Instant,
}

impl<'a> Probe<'a> {
    pub(super) fn new(grid: Option<&'a CostGrid>) -> Self {
        Self(grid)
    }

    /// Starts timing, if the path of this index is to be timed.
    ///
    /// Indices are selected by multiples of the golden ratio, which spreads them evenly over all residues. Every 512th index
    /// would not do: such paths begin close together in the picture.
    #[inline]
    pub(super) fn begin(self, index: u64) -> Option<StartedPath> {
        let timed = self.0.is_some() && is_timed(index);
        timed.then(|| StartedPath { cpu: thread_cpu_time(), wall: Instant::now() })
    }

    /// Records the time of the path whose samples the sink has taken since [`BlockSink::begin_path`].
    #[inline]
    pub(super) fn end(self, started: Option<StartedPath>, sink: &BlockSink) {
        if let Some(StartedPath { cpu, wall }) = started {
            self.note(wall.elapsed(), cpu, sink);
        }
    }

    #[cold]
    fn note(self, wall: Duration, cpu: Option<Duration>, sink: &BlockSink) {
        let own = thread_cpu_time().zip(cpu).map(|(now, then)| now.saturating_sub(then));
        let cell = sink.path_position().and_then(CostGrid::cell);
        if let (Some(grid), Some(cell)) = (self.0, cell) {
            grid.add(cell, own.map_or(wall, |own| own.min(wall)));
        }
    }
}

fn is_timed(index: u64) -> bool {
    index.wrapping_mul(GOLDEN) >> (u64::BITS - TIMED_BITS) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_of_all_workers_by_cell() {
        let grids = [CostGrid::default(), CostGrid::default()];
        assert_eq!(CostGrid::read(&[]).counts.iter().chain(&CostGrid::read(&grids).counts).sum::<u64>(), 0);
        let cell = |uv| CostGrid::cell(uv).expect("inside");
        grids[0].add(cell([0.0, 0.0]), Duration::from_micros(2));
        grids[1].add(cell([0.04, 0.03]), Duration::from_micros(4));
        grids[1].add(cell([0.999_999_9, 0.5]), Duration::from_micros(9));
        let map = CostGrid::read(&grids);
        assert!((map.seconds[0] - 3e-6).abs() < 1e-12 && map.counts[0] == 2);
        let right = COST_CELLS / 2 * COST_CELLS + COST_CELLS - 1;
        assert!((map.seconds[right] - 9e-6).abs() < 1e-12 && map.counts[right] == 1);
        let shares = map.shares();
        assert!((shares[0] - 0.25).abs() < 1e-9 && (shares[right] - 0.75).abs() < 1e-9);
        // An outlier that has nothing to do with the path.
        grids[0].add(cell([0.5, 0.0]), Duration::from_millis(5));
        (0..9).for_each(|_| grids[0].add(cell([0.5, 0.0]), Duration::from_micros(7)));
        let top = CostGrid::read(&grids);
        assert!((top.seconds[COST_CELLS / 2] - 7e-6).abs() < 1e-12 && top.counts[COST_CELLS / 2] == 10);
        for outside in [[-0.01, 0.5], [0.5, 1.0], [f32::NAN, 0.5]] {
            assert_eq!(CostGrid::cell(outside), None);
        }
    }

    /// Radical inverses in base 2 of the timed indices, as the sampler has them: no stretch of the picture is left out.
    #[test]
    fn timed_paths_lie_everywhere() {
        let timed: Vec<u64> = (0..1 << 20).filter(|index| is_timed(*index)).collect();
        let expected = (1 << 20) >> TIMED_BITS;
        assert!(timed.len().abs_diff(expected) < 4, "{}", timed.len());
        let mut columns = [0; COST_CELLS];
        for index in &timed {
            columns[(index.reverse_bits() >> 59) as usize * COST_CELLS / 32] += 1;
        }
        let mean = expected / COST_CELLS;
        assert!(columns.iter().all(|n| (mean / 2..3 * mean).contains(n)), "{columns:?}");
    }
}
