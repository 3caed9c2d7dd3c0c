//! A Chrome trace, written while it grows; Perfetto (ui.perfetto.dev) and chrome://tracing open it.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;
use std::path::Path;

use serde_json::{Value, json};

use crate::image::ImageError;
use crate::image::write::AtomicFile;

/// Spans wait this long, in nanoseconds, so that those of the GPU, which are known two frames late, still come in order.
const HOLD: u64 = 2_000_000_000;

/// Spans that wait at most; beyond, the oldest ones are written at once.
const MAX_WAITING: usize = 65_536;

/// The row of the trace that a span is drawn on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Track {
    /// The device's queue.
    Gpu,
    /// The thread that drains, records and shows.
    Client,
    /// A tracing thread.
    Worker(usize),
}

impl Track {
    /// Process and thread number in the trace.
    fn ids(self) -> (u32, usize) {
        match self {
            Track::Gpu => (1, 1),
            Track::Client => (2, 1),
            Track::Worker(number) => (2, 2 + number),
        }
    }
}

/// One span of time.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceSpan {
    /// Begin and end in nanoseconds since the capture began.
    pub time: Range<u64>,
    /// The track that it is drawn on.
    pub track: Track,
    /// The name that it is drawn with.
    pub name: &'static str,
    /// Further values to show.
    pub args: Value,
}

/// A span that waits to be written. The order is by begin; of those that begin together the longest is first, so that it
/// encloses the others.
#[derive(Debug)]
struct Waiting(TraceSpan, u64);

impl Waiting {
    fn key(&self) -> (u64, Reverse<u64>, u64) {
        (self.0.time.start, Reverse(self.0.time.end), self.1)
    }
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Waiting {}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.key().cmp(&other.key())
    }
}

/// The trace.
#[derive(Debug)]
pub struct Trace {
    file: AtomicFile,
    waiting: BinaryHeap<Reverse<Waiting>>,
    /// Spans taken so far.
    count: u64,
    workers: usize,
}

impl Trace {
    /// Begins a trace; `device` names the process of the GPU, `None` where there is none.
    ///
    /// # Errors
    ///
    /// When the file cannot be made.
    pub fn create(path: &Path, device: Option<&str>) -> Result<Self, ImageError> {
        let mut file = AtomicFile::create(path)?;
        file.append("{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n")?;
        let mut trace = Self { file, waiting: BinaryHeap::new(), count: 0, workers: 0 };
        if let Some(device) = device {
            trace.name("process_name", Track::Gpu, &format!("GPU {device}"))?;
            trace.name("thread_name", Track::Gpu, "queue")?;
        }
        trace.name("process_name", Track::Client, "CPU")?;
        trace.name("thread_name", Track::Client, "client")?;
        Ok(trace)
    }

    /// Names a process or a thread; every line but the last ends with a comma, and the last one is [`finish`](Self::finish)'s.
    fn name(&mut self, what: &str, track: Track, name: &str) -> Result<(), ImageError> {
        let (pid, tid) = track.ids();
        let line = json!({ "ph": "M", "name": what, "pid": pid, "tid": tid, "args": { "name": name } });
        self.file.append(format!("{line},\n"))
    }

    /// Adds a span.
    ///
    /// # Errors
    ///
    /// When the file cannot be written.
    pub fn push(&mut self, span: TraceSpan) -> Result<(), ImageError> {
        if let Track::Worker(number) = span.track {
            while self.workers <= number {
                self.name("thread_name", Track::Worker(self.workers), &format!("tracer {}", self.workers))?;
                self.workers += 1;
            }
        }
        self.count += 1;
        self.waiting.push(Reverse(Waiting(span, self.count)));
        Ok(())
    }

    /// Writes what is old enough at the moment `now`, nanoseconds.
    ///
    /// # Errors
    ///
    /// When the file cannot be written.
    pub fn write(&mut self, now: u64) -> Result<(), ImageError> {
        while let Some(Reverse(first)) = self.waiting.peek() {
            if first.0.time.start.saturating_add(HOLD) > now && self.waiting.len() <= MAX_WAITING {
                break;
            }
            let Some(Reverse(Waiting(span, _))) = self.waiting.pop() else { break };
            let (pid, tid) = span.track.ids();
            // Microseconds with all nanoseconds, as text: a double would round them after a few days.
            let us = |ns: u64| format!("{}.{:03}", ns / 1000, ns % 1000);
            let (ts, duration) = (us(span.time.start), us(span.time.end.saturating_sub(span.time.start)));
            let (name, args) = (Value::from(span.name), span.args);
            self.file.append(format!(
                "{{\"ph\":\"X\",\"name\":{name},\"pid\":{pid},\"tid\":{tid},\"ts\":{ts},\"dur\":{duration},\"args\":{args}}},\n"
            ))?;
        }
        Ok(())
    }

    /// Writes the rest and puts the file in its place; `about` is kept as `otherData`.
    ///
    /// # Errors
    ///
    /// When the file cannot be written.
    pub fn finish(mut self, about: &Value) -> Result<(), ImageError> {
        self.write(u64::MAX)?;
        let last = json!({ "ph": "M", "name": "process_sort_index", "pid": 1, "tid": 1, "args": { "sort_index": 0 } });
        self.file.append(format!("{last}\n],\n\"otherData\":{about}}}\n"))?;
        self.file.commit()
    }
}
