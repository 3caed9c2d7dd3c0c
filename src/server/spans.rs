//! When each worker traced which chunk, for a timeline; recorded only when asked for.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::stream::LaneWriter;

/// Chunks remembered per worker; a chunk takes about a millisecond. The oldest ones go first.
pub const MAX_SPANS: usize = 4096;

/// One chunk as one worker traced it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// The worker.
    pub worker: usize,
    /// First index of the chunk.
    pub first: u64,
    /// When it was claimed.
    pub start: Instant,
    /// When its last block was in the lane.
    pub end: Instant,
    /// Time of it asleep on a full lane, in all.
    pub parked: Duration,
    /// Begin and end of the last of those sleeps.
    pub last_park: Option<(Instant, Instant)>,
}

/// What [`Server::take_spans`](crate::server::Server::take_spans) hands out.
#[derive(Clone, Debug, Default)]
pub struct Spans {
    /// By worker, then in order of time.
    pub spans: Vec<Span>,
    /// Lost since the last call because nobody took them in time.
    pub dropped: u64,
}

/// Where the workers write. Each has a lock of its own, which nobody else wants except for the moment of taking.
#[derive(Debug)]
pub(super) struct SpanLog {
    on: AtomicBool,
    workers: Vec<Mutex<Ring>>,
}

#[derive(Debug, Default)]
#[repr(align(128))]
struct Ring {
    spans: VecDeque<Span>,
    dropped: u64,
}

/// A chunk that was begun: its first index, when, and the time slept so far.
pub(super) type Begun = Option<(u64, Instant, Duration)>;

impl SpanLog {
    pub(super) fn new(threads: usize) -> Self {
        let workers = std::iter::repeat_with(Mutex::default).take(threads).collect();
        Self { on: AtomicBool::new(false), workers }
    }

    pub(super) fn set(&self, on: bool) {
        self.on.store(on, Ordering::Relaxed);
    }

    /// Notes the begin of a chunk; `None` while nothing is recorded.
    #[inline]
    pub(super) fn begin(&self, first: u64, writer: &LaneWriter) -> Begun {
        self.on.load(Ordering::Relaxed).then(|| (first, Instant::now(), writer.parked()))
    }

    /// Notes its end.
    #[inline]
    pub(super) fn end(&self, worker: usize, begun: Begun, writer: &LaneWriter) {
        let Some((first, start, parked)) = begun else { return };
        let parked = writer.parked() - parked;
        let last_park = writer.last_park().filter(|_| parked > Duration::ZERO);
        let span = Span { worker, first, start, end: Instant::now(), parked, last_park };
        let mut ring = self.workers[worker].lock().unwrap_or_else(PoisonError::into_inner);
        if ring.spans.len() == MAX_SPANS {
            ring.spans.pop_front();
            ring.dropped += 1;
        }
        ring.spans.push_back(span);
    }

    pub(super) fn take(&self) -> Spans {
        let mut all = Spans::default();
        for worker in &self.workers {
            let mut ring = worker.lock().unwrap_or_else(PoisonError::into_inner);
            all.spans.extend(ring.spans.drain(..));
            all.dropped += std::mem::take(&mut ring.dropped);
        }
        all
    }
}
