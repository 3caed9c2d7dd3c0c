//! Splits the time of a frame: number of samples to take, internal resolution, and whether the picture is repainted.
//!
//! Plain arithmetic on measured costs; the caller owns every clock. A frame with a repaint has a budget, split in this order: the
//! panel, the repaint, samples. Frames between repaints take all samples that wait, so that the tracer never stands before full lanes:
//! a picture that is shown less often gains more than one that is shown sixty times per second from fewer samples. None is dropped.

use std::time::Duration;

use crate::client::settings::CHUNK_SAMPLES;
use crate::stream::block::BLOCK_SAMPLES;

/// A picture counts as changing for this long after an edit.
pub const CHANGING: Duration = Duration::from_millis(300);

/// If the blur spans at least this many mip levels, a coarser grid loses no detail.
const COARSE_LOD: f32 = 1.0;

/// A picture is repainted when its samples have grown by this factor: the error falls by 1.5 %, which is invisible.
const GROWTH: f64 = 1.03;

/// Shortest interval between repaints as a multiple of a repaint's cost, except for pictures that follow an edit.
const REST: f64 = 5.0;

/// The interval shrinks, down to the cost of one repaint, if the samples have grown by more than this factor.
const LEAP: f64 = 2.0;

/// Share of the budget that a repaint may take while the picture changes, before it gets coarser.
const REPAINT_SHARE: f64 = 0.5;

/// Least fraction of the budget for samples, even if the other work exceeds the budget, so that the picture always progresses.
const LEAST_SAMPLES_SHARE: f64 = 0.25;

/// Upper bound on the samples of a frame, whatever they seem to cost, so that input is polled in time.
const MOST_SAMPLES: usize = 64 * CHUNK_SAMPLES;

/// Upper bound on the samples taken beyond the budget, so that the next edit does not wait long.
const MOST_WAITING: usize = CHUNK_SAMPLES / 2;

/// Fraction of the budget that drawing a batch may take; a batch that would take longer is drawn before it is full.
const BATCH_SHARE: f64 = 0.5;

/// Exponential moving average: weight of a new measurement.
const BLEND: f64 = 0.2;

/// A running mean in seconds; `None` before the first measurement.
#[derive(Clone, Copy, Debug, Default)]
struct Mean(Option<f64>);

impl Mean {
    fn add(&mut self, seconds: f64) {
        if seconds.is_finite() && seconds >= 0.0 {
            self.0 = Some(self.0.map_or(seconds, |mean| mean + BLEND * (seconds - mean)));
        }
    }

    fn get(self) -> f64 {
        self.0.unwrap_or(0.0)
    }
}

/// The state of the viewer when it plans a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct PacingInput {
    /// Time since the last edit or gesture.
    pub since_edit: Duration,
    /// Time since the last repaint.
    pub since_repaint: Duration,
    /// Level of detail of the finest stream; `None` without samples.
    pub lod: Option<f32>,
    /// Samples on the film over samples at the last repaint.
    pub growth: f64,
    /// `detail` of the last repaint.
    pub shown_detail: u32,
    /// The last edit has not been shown, or a control has changed.
    pub due: bool,
    /// Samples waiting in the lanes.
    pub waiting: usize,
    /// Samples in the batch, added to the film and not rasterised.
    pub batched: usize,
    /// Samples of a full batch; 0 if unknown.
    pub capacity: usize,
    /// Number of streams, each of which is folded separately.
    pub streams: u32,
    /// Whether the film holds coarse sums.
    pub coarse: bool,
    /// Whether a repaint shows the denoised picture.
    pub filter: bool,
}

/// The plan of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FramePlan {
    /// Most samples to take; a multiple of a block.
    pub samples: usize,
    /// Picture pixels per reconstructed one and axis: 1, 2 or 4.
    pub detail: u32,
    /// Repaint the picture.
    pub repaint: bool,
    /// Rasterise the batch even if it is not full; without a repaint this relieves the next frame.
    pub flush: bool,
}

