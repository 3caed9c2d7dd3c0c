//! From single measurements to a study.

use crate::study::curve::{Fit, Look};
use crate::study::data::{Method, Point, Price, Regions, Stability, Study};
use crate::study::error::Figures;
use crate::study::interval::Interval;
use crate::study::measured::{Measured, REGIONS, Run};
use crate::study::prediction::{Kept, reached, score};

/// Errors whose price is told.
pub const PRICED: [f64; 4] = [0.05, 0.02, 0.01, 0.005];

/// A slope of error against time that is flatter is a sign of a heavy tail, or of bias.
const FLAT: f64 = -0.4;

/// How far beyond the last point of a curve prices are told, as a factor of time.
const BEYOND: f64 = 1e3;

/// Fills in everything that follows from `measurements`; `study` names scene and machine.
pub fn study(mut study: Study, measurements: &[Measured]) -> Study {
    let mut runs: Vec<&Run> = Vec::new();
    let mut unused = Vec::new();
    for measured in measurements {
        match measured {
            Measured::Reference(reference) => study.reference = Some(reference.clone()),
            Measured::Run(run) => runs.push(run),
            Measured::Effect(effect) => replace(&mut study.effects, effect, |e| e.name.clone()),
            Measured::Unused { ratio } => unused.push(*ratio),
            Measured::Display(price) => replace(&mut study.display, price, |p| {
                (p.knob.clone(), p.setting.clone(), p.samples_per_pixel.to_bits())
            }),
            Measured::Numeric(price) => replace(&mut study.numeric, price, |p| p.choice.clone()),
            Measured::Scheme(price) => replace(&mut study.schemes, price, |p| p.name.clone()),
        }
    }
    study.unused_effects = Interval::of_mean(&unused);
    let mut names: Vec<&str> = Vec::new();
    for run in &runs {
        if !names.contains(&run.method.as_str()) {
            names.push(&run.method);
        }
    }
    let of = |name: &str| -> Vec<&Run> { runs.iter().filter(|run| run.method == name).copied().collect() };
    study.methods = names.iter().map(|name| method(&of(name))).collect();
    study.regions = regions(&names.iter().map(|name| of(name)).collect::<Vec<_>>());
    study.stability =
        names.iter().map(|name| of(name)).filter(|runs| !runs[0].peer).map(|runs| stability(&runs)).collect();
    let kept: Vec<Kept> = runs.iter().flat_map(|run| run.kept.iter().copied()).collect();
    study.predictions = (!kept.is_empty()).then(|| score(&kept));
    study
}

/// A later measurement of the same thing takes the place of the earlier.
fn replace<T: Clone, K: PartialEq>(list: &mut Vec<T>, new: &T, key: impl Fn(&T) -> K) {
    match list.iter_mut().find(|old| key(old) == key(new)) {
        Some(old) => *old = new.clone(),
        None => list.push(new.clone()),
    }
}

/// The curve of one method.
fn method(runs: &[&Run]) -> Method {
    let mut budgets: Vec<f64> = runs.iter().map(|run| run.budget).collect();
    budgets.sort_by(f64::total_cmp);
    budgets.dedup();
    let of = |budget: f64| -> Vec<&Run> { runs.iter().filter(|run| run.budget == budget).copied().collect() };
    let points: Vec<Point> = budgets.iter().map(|&budget| point(&of(budget))).collect();
    let p95 = |point: &Point| point.relative.map_or(Interval::default(), |relative| relative[1]);
    let rms = |point: &Point| point.rel_mse.map(|e| e.max(0.0).sqrt());
    let by_time = looks(&points, &p95, &|point| point.seconds);
    let fit = line(&points, &p95, &|point| point.seconds);
    let slope = line(&points, &rms, &|point| point.seconds).map(|fit| fit.slope());
    let mut flags = Vec::new();
    if let Some(slope) = slope
        && slope.low > FLAT
    {
        let value = format!("{:.2}", slope.value).replace('-', "−");
        flags.push(format!("slope {value}, flatter than −0.4: a heavy tail or bias"));
    }
    let longest = |run: &&&Run| run.picture.is_some() && Some(&run.budget) == budgets.last();
    let last = runs.iter().find(longest);
    let efficiency = points.last().map(|point| point.rel_mse.map(|e| 1.0 / (e * point.seconds)));
    Method {
        name: runs[0].method.clone(),
        peer: runs[0].peer,
        slope,
        slope_samples: line(&points, &rms, &|point| point.samples_per_pixel).map(|fit| fit.slope()),
        flags,
        prices: PRICED.iter().map(|&error| price(error, &by_time, fit.as_ref())).collect(),
        efficiency: efficiency.filter(|e| e.value.is_finite()),
        picture: last.and_then(|run| run.picture.clone()),
        error_map: last.and_then(|run| run.error_map.clone()),
        points,
    }
}

