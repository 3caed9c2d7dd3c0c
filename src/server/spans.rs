//! A timeline of the chunks that each worker traced, recorded on request.

use std::collections::VecDeque;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::job::unpoisoned;
use crate::stream::LaneWriter;

/// Most chunks that are kept per worker; a chunk takes about a millisecond. The oldest ones are dropped first.
pub const MAX_SPANS: usize = 4096;

/// The time that one worker spent on one chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChunkSpan {
    /// The worker.
    pub worker: usize,
    /// First index of the chunk.
    pub first: u64,
    /// When it was claimed.
    pub start: Instant,
    /// When its last block was sent.
    pub end: Instant,
    /// Total time asleep on a full lane meanwhile.
    pub parked: Duration,
    /// Begin and end of the last of those sleeps.
    pub last_park: Option<(Instant, Instant)>,
}

/// The result of [`Server::take_spans`](crate::server::Server::take_spans).
#[derive(Clone, Debug, Default)]
pub struct Spans {
    /// The chunks, by worker, then in order of time.
    pub spans: Vec<ChunkSpan>,
    /// Number of chunks that were dropped since the last call.
    pub dropped: u64,
}

/// The log that the workers write. Each worker has a lock of its own, which is contended only while the log is read.
#[derive(Debug)]
pub(super) struct SpanLog {
    on: AtomicBool,
    workers: Vec<Mutex<WorkerSpans>>,
}

#[derive(Debug, Default)]
#[repr(align(128))]
struct WorkerSpans {
    spans: VecDeque<ChunkSpan>,
    dropped: u64,
}

/// The start of a chunk: its first index, the time, and the time parked so far.
#[derive(Clone, Copy)]
pub(super) struct StartedSpan {
    first: u64,
    start: Instant,
    parked: Duration,
}

impl SpanLog {
    pub(super) fn new(threads: usize) -> Self {
        let workers = std::iter::repeat_with(Mutex::default).take(threads).collect();
        Self { on: AtomicBool::new(false), workers }
    }

    pub(super) fn set(&self, on: bool) {
        self.on.store(on, Ordering::Relaxed);
    }

    /// Starts a span. `None` while nothing is recorded.
    #[inline]
    pub(super) fn begin(&self, first: u64, writer: &LaneWriter) -> Option<StartedSpan> {
        self.on.load(Ordering::Relaxed).then(|| StartedSpan {
            first,
            start: Instant::now(),
            parked: writer.parked(),
        })
    }

    /// Ends a span.
    #[inline]
    pub(super) fn end(&self, worker: usize, started: Option<StartedSpan>, writer: &LaneWriter) {
        let Some(StartedSpan { first, start, parked }) = started else { return };
        let parked = writer.parked() - parked;
        let last_park = writer.last_park().filter(|_| parked > Duration::ZERO);
        let span = ChunkSpan { worker, first, start, end: Instant::now(), parked, last_park };
        let mut ring = unpoisoned(&self.workers[worker]);
        if ring.spans.len() == MAX_SPANS {
            ring.spans.pop_front();
            ring.dropped += 1;
        }
        ring.spans.push_back(span);
    }

    pub(super) fn take(&self) -> Spans {
        let mut all = Spans::default();
        for worker in &self.workers {
            let mut ring = unpoisoned(worker);
            all.spans.extend(ring.spans.drain(..));
            all.dropped += std::mem::take(&mut ring.dropped);
        }
        all
    }
}
