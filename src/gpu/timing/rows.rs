//! Timings per frame and scope in host time, in bounded memory.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::gpu::timing::clock::DeviceClock;

/// Most rows kept until taken, about two hundred frames; the oldest are dropped first.
const MAX_ROWS: usize = 8192;

/// Total time of a scope's runs.
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

/// A frame in host time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameTimes {
    /// The frame's number.
    pub frame: u64,
    /// Just before submission to the driver.
    pub submitted: Instant,
    /// When the host noticed its completion, at most two frames later.
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
    /// Rows lost since the last call because they were not taken in time.
    pub dropped: u64,
}

/// Method and precision of the conversion from timestamps to host time.
#[derive(Clone, Debug, PartialEq)]
pub struct TimingInfo {
    /// Valid bits of a timestamp; 0 if the host times whole frames.
    pub bits: u32,
    /// Conversion method.
    pub method: String,
    /// Largest uncertainty of a calibration so far, nanoseconds; `None` before the first.
    pub deviation: Option<f64>,
    /// Largest correction at a recalibration so far (drift since the previous one), nanoseconds.
    pub correction: f64,
    /// One sentence per limitation of this device's timing.
    pub untimed: Vec<String>,
}

/// Timings of completed frames that have not been taken.
#[derive(Default)]
pub(in crate::gpu) struct Readings {
    /// Sums of the scopes by name.
    pub totals: Vec<ScopeTime>,
    /// `None` without timestamps.
    pub clock: Option<DeviceClock>,
    rows: VecDeque<ScopeRow>,
    frames: VecDeque<FrameTimes>,
    dropped: u64,
    /// End of the last row; without timestamps, of the last frame.
    end: Option<Instant>,
}

impl Readings {
    /// Readings in the times of this clock.
    pub fn new(clock: Option<DeviceClock>) -> Self {
        Self { clock, ..Self::default() }
    }

    /// Adds a frame's scopes in order of their beginning: name, depth, and timestamps of both ends.
    pub fn frame(
        &mut self,
        frame: FrameTimes,
        scopes: impl Iterator<Item = (&'static str, u32, [u64; 2])> + Clone,
    ) {
        let Some(clock) = &mut self.clock else { return };
        for (name, _, [start, end]) in scopes.clone() {
            add(&mut self.totals, name, clock.elapsed(start, end) * 1e-6);
        }
        if let Some((_, _, [first, _])) = scopes.clone().next() {
            // The counter may have wrapped around within the frame.
            let since_first = |end: &u64| clock.elapsed(first, *end);
            let ends = scopes.clone().map(|(_, _, [_, end])| end);
            let last = ends.max_by(|a, b| since_first(a).total_cmp(&since_first(b)));
            clock.align(first, last.unwrap_or(first), frame.submitted, frame.seen);
        }
        // The queue executes frames in order, but a recalibration may shift them against each other by its correction.
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

    /// Adds a frame without timestamps: its host time, from its submission or from the completion of the previous frame, is divided evenly
    /// among these scopes, which do not nest.
    pub fn frame_of_host(&mut self, frame: FrameTimes, scopes: &[&'static str]) {
        let begun = self.end.map_or(frame.submitted, |end| end.max(frame.submitted));
        let milliseconds = frame.seen.saturating_duration_since(begun).as_secs_f64() * 1e3;
        for name in scopes {
            add(&mut self.totals, name, milliseconds / scopes.len() as f64);
        }
        self.end = Some(frame.seen.max(begun));
    }

    /// The timings since the last call.
    pub fn take_rows(&mut self) -> TimingRows {
        TimingRows {
            rows: self.rows.drain(..).collect(),
            frames: self.frames.drain(..).collect(),
            dropped: std::mem::take(&mut self.dropped),
        }
    }

    /// See [`TimingInfo`]; `software`: the device is the CPU.
    pub fn info(&self, software: bool) -> TimingInfo {
        let mut untimed = Vec::new();
        let (mut bits, mut deviation, mut correction) = (0, None, 0.0);
        let method = match &self.clock {
            None => {
                untimed.push(
                    "Single passes: the queue has no timestamps (timestampValidBits is 0). The time of a frame, from its \
                     submission until it was seen to have completed, is divided evenly among its passes."
                        .to_owned(),
                );
                "none: frames are timed by the host".to_owned()
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

/// Adds a run of this scope.
fn add(totals: &mut Vec<ScopeTime>, name: &'static str, milliseconds: f64) {
    match totals.iter_mut().find(|total| total.name == name) {
        Some(total) => {
            total.count += 1;
            total.milliseconds += milliseconds;
        }
        None => totals.push(ScopeTime { name, count: 1, milliseconds }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(number: u64, submitted: Instant, milliseconds: u64) -> FrameTimes {
        let seen = submitted + Duration::from_millis(milliseconds);
        FrameTimes { frame: number, submitted, seen, untimed: 0 }
    }

    /// A 36-bit counter that wraps around within or between scopes affects neither sums nor rows.
    #[test]
    fn counters_of_36_bits_wrap() {
        let start = Instant::now() + Duration::from_secs(1);
        let run = |origin: u64| {
            let mut readings = Readings::new(Some(DeviceClock::with(None, 1.0, 36)));
            let at = |ns: u64| (origin + ns) % (1 << 36);
            let scopes = [("splat", 0, [at(0), at(3_000_000)]), ("fold", 0, [at(3_000_000), at(4_000_000)])];
            readings.frame(frame(1, start, 5), scopes.into_iter());
            (readings.totals.clone(), readings.take_rows().rows)
        };
        let (totals, rows) = run(1_000);
        assert_eq!(totals.iter().map(|t| t.milliseconds).collect::<Vec<_>>(), [3.0, 1.0]);
        for before in [0, 1, 1_500_000, 3_000_000, 3_500_000, 4_000_000] {
            let (wrapped_totals, wrapped_rows) = run((1 << 36) - before);
            assert_eq!(wrapped_totals, totals, "{before} ns before the wrap");
            assert_eq!(wrapped_rows, rows, "{before} ns before the wrap");
        }
    }

    /// Overlapping frames are counted once: the sum over all scopes is the time in which any of them ran.
    #[test]
    fn the_host_times_frames_without_timestamps() {
        let mut readings = Readings::new(None);
        let start = Instant::now();
        readings.frame_of_host(frame(1, start, 12), &["splat", "fold"]);
        // Submitted while the first frame ran, completed 8 ms after it.
        readings.frame_of_host(
            frame(2, start + Duration::from_millis(5), 15),
            &["splat", "fold", "mips", "tonemap"],
        );
        let times: Vec<_> = readings.totals.iter().map(|t| (t.name, t.count, t.milliseconds)).collect();
        assert_eq!(times, [("splat", 2, 8.0), ("fold", 2, 8.0), ("mips", 1, 2.0), ("tonemap", 1, 2.0)]);
        let info = readings.info(false);
        assert!(info.bits == 0 && info.untimed.len() == 1, "{info:?}");
    }
}
