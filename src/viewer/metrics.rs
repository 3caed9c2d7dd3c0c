//! Performance measurements of the viewer, for the panel, for pacing, and for `--json`.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use crate::client::pacing::Pacer;
use crate::client::window::statistics::{FRAMES, RecentValues};
use crate::gpu::{FrameNumber, Gpu, ScopeTime};
use crate::viewer::picture::ShownFrame;

/// A longer sleep of the loop counts as a stall.
const STALL: Duration = Duration::from_millis(250);

/// Values kept for the figures of the whole session: four and a half minutes at 60 Hz.
const KEPT: usize = 16_384;

/// Number of edits whose latencies the panel shows.
const RECENT_EDITS: usize = 100;

/// A frame that the window has not presented after this time is no longer waited for.
const UNSEEN: Duration = Duration::from_millis(500);

/// Exponential smoothing: weight of the past at each measurement.
const MEMORY: f64 = 0.9;

/// A frame submitted to the device and not finished.
struct FrameInFlight {
    number: FrameNumber,
    began: Instant,
    /// Time of the edit that this frame is the first to show.
    shows: Option<Instant>,
    /// Samples in its picture, if it was repainted.
    samples: Option<u64>,
}

/// Times after an edit, seconds, at which the samples on screen are noted.
const AFTER_EDIT: [f64; 5] = [0.033, 0.1, 0.3, 1.0, 3.0];

/// Number of samples on screen at each time of [`AFTER_EDIT`], over edits that no other edit followed in that time.
#[derive(Debug, Default)]
struct SamplesAfterEdit {
    /// The last edit that a picture shows, and how many of the times in [`AFTER_EDIT`] have passed since.
    edit: Option<(Instant, usize)>,
    /// Samples of the last picture.
    samples: u64,
    /// `(samples, edits)` for each time.
    sums: [(u64, u32); AFTER_EDIT.len()],
}

impl SamplesAfterEdit {
    /// Records the samples on screen at each time that has passed by `now`.
    fn pass(&mut self, now: Instant) {
        let Some((edit, next)) = &mut self.edit else { return };
        let seconds = now.saturating_duration_since(*edit).as_secs_f64();
        while *next < AFTER_EDIT.len() && AFTER_EDIT[*next] <= seconds {
            let (sum, edits) = &mut self.sums[*next];
            (*sum, *edits) = (*sum + self.samples, *edits + 1);
            *next += 1;
        }
    }

    /// Records an edit. The samples on screen until now count for the edit before.
    fn edit(&mut self, now: Instant) {
        self.pass(now);
        (self.edit, self.samples) = (Some((now, 0)), 0);
    }

    /// Records a picture with this many samples, begun at `began`, which is on screen from `now` on.
    fn shown(&mut self, now: Instant, began: Instant, samples: u64) {
        self.pass(now);
        if self.edit.is_none_or(|(edit, _)| edit <= began) {
            self.samples = samples;
        }
    }

    /// Mean number of samples at each time; `None` if every edit was followed by another before it.
    fn means(&self) -> [Option<f64>; AFTER_EDIT.len()] {
        self.sums.map(|(sum, edits)| (edits > 0).then(|| sum as f64 / f64::from(edits)))
    }
}

