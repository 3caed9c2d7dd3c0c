//! From the runs of one method to its curve and its prices.

use crate::study::curve::{Fit, Look};
use crate::study::data::{Method, Point, Price, Reference};
use crate::study::error::Figures;
use crate::study::interval::Interval;
use crate::study::measured::{FIGURES, Run};
use crate::study::prediction::reached;

/// Errors whose price is told.
pub const PRICED: [f64; 4] = [0.05, 0.02, 0.01, 0.005];

/// A slope of error against time that is flatter is a sign of a heavy tail, or of bias.
pub const FLAT: f64 = -0.4;

/// How far beyond the last point of a curve prices are told, as a factor of time.
const BEYOND: f64 = 1e3;

/// How far back the line of a curve goes, as a factor of time; three points at least.
const RECENT: f64 = 40.0;

/// Errors of the reference itself. Of an error below them as much is the reference's as the picture's: it is no part of a curve.
#[derive(Clone, Copy, Default)]
pub struct Own {
    p95: f64,
    rms: f64,
}

impl Own {
    /// Those that it states of itself.
    pub fn of(reference: &Reference) -> Self {
        Self { p95: reference.relative[1], rms: reference.rel_mse.unwrap_or(0.0).max(0.0).sqrt() }
    }
}

/// An error of a point, and below what it is not told.
#[derive(Clone, Copy)]
struct Kind {
    error: fn(&Point) -> Interval,
    least: f64,
}

/// The curve of one method.
pub fn method(runs: &[&Run], own: Own) -> Method {
    let mut budgets: Vec<f64> = runs.iter().map(|run| run.budget).collect();
    budgets.sort_by(f64::total_cmp);
    budgets.dedup();
    let of = |budget: f64| -> Vec<&Run> { runs.iter().filter(|run| run.budget == budget).copied().collect() };
    let mut points: Vec<Point> = budgets.iter().map(|&budget| point(&of(budget))).collect();
    let p95 = Kind {
        error: |point| point.relative.map_or(Interval::default(), |relative| relative[1]),
        least: own.p95,
    };
    let rms = Kind { error: |point| point.rel_mse.map(|e| e.max(0.0).sqrt()), least: own.rms };
    for point in points.iter_mut().filter(|point| (rms.error)(point).value < own.rms) {
        point.bias = None;
    }
    let by_time = looks(&points, p95, &|point| point.seconds);
    let fit = line(&points, p95, &|point| point.seconds);
    let slope = line(&points, rms, &|point| point.seconds).map(|fit| fit.slope());
    let biased = points.iter().rfind(|point| point.bias.is_some()).is_some_and(Point::is_biased);
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
    Method {
        name: runs[0].method.clone(),
        peer: runs[0].peer,
        slope,
        slope_samples: line(&points, rms, &|point| point.samples_per_pixel).map(|fit| fit.slope()),
        biased,
        flags,
        prices: PRICED.iter().map(|&error| price(error, &by_time, fit.as_ref(), biased)).collect(),
        efficiency: efficiency.filter(|e| e.value.is_finite()),
        points,
        ..Method::default()
    }
}

/// Picture and error map of the time that all methods share, or of the longest that this one has had.
pub fn pictures(method: &mut Method, runs: &[&Run], shared: Option<f64>) {
    let shown = runs.iter().filter(|run| run.picture.is_some() && run.error_map.is_some());
    let far = |run: &Run| shared.map_or(-run.budget, |shared| (run.budget / shared).ln().abs());
    if let Some(run) = shown.min_by(|a, b| far(a).total_cmp(&far(b))) {
        (method.picture, method.error_map) = (run.picture.clone(), run.error_map.clone());
    }
}