/// Points of a curve as looks: an error of each against seconds or samples.
fn looks(points: &[Point], error: &dyn Fn(&Point) -> Interval, x: &dyn Fn(&Point) -> f64) -> Vec<Look> {
    let look = |point: &Point| {
        let error = error(point);
        let deviation = deviation(&error, point.runs);
        Look { seconds: point.seconds, samples: x(point), error: error.value, deviation }
    };
    points.iter().map(look).filter(|look| look.error > 0.0 && look.error.is_finite()).collect()
}

/// The line of a curve, from where every pixel has a path on if two points are: before, pixels without any have another slope.
fn line(points: &[Point], error: &dyn Fn(&Point) -> Interval, x: &dyn Fn(&Point) -> f64) -> Option<Fit> {
    let covered = points.iter().filter(|point| point.samples_per_pixel >= 1.0).count();
    let from = if covered >= 2 { points.len() - covered } else { 0 };
    Fit::free(&looks(&points[from..], error, x))
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
        relative: Some([0, 1, 2].map(|i| joined(&|run| run.relative[i]))),
        stated: known(runs, |run| run.stated.map(|stated| stated[0])).map(|median| {
            let other = |i: usize| known(runs, |run| run.stated.map(|stated| stated[i])).unwrap_or_default();
            [median, other(1), other(2)]
        }),
        smape: mean(&|run| run.smape),
        flip: mean(&|run| run.flip),
    }
}

/// A figure that some runs have.
fn known(runs: &[&Run], figure: impl Fn(&Run) -> Option<Interval>) -> Option<Interval> {
    let all: Vec<Interval> = runs.iter().filter_map(|run| figure(run)).collect();
    match &all[..] {
        [one] => Some(*one),
        _ => Interval::of_mean(&all.iter().map(|interval| interval.value).collect::<Vec<f64>>()),
    }
}

/// Seconds to `error`: between two points of the curve, or by its line.
fn price(error: f64, looks: &[Look], fit: Option<&Fit>) -> Price {
    let measured = looks.last().is_some_and(|last| last.error <= error);
    if measured {
        let at = reached(looks, error).unwrap_or_default();
        let near = looks.iter().find(|look| look.error <= error).map_or(0.1, |look| look.deviation);
        let slope = fit.map_or(0.5, |fit| fit.slope.clamp(0.2, 1.0));
        return Price { error, seconds: Some(Interval::of_log(at, near / slope)), measured };
    }
    let further = || {
        let (last, (x, deviation)) = (looks.last()?, fit?.until(error)?);
        let seconds = Interval::of_log(last.seconds * x.exp(), deviation);
        (x < BEYOND.ln()).then_some(seconds)
    };
    Price { error, seconds: further(), measured }
}

/// Who is best where, at the longest time that all of ours have had.
fn regions(methods: &[Vec<&Run>]) -> Option<Regions> {
    let has =
        |runs: &[&Run], budget: f64| runs.iter().any(|run| run.budget == budget && !run.regions.is_empty());
    let taking_part: Vec<usize> = (0..methods.len())
        .filter(|&m| methods[m].iter().any(|run| !run.peer && !run.regions.is_empty()))
        .collect();
    if taking_part.len() < 2 {
        return None;
    }
    let mut budgets: Vec<f64> = methods.iter().flatten().map(|run| run.budget).collect();
    budgets.sort_by(f64::total_cmp);
    let shared =
        budgets.into_iter().rfind(|&budget| taking_part.iter().all(|&m| has(&methods[m], budget)))?;
    let count = REGIONS[0] * REGIONS[1];
    let mean = |m: usize, cell: usize| {
        let runs = methods[m].iter().filter(|run| run.budget == shared);
        let values: Vec<f64> = runs.filter_map(|run| run.regions.get(cell)).map(|&v| f64::from(v)).collect();
        values.iter().sum::<f64>() / values.len().max(1) as f64
    };
    let (mut winner, mut margin) = (Vec::new(), Vec::new());
    for cell in 0..count {
        let mut rated: Vec<(f64, usize)> = taking_part.iter().map(|&m| (mean(m, cell), m)).collect();
        rated.sort_by(|a, b| a.0.total_cmp(&b.0));
        winner.push(rated[0].1);
        margin.push(rated.get(1).map_or(1.0, |second| second.0 / rated[0].0.max(1e-12)));
    }
    Some(Regions { seconds: shared, grid: REGIONS, winner, margin })
}

