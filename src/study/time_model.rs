//! The time in which a method reaches an error, from all of its pictures.
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

/// Standard deviation of the logarithm of a full-size error over that of a trial, before any is known.
const SIZE_DEVIATION: f64 = 0.12;

/// The same from method to method, around that of the scene.
const METHOD_DEVIATION: f64 = 0.05;

/// Standard deviation that remains between errors of one curve: the sequence has better and worse moments.
const SEQUENCE_DEVIATION: f64 = 0.03;

/// A trial shares its photon maps over fewer pixels: standard deviation of the logarithm of its error on top.
const PHOTON_TRIAL_DEVIATION: f64 = 0.3;

/// Extra standard deviation per e-fold of extrapolation where bias falls differently from noise.
const BIASED_DEVIATION: f64 = 0.2;

/// Standard deviation of the logarithm of the speed, where only trials were timed.
const TRIAL_SPEED_DEVIATION: f64 = 0.12;

/// A time whose logarithm has a larger standard deviation than this is none: its interval spans a factor of more than 1000.
const USELESS: f64 = 2.1;

/// Renders shorter than this share of the longest do not count for the speed: starting takes a part of their time.
const SHORT: f64 = 0.1;

/// Errors of fewer samples per pixel do not count where so many points remain.
const FIRST_SAMPLES: f64 = 4.0;
const LEAST_POINTS: usize = 3;

/// Slope with which errors at unequal samples are compared.
const USUAL_SLOPE: f64 = 0.55;

/// Errors at samples that differ by a larger factor are not compared.
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

/// How errors of full size follow from those of trials: the logarithm of their ratio, and its standard deviation.
#[derive(Clone, Copy, Debug)]
pub struct SizeTransfer {
    /// Pixels of full size.
    pixels: f64,
    log_ratio: f64,
    deviation: f64,
}

/// The curve of a method.
#[derive(Clone, Debug)]
pub struct TimeModel {
    points: Vec<ModelPoint>,
    /// Samples per pixel and second, of the picture.
    rate: f64,
    rate_deviation: f64,
    /// Standard deviation of the logarithm of the trials' errors, which all have in common.
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
    /// What the pictures of all other methods tell of one of this width and height; those of the method itself are added by the
    /// [`TimeModel`].
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

    /// The same for one method, with its own pictures.
    fn of_method(&self, points: &[ModelPoint]) -> Self {
        let known = Self { deviation: self.deviation.hypot(METHOD_DEVIATION), ..*self };
        compared(points).map_or(known, |(ratio, deviation)| known.updated(ratio, deviation))
    }

    /// The mean of both, weighted by their precision.
    fn updated(&self, log_ratio: f64, deviation: f64) -> Self {
        let [a, b] = [self.deviation, deviation].map(|d| d.max(1e-3).powi(-2));
        let log_ratio = (a * self.log_ratio + b * log_ratio) / (a + b);
        Self { log_ratio, deviation: (a + b).powf(-0.5), ..*self }
    }
}

/// The logarithm of the ratio of full-size to trial errors at about equal samples, and its standard deviation.
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
    /// The model of the runs of one method; `None` where no error is known.
    pub fn of(runs: &[&RenderMeasurement], transfer: &SizeTransfer) -> Option<Self> {
        let mut points = points(runs);
        let transfer = transfer.of_method(&points);
        let biased = runs.iter().any(|run| run.biased);
        let has_full = points.iter().any(|point| !point.is_trial);
        // Photon maps of trials have fewer photons: where there is better, they do not count.
        points.retain(|point| !(point.is_trial && biased && has_full));
        for point in points.iter_mut().filter(|point| point.is_trial) {
            point.error *= transfer.log_ratio.exp();
        }
        // Samples per pixel of the picture and second, over all runs that are not much shorter than the longest.
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

    /// Seconds until the error is reached, and whether pictures of full size lie on both sides of it. `None` where the error does not fall,
    /// or the interval would say nothing.
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
        // The first errors are no part of the power law, as far as others tell it.
        let early = used.partition_point(|point| point.samples < FIRST_SAMPLES);
        let early = early.min(used.len().saturating_sub(LEAST_POINTS));
        let checkpoints: Vec<Checkpoint> = used[early..].iter().map(checkpoint).collect();
        let (last, fit) = (used.last()?, PowerLaw::new(&checkpoints, self.biased)?);
        let (x, deviation) = fit.until(error)?;
        // Where points are close on both sides, nothing is extrapolated.
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

/// True where the 90 % interval of `slower` lies above that of `faster`, by a factor of two in the middle.
pub fn is_hopeless(slower: &Interval, faster: &Interval) -> bool {
    slower.low > faster.high && slower.value > 2.0 * faster.value
}

/// How many times as long, from the interval of a ratio: its lower bound.
pub fn at_least(slower: &Interval, faster: &Interval) -> f64 {
    slower.ratio(faster).map_or(1.0, |ratio| ratio.low.max(1.0))
}
