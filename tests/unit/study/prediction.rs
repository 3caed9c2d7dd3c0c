//! Tests of `study::prediction`.

use pointillist::study::curve::Checkpoint;
use pointillist::study::prediction::*;

fn checkpoints() -> Vec<Checkpoint> {
    let checkpoint = |i: i32| {
        let samples = 100.0 * 1.3f64.powi(i);
        Checkpoint { seconds: samples / 100.0, samples, error: (samples / 100.0).powf(-0.6), deviation: 0.01 }
    };
    (0..12).map(checkpoint).collect()
}

#[test]
fn predictions_hold_where_the_error_is_a_power_law() {
    let checkpoints = checkpoints();
    let now = checkpoints[7];
    let target = checkpoints[11].error;
    let said = predict(&checkpoints[..8], target, false).expect("eight checkpoints");
    assert!(said.seconds.holds(checkpoints[11].seconds), "{said:?}");
    assert!(said.seconds.low > now.seconds && said.at == now.seconds);
    let was = time_reached(&checkpoints, target, now.seconds).expect("it is the last");
    assert!((was - checkpoints[11].seconds).abs() < 1e-9);
    let score = score(&[
        PredictionOutcome {
            prediction: said,
            reached: Some(was),
            ended: was,
            light: Some(LightClass::Ordinary),
        },
        PredictionOutcome {
            prediction: said,
            reached: None,
            ended: now.seconds,
            light: Some(LightClass::Ordinary),
        },
        PredictionOutcome { prediction: said, reached: None, ended: 1e6, light: Some(LightClass::Ordinary) },
    ]);
    assert_eq!((score.known, score.held, score.open), (2, 1, 1));
    assert!((score.ratio - 1.0).abs() < 0.1);
}

/// An error that was too small at first, because rare light had not been found, does not count as reached.
#[test]
fn only_times_after_a_prediction_are_its_outcome() {
    let mut checkpoints = checkpoints();
    checkpoints[1].error = 0.01;
    let (since, target) = (checkpoints[5].seconds, checkpoints[9].error * 1.000_001);
    assert!(time_reached(&checkpoints, target, 0.0).is_some_and(|at| at < since));
    assert!(
        time_reached(&checkpoints, target, since)
            .is_some_and(|at| (at / checkpoints[9].seconds - 1.0).abs() < 1e-3)
    );
}

#[test]
fn the_predicted_curve_continues_to_the_target() {
    let checkpoints = checkpoints();
    let course = predicted_curve(&checkpoints[..8], checkpoints[11].seconds, false);
    let [seconds, error] = course[course.len() - 1];
    assert!((seconds / checkpoints[11].seconds - 1.0).abs() < 1e-9);
    assert!((error / checkpoints[11].error - 1.0).abs() < 0.1, "{error} {}", checkpoints[11].error);
    assert!(course.is_sorted_by(|a, b| a[0] <= b[0] && a[1] >= b[1]));
    assert!(
        pointillist::study::prediction::predicted_curve(&checkpoints[..1], 9.0, false).is_empty()
            && pointillist::study::prediction::predicted_curve(&[], 9.0, false).is_empty()
    );
}

#[test]
fn nothing_is_predicted_before_the_first_checkpoint() {
    assert_eq!(predict(&[], 0.01, false), None);
    assert_eq!(predict(&checkpoints()[..2], 0.01, false), None);
    assert_eq!(time_reached(&[], 0.01, 0.0), None);
    assert_eq!(
        (next_target(0.03), next_target(0.0200001), next_target(1e-9)),
        (Some(0.02), Some(0.01), None)
    );
    // A target that is reached already is due now.
    let checkpoints = checkpoints();
    let said = predict(&checkpoints, 2.0, false).expect("reached long ago");
    assert_eq!(said.seconds.value, checkpoints[11].seconds);
}