fn stability(runs: &[&Run]) -> Stability {
    let mut rejected: Vec<(String, u64, String)> = Vec::new();
    for (cause, count, command) in runs.iter().flat_map(|run| &run.rejected) {
        match rejected.iter_mut().find(|(known, ..)| known == cause) {
            Some((_, sum, _)) => *sum += count,
            None => rejected.push((cause.clone(), *count, command.clone())),
        }
    }
    // The longest ones of which there are three, or nobody knows how far they scatter.
    let of = |budget: f64| {
        runs.iter().filter(|run| run.budget == budget).map(|run| run.energy).collect::<Vec<f64>>()
    };
    let often = runs.iter().map(|run| run.budget).filter(|&budget| of(budget).len() >= 3);
    let energies = of(often.fold(0.0, f64::max));
    Stability {
        method: runs[0].method.clone(),
        paths: runs.iter().map(|run| run.paths).sum(),
        rejected,
        energy: Interval::of_mean(&energies),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(method: &str, seconds: f64, error: f64, seed: u32) -> Measured {
        let interval = Interval::of_log(error, 0.05);
        Measured::Run(Box::new(Run {
            method: method.to_string(),
            budget: seconds,
            seed,
            seconds,
            samples_per_pixel: 10.0 * seconds,
            paths: 1000,
            rel_mse: interval.map(|e| e * e),
            relative: [interval; 3],
            noise: Some(interval.map(|e| 0.9 * e * e)),
            regions: vec![error as f32; REGIONS[0] * REGIONS[1]],
            rejected: vec![("NaN".to_string(), 2, "render".to_string())],
            energy: 1.0,
            ..Run::default()
        }))
    }

    #[test]
    fn curves_prices_and_winners_follow_from_the_runs() {
        let mut measured = Vec::new();
        for (seconds, n) in [(0.1, 3), (1.0, 2), (10.0, 1)] {
            for seed in 0..n {
                let wobble = 1.0 + 0.01 * f64::from(seed);
                measured.push(run("path", seconds, 0.1 * wobble * f64::powf(seconds, -0.5), seed));
                measured.push(run("photon", seconds, 0.08 * wobble * f64::powf(seconds, -0.2), seed));
            }
        }
        let study = study(Study::default(), &measured);
        let [path, photon] = &study.methods[..] else { panic!("two methods") };
        assert_eq!(path.points.iter().map(|p| p.runs).collect::<Vec<_>>(), [3, 2, 1]);
        assert!(path.slope.is_some_and(|s| s.holds(-0.5)), "{:?}", path.slope);
        assert!(path.flags.is_empty(), "{:?}", path.flags);
        assert_eq!(photon.flags.len(), 1);
        let bias = path.points[2].bias.expect("replicates");
        assert!((bias.value / path.points[2].rel_mse.value - 0.1).abs() < 1e-6);
        // 5 % after 4 seconds, measured; 1 % after 100, drawn further.
        let [five, _, one, _] = &path.prices[..] else { panic!("four prices") };
        assert!(five.measured && five.seconds.is_some_and(|s| (s.value / 4.0).ln().abs() < 0.2));
        assert!(!one.measured && one.seconds.is_some_and(|s| s.holds(100.0)));
        let regions = study.regions.expect("two methods");
        assert_eq!((regions.seconds, regions.winner[7]), (10.0, 0));
        assert!(regions.margin[7] > 1.0);
        assert_eq!(study.stability[0].rejected, [("NaN".to_string(), 12, "render".to_string())]);
        assert_eq!(study.stability[0].paths, 6000);
    }

    #[test]
    fn nothing_gives_nothing_and_later_figures_replace_earlier_ones() {
        assert_eq!(study(Study::default(), &[]), Study::default());
        let scheme = |value| {
            let price = crate::study::data::SchemePrice {
                name: "two".to_string(),
                error: Interval::exact(value),
                ..Default::default()
            };
            Measured::Scheme(price)
        };
        let study = study(Study::default(), &[scheme(1.0), scheme(2.0), Measured::Unused { ratio: 1.5 }]);
        assert_eq!((study.schemes.len(), study.schemes[0].error.value), (1, 2.0));
        assert_eq!(study.unused_effects, Some(Interval::exact(1.5)));
    }
}
