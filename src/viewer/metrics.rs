//! What the viewer measures of itself: for the panel, for pacing, and for `--json`.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use crate::client::pacing::Pacer;
use crate::client::window::statistics::{FRAMES, RecentValues};
use crate::gpu::{FrameNumber, Gpu, ScopeTime};
use crate::viewer::picture::ShownFrame;

/// A wait of the loop that is longer than this counts as a stall.
const STALL: Duration = Duration::from_millis(250);

/// Values kept for the figures of the whole session: four and a half minutes at 60 Hz.
const KEPT: usize = 16_384;

/// Number of edits whose latencies the panel shows.
const RECENT_EDITS: usize = 100;

/// A frame that the window has not shown for this long is not waited for.
const UNSEEN: Duration = Duration::from_millis(500);

/// Factor on the weight of the past with each measurement.
const MEMORY: f64 = 0.9;

/// A frame that the device has not finished yet.
struct FrameInFlight {
    number: FrameNumber,
    began: Instant,
    /// When the edit was made that this frame is the first to show.
    shows: Option<Instant>,
    /// Samples in its picture, if it was repainted.
    samples: Option<u64>,
}

/// Times after an edit, seconds, at which the samples on screen are noted.
const AFTER_EDIT: [f64; 5] = [0.033, 0.1, 0.3, 1.0, 3.0];

/// How many samples were on screen at each time of [`AFTER_EDIT`], for edits that were left alone for so long.
#[derive(Debug, Default)]
struct SamplesAfterEdit {
    /// The last edit that a picture shows, and how many of the times have passed since.
    edit: Option<(Instant, usize)>,
    /// Samples of the last picture.
    samples: u64,
    /// Samples and edits, for each time.
    sums: [(u64, u32); AFTER_EDIT.len()],
}

impl SamplesAfterEdit {
    /// Notes the samples that were on screen at the times that have passed by now.
    fn pass(&mut self, now: Instant) {
        let Some((edit, next)) = &mut self.edit else { return };
        let seconds = now.saturating_duration_since(*edit).as_secs_f64();
        while *next < AFTER_EDIT.len() && AFTER_EDIT[*next] <= seconds {
            let (sum, edits) = &mut self.sums[*next];
            (*sum, *edits) = (*sum + self.samples, *edits + 1);
            *next += 1;
        }
    }

    /// Something is edited now: what was on screen until now was that of the edit before.
    fn edit(&mut self, now: Instant) {
        self.pass(now);
        (self.edit, self.samples) = (Some((now, 0)), 0);
    }

    /// A picture with this many samples, begun at that time, is on screen from now on.
    fn shown(&mut self, now: Instant, began: Instant, samples: u64) {
        self.pass(now);
        if self.edit.is_none_or(|(edit, _)| edit <= began) {
            self.samples = samples;
        }
    }

    /// The mean number of samples at each time; `None` where no edit was left alone for so long.
    fn means(&self) -> [Option<f64>; AFTER_EDIT.len()] {
        self.sums.map(|(sum, edits)| (edits > 0).then(|| sum as f64 / f64::from(edits)))
    }
}

/// The measurements of a session.
pub struct ViewerMetrics {
    pub started: Instant,
    /// Milliseconds from the beginning of a frame to its end on the device.
    pub frames: RecentValues,
    /// Milliseconds from one frame's end on the device to the next, for the panel.
    pub intervals: RecentValues,
    /// Milliseconds from an edit to the first picture that shows it: seen in the window, or finished on the device where the window does
    /// not say when.
    pub edits: RecentValues,
    /// Samples on screen after an edit.
    after_edit: SamplesAfterEdit,
    /// The last of `edits`, for the panel.
    pub recent_edits: RecentValues,
    /// Time from the start of the program to the first picture on the device.
    pub first: Option<Duration>,
    pub presented: u64,
    pub epochs: u64,
    /// Number of waits of the loop for more than [`STALL`].
    pub stalls: u64,
    /// Number of films of another size.
    pub resizes: u64,
    /// Milliseconds of each pass, per run, smoothed.
    pub passes: Vec<(&'static str, f64)>,
    /// `detail` of the repaints whose times have not been read yet; `None` for those of filtered pictures.
    paints: VecDeque<Option<u32>>,
    in_flight: VecDeque<FrameInFlight>,
    /// Frames that the device has finished and the window has not shown yet, where it says so.
    unseen: VecDeque<FrameInFlight>,
    last_end: Option<Instant>,
    /// The oldest edit that no epoch contains yet.
    noted_edit: Option<Instant>,
    /// The oldest edit that the present epoch contains and no presented picture shows.
    waiting_edit: Option<Instant>,
    /// Seconds and samples of rasterising, fading.
    raster: (f64, f64),
    /// Samples rasterised when times were read last.
    rasterised: u64,
    /// Seconds that the display has drawn since the start.
    drawing: f64,
    rates: MeanRates,
}

/// Rates over the last half second or so.
struct MeanRates {
    since: Instant,
    totals: [f64; 3],
    values: DisplayRates,
}

/// What tracer and display do in a second.
#[derive(Clone, Copy, Debug, Default)]
pub struct DisplayRates {
    /// Samples per second that the tracer makes.
    pub traced: f64,
    /// Samples per second that the display draws.
    pub rasterised: f64,
    /// Share of the time in which the display draws, samples or pictures.
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
    /// No measurements of a program that was started then.
    pub fn since(started: Instant) -> Self {
        Self { started, ..Self::default() }
    }

