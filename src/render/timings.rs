//! `--gpu-timings`: activity of GPU, workers and client over time, as CSV and as a Chrome trace, on a common clock.
//!
//! Both files are written under temporary names and renamed at the end. Memory is bounded: every [`TimingCapture::frame`] writes the
//! pending records, and records lost in between are counted at the end of both files.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};
use serde_json::{Value, json};

use crate::gpu::{Gpu, TimingRows};
use crate::image::write::{AtomicFile, check_place, same_file};
use crate::render::trace::{Trace, TraceSpan, Track};
use crate::server::{Server, Spans};

/// Interval at which records of device and workers are taken.
const EVERY: Duration = Duration::from_millis(50);

/// A capture in progress.
pub struct TimingCapture {
    gpu: Option<Arc<Gpu>>,
    /// Origin of all times.
    origin: Instant,
    csv: AtomicFile,
    trace: Trace,
    /// When records were last taken.
    taken: Instant,
    lost: Lost,
}

/// Numbers of lost records.
#[derive(Clone, Copy, Debug, Default)]
struct Lost {
    scopes_untimed: u64,
    rows: u64,
    spans: u64,
}

/// Path of a capture's Chrome trace: the name with `.json` appended.
pub fn trace_path(csv: &Path) -> PathBuf {
    let mut name = csv.as_os_str().to_owned();
    name.push(".json");
    PathBuf::from(name)
}

/// Checks before any work that both files of `--gpu-timings` can be written and are none of `others`.
pub fn check<'a>(path: &Path, others: impl IntoIterator<Item = &'a PathBuf>) -> Result<()> {
    if path == Path::new("-") {
        return Err(miette::miette!("--gpu-timings writes two files and needs a name for them, not `-`"));
    }
    let mine = [path.to_path_buf(), trace_path(path)];
    for file in &mine {
        check_place(file).into_diagnostic()?;
    }
    for other in others {
        if mine.iter().any(|file| same_file(file, other)) {
            return Err(miette::miette!(
                "--gpu-timings {} would overwrite {}; choose another name",
                path.display(),
                other.display()
            ));
        }
    }
    Ok(())
}

impl TimingCapture {
    /// Creates both files and enables the device's timestamps; the caller must call [`Server::set_tracing`]. Without a device (`--device
    /// cpu`) there are only CPU spans, which the files state.
    pub fn new(path: &Path, gpu: Option<&Arc<Gpu>>) -> Result<Self> {
        let device = gpu.map(|gpu| gpu.info().name.clone());
        let mut csv = AtomicFile::create(path).into_diagnostic()?;
        csv.append(header(gpu)).into_diagnostic()?;
        let trace = Trace::create(&trace_path(path), device.as_deref()).into_diagnostic()?;
        if let Some(gpu) = gpu {
            gpu.take_rows();
            gpu.set_timing(true);
        }
        let now = Instant::now();
        Ok(Self { gpu: gpu.cloned(), origin: now, csv, trace, taken: now, lost: Lost::default() })
    }

    /// Records work of the client from `start` until now.
    pub fn client(&mut self, name: &'static str, start: Instant) -> Result<()> {
        self.span(Track::Client, name, start..Instant::now(), Value::Null)
    }

    /// Takes pending records if due. To be called once per frame, while no frame is being recorded.
    pub fn frame(&mut self, server: Option<&Server>) -> Result<()> {
        match self.gpu.clone() {
            Some(gpu) if self.is_due() => self.rows(&gpu.take_rows())?,
            _ => {}
        }
        self.frame_of_cpu(server)
    }

    /// As [`frame`](Self::frame), for a caller that passes the device's [`rows`](Self::rows) itself.
    pub fn frame_of_cpu(&mut self, server: Option<&Server>) -> Result<()> {
        if !self.is_due() {
            return Ok(());
        }
        self.taken = Instant::now();
        if let Some(server) = server {
            self.spans(server.take_spans())?;
        }
        self.trace.write(self.time(self.taken)).into_diagnostic()
    }

    fn is_due(&self) -> bool {
        self.taken.elapsed() >= EVERY
    }

    /// Records spans of the workers.
    pub fn spans(&mut self, spans: Spans) -> Result<()> {
        self.lost.spans += spans.dropped;
        for span in spans.spans {
            let track = Track::Worker(span.worker);
            let parked = span.parked.as_micros() as u64;
            let args = json!({ "first": span.first, "parked_us": parked });
            self.span(track, "chunk", span.start..span.end, args)?;
            if let Some((start, end)) = span.last_park {
                self.span(track, "parked", start..end, Value::Null)?;
            }
        }
        Ok(())
    }

