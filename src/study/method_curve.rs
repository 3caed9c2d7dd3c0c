//! Derives the curve of one method and its times to errors from its renders.

use crate::study::curve::{Checkpoint, PowerLaw};
use crate::study::data::{CurvePoint, MethodResult, TimeToError};
use crate::study::error::ErrorEstimate;
use crate::study::interval::Interval;
use crate::study::measurement::{FIGURES, RenderMeasurement};
use crate::study::pool::LACKING;
use crate::study::time_model::{SizeTransfer, TimeModel};

/// Errors whose times are reported.
pub const PRICED: [f64; 4] = [0.05, 0.02, 0.01, 0.005];

/// A flatter slope of error against time indicates a heavy tail, or bias.
pub const FLAT: f64 = -0.4;

/// Range of a fit as a factor of time, extended to three points if necessary.
const FIT_RANGE: f64 = 40.0;

/// Curve of one method from its renders, with picture and error map at the longest time shared by all methods, or else of its longest
/// render.
pub fn method(runs: &[&RenderMeasurement], transfer: &SizeTransfer, shared: Option<f64>) -> MethodResult {
    let full: Vec<&RenderMeasurement> = runs.iter().filter(|run| !run.is_trial).copied().collect();
    let mut budgets: Vec<f64> = full.iter().map(|run| run.budget).collect();
    budgets.sort_by(f64::total_cmp);
    budgets.dedup();
    let of = |budget: f64| -> Vec<&RenderMeasurement> {
        full.iter().filter(|run| run.budget == budget).copied().collect()
    };
    let points: Vec<CurvePoint> = budgets.iter().map(|&budget| point(&of(budget))).collect();
    let slope = line(&points, &|point| point.seconds).map(|fit| fit.slope());
    let known = points.iter().rev().find_map(|point| Some((point, point.rel_mse?)));
    let efficiency = known.map(|(point, error)| error.map(|e| 1.0 / (e * point.seconds)));
    let biased = runs.iter().any(|run| run.biased);
    // The longest render of either kind is most precise.
    let latest = runs.iter().max_by(|a, b| a.samples_per_pixel.total_cmp(&b.samples_per_pixel));
    let missing = latest.map_or(0.0, |run| run.missing);
    let mut flags = Vec::new();
    if let Some(slope) = slope
        && slope.low > FLAT
    {
        let value = format!("{:.2}", slope.value).replace('-', "−");
        flags.push(format!("slope {value}, flatter than −0.4: a heavy tail or bias"));
    }
    if missing > LACKING && !biased {
        let missing = crate::study::format::percent_of(missing);
        flags.push(format!("other methods show {missing} more light: its own stated error is too small"));
    }
    let shown = full.iter().filter(|run| run.picture.is_some() && run.error_map.is_some());
    let far = |run: &RenderMeasurement| shared.map_or(-run.budget, |shared| (run.budget / shared).ln().abs());
    let shown = shown.min_by(|a, b| far(a).total_cmp(&far(b)));
    MethodResult {
        name: runs[0].method.clone(),
        peer: runs[0].peer,
        slope,
        slope_samples: line(&points, &|point| point.samples_per_pixel).map(|fit| fit.slope()),
        biased,
        missing,
        flags,
        prices: if runs[0].peer { Vec::new() } else { prices(runs, transfer) },
        efficiency: efficiency.filter(|e| e.value.is_finite()),
        points,
        picture: shown.and_then(|run| run.picture.clone()),
        error_map: shown.and_then(|run| run.error_map.clone()),
    }
}

/// Times to the errors of [`PRICED`].
pub fn prices(runs: &[&RenderMeasurement], transfer: &SizeTransfer) -> Vec<TimeToError> {
    let model = TimeModel::of(runs, transfer);
    let price = |error: f64| {
        let time = model.as_ref().and_then(|model| model.time_to(error));
        TimeToError { error, seconds: time.map(|t| t.0), measured: time.is_some_and(|t| t.1) }
    };
    PRICED.map(price).into()
}

