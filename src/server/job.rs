//! The description of a render, and the distribution of its indices to the workers.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crate::server::cost::CostGrid;
use crate::server::stats::StatsCell;
use crate::stream::{Epoch, UvWindow};
use crate::tracer::Integrator;

pub use crate::stream::CHUNK;

/// The age at which a block is sent even if it is not full.
pub const DEADLINE: Duration = Duration::from_millis(2);

/// A render: a range of path indices to be traced.
#[derive(Debug)]
pub struct RenderJob<I> {
    /// The algorithm that traces one index.
    pub integrator: Arc<I>,
    /// The path indices. `0..u64::MAX` goes on until aborted.
    pub range: Range<u64>,
    /// The window in which samples may lie, the same as the integrator's.
    pub window: UvWindow,
    /// The age at which a block is sent even if it is not full. With `None` only full blocks and ends of chunks are sent. Then
    /// the blocks themselves, and not only their samples, are independent of time and threads.
    pub deadline: Option<Duration>,
}

impl<I: Integrator> RenderJob<I> {
    /// A job for the window of the picture, with the default deadline.
    pub fn new(integrator: Arc<I>, range: Range<u64>) -> Self {
        Self { integrator, range, window: UvWindow::PICTURE, deadline: Some(DEADLINE) }
    }
}

/// One render, as the workers share it.
#[derive(Debug)]
pub(super) struct Task {
    pub(super) epoch: Epoch,
    pub(super) window: UvWindow,
    pub(super) deadline: Option<Duration>,
    pub(super) stats: Vec<StatsCell>,
    /// One grid per worker, or none.
    pub(super) costs: Vec<CostGrid>,
    range: Range<u64>,
    /// Number of chunks handed out.
    claimed: AtomicU64,
}

impl Task {
    /// The task for `threads` workers. `timed` switches the cost map on.
    pub(super) fn new<I>(job: &RenderJob<I>, epoch: Epoch, threads: usize, timed: bool) -> Self {
        let grids = if timed { threads } else { 0 };
        Self {
            epoch,
            window: job.window,
            deadline: job.deadline,
            stats: std::iter::repeat_with(StatsCell::default).take(threads).collect(),
            costs: std::iter::repeat_with(CostGrid::default).take(grids).collect(),
            range: job.range.clone(),
            claimed: AtomicU64::new(0),
        }
    }

    /// Claims the next chunk: contiguous indices, aligned to [`CHUNK`] and clipped to the range, ascending over all workers.
    pub(super) fn claim(&self) -> Option<Range<u64>> {
        let Range { start, end } = self.range;
        let chunk = (start / CHUNK).checked_add(self.claimed.fetch_add(1, Ordering::Relaxed))?;
        let first = chunk.checked_mul(CHUNK)?;
        let range = first.max(start)..first.saturating_add(CHUNK).min(end);
        (!range.is_empty()).then_some(range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunks(range: Range<u64>) -> Vec<Range<u64>> {
        let task = Task {
            epoch: Epoch(0),
            window: UvWindow::PICTURE,
            deadline: None,
            stats: Vec::new(),
            costs: Vec::new(),
            range,
            claimed: AtomicU64::new(0),
        };
        std::iter::from_fn(|| task.claim()).collect()
    }

    #[test]
    fn chunks_are_aligned_and_cover_the_range_to_its_very_end() {
        assert_eq!(chunks(1000..3000), [1000..1024, 1024..2048, 2048..3000]);
        assert_eq!(chunks(1023..1025), [1023..1024, 1024..1025]);
        assert_eq!(chunks(7..7), []);
        let top = u64::MAX - 1500;
        assert_eq!(chunks(top..u64::MAX), [top..u64::MAX - 1023, u64::MAX - 1023..u64::MAX]);
    }
}
