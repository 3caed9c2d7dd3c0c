//! One render on all tracing threads, and how it ends.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use crate::job::unpoisoned;
use crate::server::job::Task;
use crate::server::stats::Stopwatch;
use crate::server::worker::{Work, Worker, stop_after_panic};
use crate::stream::{Event, FinishReason};

/// A render that some workers have yet to trace or to end.
pub(super) struct PendingRender {
    task: Arc<Task>,
    events: Sender<Event>,
    progress: Mutex<RenderProgress>,
}

struct RenderProgress {
    /// The work of each worker. It is taken when the last worker is done, so that nothing keeps the integrator alive.
    work: Option<Work>,
    /// Workers that are not done.
    workers: usize,
    reason: FinishReason,
}

impl PendingRender {
    pub(super) fn new(task: Arc<Task>, work: Work, workers: usize, events: Sender<Event>) -> Self {
        let progress = RenderProgress { work: Some(work), workers, reason: FinishReason::Complete };
        Self { task, events, progress: Mutex::new(progress) }
    }

    /// Traces chunks on this thread until none is left or the render is stopped. The last worker that is done reports the end.
    pub(super) fn run(&self, worker: &mut Worker) {
        let Some(work) = unpoisoned(&self.progress).work.clone() else { return };
        let task = &self.task;
        let cell = &task.stats[worker.number];
        let mut watch = Stopwatch::start(cell, worker.sink.writer().parked());
        worker.sink.start(task.epoch, task.window);
        // The sink stays usable after a panic: its block is restarted, and the lane is not touched between flushes.
        let reason = catch_unwind(AssertUnwindSafe(|| work(worker, task, &mut watch)))
            .unwrap_or_else(|panic| stop_after_panic(worker, task, panic.as_ref()));
        cell.totals(worker.sink.totals());
        watch.finish(worker.sink.writer().parked());
        drop_caught(work);
        self.worker_done(worker, reason);
    }

    /// Counts down the workers, and reports the end when the last one is done.
    fn worker_done(&self, worker: &Worker, reason: FinishReason) {
        let mut progress = unpoisoned(&self.progress);
        progress.workers -= 1;
        // The most severe reason wins. Of several panics, in any order, it is the one at the smallest index.
        let severity = |reason: &FinishReason| match reason {
            FinishReason::Complete => (0, 0),
            FinishReason::Aborted => (1, 0),
            FinishReason::Panicked { index, .. } => (2, u64::MAX - index),
        };
        if severity(&reason) > severity(&progress.reason) {
            progress.reason = reason;
        }
        if progress.workers == 0 {
            if let Some(work) = progress.work.take() {
                drop_caught(work);
            }
            let (epoch, reason) = (self.task.epoch, progress.reason.clone());
            // The event comes first, so that whoever sees the end of the epoch finds the event. The receiver may be gone.
            let _ = self.events.send(Event::Finished { epoch, reason, at: Instant::now() });
            worker.sink.writer().hub().end(epoch);
        }
    }
}

/// Drops `work`, and with it perhaps an integrator whose `drop` panics.
fn drop_caught(work: Work) {
    let _ = catch_unwind(AssertUnwindSafe(|| drop(work)));
}