/// Learns the costs of samples and repaints, and splits the budget of each frame.
#[derive(Clone, Debug)]
pub struct Pacer {
    budget: f64,
    /// Rasterisation per sample, into full and coarse sums.
    per_sample: [Mean; 2],
    /// Loop time per sample until it is in a batch.
    per_fed_sample: Mean,
    /// Fold of one stream, of full and coarse sums.
    per_fold: [Mean; 2],
    /// Repaint at `detail` 1, 2, 4.
    repaint: [Mean; 3],
    /// The noise filter, and the rest of a repaint of its picture.
    filter: Mean,
    filtered_repaint: Mean,
    panel: Mean,
    /// Fraction of the affordable samples that is taken; it falls when frames are late for unmeasured reasons.
    trust: f64,
    /// Number of frames by which the loop is ahead of the device.
    lead: f64,
}

impl Pacer {
    /// A pacer for frames of this length.
    pub fn new(budget: Duration) -> Self {
        Self {
            budget: budget.as_secs_f64().max(1e-3),
            per_sample: Default::default(),
            per_fed_sample: Mean::default(),
            per_fold: Default::default(),
            repaint: [Mean::default(); 3],
            filter: Mean::default(),
            filtered_repaint: Mean::default(),
            panel: Mean::default(),
            trust: 1.0,
            lead: 0.0,
        }
    }

    /// Frames have another length from now on.
    pub fn set_budget(&mut self, budget: Duration) {
        self.budget = budget.as_secs_f64().max(1e-3);
    }

    /// The length of a frame.
    pub fn budget(&self) -> Duration {
        Duration::from_secs_f64(self.budget)
    }

    /// Records the time to rasterise `samples` into full or `coarse` sums, without the part counted by [`fold`](Self::fold).
    pub fn samples(&mut self, samples: u64, time: Duration, coarse: bool) {
        if samples > 0 {
            self.per_sample[usize::from(coarse)].add(time.as_secs_f64() / samples as f64);
        }
    }

    /// Records the time to move `samples` from the lanes into the batch: the loop copies them, and waits until the last ones are sorted.
    pub fn fed(&mut self, samples: u64, time: Duration) {
        if samples > 0 {
            self.per_fed_sample.add(time.as_secs_f64() / samples as f64);
        }
    }

    /// Records the fold: the work per batch and stream that does not depend on the number of samples.
    pub fn fold(&mut self, time: Duration, coarse: bool) {
        self.per_fold[usize::from(coarse)].add(time.as_secs_f64());
    }

    /// Records the time of a repaint at this `detail`.
    pub fn repainted(&mut self, detail: u32, time: Duration) {
        self.repaint[level(detail)].add(time.as_secs_f64());
    }

    /// Records the time of the noise filter.
    pub fn filtered(&mut self, time: Duration) {
        self.filter.add(time.as_secs_f64());
    }

    /// Records the time of a repaint of a denoised picture, without the filter.
    pub fn repainted_filtered(&mut self, time: Duration) {
        self.filtered_repaint.add(time.as_secs_f64());
    }

    /// Records the time of the panel.
    pub fn panel(&mut self, time: Duration) {
        self.panel.add(time.as_secs_f64());
    }

    /// Sets whether frames begin while the device works on the previous one, which allows each twice the time.
    pub fn set_lead(&mut self, leads: bool) {
        self.lead = if leads { 1.0 } else { 0.0 };
    }

    /// Records the time of a frame from its beginning to its completion on the device.
    pub fn frame(&mut self, time: Duration) {
        let late = time.as_secs_f64() > (1.25 + self.lead) * self.budget;
        self.trust = (if late { self.trust * 0.9 } else { self.trust + 0.02 }).clamp(1.0 / 16.0, 1.0);
    }