    /// Records rows of the device; [`frame`](Self::frame) does this unless the caller needs the rows itself.
    pub fn rows(&mut self, taken: &TimingRows) -> Result<()> {
        self.lost.rows += taken.dropped;
        self.lost.scopes_untimed += taken.frames.iter().map(|f| u64::from(f.untimed)).sum::<u64>();
        let mut frames = taken.frames.iter().peekable();
        for row in &taken.rows {
            while frames.peek().is_some_and(|f| f.frame < row.frame) {
                frames.next();
            }
            let (start, end) = (self.time(row.start), self.time(row.end));
            let line = format!("{},{},{},{start},{end}\n", row.frame, row.name, row.depth);
            self.csv.append(&line).into_diagnostic()?;
            let seen = frames.peek().filter(|f| f.frame == row.frame);
            let us = |t: Instant| self.time(t) as f64 * 1e-3;
            let args = json!({
                "frame": row.frame,
                "submitted_us": seen.map(|f| us(f.submitted)),
                "seen_complete_us": seen.map(|f| us(f.seen)),
            });
            self.span(Track::Gpu, row.name, row.start..row.end, args)?;
        }
        Ok(())
    }

    /// Continues with another device after the first was lost.
    pub fn replace_gpu(&mut self, gpu: &Arc<Gpu>) {
        gpu.set_timing(true);
        self.gpu = Some(gpu.clone());
    }

    /// Writes the remaining records and the counts of lost ones, and renames both files.
    pub fn finish(mut self, server: Option<&Server>) -> Result<()> {
        if let Some(server) = server {
            server.set_tracing(false);
            self.spans(server.take_spans())?;
        }
        let mut about =
            json!({ "clock": "nanoseconds (CSV) and microseconds (trace) since the capture began" });
        if let Some(gpu) = self.gpu.take() {
            // An empty frame: when it has completed, so have all earlier ones. A lost device has no more rows.
            let last = gpu.begin().and_then(|frame| frame.submit()).and_then(|number| gpu.wait(number));
            gpu.set_timing(false);
            if last.is_ok() {
                self.rows(&gpu.take_rows())?;
            }
            about["gpu"] = describe(&gpu);
        }
        let Lost { scopes_untimed, rows, spans } = self.lost;
        about["lost"] = json!({ "scopes_untimed": scopes_untimed, "rows": rows, "worker_spans": spans });
        let mut footer = format!(
            "# lost: {scopes_untimed} scopes without a timestamp left in their frame, {rows} rows and {spans} worker spans not \
             taken in time\n"
        );
        if let Some(deviation) = about["gpu"]["deviation_us"].as_f64() {
            let correction = about["gpu"]["correction_us"].as_f64().unwrap_or(0.0);
            footer += &format!(
                "# clock: uncertain by up to {deviation:.3} µs, largest correction at a recalibration {correction:.3} µs\n"
            );
        }
        self.csv.append(&footer).into_diagnostic()?;
        self.trace.finish(&about).into_diagnostic()?;
        self.csv.commit().into_diagnostic()
    }

    fn span(&mut self, track: Track, name: &'static str, time: Range<Instant>, args: Value) -> Result<()> {
        let time = self.time(time.start)..self.time(time.end);
        self.trace.push(TraceSpan { time, track, name, args }).into_diagnostic()
    }

    /// Nanoseconds since the capture began.
    fn time(&self, moment: Instant) -> u64 {
        moment.saturating_duration_since(self.origin).as_nanos() as u64
    }
}

/// Device, driver, and precision of its timings.
pub fn describe(gpu: &Gpu) -> Value {
    let (device, timing) = (gpu.info(), gpu.timing_info());
    json!({
        "device": device.name,
        "kind": device.kind.to_string(),
        "driver": device.driver,
        "vulkan": device.api,
        "timestamp_bits": timing.bits,
        "method": timing.method,
        "deviation_us": timing.deviation.map(|ns| ns * 1e-3),
        "correction_us": timing.correction * 1e-3,
        "not_timed": timing.untimed,
    })
}

fn header(gpu: Option<&Arc<Gpu>>) -> String {
    let mut text =
        "# Pointillist GPU timings: one row per frame and scope, in order of the frames\n".to_owned();
    match gpu {
        None => {
            text += "# device: none (--device cpu): nothing to time on a GPU; the trace has the CPU's spans\n"
        }
        Some(gpu) => {
            let (device, timing) = (gpu.info(), gpu.timing_info());
            text += &format!(
                "# device: {} ({}, {}, Vulkan {})\n",
                device.name, device.kind, device.driver, device.api
            );
            text += &format!("# clock: {}; {} valid bits\n", timing.method, timing.bits);
            timing.untimed.iter().for_each(|what| text += &format!("# not timed: {what}\n"));
        }
    }
    text += "# frame: number of the submission; depth: scopes around it; start_ns, end_ns: host's monotonic clock since the \
             capture began\n";
    text + "frame,scope,depth,start_ns,end_ns\n"
}
