//! Derives a study from single measurements.

use crate::study::brightness::{Brightness, MethodMeans, audit};
use crate::study::data::{RegionWinners, Stability, StatedErrors, Study};
use crate::study::interval::Interval;
use crate::study::measurement::{Measurement, REGIONS, RenderMeasurement};
use crate::study::method_curve::method;
use crate::study::prediction::{PredictionOutcome, score};
use crate::study::time_model::SizeTransfer;

/// Completes `study`, which has scene and machine, with everything derived from `measurements`.
pub fn study(mut study: Study, measurements: &[Measurement]) -> Study {
    let mut runs: Vec<&RenderMeasurement> = Vec::new();
    let (mut unused, mut commands) = (Vec::new(), Vec::new());
    for measured in measurements {
        match measured {
            Measurement::Command { command } => commands.push(command.clone()),
            Measurement::Reference(reference) => study.reference = Some(reference.clone()),
            Measurement::Run(run) => runs.push(run),
            Measurement::Dropped(dropped) => replace(&mut study.dropped, dropped, |d| d.method.clone()),
            Measurement::Auto(auto) => study.auto = Some(auto.clone()),
            Measurement::Option(price) => replace(&mut study.options, price, |p| p.name.clone()),
            Measurement::Effect(effect) => replace(&mut study.effects, effect, |e| e.name.clone()),
            Measurement::Unused { ratio } => unused.push(*ratio),
            Measurement::Display(price) => replace(&mut study.display, price, |p| {
                (p.knob.clone(), p.setting.clone(), p.samples_per_pixel.to_bits())
            }),
            Measurement::Numeric(price) => replace(&mut study.numeric, price, |p| p.choice.clone()),
            Measurement::Scheme(price) => replace(&mut study.schemes, price, |p| p.name.clone()),
        }
    }
    study.unused_effects = Interval::of_mean(&unused);
    commands.dedup();
    study.command = commands.join("\n");
    let methods = by_method(&runs);
    study.trial_size = runs.iter().rev().find(|run| run.is_trial).map(|run| run.size);
    study.regions = regions(&methods);
    let shared = study.regions.as_ref().map(|regions| regions.seconds);
    let result = |(i, runs): (usize, &Vec<&RenderMeasurement>)| {
        method(runs, &SizeTransfer::for_method(i, &methods, study.size), shared)
    };
    study.methods = methods.iter().enumerate().map(result).collect();
    let given = study.reference.as_ref().map(|reference| reference.luminance).filter(|mean| *mean > 0.0);
    study.stability = stability(&methods, given);
    let kept: Vec<PredictionOutcome> = runs.iter().flat_map(|run| run.predictions.iter().copied()).collect();
    study.stated = methods.iter().filter_map(|runs| stated(runs)).collect();
    study.predictions = (!kept.is_empty()).then(|| score(&kept));
    study
}

/// Runs grouped by method, in order of first appearance.
pub fn by_method<'a>(runs: &[&'a RenderMeasurement]) -> Vec<Vec<&'a RenderMeasurement>> {
    let mut methods: Vec<Vec<&RenderMeasurement>> = Vec::new();
    for &run in runs {
        match methods.iter_mut().find(|runs| runs[0].method == run.method) {
            Some(runs) => runs.push(run),
            None => methods.push(vec![run]),
        }
    }
    methods
}

/// Replaces an earlier measurement with the same key, or adds the new one.
fn replace<T: Clone, K: PartialEq>(list: &mut Vec<T>, new: &T, key: impl Fn(&T) -> K) {
    match list.iter_mut().find(|old| key(old) == key(new)) {
        Some(old) => *old = new.clone(),
        None => list.push(new.clone()),
    }
}

/// The best method of each region, at the longest time that all of the program's methods have had.
fn regions(methods: &[Vec<&RenderMeasurement>]) -> Option<RegionWinners> {
    let has = |runs: &[&RenderMeasurement], budget: f64| {
        runs.iter().any(|run| run.budget == budget && !run.regions.is_empty())
    };
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
    Some(RegionWinners { seconds: shared, grid: REGIONS, winner, margin })
}

/// How often the error intervals of a method's renders contained the true error; `None` if no true error is known.
fn stated(runs: &[&RenderMeasurement]) -> Option<StatedErrors> {
    let known: Vec<([Interval; 3], [f64; 3])> =
        runs.iter().filter_map(|run| Some((run.stated?, run.truth?))).collect();
    let held = |i: usize| known.iter().filter(|(stated, truth)| stated[i].holds(truth[i])).count();
    let logs: Vec<f64> = known.iter().map(|(stated, truth)| (stated[1].value / truth[1]).ln()).collect();
    let mean = Interval::of_mean(&logs)?;
    Some(StatedErrors {
        method: runs[0].method.clone(),
        pictures: known.len(),
        held: [held(0), held(1), held(2)],
        ratio: mean.map(f64::exp),
    })
}

/// Rejected samples and brightness of the program's methods.
fn stability(methods: &[Vec<&RenderMeasurement>], given: Option<f64>) -> Vec<Stability> {
    let own: Vec<&Vec<&RenderMeasurement>> = methods.iter().filter(|runs| !runs[0].peer).collect();
    let means = |runs: &&Vec<&RenderMeasurement>| MethodMeans {
        biased: runs.iter().any(|run| run.biased),
        means: runs.iter().flat_map(|run| run.brightness.iter().copied()).collect(),
    };
    let found = audit(&own.iter().map(means).collect::<Vec<_>>(), given);
    own.iter().zip(found).map(|(runs, found)| of_method(runs, found)).collect()
}

fn of_method(runs: &[&RenderMeasurement], brightness: Option<Brightness>) -> Stability {
    let mut rejected: Vec<(String, u64, String)> = Vec::new();
    for (cause, count, command) in runs.iter().flat_map(|run| &run.rejected) {
        match rejected.iter_mut().find(|(known, ..)| known == cause) {
            Some((_, sum, _)) => *sum += count,
            None => rejected.push((cause.clone(), *count, command.clone())),
        }
    }
    Stability {
        method: runs[0].method.clone(),
        paths: runs.iter().map(|run| run.paths).sum(),
        rejected,
        energy: brightness.map(|b| b.ratio),
        alarm: brightness.is_some_and(|b| b.alarm),
        biased: runs.iter().any(|run| run.biased),
    }
}
