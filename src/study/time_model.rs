//! Model of the time in which a method reaches an error, fitted to all of its pictures.
//!
//! The error is a power law of the samples per pixel, as during a render ([`prediction`](crate::study::prediction)), with the same
//! prior and the same allowances for what is no power law. Small pictures of the same view, the trials, tell the error at many more
//! samples per pixel than the picture itself has got in the same time: noise depends on samples per pixel, and hardly on the number of
//! pixels. By how much the errors of both differ at equal samples is estimated from the pictures of full size ([`SizeTransfer`]).

use crate::study::curve::{Checkpoint, PowerLaw};
use crate::study::error::ErrorEstimate;
use crate::study::interval::Interval;
use crate::study::measurement::RenderMeasurement;
use crate::study::prediction::{EXTRAPOLATION_DEVIATION, SPEED_DEVIATION};

/// Standard deviation of the logarithm of a full-size error relative to a trial's, before any is known.
const SIZE_DEVIATION: f64 = 0.12;

/// Standard deviation of that logarithm between methods, around the scene's.
const METHOD_DEVIATION: f64 = 0.05;

/// Residual standard deviation of the errors of one curve, since low-discrepancy sequences are better at some sample counts than at others.
const SEQUENCE_DEVIATION: f64 = 0.03;

/// Additional standard deviation of the logarithm of a trial's error, because its photon maps are shared by fewer pixels.
const PHOTON_TRIAL_DEVIATION: f64 = 0.3;

/// Additional standard deviation per e-fold of extrapolation if bias decreases at another rate than noise.
const BIASED_DEVIATION: f64 = 0.2;

/// Standard deviation of the logarithm of the speed, if only trials were timed.
const TRIAL_SPEED_DEVIATION: f64 = 0.12;

/// A time is rejected if its logarithm has a larger standard deviation: its interval would span a factor of more than 1000.
const USELESS: f64 = 2.1;

/// Renders shorter than this fraction of the longest are ignored for the speed, since startup takes part of their time.
const SHORT: f64 = 0.1;

/// Errors at fewer samples per pixel are ignored if enough points remain.
const FIRST_SAMPLES: f64 = 4.0;
const LEAST_POINTS: usize = 3;

/// Slope used to compare errors at unequal sample counts.
const USUAL_SLOPE: f64 = 0.55;

/// Errors whose sample counts differ by a larger factor are not compared.
const COMPARABLE: f64 = 3.0;

/// The error of one picture.
#[derive(Clone, Copy, Debug)]
struct ModelPoint {
    samples: f64,
    error: f64,
    /// Standard deviation of the logarithm of `error`.
    deviation: f64,
    is_trial: bool,
}

/// Relation of full-size errors to those of trials: logarithm of their ratio, and its standard deviation.
#[derive(Clone, Copy, Debug)]
pub struct SizeTransfer {
    /// Number of pixels at full size.
    pixels: f64,
    log_ratio: f64,
    deviation: f64,
}

/// Fitted curve of a method.
#[derive(Clone, Debug)]
pub struct TimeModel {
    points: Vec<ModelPoint>,
    /// Samples per pixel and second, at full size.
    rate: f64,
    rate_deviation: f64,
    /// Standard deviation of the logarithm of the trials' errors, common to all of them.
    transfer_deviation: f64,
    biased: bool,
}

fn pixels(run: &RenderMeasurement) -> f64 {
    f64::from(run.size[0]) * f64::from(run.size[1])
}

fn points(runs: &[&RenderMeasurement]) -> Vec<ModelPoint> {
    let point = |run: &&RenderMeasurement| {
        let error = run.relative?[1];
        let usable = error.value > 0.0 && error.value.is_finite() && run.samples_per_pixel > 0.0;
        let deviation = ErrorEstimate::log_deviation(&error).max(0.01);
        let samples = run.samples_per_pixel;
        usable.then_some(ModelPoint { samples, error: error.value, deviation, is_trial: run.is_trial })
    };
    let mut points: Vec<ModelPoint> = runs.iter().filter_map(point).collect();
    points.sort_by(|a, b| a.samples.total_cmp(&b.samples));
    points
}