/// Points of a curve as looks: an error of each against seconds or samples.
fn looks(points: &[Point], kind: Kind, x: &dyn Fn(&Point) -> f64) -> Vec<Look> {
    let look = |point: &Point| {
        let error = (kind.error)(point);
        let deviation = deviation(&error, point.runs);
        Look { seconds: point.seconds, samples: x(point), error: error.value, deviation }
    };
    let told = |look: &Look| look.error > 0.0 && look.error.is_finite() && look.error >= kind.least;
    points.iter().map(look).filter(told).collect()
}

/// The line of the end of a curve: its beginning has another slope, where pixels have no path yet, or rare light was not found.
fn line(points: &[Point], kind: Kind, x: &dyn Fn(&Point) -> f64) -> Option<Fit> {
    let looks = looks(points, kind, x);
    let last = looks.last()?.seconds;
    let recent = looks.partition_point(|look| look.seconds < last / RECENT);
    Fit::free(&looks[recent.min(looks.len().saturating_sub(3))..])
}

/// Standard deviation of the logarithm: the interval of one run alone has the chance of two pictures in it.
fn deviation(interval: &Interval, runs: usize) -> f64 {
    if interval.value <= 0.0 || interval.low <= 0.0 {
        return 0.3;
    }
    let one = Figures::log_deviation(interval);
    if runs == 1 { one } else { one * std::f64::consts::SQRT_2 }
}

/// Several runs of one budget; one alone keeps the interval that it has itself.
fn point(runs: &[&Run]) -> Point {
    let mean = |f: &dyn Fn(&Run) -> f64| runs.iter().map(|run| f(run)).sum::<f64>() / runs.len() as f64;
    let joined = |f: &dyn Fn(&Run) -> Interval| match runs {
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
    Point {
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
        stated: known(runs, |run| run.stated.map(|stated| stated[0])).map(|median| {
            let other = |i: usize| known(runs, |run| run.stated.map(|stated| stated[i])).unwrap_or_default();
            [median, other(1), other(2)]
        }),
        smape: joined(&|run| Interval::exact(run.smape)),
        flip: joined(&|run| Interval::exact(run.flip)),
        picture: runs
            .iter()
            .find_map(|run| run.picture.clone())
            .filter(|_| FIGURES.contains(&runs[0].budget)),
    }
}

/// Quantiles rise; with the reference's own taken off each by itself they might not.
fn rising([median, p95, p99]: [Interval; 3]) -> [Interval; 3] {
    let least = |a: Interval, b: Interval| if b.value < a.value { a } else { b };
    let p95 = least(median, p95);
    [median, p95, least(p95, p99)]
}

/// A figure that some runs have.
fn known(runs: &[&Run], figure: impl Fn(&Run) -> Option<Interval>) -> Option<Interval> {
    let all: Vec<Interval> = runs.iter().filter_map(|run| figure(run)).collect();
    match &all[..] {
        [one] => Some(*one),
        _ => Interval::of_mean(&all.iter().map(|interval| interval.value).collect::<Vec<f64>>()),
    }
}

/// Seconds to `error`: between two points of the curve, or by its line, which is not drawn further where there is bias.
fn price(error: f64, looks: &[Look], fit: Option<&Fit>, biased: bool) -> Price {
    let measured = looks.last().is_some_and(|last| last.error <= error);
    if measured {
        let at = reached(looks, error, f64::NEG_INFINITY).unwrap_or_default();
        if looks[0].error <= error {
            return Price { error, seconds: Some(Interval { value: at, low: 0.0, high: at }), measured };
        }
        let near = looks.iter().find(|look| look.error <= error).map_or(0.1, |look| look.deviation);
        let slope = fit.map_or(0.5, |fit| fit.slope.clamp(0.2, 1.0));
        return Price { error, seconds: Some(Interval::of_log(at, near / slope)), measured };
    }
    let further = || {
        let (last, (x, deviation)) = (looks.last()?, fit?.until(error)?);
        let seconds = Interval::of_log(last.seconds * x.exp(), deviation);
        (x < BEYOND.ln()).then_some(seconds)
    };
    Price { error, seconds: if biased { None } else { further() }, measured }
}
