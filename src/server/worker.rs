//! One tracing thread: it claims chunks, traces their paths and flushes blocks in time.

use std::any::Any;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::job::panic_message;
use crate::server::cost::Probe;
use crate::server::job::Task;
use crate::server::spans::SpanLog;
use crate::server::stats::{StatsCell, Stopwatch};
use crate::stream::{BlockSink, FinishReason};
use crate::tracer::Integrator;

/// [`trace_chunks`] for one type of integrator. This is the only dynamic call: one per worker and render.
pub(super) type Work = Arc<dyn Fn(&mut Worker, &Task, &mut Stopwatch) -> FinishReason + Send + Sync>;

/// The state of a tracing thread.
pub(super) struct Worker {
    pub(super) number: usize,
    pub(super) sink: BlockSink,
    pub(super) spans: Arc<SpanLog>,
}

/// Drops the samples of the path that panicked, stops the other workers and sends the samples of complete paths.
pub(super) fn stop_after_panic(worker: &mut Worker, task: &Task, panic: &(dyn Any + Send)) -> FinishReason {
    let message = panic_message(panic).unwrap_or_else(|| "no message".to_owned());
    worker.sink.writer().hub().stop(task.epoch);
    worker.sink.abandon_path();
    worker.sink.flush();
    FinishReason::Panicked { index: worker.sink.index(), message }
}

/// Traces chunks of `task` until there are none left or its epoch is stopped, which is checked before every path.
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
    let mut timer = FlushTimer::new(watch, &task.stats[*number], task.deadline, sink);
    while let Some(chunk) = task.claim() {
        let span = spans.begin(chunk.start, sink.writer());
        sink.begin_chunk(chunk.start);
        for index in chunk {
            if !hub.is_running(task.epoch) {
                sink.flush();
                spans.end(*number, span, sink.writer());
                return FinishReason::Aborted;
            }
            sink.begin_path(index);
            let begun = probe.begin(index);
            integrator.trace(index, &mut scratch, sink);
            probe.end(begun, sink);
            sink.end_path(paths);
            timer.after_path(sink);
        }
        let sent = sink.flush();
        spans.end(*number, span, sink.writer());
        if !sent {
            return FinishReason::Aborted;
        }
    }
    FinishReason::Complete
}

/// Reads the clock after every path if paths are slow, and after every 16th if they are fast. So it costs a nanosecond or two
/// per path, and no block waits much longer than its deadline.
struct FlushTimer<'a, 'b> {
    watch: &'a mut Stopwatch<'b>,
    cell: &'a StatsCell,
    deadline: Option<Duration>,
    /// Paths until the next reading.
    countdown: u32,
    /// Paths between two readings.
    every: u32,
    last_reading: Instant,
    /// The number of flushes at the last reading, and the time of the reading that first saw that number.
    flushes: u64,
    flushed: Instant,
}

/// Most paths between two readings. It is small, because paths may become slow from one to the next.
const MAX_EVERY: u32 = 16;

impl<'a, 'b> FlushTimer<'a, 'b> {
    fn new(
        watch: &'a mut Stopwatch<'b>,
        cell: &'a StatsCell,
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
            last_reading: now,
            flushes: sink.flushes(),
            flushed: now,
        }
    }

    #[inline]
    fn after_path(&mut self, sink: &mut BlockSink) {
        self.countdown -= 1;
        if self.countdown == 0 {
            self.check(sink);
        }
    }

    #[cold]
    fn check(&mut self, sink: &mut BlockSink) {
        let now = Instant::now();
        if sink.flushes() != self.flushes {
            // The block was sent between two readings, because it was full or its chunk ended.
            self.note_flush(sink, self.last_reading);
        }
        if self.deadline.is_some_and(|deadline| now - self.flushed >= deadline) {
            sink.flush();
            self.note_flush(sink, now);
        }
        let fast = self.deadline.unwrap_or(Duration::from_millis(10)) / 8;
        self.every = if now - self.last_reading < fast { (2 * self.every).min(MAX_EVERY) } else { 1 };
        self.countdown = self.every;
        self.last_reading = now;
    }

    fn note_flush(&mut self, sink: &BlockSink, when: Instant) {
        self.flushes = sink.flushes();
        self.flushed = when;
        self.cell.totals(sink.totals());
        self.watch.lap(when, sink.writer().parked());
    }
}
