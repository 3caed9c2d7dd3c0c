//! Tests of `study::analysis`.

use pointillist::study::analysis::*;
use pointillist::study::brightness::MeanLuminance;
use pointillist::study::data::Study;
use pointillist::study::interval::Interval;
use pointillist::study::measurement::{Measurement, REGIONS, RenderMeasurement};

fn run(method: &str, seconds: f64, error: f64, seed: u32) -> Measurement {
    let interval = Interval::of_log(error, 0.05);
    Measurement::Run(Box::new(RenderMeasurement {
        method: method.to_string(),
        budget: seconds,
        seed,
        seconds,
        samples_per_pixel: 10.0 * seconds,
        paths: 1000,
        size: [64, 64],
        rel_mse: Some(interval.map(|e| e * e)),
        relative: Some([interval; 3]),
        noise: Some(interval.map(|e| 0.9 * e * e)),
        regions: vec![error as f32; REGIONS[0] * REGIONS[1]],
        rejected: vec![("NaN".to_string(), 2, "render".to_string())],
        brightness: vec![
            MeanLuminance { value: 1.0 + 1e-6 * f64::from(seed), paths: 500.0, largest: 1e-6 };
            2
        ],
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
    assert!((bias.value / path.points[2].rel_mse.unwrap_or_default().value - 0.1).abs() < 1e-6);
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

fn changed(measured: Measurement, change: impl Fn(&mut RenderMeasurement)) -> Measurement {
    match measured {
        Measurement::Run(mut run) => {
            change(&mut run);
            Measurement::Run(run)
        }
        other => other,
    }
}

/// A trial of a quarter of the pixels tells the error at four times the samples per pixel in the same time; that its errors are a tenth
/// smaller at equal samples is found from the pictures of full size.
#[test]
fn trials_tell_the_time_to_a_small_error() {
    let mut measured = Vec::new();
    for method in ["path", "bidirectional"] {
        let slower = if method == "path" { 1.0 } else { 2.0 };
        // The error of the picture is 0.5 / √samples per pixel.
        let error = |samples: f64| 0.5 * slower / samples.sqrt();
        for seconds in [1.0, 3.0] {
            measured.push(run(method, seconds, error(10.0 * seconds), 1));
        }
        for seconds in [1.0, 3.0, 9.0, 27.0] {
            let samples = 40.0 * seconds;
            measured.push(changed(run(method, seconds, 0.9 * error(samples), 2), |run| {
                (run.is_trial, run.size, run.samples_per_pixel) = (true, [32, 32], samples);
            }));
        }
    }
    let study = study(Study { size: [64, 64], ..Study::default() }, &measured);
    assert_eq!(study.trial_size, Some([32, 32]));
    let [path, bidirectional] = &study.methods[..] else { panic!("two methods") };
    // 1 % after 2500 samples per pixel, at 10 in a second.
    for (method, seconds) in [(path, 250.0), (bidirectional, 1000.0)] {
        let one = method.prices[2].seconds.expect("a time");
        assert!(one.holds(seconds) && one.high < 3.0 * one.low, "{one:?}");
        assert!(!method.prices[2].measured && method.points.len() == 2);
    }
}

/// A method of which nothing falls has no times, and pictures without samples in some pixels count by what is displayed alone.
#[test]
fn what_is_not_known_is_left_out() {
    let flat: Vec<Measurement> = [0.1, 1.0, 10.0, 100.0].map(|t| run("path", t, 0.1 * t.powf(0.3), 0)).into();
    let flat = study(Study::default(), &flat).methods.remove(0);
    assert!(flat.prices[3].seconds.is_none(), "{:?}", flat.prices);
    let holes = changed(run("path", 0.1, 0.1, 0), |run| {
        (run.relative, run.rel_mse, run.noise, run.flip) = (None, None, None, Some(0.4));
    });
    let seen = study(Study::default(), &[holes, run("path", 1.0, 0.1, 0)]).methods.remove(0);
    assert_eq!(seen.points[0].flip, Some(Interval::exact(0.4)));
    assert!(seen.points[0].rel_mse.is_none() && seen.points[1].rel_mse.is_some());
    assert!(seen.prices[0].seconds.is_some());
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
    let measured =
        [seen("path", 1.0), seen("path", 3.0), seen("path", 30.0), seen("photon", 1.0), seen("photon", 3.0)];
    let study = study(Study::default(), &measured);
    let pictures: Vec<_> = study.methods.iter().filter_map(|m| m.picture.as_deref()).collect();
    assert_eq!(pictures, ["path 3", "photon 3"]);
}

#[test]
fn nothing_gives_nothing_and_later_measurements_replace_earlier_ones() {
    assert_eq!(study(Study::default(), &[]), Study::default());
    let scheme = |value| {
        let price = pointillist::study::data::SchemePrice {
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
