//! One row per frame and scope, in times of the host's clock, in bounded memory.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::gpu::timing::clock::DeviceClock;

/// Most rows that are kept until they are taken, those of about two hundred frames; the oldest are dropped first.
const MAX_ROWS: usize = 8192;

/// The sum of one scope's runs.
#[derive(Clone, Debug, PartialEq)]
pub struct ScopeTime {
    /// Name given to [`Cmd::scope`](crate::gpu::Cmd::scope).
    pub name: &'static str,
    /// Number of runs.
    pub count: u64,
    /// Time between its first and last command, milliseconds, summed over the runs.
    pub milliseconds: f64,
}

/// One run of a scope.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScopeRow {
    /// Number of the frame.
    pub frame: u64,
    /// Name given to [`Cmd::scope`](crate::gpu::Cmd::scope).
    pub name: &'static str,
    /// Number of scopes that enclose it.
    pub depth: u32,
    /// When everything before its first command had completed.
    pub start: Instant,
    /// When its last command had completed.
    pub end: Instant,
}

/// A frame as the host saw it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameTimes {
    /// The frame's number.
    pub frame: u64,
    /// Just before it was handed to the driver.
    pub submitted: Instant,
    /// When the host noticed that it had completed, at the latest two frames later.
    pub seen: Instant,
    /// Number of scopes for which no timestamps were left.
    pub untimed: u32,
}

/// The timings of completed frames, from [`Gpu::take_rows`](crate::gpu::Gpu::take_rows).
#[derive(Clone, Debug, Default)]
pub struct TimingRows {
    /// Scopes, in the order in which they began.
    pub rows: Vec<ScopeRow>,
    /// Their frames.
    pub frames: Vec<FrameTimes>,
    /// Rows lost since the last call because nobody took them in time.
    pub dropped: u64,
}

/// How timestamps become times of the host, and how precise those are.
#[derive(Clone, Debug, PartialEq)]
pub struct TimingInfo {
    /// Valid bits of a timestamp; 0: nothing is timed.
    pub bits: u32,
    /// The method that turns device times into host times.
    pub method: String,
    /// Largest uncertainty of a calibration so far, nanoseconds; `None` before the first.
    pub deviation: Option<f64>,
    /// Largest correction at a recalibration so far (drift between two), nanoseconds.
    pub correction: f64,
    /// One sentence for each thing that this device cannot time.
    pub untimed: Vec<String>,
}

/// The timings of completed frames, until they are taken.
#[derive(Default)]
pub(in crate::gpu) struct Readings {
    /// Sums of the scopes by name.
    pub totals: Vec<ScopeTime>,
    /// `None` without timestamps.
    pub clock: Option<DeviceClock>,
    rows: VecDeque<ScopeRow>,
    frames: VecDeque<FrameTimes>,
    dropped: u64,
    /// End of the last row without a parent.
    end: Option<Instant>,
}

impl Readings {
    /// Readings in the times of this clock.
    pub fn new(clock: Option<DeviceClock>) -> Self {
        Self { clock, ..Self::default() }
    }

    /// Adds a frame's scopes: name, depth, and the timestamps at both ends, in the order in which they began; a tick takes
    /// `tick` nanoseconds.
    pub fn frame(
        &mut self,
        frame: FrameTimes,
        tick: f64,
        scopes: impl Iterator<Item = (&'static str, u32, [u64; 2])> + Clone,
    ) {
        for (name, _, [start, end]) in scopes.clone() {
            let milliseconds = end.saturating_sub(start) as f64 * tick * 1e-6;
            match self.totals.iter_mut().find(|t| t.name == name) {
                Some(total) => {
                    total.count += 1;
                    total.milliseconds += milliseconds;
                }
                None => self.totals.push(ScopeTime { name, count: 1, milliseconds }),
            }
        }
        let Some(clock) = &mut self.clock else { return };
        let outer = scopes.clone().map(|(_, _, ticks)| ticks);
        let last = outer.clone().map(|t| t[1]).max();
        if let Some((first, last)) = outer.clone().map(|t| t[0]).next().zip(last) {
            clock.align(first, last, frame.submitted, frame.seen);
        }
        // The queue runs frames in order; a new calibration may shift them against each other by its correction.
        let slack = Duration::from_nanos((2.0 * clock.error()).clamp(1e3, 1e9) as u64);
        let floor = self.end;
        let clamp = |t: Instant| match floor {
            Some(end) if t < end && end - t <= slack => end,
            _ => t,
        };
        for (name, depth, [start, end]) in scopes {
            let start = clamp(clock.host(start));
            let end = clamp(clock.host(end)).max(start);
            self.end = Some(self.end.map_or(end, |e| e.max(end)));
            self.rows.push_back(ScopeRow { frame: frame.frame, name, depth, start, end });
        }
        self.frames.push_back(frame);
        while self.rows.len() > MAX_ROWS {
            self.rows.pop_front();
            self.dropped += 1;
        }
        while self.frames.len() > MAX_ROWS {
            self.frames.pop_front();
        }
    }

    /// The timings since the last call.
    pub fn take_rows(&mut self) -> TimingRows {
        TimingRows {
            rows: self.rows.drain(..).collect(),
            frames: self.frames.drain(..).collect(),
            dropped: std::mem::take(&mut self.dropped),
        }
    }

    /// See [`TimingInfo`]; `software` says that the device is a processor.
    pub fn info(&self, software: bool) -> TimingInfo {
        let mut untimed = Vec::new();
        let (mut bits, mut deviation, mut correction) = (0, None, 0.0);
        let method = match &self.clock {
            None => {
                untimed.push("All passes: the queue has no timestamps (timestampValidBits is 0).".to_owned());
                "none".to_owned()
            }
            Some(clock) => {
                bits = clock.bits;
                deviation = clock.error().is_finite().then_some(clock.worst);
                correction = clock.correction;
                match clock.is_calibrated() {
                    true => "calibrated: the device's clock is read against the host's monotonic clock every 100 ms",
                    false => "host-aligned: frames are placed between their submission and their completion",
                }
                .to_owned()
            }
        };
        if software && self.clock.is_some() {
            untimed.push(
                "Clears of targets and compute dispatches may lie outside of their scopes: software drivers such as \
                 lavapipe take timestamps in the rasteriser."
                    .to_owned(),
            );
        }
        TimingInfo { bits, method, deviation, correction, untimed }
    }
}
