//! One row per frame and scope, told in the host's clock, in bounded memory.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::gpu::timing::clock::Clock;
use crate::gpu::timing::queries::ScopeTime;

/// Rows that wait to be taken: about two hundred frames; the oldest ones go first.
const MAX_ROWS: usize = 8192;

/// One run of a scope.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScopeRow {
    /// Number of the frame.
    pub frame: u64,
    /// Name given to [`Cmd::scope`](crate::gpu::Cmd::scope).
    pub name: &'static str,
    /// Scopes around it.
    pub depth: u32,
    /// When everything before its first command had been done.
    pub start: Instant,
    /// When its last command had been done.
    pub end: Instant,
}

/// A frame as the host saw it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameTimes {
    /// Its number.
    pub frame: u64,
    /// Just before it was handed to the driver.
    pub submitted: Instant,
    /// When the host noticed that it had completed, at the latest two frames later.
    pub seen: Instant,
    /// Scopes for which there was no timestamp left.
    pub untimed: u32,
}

/// What [`Gpu::take_rows`](crate::gpu::Gpu::take_rows) hands out.
#[derive(Clone, Debug, Default)]
pub struct TimingRows {
    /// Scopes, in the order in which they began.
    pub rows: Vec<ScopeRow>,
    /// Their frames.
    pub frames: Vec<FrameTimes>,
    /// Rows lost since the last call because nobody took them in time.
    pub dropped: u64,
}

/// How trustworthy rows are.
#[derive(Clone, Debug, PartialEq)]
pub struct TimingInfo {
    /// Valid bits of a timestamp; 0: nothing is timed.
    pub bits: u32,
    /// How device times became host times, in words.
    pub method: String,
    /// Largest uncertainty of a calibration so far, nanoseconds; `None` before the first.
    pub deviation: Option<f64>,
    /// Largest correction at a recalibration so far (drift between two), nanoseconds.
    pub correction: f64,
    /// What this device cannot time, one sentence each.
    pub untimed: Vec<String>,
}

/// What is known of completed frames, until it is taken.
#[derive(Default)]
pub(in crate::gpu) struct Readings {
    /// Sums of the scopes by name.
    pub totals: Vec<ScopeTime>,
    /// `None` without timestamps.
    pub clock: Option<Clock>,
    rows: VecDeque<ScopeRow>,
    frames: VecDeque<FrameTimes>,
    dropped: u64,
    /// End of the last row without a parent.
    end: Option<Instant>,
}

impl Readings {
    /// Renews the calibration where it has grown old.
    pub fn calibrate(&mut self) {
        if let Some(clock) = &mut self.clock {
            clock.calibrate();
        }
    }

    /// Adds a frame's scopes: name, depth, and the timestamps at both ends, in the order in which they began.
    pub fn frame(
        &mut self,
        frame: FrameTimes,
        scopes: impl Iterator<Item = (&'static str, u32, [u64; 2])> + Clone,
    ) {
        let Some(clock) = &mut self.clock else { return };
        let outer = scopes.clone().map(|(_, _, ticks)| ticks);
        let last = outer.clone().map(|t| t[1]).max();
        if let Some((first, last)) = outer.clone().map(|t| t[0]).next().zip(last) {
            clock.align((first, last), (frame.submitted, frame.seen));
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

    /// Everything since the last call.
    pub fn take_rows(&mut self) -> TimingRows {
        TimingRows {
            rows: self.rows.drain(..).collect(),
            frames: self.frames.drain(..).collect(),
            dropped: std::mem::take(&mut self.dropped),
        }
    }

    /// How trustworthy rows are. `software`: the device is a processor.
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