/// The measurements of a session.
pub struct ViewerMetrics {
    pub started: Instant,
    /// Milliseconds from the beginning of a frame to its completion on the device.
    pub frames: RecentValues,
    /// Milliseconds between completions of consecutive frames on the device, for the panel.
    pub intervals: RecentValues,
    /// Latency of edits: milliseconds from an edit to the first picture that shows it, presented in the window, or completed on the device
    /// if the window does not report presentation.
    pub edits: RecentValues,
    /// Samples on screen after an edit.
    after_edit: SamplesAfterEdit,
    /// The most recent of `edits`, for the panel.
    pub recent_edits: RecentValues,
    /// Time from the start of the program to the first picture on the device.
    pub first: Option<Duration>,
    pub presented: u64,
    pub epochs: u64,
    /// Number of sleeps of the loop longer than [`STALL`].
    pub stalls: u64,
    /// Number of film resizes.
    pub resizes: u64,
    /// Milliseconds per run of each pass, smoothed.
    pub passes: Vec<(&'static str, f64)>,
    /// `detail` of each repaint whose timings have not been read yet; `None` for denoised pictures.
    paints: VecDeque<Option<u32>>,
    in_flight: VecDeque<FrameInFlight>,
    /// Frames completed on the device and not yet presented, if the window reports presentation.
    unseen: VecDeque<FrameInFlight>,
    last_end: Option<Instant>,
    /// Oldest edit that no epoch contains yet.
    noted_edit: Option<Instant>,
    /// Oldest edit in the present epoch that no presented picture shows.
    waiting_edit: Option<Instant>,
    /// Seconds and samples of rasterisation, exponentially smoothed.
    raster: (f64, f64),
    /// Samples rasterised at the last reading of timings.
    rasterised: u64,
    /// Seconds spent drawing since the start.
    drawing: f64,
    rates: MeanRates,
}

/// Rates over about the last half second.
struct MeanRates {
    since: Instant,
    totals: [f64; 3],
    values: DisplayRates,
}

/// Throughput of tracer and display.
#[derive(Clone, Copy, Debug, Default)]
pub struct DisplayRates {
    /// Traced samples per second.
    pub traced: f64,
    /// Rasterised samples per second.
    pub rasterised: f64,
    /// Fraction of the time that the display spends drawing samples or pictures.
    pub drawing: f64,
}

impl Default for ViewerMetrics {
    fn default() -> Self {
        Self {
            started: Instant::now(),
            frames: RecentValues::new(KEPT),
            intervals: RecentValues::new(FRAMES),
            edits: RecentValues::new(KEPT),
            after_edit: SamplesAfterEdit::default(),
            recent_edits: RecentValues::new(RECENT_EDITS),
            first: None,
            presented: 0,
            epochs: 0,
            stalls: 0,
            resizes: 0,
            passes: Vec::new(),
            paints: VecDeque::new(),
            in_flight: VecDeque::new(),
            unseen: VecDeque::new(),
            last_end: None,
            noted_edit: None,
            waiting_edit: None,
            raster: (0.0, 0.0),
            rasterised: 0,
            drawing: 0.0,
            rates: MeanRates { since: Instant::now(), totals: [0.0; 3], values: DisplayRates::default() },
        }
    }
}

impl ViewerMetrics {
    /// Empty measurements of a program that started at `started`.
    pub fn since(started: Instant) -> Self {
        Self { started, ..Self::default() }
    }

    /// Records an edit. If edits are waiting for their picture, the latency counts from the first of them.
    pub fn edit(&mut self, now: Instant) {
        self.noted_edit.get_or_insert(now);
        self.after_edit.edit(now);
    }

    /// Begins an epoch that contains all edits so far.
    pub fn epoch(&mut self) {
        let noted = self.noted_edit.take();
        self.waiting_edit = self.waiting_edit.or(noted);
        self.epochs += 1;
    }

    /// Records a frame submitted to the device. A repaint is the first to show the waiting edits; later edits are not in it.
    pub fn presented(&mut self, frame: &ShownFrame) {
        self.presented += 1;
        let shows = frame.detail.and_then(|detail| {
            self.paints.push_back((!frame.filtered).then_some(detail));
            self.waiting_edit.take()
        });
        // A picture of samples from before the last edit does not count for that edit.
        let is_present = self.noted_edit.is_none() && self.waiting_edit.is_none();
        let samples = frame.detail.filter(|_| is_present).map(|_| frame.samples);
        self.in_flight.push_back(FrameInFlight { number: frame.number, began: frame.began, shows, samples });
    }

    /// Mean number of samples on screen, by seconds after an edit that was left alone for so long.
    pub fn samples_after_edit(&self) -> BTreeMap<String, f64> {
        let means = AFTER_EDIT.iter().zip(self.after_edit.means());
        means.filter_map(|(seconds, mean)| Some((seconds.to_string(), mean?))).collect()
    }

    /// Whether a frame that shows an edit is in flight.
    pub fn awaits_edit(&self) -> bool {
        self.in_flight.iter().chain(&self.unseen).any(|frame| frame.shows.is_some())
    }

