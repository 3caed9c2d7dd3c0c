//! Statistics of the workers, readable at any time.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::job::unpoisoned;
use crate::stream::{Epoch, Rejections, Totals};

/// Statistics of one worker in one render.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WorkerStats {
    /// Time spent on the render, without the time parked on a full lane.
    pub busy: Duration,
    /// CPU time, where the system reports it (Linux). Unlike `busy` it does not include the time of other programs.
    pub cpu: Option<Duration>,
    /// Time parked on a full lane.
    pub parked: Duration,
    /// Number of indices traced.
    pub paths: u64,
    /// Number of samples sent.
    pub samples: u64,
    /// Number of samples discarded because the render was stopped while the lane was full, or their path panicked.
    pub discarded: u64,
    /// Rejected samples.
    pub rejections: Rejections,
}

/// Statistics of the latest render.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// The render, `Epoch(0)` before the first one.
    pub epoch: Epoch,
    /// One entry per worker.
    pub workers: Vec<WorkerStats>,
}

impl Stats {
    /// The sum over all workers. `cpu` is `None` if it is unknown for one of them.
    pub fn total(&self) -> WorkerStats {
        let zero = WorkerStats { cpu: Some(Duration::ZERO), ..WorkerStats::default() };
        self.workers.iter().fold(zero, |mut sum, worker| {
            sum.busy += worker.busy;
            sum.cpu = sum.cpu.zip(worker.cpu).map(|(a, b)| a + b);
            sum.parked += worker.parked;
            sum.paths += worker.paths;
            sum.samples += worker.samples;
            sum.discarded += worker.discarded;
            sum.rejections.merge(&worker.rejections);
            sum
        })
    }
}

/// The statistics that one worker publishes, on cache lines of its own. It does so about every millisecond.
#[derive(Debug, Default)]
#[repr(align(128))]
pub(super) struct StatsCell(Mutex<WorkerStats>);

impl StatsCell {
    pub(super) fn totals(&self, totals: &Totals) {
        self.update(|stats| {
            stats.paths = totals.indices;
            stats.samples = totals.samples;
            stats.discarded = totals.discarded;
            stats.rejections = totals.rejections.clone();
        });
    }

    pub(super) fn read(&self) -> WorkerStats {
        unpoisoned(&self.0).clone()
    }

    fn update(&self, change: impl FnOnce(&mut WorkerStats)) {
        change(&mut unpoisoned(&self.0));
    }
}

/// CPU time of this thread, `None` where the system does not report it. Reading it takes about a microsecond.
pub fn thread_cpu_time() -> Option<Duration> {
    #[cfg(target_os = "linux")]
    {
        use rustix::time::{ClockId, clock_gettime};
        clock_gettime(ClockId::ThreadCPUTime).try_into().ok()
    }
    #[cfg(not(target_os = "linux"))]
    None
}

/// Measures a worker's times over one render.
#[derive(Debug)]
pub(super) struct Stopwatch<'a> {
    cell: &'a StatsCell,
    start: Instant,
    parked_before: Duration,
    cpu_before: Option<Duration>,
    cpu_read: Instant,
}

impl<'a> Stopwatch<'a> {
    /// Starts it. `parked` is the present value of [`LaneWriter::parked`](crate::stream::LaneWriter::parked).
    pub(super) fn start(cell: &'a StatsCell, parked: Duration) -> Self {
        let now = Instant::now();
        Self { cell, start: now, parked_before: parked, cpu_before: thread_cpu_time(), cpu_read: now }
    }

    /// Publishes wall times, and every 100 ms CPU time.
    pub(super) fn lap(&mut self, now: Instant, parked: Duration) {
        let parked = parked.saturating_sub(self.parked_before);
        let busy = (now - self.start).saturating_sub(parked);
        self.cell.update(|stats| (stats.busy, stats.parked) = (busy, parked));
        if now - self.cpu_read >= Duration::from_millis(100) {
            self.cpu_read = now;
            self.publish_cpu();
        }
    }

    pub(super) fn finish(mut self, parked: Duration) {
        self.lap(Instant::now(), parked);
        self.publish_cpu();
    }

    fn publish_cpu(&self) {
        if let Some((now, before)) = thread_cpu_time().zip(self.cpu_before) {
            self.cell.update(|stats| stats.cpu = Some(now.saturating_sub(before)));
        }
    }
}