impl SizeTransfer {
    /// Estimate from the pictures of all other methods, for this width and height; the [`TimeModel`] adds those of the method itself.
    pub fn for_method(method: usize, methods: &[Vec<&RenderMeasurement>], size: [u32; 2]) -> Self {
        let pixels = f64::from(size[0]) * f64::from(size[1]);
        let pixels = methods.iter().flatten().map(|run| self::pixels(run)).fold(pixels, f64::max);
        let none = Self { pixels, log_ratio: 0.0, deviation: SIZE_DEVIATION };
        let others = methods.iter().enumerate().filter(|(i, _)| *i != method).map(|(_, runs)| runs);
        others.filter(|runs| !runs[0].peer && !runs[0].biased).fold(none, |known, runs| {
            match compared(&points(runs)) {
                Some((ratio, deviation)) => known.updated(ratio, deviation.hypot(METHOD_DEVIATION)),
                None => known,
            }
        })
    }

    /// Update with the method's own pictures.
    fn of_method(&self, points: &[ModelPoint]) -> Self {
        let known = Self { deviation: self.deviation.hypot(METHOD_DEVIATION), ..*self };
        compared(points).map_or(known, |(ratio, deviation)| known.updated(ratio, deviation))
    }

    /// Precision-weighted mean of both estimates.
    fn updated(&self, log_ratio: f64, deviation: f64) -> Self {
        let [a, b] = [self.deviation, deviation].map(|d| d.max(1e-3).powi(-2));
        let log_ratio = (a * self.log_ratio + b * log_ratio) / (a + b);
        Self { log_ratio, deviation: (a + b).powf(-0.5), ..*self }
    }
}

/// Logarithm of the ratio of full-size to trial errors at about equal samples, and its standard deviation.
fn compared(points: &[ModelPoint]) -> Option<(f64, f64)> {
    let mut sums = [0.0; 2];
    for full in points.iter().filter(|point| !point.is_trial) {
        let near = |point: &&ModelPoint| (point.samples / full.samples).ln().abs();
        let trials = points.iter().filter(|point| point.is_trial);
        let Some(trial) = trials.min_by(|a, b| near(a).total_cmp(&near(b))) else { continue };
        let apart = (trial.samples / full.samples).ln();
        if apart.abs() > COMPARABLE.ln() {
            continue;
        }
        let ratio = (full.error / trial.error).ln() - USUAL_SLOPE * apart;
        let variance = full.deviation.powi(2)
            + trial.deviation.powi(2)
            + 2.0 * SEQUENCE_DEVIATION.powi(2)
            + (EXTRAPOLATION_DEVIATION * apart).powi(2);
        sums = [sums[0] + ratio / variance, sums[1] + 1.0 / variance];
    }
    (sums[1] > 0.0).then(|| (sums[0] / sums[1], sums[1].powf(-0.5)))
}