    /// Measures the frames that the device has completed by now. `shown`: the last frame presented in the window, if it reports that.
    pub fn completed(&mut self, gpu: &Gpu, shown: Option<FrameNumber>, pacer: &mut Pacer) {
        self.after_edit.pass(Instant::now());
        while let Some(frame) = self.in_flight.pop_front_if(|frame| gpu.has_completed(frame.number)) {
            let now = Instant::now();
            pacer.frame(now - frame.began);
            self.finished(&frame, now);
            match shown {
                Some(_) => self.unseen.push_back(frame),
                None => self.seen(&frame, now),
            }
        }
        self.unseen.retain(|frame| frame.began.elapsed() < UNSEEN);
        while let Some(frame) = self.unseen.pop_front_if(|frame| Some(frame.number) <= shown) {
            self.seen(&frame, Instant::now());
        }
    }

    /// Records that the device has completed a frame.
    fn finished(&mut self, frame: &FrameInFlight, now: Instant) {
        let since = |then| milliseconds(now.saturating_duration_since(then));
        self.first.get_or_insert(now - self.started);
        self.frames.push(since(frame.began));
        if let Some(last) = self.last_end.replace(now) {
            self.intervals.push(since(last));
        }
    }

    /// Records that a frame was presented.
    fn seen(&mut self, frame: &FrameInFlight, now: Instant) {
        if let Some(samples) = frame.samples {
            self.after_edit.shown(now, frame.began, samples);
        }
        if let Some(edited) = frame.shows {
            let latency = milliseconds(now.saturating_duration_since(edited));
            self.edits.push(latency);
            self.recent_edits.push(latency);
        }
    }

    /// Records a sleep of the loop, which waited for `what`.
    pub fn waited(&mut self, what: &str, time: Duration) {
        if time > STALL {
            self.stalls += 1;
            tracing::info!("the window stood still for {time:.0?}, waiting {what}");
        }
    }

    /// Discards the frames in flight on a lost device: they will never complete.
    pub fn forget_device(&mut self) {
        self.in_flight.clear();
        self.unseen.clear();
        self.paints.clear();
        // The time until the next completion is not a frame interval.
        self.last_end = None;
    }

    /// Updates the pacer from the pass timings measured since the last call, and from the total number of samples `rasterised` by now, into
    /// full or `coarse` sums.
    pub fn learn(&mut self, times: &[ScopeTime], rasterised: u64, coarse: bool, pacer: &mut Pacer) {
        let sum = |names: &[&str]| -> f64 {
            times.iter().filter(|t| names.contains(&t.name)).map(|t| t.milliseconds).sum::<f64>() * 1e-3
        };
        let count = |name: &str| times.iter().filter(|t| t.name == name).map(|t| t.count).sum::<u64>();
        let samples = (rasterised - std::mem::replace(&mut self.rasterised, rasterised)) as f64;
        // The variance fold is timed inside the variance pass.
        let seconds = sum(&["splat", "variance"]) - sum(&["variance fold"]);
        self.raster = (self.raster.0 * MEMORY + seconds, self.raster.1 * MEMORY + samples);
        // Zero if the CPU rasterises; its time is taken from the film.
        if self.raster.1 >= 1.0 && self.raster.0 > 0.0 {
            pacer.samples(self.raster.1 as u64, Duration::from_secs_f64(self.raster.0), coarse);
        }
        let batches = count("fold");
        if batches > 0 {
            pacer.fold(
                Duration::from_secs_f64(sum(&["fold", "variance fold", "clear"]) / batches as f64),
                coarse,
            );
        }
        let repaints = count("tonemap");
        if repaints > 0 {
            let others = ["splat", "variance", "fold", "variance fold", "clear", "panel", "show", "readback"];
            let all: f64 = times.iter().filter(|t| !others.contains(&t.name)).map(|t| t.milliseconds).sum();
            let each = Duration::from_secs_f64(all * 1e-3 / repaints as f64);
            for _ in 0..repaints {
                match self.paints.pop_front() {
                    Some(Some(detail)) => pacer.repainted(detail, each),
                    Some(None) => pacer.repainted_filtered(each),
                    None => {}
                }
            }
        }
        // Nested passes are included in their outer ones.
        let outer = times.iter().filter(|time| time.name != "variance fold");
        self.drawing += outer.map(|time| time.milliseconds).sum::<f64>() * 1e-3;
        for time in times {
            let value = time.milliseconds / time.count.max(1) as f64;
            match self.passes.iter_mut().find(|(name, _)| *name == time.name) {
                Some((_, last)) => *last += 0.2 * (value - *last),
                None => self.passes.push((time.name, value)),
            }
        }
    }