/// Fits the end of a curve of √relMSE; its beginning has another slope while rare light has not been found.
fn line(points: &[CurvePoint], x: &dyn Fn(&CurvePoint) -> f64) -> Option<PowerLaw> {
    let checkpoint = |point: &CurvePoint| {
        let error = point.rel_mse?.map(|e| e.max(0.0).sqrt());
        let deviation = if error.low > 0.0 { (error.high / error.value).ln() / 1.645 } else { 0.3 };
        let usable = error.value > 0.0 && error.value.is_finite();
        usable.then(|| Checkpoint {
            seconds: point.seconds,
            samples: x(point),
            error: error.value,
            deviation,
        })
    };
    let checkpoints: Vec<Checkpoint> = points.iter().filter_map(checkpoint).collect();
    let last = checkpoints.last()?.seconds;
    let recent = checkpoints.partition_point(|checkpoint| checkpoint.seconds < last / FIT_RANGE);
    PowerLaw::free(&checkpoints[recent.min(checkpoints.len().saturating_sub(3))..])
}

/// Averages the runs of one time budget.
fn point(runs: &[&RenderMeasurement]) -> CurvePoint {
    let mean = |f: &dyn Fn(&RenderMeasurement) -> f64| {
        runs.iter().map(|run| f(run)).sum::<f64>() / runs.len() as f64
    };
    let rel_mse = joined(runs, |run| run.rel_mse);
    let noise = joined(runs, |run| run.noise);
    let bias = rel_mse.zip(noise).map(|(rel_mse, noise)| Interval {
        value: (rel_mse.value - noise.value).max(0.0),
        low: (rel_mse.low - noise.high).max(0.0),
        high: (rel_mse.high - noise.low).max(0.0),
    });
    let several = |figure: &dyn Fn(&RenderMeasurement) -> Option<f64>| {
        Interval::of_mean(&runs.iter().filter_map(|run| figure(run)).collect::<Vec<f64>>())
    };
    let quantiles = |figure: &dyn Fn(&RenderMeasurement) -> Option<[Interval; 3]>| {
        let quantile = |i: usize| joined(runs, |run| figure(run).map(|all| all[i]));
        Some([quantile(0)?, quantile(1)?, quantile(2)?])
    };
    CurvePoint {
        budget: runs[0].budget,
        seconds: mean(&|run| run.seconds),
        trace_seconds: mean(&|run| run.trace_seconds),
        splat_seconds: mean(&|run| run.splat_seconds),
        display_seconds: mean(&|run| run.display_seconds),
        samples_per_pixel: mean(&|run| run.samples_per_pixel),
        runs: runs.len(),
        rel_mse,
        rel_mse_trimmed: several(&|run| run.trimmed),
        noise,
        bias,
        relative: quantiles(&|run| run.relative).map(rising),
        stated: quantiles(&|run| run.stated),
        smape: several(&|run| run.smape),
        flip: several(&|run| run.flip),
        flip_filtered: several(&|run| run.flip_filtered),
        picture: runs
            .iter()
            .find_map(|run| run.picture.clone())
            .filter(|_| FIGURES.contains(&runs[0].budget)),
    }
}

/// Makes quantiles monotonic, which subtracting the reference's error from each may have violated.
fn rising([median, p95, p99]: [Interval; 3]) -> [Interval; 3] {
    let least = |a: Interval, b: Interval| if b.value < a.value { a } else { b };
    let p95 = least(median, p95);
    [median, p95, least(p95, p99)]
}

/// Mean of a value that some runs have. Its interval is the runs' own, divided by the root of their number: the scatter of a few runs would
/// be less reliable.
fn joined(
    runs: &[&RenderMeasurement],
    figure: impl Fn(&RenderMeasurement) -> Option<Interval>,
) -> Option<Interval> {
    let all: Vec<Interval> = runs.iter().filter_map(|run| figure(run)).collect();
    let n = all.len() as f64;
    let value = all.iter().map(|interval| interval.value).sum::<f64>() / n;
    match &all[..] {
        [] => None,
        [one] => Some(*one),
        _ if value > 0.0 => {
            let squares = all.iter().map(|interval| ErrorEstimate::log_deviation(interval).powi(2));
            Some(Interval::of_log(value, (squares.sum::<f64>() / (n * n)).sqrt()))
        }
        _ => Some(Interval::exact(value)),
    }
}