impl TimeModel {
    /// Fits the model to the runs of one method; `None` if no error is known.
    pub fn of(runs: &[&RenderMeasurement], transfer: &SizeTransfer) -> Option<Self> {
        let mut points = points(runs);
        let transfer = transfer.of_method(&points);
        let biased = runs.iter().any(|run| run.biased);
        let has_full = points.iter().any(|point| !point.is_trial);
        // Photon maps of trials have fewer photons, so trials are ignored if there are full-size pictures.
        points.retain(|point| !(point.is_trial && biased && has_full));
        for point in points.iter_mut().filter(|point| point.is_trial) {
            point.error *= transfer.log_ratio.exp();
        }
        // Samples per pixel and second at full size, over all runs that are not much shorter than the longest.
        let speed = |is_trial: bool| {
            let of_kind = || runs.iter().filter(|run| run.is_trial == is_trial && run.seconds > 0.0);
            let longest = of_kind().map(|run| run.seconds).fold(0.0, f64::max);
            let long = of_kind().filter(|run| run.seconds >= SHORT * longest);
            let sum = |[samples, seconds]: [f64; 2], run: &&RenderMeasurement| {
                [samples + run.samples_per_pixel * pixels(run) / transfer.pixels, seconds + run.seconds]
            };
            let [samples, seconds] = long.fold([0.0; 2], sum);
            (seconds > 0.0).then(|| samples / seconds)
        };
        let (rate, rate_deviation) = match (speed(false), speed(true)) {
            (Some(rate), _) => (rate, SPEED_DEVIATION),
            (None, Some(rate)) => (rate, TRIAL_SPEED_DEVIATION),
            (None, None) => return None,
        };
        let any_trial = points.iter().any(|point| point.is_trial);
        let photons = if biased { PHOTON_TRIAL_DEVIATION } else { 0.0 };
        let transfer_deviation = if any_trial { transfer.deviation.hypot(photons) } else { 0.0 };
        (rate > 0.0 && rate.is_finite() && !points.is_empty()).then_some(Self {
            points,
            rate,
            rate_deviation,
            transfer_deviation,
            biased,
        })
    }

    /// Seconds until the error is reached, and whether full-size pictures bracket it. `None` if the error does not decrease, or if the
    /// interval would be useless.
    pub fn time_to(&self, error: f64) -> Option<(Interval, bool)> {
        let reached = self.points.iter().position(|point| point.error <= error);
        let used = &self.points[..reached.map_or(self.points.len(), |at| at + 1)];
        let bracketed =
            reached.is_some_and(|at| at > 0 && used[at - 1..].iter().all(|point| !point.is_trial));
        let checkpoint = |point: &ModelPoint| Checkpoint {
            seconds: point.samples / self.rate,
            samples: point.samples,
            error: point.error,
            deviation: point.deviation,
        };
        // Early errors do not follow the power law, so they are ignored if enough others remain.
        let early = used.partition_point(|point| point.samples < FIRST_SAMPLES);
        let early = early.min(used.len().saturating_sub(LEAST_POINTS));
        let checkpoints: Vec<Checkpoint> = used[early..].iter().map(checkpoint).collect();
        let (last, fit) = (used.last()?, PowerLaw::new(&checkpoints, self.biased)?);
        let (x, deviation) = fit.until(error)?;
        // If there are close points on both sides, nothing is extrapolated.
        let far = if bracketed { 0.0 } else { x.abs() };
        let per_fold = if self.biased {
            EXTRAPOLATION_DEVIATION.hypot(BIASED_DEVIATION)
        } else {
            EXTRAPOLATION_DEVIATION
        };
        let shared = if used.iter().any(|point| point.is_trial) { self.transfer_deviation } else { 0.0 };
        let errors =
            (shared.powi(2) + last.deviation.powi(2) + SEQUENCE_DEVIATION.powi(2)).sqrt() / fit.slope;
        let spread = [deviation, errors, per_fold * far, self.rate_deviation]
            .iter()
            .fold(0.0, |sum: f64, d| sum.hypot(*d));
        let seconds = Interval::of_log(last.samples * x.exp() / self.rate, spread);
        (spread < USELESS && seconds.high.is_finite() && seconds.low > 0.0).then_some((seconds, bracketed))
    }
}

/// Whether the 90 % interval of `slower` lies above that of `faster`, and their values differ by a factor of two.
pub fn is_hopeless(slower: &Interval, faster: &Interval) -> bool {
    slower.low > faster.high && slower.value > 2.0 * faster.value
}

/// Lower bound of the ratio of times, from its interval.
pub fn at_least(slower: &Interval, faster: &Interval) -> f64 {
    slower.ratio(faster).map_or(1.0, |ratio| ratio.low.max(1.0))
}