    /// Adds drawing time outside of device passes.
    pub fn drew(&mut self, time: Duration) {
        self.drawing += time.as_secs_f64();
    }

    /// Throughput of tracer and display, given the total samples traced and rasterised by now.
    pub fn rates(&mut self, traced: u64, rasterised: u64) -> DisplayRates {
        let now = Instant::now();
        let seconds = (now - self.rates.since).as_secs_f64();
        if seconds >= 0.5 {
            let totals = [traced as f64, rasterised as f64, self.drawing];
            let per_second = |i: usize| (totals[i] - self.rates.totals[i]).max(0.0) / seconds;
            let values =
                DisplayRates { traced: per_second(0), rasterised: per_second(1), drawing: per_second(2) };
            self.rates = MeanRates { since: now, totals, values };
        }
        self.rates.values
    }
}

fn milliseconds(time: Duration) -> f32 {
    (time.as_secs_f64() * 1e3) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Presents a repaint and returns it as a frame in flight.
    fn present(metrics: &mut ViewerMetrics, began: Instant) -> FrameInFlight {
        metrics.presented(&ShownFrame {
            number: FrameNumber::default(),
            began,
            samples: 0,
            detail: Some(1),
            filtered: false,
        });
        metrics.in_flight.pop_back().expect("a frame")
    }

    /// Completes a frame on the device and presents it at once.
    fn end(metrics: &mut ViewerMetrics, frame: &FrameInFlight, now: Instant) {
        metrics.finished(frame, now);
        metrics.seen(frame, now);
    }

    #[test]
    fn latency_counts_from_the_first_edit_without_a_picture() {
        let (mut metrics, start) = (ViewerMetrics::default(), Instant::now());
        let at = |ms: u64| start + Duration::from_millis(ms);
        let frame = present(&mut metrics, start);
        end(&mut metrics, &frame, at(0));
        assert_eq!(metrics.edits.last(), None);
        metrics.edit(at(5));
        metrics.epoch();
        metrics.edit(at(20));
        end(&mut metrics, &frame, at(16));
        metrics.epoch();
        let frame = present(&mut metrics, at(30));
        // The next edit comes while that picture is in flight and is not in it.
        metrics.edit(at(44));
        end(&mut metrics, &frame, at(45));
        assert!(present(&mut metrics, at(50)).shows.is_none());
        end(&mut metrics, &FrameInFlight { shows: None, ..frame }, at(60));
        let latency = metrics.edits.last().expect("an edit was shown");
        assert!((latency - 40.0).abs() < 1e-3, "{latency:?}");
        assert_eq!(metrics.recent_edits.percentiles([95.0]), [latency]);
        assert_eq!(metrics.intervals.iter().count(), 3);
    }

    #[test]
    fn samples_on_screen_are_those_at_the_time() {
        let (mut after, start) = (SamplesAfterEdit::default(), Instant::now());
        let at = |ms: u64| start + Duration::from_millis(ms);
        after.shown(at(0), at(0), 7);
        after.edit(at(10));
        after.shown(at(20), at(9), 7);
        after.shown(at(40), at(20), 100);
        after.shown(at(90), at(70), 200);
        after.shown(at(400), at(380), 900);
        after.edit(at(1500));
        after.shown(at(1530), at(1510), 50);
        after.pass(at(1700));
        // Expected: 33 ms: 100 and 50; .1 s: 200 and 50; .3 s: 200; 1 s: 900.
        assert_eq!(after.means(), [Some(75.0), Some(125.0), Some(200.0), Some(900.0), None]);
    }

    #[test]
    fn a_lost_device_is_no_frame_time() {
        let (mut metrics, start) = (ViewerMetrics::default(), Instant::now());
        let frame = present(&mut metrics, start);
        end(&mut metrics, &frame, start);
        metrics.forget_device();
        end(&mut metrics, &frame, start + Duration::from_secs(10));
        end(&mut metrics, &frame, start + Duration::from_millis(10_016));
        assert_eq!(metrics.intervals.percentiles([50.0, 95.0, 99.0]).map(f32::round), [16.0; 3]);
    }
}
