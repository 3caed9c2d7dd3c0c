//! One tracing thread: claims chunks, traces paths, flushes blocks in time.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender};
use std::time::{Duration, Instant};

use crate::server::cost::Probe;
use crate::server::job::Task;
use crate::server::priority::Priority;
use crate::server::spans::SpanLog;
use crate::server::stats::{StatsCell, Stopwatch};
use crate::server::wrapper::Message;
use crate::stream::{BlockSink, FinishReason};
use crate::tracer::Integrator;

/// What a worker does for one render: [`trace_chunks`] for one type of integrator. The only dynamic call, once per
/// worker and render.
pub(super) type Work = Arc<dyn Fn(&mut Worker, &Task, &mut Stopwatch) -> FinishReason + Send + Sync>;

/// A render as it is sent to a worker.
pub(super) struct Assignment {
    pub(super) task: Arc<Task>,
    pub(super) work: Work,
}

/// What one thread owns.
pub(super) struct Worker {
    pub(super) number: usize,
    pub(super) sink: BlockSink,
    pub(super) spans: Arc<SpanLog>,
    pub(super) priority: Priority,
}

/// Body of a tracing thread: one assignment after another until the wrapper hangs up.
pub(super) fn run(mut worker: Worker, assignments: Receiver<Assignment>, done: Sender<Message>) {
    worker.priority.apply();
    for Assignment { task, work } in assignments {
        let cell = &task.stats[worker.number];
        let mut watch = Stopwatch::start(cell, worker.sink.writer().parked());
        worker.sink.start(task.epoch, task.window);
        // The sink stays usable after a panic: its block is restarted, the lane is untouched between flushes.
        let reason = catch_unwind(AssertUnwindSafe(|| work(&mut worker, &task, &mut watch)))
            .unwrap_or_else(|panic| stop_after_panic(&mut worker, &task, panic.as_ref()));
        cell.totals(worker.sink.totals());
        watch.finish(worker.sink.writer().parked());
        // An idle worker must not keep the integrator alive; its `drop` is foreign code too.
        let _ = catch_unwind(AssertUnwindSafe(|| drop(work)));
        if done.send(Message::WorkerDone { epoch: task.epoch, reason }).is_err() {
            return;
        }
    }
}

/// Drops the samples of the path that panicked, stops the other workers and sends what was good.
fn stop_after_panic(worker: &mut Worker, task: &Task, panic: &(dyn Any + Send)) -> FinishReason {
    let message = panic
        .downcast_ref::<&str>()
        .map(ToString::to_string)
        .or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned());
    worker.sink.writer().hub().stop(task.epoch);
    worker.sink.abandon_path();
    worker.sink.flush();
    FinishReason::Panicked { index: worker.sink.index(), message }
}

/// Traces chunks of `task` until there are none or its epoch may not run any more, which is looked up before every path.
pub(super) fn trace_chunks<I: Integrator>(
    integrator: &I,
    worker: &mut Worker,
    task: &Task,
    watch: &mut Stopwatch,
) -> FinishReason {
    let Worker { number, sink, spans, .. } = worker;
    let hub = sink.writer().hub().clone();
    let mut scratch = I::Scratch::default();
    let paths = integrator.paths_per_index();
    let probe = Probe::new(task.costs.get(*number));
    let mut clock = Clock::new((watch, &task.stats[*number]), task.deadline, sink);
    while let Some(chunk) = task.claim() {
        let span = spans.begin(chunk.start, sink.writer());
        sink.begin_chunk(chunk.start);
        for index in chunk {
            if !hub.running().is(task.epoch) {
                sink.flush();
                spans.end(*number, span, sink.writer());
                return FinishReason::Aborted;
            }
            sink.begin_path(index);
            let begun = probe.begin(index);
            integrator.trace(index, &mut scratch, sink);
            probe.end(begun, sink);
            sink.end_path(paths);
            clock.after_path(sink);
        }
        let sent = sink.flush();
        spans.end(*number, span, sink.writer());
        if !sent {
            return FinishReason::Aborted;
        }
    }
    FinishReason::Complete
}

/// Looks at the time now and then: after every path when paths are slow, after every 16th when they are fast, so that
/// the look costs a nanosecond or two per path and no block waits much beyond its deadline.
struct Clock<'a, 'b> {
    watch: &'a mut Stopwatch<'b>,
    cell: &'a StatsCell,
    deadline: Option<Duration>,
    /// Paths until the next look.
    countdown: u32,
    /// Paths between two looks.
    every: u32,
    last_look: Instant,
    /// Flushes counted at the last look, and the time of the look that first saw that count.
    flushes: u64,
    flushed: Instant,
}

/// Most paths between two looks. Small, because paths may become slow from one to the next.
const MAX_EVERY: u32 = 16;

impl<'a, 'b> Clock<'a, 'b> {
    fn new(
        (watch, cell): (&'a mut Stopwatch<'b>, &'a StatsCell),
        deadline: Option<Duration>,
        sink: &BlockSink,
    ) -> Self {
        let now = Instant::now();
        Self {
            watch,
            cell,
            deadline,
            countdown: 1,
            every: 1,
            last_look: now,
            flushes: sink.flushes(),
            flushed: now,
        }
    }

    #[inline]
    fn after_path(&mut self, sink: &mut BlockSink) {
        self.countdown -= 1;
        if self.countdown == 0 {
            self.look(sink);
        }
    }

    #[cold]
    fn look(&mut self, sink: &mut BlockSink) {
        let now = Instant::now();
        if sink.flushes() != self.flushes {
            // Sent between two looks, because it was full or its chunk ended.
            self.note_flush(sink, self.last_look);
        }
        if self.deadline.is_some_and(|deadline| now - self.flushed >= deadline) {
            sink.flush();
            self.note_flush(sink, now);
        }
        let fast = self.deadline.unwrap_or(Duration::from_millis(10)) / 8;
        self.every = if now - self.last_look < fast { (2 * self.every).min(MAX_EVERY) } else { 1 };
        self.countdown = self.every;
        self.last_look = now;
    }

    fn note_flush(&mut self, sink: &BlockSink, when: Instant) {
        self.flushes = sink.flushes();
        self.flushed = when;
        self.cell.totals(sink.totals());
        self.watch.lap(when, sink.writer().parked());
    }
}
