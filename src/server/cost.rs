//! Where the time goes: what paths cost, by the place of the picture that they begin at.
//!
//! One path of 512 is timed, by two clocks. A system that takes the processor away in the middle of a path would charge its
//! region with milliseconds, where paths take microseconds; the clock of the thread stands still then. That one costs a
//! microsecond to read, which is no part of the path: the clock on the wall does not count it. The lesser of both is right.
//! Where the machine itself is one of several on a host, neither tells: a cell's times go to five sums in turn, and the median
//! of their means is not moved by one time that is off by a thousand.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::server::stats::thread_cpu_time;
use crate::stream::BlockSink;

/// Cells along each axis of a [`CostMap`].
pub const COST_CELLS: usize = 24;

/// One path of 2^9 is timed: more of them would cost more than a few nanoseconds per path.
const TIMED_BITS: u32 = 9;

/// Sums of a cell.
const BATCHES: usize = 5;

/// What paths cost by cell, row by row from the top left; `uv` from 0 to 1 along both axes, the overscan left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CostMap {
    /// Seconds of one index on one thread, median of means, without what other programs took; 0 where `counts` is.
    pub seconds: Vec<f64>,
    /// Indices that were timed.
    pub counts: Vec<u64>,
}

impl CostMap {
    /// True before anything was timed, or where nobody asked for times.
    pub fn is_empty(&self) -> bool {
        self.counts.iter().all(|count| *count == 0)
    }

    /// Share of each cell in the time of all, if as many paths begin in each; 0 where nothing was timed.
    pub fn shares(&self) -> Vec<f64> {
        let sum: f64 = self.seconds.iter().sum();
        self.seconds.iter().map(|seconds| if sum > 0.0 { seconds / sum } else { 0.0 }).collect()
    }
}

/// Nanoseconds and counts of one worker, cell by cell: nobody else writes them.
#[derive(Debug)]
pub(super) struct CostGrid(Vec<[[AtomicU64; 2]; BATCHES]>);

impl Default for CostGrid {
    fn default() -> Self {
        Self(std::iter::repeat_with(Default::default).take(COST_CELLS * COST_CELLS).collect())
    }
}

impl CostGrid {
    /// The cell of a place; `None` outside of the picture, and for NaN.
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

    /// What several workers have found.
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

/// The middle one, or the mean of both; 0 of none.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 { 0.0 } else { 0.5 * (values[n / 2] + values[(n - 1) / 2]) }
}

/// Times some paths of a worker; without a grid it does nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Probe<'a>(Option<&'a CostGrid>);

/// When a path was begun, by the clock of the thread and on the wall.
pub(super) type Begun = (Option<Duration>, Instant);

impl<'a> Probe<'a> {
    pub(super) fn new(grid: Option<&'a CostGrid>) -> Self {
        Self(grid)
    }

    /// The time, if the path of this index is one to be timed.
    ///
    /// Multiples of the golden ratio spread such indices evenly over all remainders: those of a power of 2, as every 512th
    /// would have, lie side by side in the picture.
    #[inline]
    pub(super) fn begin(self, index: u64) -> Option<Begun> {
        let timed = self.0.is_some() && is_timed(index);
        timed.then(|| (thread_cpu_time(), Instant::now()))
    }

    /// Notes the path whose samples the sink has taken since [`BlockSink::begin_path`].
    #[inline]
    pub(super) fn end(self, begun: Option<Begun>, sink: &BlockSink) {
        if let Some((cpu, wall)) = begun {
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
    index.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (u64::BITS - TIMED_BITS) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_of_all_workers_by_cell() {
        let grids = [CostGrid::default(), CostGrid::default()];
        assert!(CostGrid::read(&[]).is_empty() && CostGrid::read(&grids).is_empty());
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
        // What has nothing to do with the path.
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