    /// Something was edited now. While edits wait for their picture, the latency counts from the first.
    pub fn edit(&mut self, now: Instant) {
        self.noted_edit.get_or_insert(now);
        self.after_edit.edit(now);
    }

    /// An epoch begins that contains all edits so far.
    pub fn epoch(&mut self) {
        let noted = self.noted_edit.take();
        self.waiting_edit = self.waiting_edit.or(noted);
        self.epochs += 1;
    }

    /// A frame was handed to the device. A repaint is the first to show the edits that wait; later ones are not in it.
    pub fn presented(&mut self, frame: &ShownFrame) {
        self.presented += 1;
        let shows = frame.detail.and_then(|detail| {
            self.paints.push_back((!frame.filtered).then_some(detail));
            self.waiting_edit.take()
        });
        // A picture of the samples from before the last edit shows none from after it.
        let is_present = self.noted_edit.is_none() && self.waiting_edit.is_none();
        let samples = frame.detail.filter(|_| is_present).map(|_| frame.samples);
        self.in_flight.push_back(FrameInFlight { number: frame.number, began: frame.began, shows, samples });
    }

    /// Mean number of samples on screen, by seconds after an edit that was left alone for so long.
    pub fn samples_after_edit(&self) -> BTreeMap<String, f64> {
        let means = AFTER_EDIT.iter().zip(self.after_edit.means());
        means.filter_map(|(seconds, mean)| Some((seconds.to_string(), mean?))).collect()
    }

    /// True while a frame that shows an edit is on its way.
    pub fn awaits_edit(&self) -> bool {
        self.in_flight.iter().chain(&self.unseen).any(|frame| frame.shows.is_some())
    }

    /// Measures the frames that the device has finished by now. `shown` is the last one that the window has shown, where it says so.
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

    /// The device has finished a frame now.
    fn finished(&mut self, frame: &FrameInFlight, now: Instant) {
        let since = |then| milliseconds(now.saturating_duration_since(then));
        self.first.get_or_insert(now - self.started);
        self.frames.push(since(frame.began));
        if let Some(last) = self.last_end.replace(now) {
            self.intervals.push(since(last));
        }
    }

    /// A frame is seen now.
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

    /// The loop has waited for `what` this long.
    pub fn waited(&mut self, what: &str, time: Duration) {
        if time > STALL {
            self.stalls += 1;
            tracing::info!("the window stood still for {time:.0?}, waiting {what}");
        }
    }

    /// Drops the frames in flight on a device that is gone: they will never be finished.
    pub fn forget_device(&mut self) {
        self.in_flight.clear();
        self.unseen.clear();
        self.paints.clear();
        // The gap is no frame time.
        self.last_end = None;
    }

    /// Learns from the times of passes that have been measured since the last call, and from the number of samples that were
    /// `rasterised` by now, into full or `coarse` sums.
    pub fn learn(&mut self, times: &[ScopeTime], rasterised: u64, coarse: bool, pacer: &mut Pacer) {
        let sum = |names: &[&str]| -> f64 {
            times.iter().filter(|t| names.contains(&t.name)).map(|t| t.milliseconds).sum::<f64>() * 1e-3
        };
        let count = |name: &str| times.iter().filter(|t| t.name == name).map(|t| t.count).sum::<u64>();
        let samples = (rasterised - std::mem::replace(&mut self.rasterised, rasterised)) as f64;
        // The fold of the variance is nested in its pass.
        let seconds = sum(&["splat", "variance"]) - sum(&["variance fold"]);
        self.raster = (self.raster.0 * MEMORY + seconds, self.raster.1 * MEMORY + samples);
        // Zero where the processor draws, whose time is taken elsewhere.
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
        // Passes that are nested in others are part of them.
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

    /// The display has drawn for this long without a pass of the device.
    pub fn drew(&mut self, time: Duration) {
        self.drawing += time.as_secs_f64();
    }

    /// What tracer and display do in a second, given the samples traced and rasterised by now.
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

    /// Presents a repaint and returns it as the device gets it.
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

    /// The device has finished a frame, and the window shows it at once.
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
        // The next edit comes while that picture is on its way: it is not in it.
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
        // 33 ms: 100 and 50; .1 s: 200 and 50; .3 s: 200; 1 s: 900.
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