    /// Plans the next frame.
    pub fn plan(&self, now: &PacingInput) -> FramePlan {
        let changing = now.since_edit < CHANGING || now.lod.is_none_or(|lod| lod >= COARSE_LOD);
        let detail = if changing && !now.filter { self.coarseness() } else { 1 };
        let cost = match now.filter {
            true => self.filter.get() + self.filtered_repaint.get(),
            false => self.repaint_cost(detail),
        };
        // A repaint flushes the partial batch; the cost of folding it early is part of the repaint's cost.
        let per_sample = self.per_sample[usize::from(now.coarse)].get();
        let fold = self.per_fold[usize::from(now.coarse)].get() * f64::from(now.streams.max(1));
        let price = cost + fold;
        let rest = (REST * LEAP / now.growth).clamp(1.0, REST) * price;
        let rested = now.since_repaint.as_secs_f64() >= rest.max(0.9 * self.budget);
        let finer = detail < now.shown_detail;
        let repaint = now.due || (rested && (finer || now.growth >= GROWTH));
        let drawing = now.batched as f64 * per_sample;
        // In a still scene the next picture is not urgent, but an edit may arrive while the device is busy.
        if repaint
            && !changing
            && !now.due
            && !now.filter
            && now.batched > 0
            && drawing + fold + cost > self.budget
        {
            return FramePlan { samples: 0, detail, repaint: false, flush: true };
        }
        let taken = self.panel.get() + fold + if repaint { cost } else { 0.0 };
        let least = LEAST_SAMPLES_SHARE * self.budget;
        // The first picture after an edit is worth more than the samples that would refine it slightly.
        let left = if now.due && changing { least } else { (self.budget - taken).max(least) };
        // Between repaints all waiting samples are taken, since full lanes would block the tracer.
        let waiting = if repaint { 0 } else { now.waiting.min(MOST_WAITING) / BLOCK_SAMPLES * BLOCK_SAMPLES };
        let samples = self.affordable(left * self.trust, per_sample, fold, now.capacity).max(waiting);
        // A large batch must not delay a frame, but folding a small one early is wasteful.
        let flush = !repaint && drawing > fold.max(BATCH_SHARE * self.budget);
        FramePlan { samples, detail, repaint, flush }
    }

    /// Whole blocks, at least one, that can be taken and rasterised in this time, including one fold per `capacity` samples.
    fn affordable(&self, seconds: f64, per_sample: f64, fold: f64, capacity: usize) -> usize {
        let folds = if capacity > 0 { fold / capacity as f64 } else { 0.0 };
        let samples = match per_sample + self.per_fed_sample.get() + folds {
            cost if cost > 0.0 => (seconds / cost).min(MOST_SAMPLES as f64) as usize,
            _ => CHUNK_SAMPLES,
        };
        (samples / BLOCK_SAMPLES).max(1) * BLOCK_SAMPLES
    }

    /// The finest internal resolution whose repaint leaves room in the budget.
    fn coarseness(&self) -> u32 {
        let fits =
            |detail: &u32| self.repaint_cost(*detail) + self.panel.get() <= REPAINT_SHARE * self.budget;
        [1, 2].into_iter().find(fits).unwrap_or(4)
    }

    /// Measured cost of a repaint; if unmeasured, extrapolated from the nearest `detail`, half of the cost being proportional to the area.
    fn repaint_cost(&self, detail: u32) -> f64 {
        let wanted = level(detail);
        let known = (0..3).filter(|&i| self.repaint[i].0.is_some()).min_by_key(|&i| i.abs_diff(wanted));
        known.map_or(0.0, |i| {
            let steps = i as f64 - wanted as f64;
            self.repaint[i].get() * if steps == 0.0 { 1.0 } else { 0.5 + 0.5 * 4_f64.powf(steps) }
        })
    }
}

