//! A Chrome trace, written incrementally; Perfetto (ui.perfetto.dev) and chrome://tracing open it.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use serde_json::{Value, json};

use crate::image::ImageError;
use crate::image::write::AtomicFile;

/// Nanoseconds for which spans are held back, so that GPU spans, which are known two frames late, are still written in order.
const HOLD: u64 = 2_000_000_000;

/// Most spans held back; beyond, the oldest ones are written at once.
const MAX_WAITING: usize = 65_536;

/// Row of the trace that a span is drawn on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Track {
    /// The device's queue.
    Gpu,
    /// The client's thread, which drains, records and presents.
    Client,
    /// A tracing thread.
    Worker(usize),
}

impl Track {
    /// Process and thread id in the trace.
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
    /// Begin and end, in nanoseconds since the capture began.
    pub time: Range<u64>,
    pub track: Track,
    pub name: &'static str,
    pub args: Value,
}

/// The trace.
#[derive(Debug)]
pub struct Trace {
    file: AtomicFile,
    /// Spans held back, sorted by begin, end (descending) and order of arrival. Of those that begin together the longest is first, so that
    /// it encloses the others.
    waiting: BTreeMap<(u64, Reverse<u64>, u64), TraceSpan>,
    /// Number of spans so far.
    count: u64,
    workers: usize,
}

impl Trace {
    /// Creates a trace; `device`: name of the GPU process, `None` without a device.
    pub fn create(path: &Path, device: Option<&str>) -> Result<Self, ImageError> {
        let mut file = AtomicFile::create(path)?;
        file.append("{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n")?;
        let mut trace = Self { file, waiting: BTreeMap::new(), count: 0, workers: 0 };
        if let Some(device) = device {
            trace.name("process_name", Track::Gpu, &format!("GPU {device}"))?;
            trace.name("thread_name", Track::Gpu, "queue")?;
        }
        trace.name("process_name", Track::Client, "CPU")?;
        trace.name("thread_name", Track::Client, "client")?;
        Ok(trace)
    }

    /// Names a process or a thread. Every line but the last ends with a comma; [`finish`](Self::finish) writes the last one.
    fn name(&mut self, what: &str, track: Track, name: &str) -> Result<(), ImageError> {
        let (pid, tid) = track.ids();
        let line = json!({ "ph": "M", "name": what, "pid": pid, "tid": tid, "args": { "name": name } });
        self.file.append(format!("{line},\n"))
    }

    /// Adds a span.
    pub fn push(&mut self, span: TraceSpan) -> Result<(), ImageError> {
        if let Track::Worker(number) = span.track {
            while self.workers <= number {
                self.name("thread_name", Track::Worker(self.workers), &format!("tracer {}", self.workers))?;
                self.workers += 1;
            }
        }
        self.count += 1;
        self.waiting.insert((span.time.start, Reverse(span.time.end), self.count), span);
        Ok(())
    }

    /// Writes spans that are old enough at time `now`, nanoseconds.
    pub fn write(&mut self, now: u64) -> Result<(), ImageError> {
        while let Some((&(begin, ..), _)) = self.waiting.first_key_value() {
            if begin.saturating_add(HOLD) > now && self.waiting.len() <= MAX_WAITING {
                break;
            }
            let Some((_, span)) = self.waiting.pop_first() else { break };
            let (pid, tid) = span.track.ids();
            // Microseconds with nanosecond digits, as text: a double would round them after a few days.
            let us = |ns: u64| format!("{}.{:03}", ns / 1000, ns % 1000);
            let (ts, duration) = (us(span.time.start), us(span.time.end.saturating_sub(span.time.start)));
            let (name, args) = (Value::from(span.name), span.args);
            self.file.append(format!(
                "{{\"ph\":\"X\",\"name\":{name},\"pid\":{pid},\"tid\":{tid},\"ts\":{ts},\"dur\":{duration},\"args\":{args}}},\n"
            ))?;
        }
        Ok(())
    }

    /// Writes the remaining spans and renames the file; `about` is stored as `otherData`.
    pub fn finish(mut self, about: &Value) -> Result<(), ImageError> {
        self.write(u64::MAX)?;
        let last = json!({ "ph": "M", "name": "process_sort_index", "pid": 1, "tid": 1, "args": { "sort_index": 0 } });
        self.file.append(format!("{last}\n],\n\"otherData\":{about}}}\n"))?;
        self.file.commit()
    }
}
