//! Makes the curve of one method and its times to errors from its renders.

use crate::study::curve::{Checkpoint, PowerLaw};
use crate::study::data::{CurvePoint, MethodResult, ReferenceImage, TimeToError};
use crate::study::error::ErrorEstimate;
use crate::study::interval::{Interval, student_95};
use crate::study::measurement::{FIGURES, RenderMeasurement};
use crate::study::prediction::time_reached;

/// The errors whose times are stated.
const PRICED: [f64; 4] = [0.05, 0.02, 0.01, 0.005];

/// A flatter slope of error against time indicates a heavy tail, or bias.
pub const FLAT: f64 = -0.4;

/// How far a curve is extrapolated beyond its last point, as a factor of time.
const MAX_EXTRAPOLATION: f64 = 1e3;

/// How far back a fit reaches, as a factor of time; it uses three points at least.
const FIT_RANGE: f64 = 40.0;

/// Errors of the reference itself. A smaller error is as much the reference's as the picture's and is not part of a curve.
#[derive(Clone, Copy, Default)]
pub struct ReferenceError {
    p95: f64,
    rms: f64,
}

impl ReferenceError {
    /// The errors that the reference states of itself.
    pub fn of(reference: &ReferenceImage) -> Self {
        Self { p95: reference.relative[1], rms: reference.rel_mse.unwrap_or(0.0).max(0.0).sqrt() }
    }
}

/// One of a point's errors, and the smallest value that is measurable.
#[derive(Clone, Copy)]
struct ErrorMeasure {
    error: fn(&CurvePoint) -> Interval,
    least: f64,
}

/// The curve of one method from its renders, with picture and error map of the time that all methods share, or else of its longest.
pub fn method(runs: &[&RenderMeasurement], own: ReferenceError, shared: Option<f64>) -> MethodResult {
    let mut budgets: Vec<f64> = runs.iter().map(|run| run.budget).collect();
    budgets.sort_by(f64::total_cmp);
    budgets.dedup();
    let of = |budget: f64| -> Vec<&RenderMeasurement> {
        runs.iter().filter(|run| run.budget == budget).copied().collect()
    };
    let mut points: Vec<CurvePoint> = budgets.iter().map(|&budget| point(&of(budget))).collect();
    let p95 = ErrorMeasure {
        error: |point| point.relative.map_or(Interval::default(), |relative| relative[1]),
        least: own.p95,
    };
    let rms = ErrorMeasure { error: |point| point.rel_mse.map(|e| e.max(0.0).sqrt()), least: own.rms };
    for point in points.iter_mut().filter(|point| (rms.error)(point).value < own.rms) {
        point.bias = None;
    }
    let by_time = checkpoints(&points, p95, &|point| point.seconds);
    let fit = line(&points, p95, &|point| point.seconds);
    let slope = line(&points, rms, &|point| point.seconds).map(|fit| fit.slope());
    let biased = points.iter().rfind(|point| point.bias.is_some()).is_some_and(CurvePoint::is_biased);
    let known = points.iter().rfind(|point| (rms.error)(point).value >= own.rms);
    let efficiency = known.map(|point| point.rel_mse.map(|e| 1.0 / (e * point.seconds)));
    let mut flags = Vec::new();
    if let Some(slope) = slope
        && slope.low > FLAT
    {
        let value = format!("{:.2}", slope.value).replace('-', "−");
        flags.push(format!("slope {value}, flatter than −0.4: a heavy tail or bias"));
    }
    if by_time.len() < points.len() && points.iter().all(|point| (p95.error)(point).value > 0.0) {
        flags.push(
            "it comes down to the error of the reference, which ends its curve: a longer one would tell more"
                .into(),
        );
    }
    let shown = runs.iter().filter(|run| run.picture.is_some() && run.error_map.is_some());
    let far = |run: &RenderMeasurement| shared.map_or(-run.budget, |shared| (run.budget / shared).ln().abs());
    let shown = shown.min_by(|a, b| far(a).total_cmp(&far(b)));
    MethodResult {
        name: runs[0].method.clone(),
        peer: runs[0].peer,
        slope,
        slope_samples: line(&points, rms, &|point| point.samples_per_pixel).map(|fit| fit.slope()),
        biased,
        flags,
        prices: PRICED.iter().map(|&error| price(error, &by_time, fit.as_ref(), biased)).collect(),
        efficiency: efficiency.filter(|e| e.value.is_finite()),
        points,
        picture: shown.and_then(|run| run.picture.clone()),
        error_map: shown.and_then(|run| run.error_map.clone()),
    }
}

/// One error of each point of a curve against seconds or samples.
fn checkpoints(points: &[CurvePoint], kind: ErrorMeasure, x: &dyn Fn(&CurvePoint) -> f64) -> Vec<Checkpoint> {
    let checkpoint = |point: &CurvePoint| {
        let error = (kind.error)(point);
        let deviation = deviation(&error, point.runs);
        Checkpoint { seconds: point.seconds, samples: x(point), error: error.value, deviation }
    };
    let told = |checkpoint: &Checkpoint| {
        checkpoint.error > 0.0 && checkpoint.error.is_finite() && checkpoint.error >= kind.least
    };
    points.iter().map(checkpoint).filter(told).collect()
}