/// Index of a `detail` in tables.
fn level(detail: u32) -> usize {
    (detail.max(1).ilog2() as usize).min(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(x: f64) -> Duration {
        Duration::from_secs_f64(x * 1e-3)
    }

    fn pacer(per_sample_ns: f64, repaint_ms: f64) -> Pacer {
        let mut pacer = Pacer::new(ms(16.0));
        pacer.samples(1000, ms(per_sample_ns * 1e-3), false);
        pacer.repainted(1, ms(repaint_ms));
        pacer
    }

    fn still() -> PacingInput {
        let long = Duration::from_secs(10);
        PacingInput {
            since_edit: long,
            since_repaint: long,
            lod: Some(-1.0),
            growth: 2.0,
            shown_detail: 1,
            due: false,
            waiting: 0,
            batched: 0,
            capacity: 0,
            streams: 1,
            coarse: false,
            filter: false,
        }
    }

    /// Every planned batch costs a fold, and the CPU time per sample counts too.
    #[test]
    fn folds_and_feeding_cost() {
        let mut pacer = pacer(100.0, 1.0);
        let alone = pacer.plan(&still()).samples;
        pacer.fold(ms(0.5), false);
        pacer.fold(ms(50.0), true);
        let now = PacingInput { capacity: 10 * BLOCK_SAMPLES, ..still() };
        let folded = pacer.plan(&now).samples;
        // 100 ns a sample and 0.5 ms for each 10,240 of them; 15 ms are left, less one fold.
        let wanted = 14.5e6 / (100.0 + 0.5e6 / 10_240.0);
        assert!((folded as f64 / wanted - 1.0).abs() < 0.02, "{folded} of {wanted}, without folds {alone}");
        let twice = pacer.plan(&PacingInput { streams: 2, ..now }).samples;
        assert!((twice as f64 / (14e6 / (100.0 + 1e6 / 10_240.0)) - 1.0).abs() < 0.02, "{twice}");
        pacer.fed(1000, ms(0.1));
        assert!((pacer.plan(&now).samples as f64 / (14.5e6 / (200.0 + 0.5e6 / 10_240.0)) - 1.0).abs() < 0.02);
    }

    /// A large batch is drawn before it delays a frame, unless its fold would cost more than it.
    #[test]
    fn large_batches_are_drawn_early() {
        let mut pacer = pacer(1000.0, 10.0);
        let quiet = PacingInput { growth: 1.0, ..still() };
        assert!(!pacer.plan(&PacingInput { batched: 7 * BLOCK_SAMPLES, ..quiet }).flush);
        assert!(pacer.plan(&PacingInput { batched: 9 * BLOCK_SAMPLES, ..quiet }).flush);
        pacer.fold(ms(12.0), false);
        assert!(!pacer.plan(&PacingInput { batched: 9 * BLOCK_SAMPLES, ..quiet }).flush);
        assert!(pacer.plan(&PacingInput { batched: 13 * BLOCK_SAMPLES, ..quiet }).flush);
    }

    #[test]
    fn budget_is_split() {
        // 16 ms − 4 ms repaint − 2 ms panel = 10 ms: 100 000 samples of 100 ns, down to whole blocks.
        let mut pacer = pacer(100.0, 4.0);
        pacer.panel(ms(2.0));
        let plan = pacer.plan(&still());
        assert_eq!(plan, FramePlan { samples: 97 * BLOCK_SAMPLES, detail: 1, repaint: true, flush: false });
        let calm = PacingInput { growth: 1.01, ..still() };
        let plan = pacer.plan(&calm);
        assert_eq!(plan, FramePlan { samples: 136 * BLOCK_SAMPLES, detail: 1, repaint: false, flush: false });
    }

    #[test]
    fn dear_repaints_become_coarse_then_rare() {
        let pacer = pacer(100.0, 40.0);
        let moving = PacingInput { since_edit: ms(5.0), due: true, ..still() };
        assert_eq!(pacer.plan(&moving).detail, 4);
        assert!(pacer.plan(&moving).repaint);
        // Still: full resolution at most every 200 ms.
        let soon = PacingInput { since_repaint: ms(199.0), ..still() };
        assert!(!pacer.plan(&soon).repaint);
        let later = PacingInput { since_repaint: ms(201.0), ..still() };
        assert_eq!((pacer.plan(&later).repaint, pacer.plan(&later).detail), (true, 1));
        // A picture shown at coarse resolution is repainted at full resolution, even without new samples.
        let settled = PacingInput { growth: 1.0, shown_detail: 4, ..still() };
        assert!(pacer.plan(&settled).repaint);
        assert!(!pacer.plan(&PacingInput { growth: 1.0, ..still() }).repaint);
    }

    /// The first pictures after an edit have few samples: a picture of many more must not wait for its regular turn.
    #[test]
    fn leaps_are_shown_soon() {
        let pacer = pacer(100.0, 40.0);
        let leap = PacingInput { growth: 40.0, since_repaint: ms(41.0), ..still() };
        assert!(pacer.plan(&leap).repaint);
        assert!(!pacer.plan(&PacingInput { since_repaint: ms(39.0), ..leap }).repaint);
        assert!(!pacer.plan(&PacingInput { growth: 2.0, ..leap }).repaint);
        // Between repaints the lanes are emptied, even shortly after a camera move.
        let between =
            PacingInput { since_edit: ms(50.0), since_repaint: ms(1.0), waiting: usize::MAX, ..leap };
        assert_eq!(pacer.plan(&between).samples, MOST_WAITING.max(156 * BLOCK_SAMPLES));
    }

    #[test]
    fn few_samples_are_coarse() {
        let pacer = pacer(100.0, 12.0);
        let few = PacingInput { lod: Some(3.0), ..still() };
        assert!(pacer.plan(&few).detail > 1);
        assert!(pacer.plan(&PacingInput { lod: None, ..still() }).detail > 1);
        assert_eq!(pacer.plan(&still()).detail, 1);
        let mut cheap = pacer.clone();
        (0..50).for_each(|_| cheap.repainted(1, ms(1.0)));
        assert_eq!(cheap.plan(&few).detail, 1);
    }

    #[test]
    fn nothing_starves() {
        // A single sample takes longer than a frame, and so does a repaint.
        let mut pacer = pacer(1e9, 1e3);
        (0..100).for_each(|_| pacer.frame(ms(100.0)));
        assert_eq!(pacer.plan(&still()).samples, BLOCK_SAMPLES);
        assert!(pacer.plan(&still()).repaint);
        // Before anything was measured, a batch.
        assert_eq!(Pacer::new(ms(16.0)).plan(&still()).samples, CHUNK_SAMPLES);
    }

    #[test]
    fn lanes_are_emptied_between_repaints() {
        let pacer = pacer(1e5, 1.0);
        let full = PacingInput { waiting: 20 * BLOCK_SAMPLES + 7, growth: 1.0, ..still() };
        assert_eq!(pacer.plan(&full).samples, 20 * BLOCK_SAMPLES);
        assert_eq!(pacer.plan(&PacingInput { waiting: usize::MAX, ..full }).samples, MOST_WAITING);
        assert_eq!(pacer.plan(&PacingInput { since_edit: ms(5.0), ..full }).samples, 20 * BLOCK_SAMPLES);
        assert_eq!(
            pacer.plan(&PacingInput { since_edit: ms(5.0), due: true, ..full }).samples,
            BLOCK_SAMPLES
        );
    }

    /// If batch and repaint do not fit into one frame, they take turns: first the batch, then, with an empty batch, the repaint.
    #[test]
    fn dear_batches_come_before_their_picture() {
        let pacer = pacer(1000.0, 10.0);
        let full = PacingInput { batched: 30 * BLOCK_SAMPLES, ..still() };
        let plan = pacer.plan(&full);
        assert_eq!((plan.samples, plan.repaint, plan.flush), (0, false, true));
        let plan = pacer.plan(&PacingInput { batched: 0, ..full });
        assert_eq!((plan.repaint, plan.flush), (true, false));
        assert!(pacer.plan(&PacingInput { due: true, ..full }).repaint, "who has asked for it must not wait");
        assert!(pacer.plan(&PacingInput { batched: BLOCK_SAMPLES, ..full }).repaint, "a small one fits");
    }

    #[test]
    fn late_frames_take_less_and_recover() {
        let mut pacer = pacer(100.0, 1.0);
        let before = pacer.plan(&still()).samples;
        (0..10).for_each(|_| pacer.frame(ms(30.0)));
        let late = pacer.plan(&still()).samples;
        assert!(late < before / 2, "{late} of {before}");
        (0..100).for_each(|_| pacer.frame(ms(10.0)));
        assert_eq!(pacer.plan(&still()).samples, before);
        // A loop that is ahead of its device also waits for the previous frame.
        pacer.set_lead(true);
        (0..10).for_each(|_| pacer.frame(ms(30.0)));
        assert_eq!(pacer.plan(&still()).samples, before);
    }

    #[test]
    fn nonsense_is_ignored() {
        let mut pacer = pacer(100.0, 1.0);
        let before = pacer.plan(&still());
        pacer.samples(0, ms(5.0), false);
        pacer.per_sample[0].add(f64::NAN);
        pacer.per_sample[0].add(-1.0);
        assert_eq!(pacer.plan(&still()), before);
    }
}
