//! Makes a study from single measurements.

use crate::study::data::{RegionWinners, Stability, Study};
use crate::study::interval::Interval;
use crate::study::measurement::{Measurement, REGIONS, RenderMeasurement};
use crate::study::method_curve::{ReferenceError, method};
use crate::study::prediction::{PredictionOutcome, score};

/// Completes `study`, which names scene and machine, by everything that follows from `measurements`.
pub fn study(mut study: Study, measurements: &[Measurement]) -> Study {
    let mut runs: Vec<&RenderMeasurement> = Vec::new();
    let (mut unused, mut commands) = (Vec::new(), Vec::new());
    for measured in measurements {
        match measured {
            Measurement::Command { command } => commands.push(command.clone()),
            Measurement::Reference(reference) => study.reference = Some(reference.clone()),
            Measurement::Run(run) => runs.push(run),
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
    let mut methods: Vec<Vec<&RenderMeasurement>> = Vec::new();
    for run in &runs {
        match methods.iter_mut().find(|runs| runs[0].method == run.method) {
            Some(runs) => runs.push(run),
            None => methods.push(vec![run]),
        }
    }
    let own = study.reference.as_ref().map_or(ReferenceError::default(), ReferenceError::of);
    study.regions = regions(&methods);
    let shared = study.regions.as_ref().map(|regions| regions.seconds);
    study.methods = methods.iter().map(|runs| method(runs, own, shared)).collect();
    study.stability = methods.iter().filter(|runs| !runs[0].peer).map(|runs| stability(runs)).collect();
    let kept: Vec<PredictionOutcome> = runs.iter().flat_map(|run| run.predictions.iter().copied()).collect();
    study.predictions = (!kept.is_empty()).then(|| score(&kept));
    study
}

/// Replaces an earlier measurement of the same thing, or adds the new one.
fn replace<T: Clone, K: PartialEq>(list: &mut Vec<T>, new: &T, key: impl Fn(&T) -> K) {
    match list.iter_mut().find(|old| key(old) == key(new)) {
        Some(old) => *old = new.clone(),
        None => list.push(new.clone()),
    }
}

/// The best method of each region, at the longest time that all own methods have had.
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

fn stability(runs: &[&RenderMeasurement]) -> Stability {
    let mut rejected: Vec<(String, u64, String)> = Vec::new();
    for (cause, count, command) in runs.iter().flat_map(|run| &run.rejected) {
        match rejected.iter_mut().find(|(known, ..)| known == cause) {
            Some((_, sum, _)) => *sum += count,
            None => rejected.push((cause.clone(), *count, command.clone())),
        }
    }
    // The longest renders of which there are three: fewer do not tell their spread.
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
    use crate::study::data::ReferenceImage;

    fn run(method: &str, seconds: f64, error: f64, seed: u32) -> Measurement {
        let interval = Interval::of_log(error, 0.05);
        Measurement::Run(Box::new(RenderMeasurement {
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
            ..RenderMeasurement::default()
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
        // 5 % after 4 seconds, measured; 1 % after 100, extrapolated.
        let [five, _, one, _] = &path.prices[..] else { panic!("four prices") };
        assert!(five.measured && five.seconds.is_some_and(|s| (s.value / 4.0).ln().abs() < 0.2));
        assert!(!one.measured && one.seconds.is_some_and(|s| s.holds(100.0)));
        let regions = study.regions.expect("two methods");
        assert_eq!((regions.seconds, regions.winner[7]), (10.0, 0));
        assert!(regions.margin[7] > 1.0);
        assert_eq!(study.stability[0].rejected, [("NaN".to_string(), 12, "render".to_string())]);
        assert_eq!(study.stability[0].paths, 6000);
    }

    /// Bias falls differently from noise, and errors below the reference's own are not part of a curve: neither is extrapolated.
    #[test]
    fn neither_bias_nor_the_error_of_the_reference_is_extrapolated() {
        let changed = |measured: Measurement, change: &dyn Fn(&mut RenderMeasurement)| match measured {
            Measurement::Run(mut run) => {
                change(&mut run);
                Measurement::Run(run)
            }
            other => other,
        };
        let curve = |change: &dyn Fn(&mut RenderMeasurement)| -> Vec<Measurement> {
            let at = |t: f64| run("path", t, 0.1 * t.powf(-0.5), 0);
            [0.1, 1.0, 10.0].map(|t| changed(at(t), change)).into()
        };
        let clean = study(Study::default(), &curve(&|_| {})).methods.remove(0);
        assert!(!clean.biased && clean.prices[2].seconds.is_some());
        let half = curve(&|run| run.noise = run.noise.map(|noise| noise.map(|e| 0.5 * e)));
        let biased = study(Study::default(), &half).methods.remove(0);
        assert!(biased.biased && biased.prices[0].seconds.is_some() && biased.prices[2].seconds.is_none());
        let reference =
            ReferenceImage { relative: [0.05; 3], rel_mse: Some(0.0025), ..ReferenceImage::default() };
        let mut measured = vec![Measurement::Reference(reference)];
        measured.extend(half);
        let short = study(Study::default(), &measured).methods.remove(0);
        // 10 s are below the reference's own 5 %: two points are left, and no bias is known of the third.
        assert!(short.flags.iter().any(|flag| flag.contains("reference")), "{:?}", short.flags);
        assert!(short.points[2].bias.is_none() && short.points[1].bias.is_some());
        assert!(!short.prices[0].measured);
    }

    /// A method that has had longer shows the picture of the time that all methods share.
    #[test]
    fn pictures_side_by_side_are_of_one_time() {
        let seen = |method: &str, t: f64| match run(method, t, 0.1, 0) {
            Measurement::Run(mut run) => {
                (run.picture, run.error_map) = (Some(format!("{method} {t}")), Some(String::new()));
                Measurement::Run(run)
            }
            other => other,
        };
        let measured = [
            seen("path", 1.0),
            seen("path", 3.0),
            seen("path", 30.0),
            seen("photon", 1.0),
            seen("photon", 3.0),
        ];
        let study = study(Study::default(), &measured);
        let pictures: Vec<_> = study.methods.iter().filter_map(|m| m.picture.as_deref()).collect();
        assert_eq!(pictures, ["path 3", "photon 3"]);
    }

    #[test]
    fn nothing_gives_nothing_and_later_measurements_replace_earlier_ones() {
        assert_eq!(study(Study::default(), &[]), Study::default());
        let scheme = |value| {
            let price = crate::study::data::SchemePrice {
                name: "two".to_string(),
                error: Interval::exact(value),
                ..Default::default()
            };
            Measurement::Scheme(price)
        };
        let study = study(Study::default(), &[scheme(1.0), scheme(2.0), Measurement::Unused { ratio: 1.5 }]);
        assert_eq!((study.schemes.len(), study.schemes[0].error.value), (1, 2.0));
        assert_eq!(study.unused_effects, Some(Interval::exact(1.5)));
    }
}