/// Fits the end of a curve: its beginning has another slope, while pixels have no path yet or rare light has not been found.
fn line(points: &[CurvePoint], kind: ErrorMeasure, x: &dyn Fn(&CurvePoint) -> f64) -> Option<PowerLaw> {
    let checkpoints = checkpoints(points, kind, x);
    let last = checkpoints.last()?.seconds;
    let recent = checkpoints.partition_point(|checkpoint| checkpoint.seconds < last / FIT_RANGE);
    PowerLaw::free(&checkpoints[recent.min(checkpoints.len().saturating_sub(3))..])
}

/// Standard deviation of the logarithm of an error, from the interval that one run states or from that of the mean of several.
fn deviation(interval: &Interval, runs: usize) -> f64 {
    if interval.value <= 0.0 || interval.low <= 0.0 {
        return 0.3;
    }
    match runs {
        1 => ErrorEstimate::log_deviation(interval),
        _ => (interval.high / interval.value).ln() / student_95(runs as f64 - 1.0),
    }
}

/// Joins the runs of one budget; a single run keeps its own interval.
fn point(runs: &[&RenderMeasurement]) -> CurvePoint {
    let mean = |f: &dyn Fn(&RenderMeasurement) -> f64| {
        runs.iter().map(|run| f(run)).sum::<f64>() / runs.len() as f64
    };
    let joined = |f: &dyn Fn(&RenderMeasurement) -> Interval| match runs {
        [one] => f(one),
        _ => {
            let values: Vec<f64> = runs.iter().map(|run| f(run).value).collect();
            let mut joined = Interval::of_mean(&values).unwrap_or_default();
            joined.low = joined.low.max(0.25 * joined.value);
            joined
        }
    };
    let rel_mse = joined(&|run| run.rel_mse);
    let noise = known(runs, |run| run.noise);
    let bias = noise.map(|noise| Interval {
        value: (rel_mse.value - noise.value).max(0.0),
        low: (rel_mse.low - noise.high).max(0.0),
        high: (rel_mse.high - noise.low).max(0.0),
    });
    CurvePoint {
        budget: runs[0].budget,
        seconds: mean(&|run| run.seconds),
        trace_seconds: mean(&|run| run.trace_seconds),
        splat_seconds: mean(&|run| run.splat_seconds),
        display_seconds: mean(&|run| run.display_seconds),
        samples_per_pixel: mean(&|run| run.samples_per_pixel),
        runs: runs.len(),
        rel_mse,
        rel_mse_trimmed: match runs {
            [one] => Interval::exact(one.trimmed),
            _ => joined(&|run| Interval::exact(run.trimmed)),
        },
        noise,
        bias,
        relative: Some(rising([0, 1, 2].map(|i| joined(&|run| run.relative[i])))),
        stated: runs.iter().any(|run| run.stated.is_some()).then(|| {
            [0, 1, 2].map(|i| known(runs, |run| run.stated.map(|stated| stated[i])).unwrap_or_default())
        }),
        smape: joined(&|run| Interval::exact(run.smape)),
        flip: joined(&|run| Interval::exact(run.flip)),
        flip_filtered: known(runs, |run| run.flip_filtered.map(Interval::exact)),
        picture: runs
            .iter()
            .find_map(|run| run.picture.clone())
            .filter(|_| FIGURES.contains(&runs[0].budget)),
    }
}

/// Makes quantiles rise, which they might not after the reference's error has been subtracted from each.
fn rising([median, p95, p99]: [Interval; 3]) -> [Interval; 3] {
    let least = |a: Interval, b: Interval| if b.value < a.value { a } else { b };
    let p95 = least(median, p95);
    [median, p95, least(p95, p99)]
}

/// A number that some runs have.
fn known(
    runs: &[&RenderMeasurement],
    figure: impl Fn(&RenderMeasurement) -> Option<Interval>,
) -> Option<Interval> {
    let all: Vec<Interval> = runs.iter().filter_map(|run| figure(run)).collect();
    match &all[..] {
        [one] => Some(*one),
        _ => Interval::of_mean(&all.iter().map(|interval| interval.value).collect::<Vec<f64>>()),
    }
}

/// Seconds to `error`: interpolated between two points of the curve, or extrapolated by its fit unless there is bias.
fn price(error: f64, checkpoints: &[Checkpoint], fit: Option<&PowerLaw>, biased: bool) -> TimeToError {
    let measured = checkpoints.last().is_some_and(|last| last.error <= error);
    if measured {
        let at = time_reached(checkpoints, error, f64::NEG_INFINITY).unwrap_or_default();
        let near = checkpoints.iter().find(|checkpoint| checkpoint.error <= error);
        let deviation = near.map_or(0.1, |checkpoint| checkpoint.deviation);
        let slope = fit.map_or(0.5, |fit| fit.slope.clamp(0.2, 1.0));
        let seconds = match checkpoints[0].error <= error {
            true => Interval { value: at, low: 0.0, high: at },
            false => Interval::of_log(at, deviation / slope),
        };
        return TimeToError { error, seconds: Some(seconds), measured };
    }
    let further = || {
        let (last, (x, deviation)) = (checkpoints.last()?, fit?.until(error)?);
        let seconds = Interval::of_log(last.seconds * x.exp(), deviation);
        (x < MAX_EXTRAPOLATION.ln()).then_some(seconds)
    };
    TimeToError { error, seconds: if biased { None } else { further() }, measured }
}
