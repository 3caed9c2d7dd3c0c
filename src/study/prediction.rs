//! How long until a picture is as good as somebody wants: said while it is rendered, and held against what then happened.

use serde::{Deserialize, Serialize};

use crate::study::curve::{Fit, Look};
use crate::study::data::PredictionScore;
use crate::study::interval::Interval;

/// Relative errors that are predicted where nobody asks for one: the next of these.
pub const LADDER: [f64; 12] = [0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002, 0.0001];

/// Standard deviation of the logarithm of what remains, besides that of the curve: a machine is not always as fast.
const PACE: f64 = 0.05;

/// How much less is known of the curve with every factor e of samples ahead, as a share of the logarithm.
const BEYOND: f64 = 0.1;

/// Samples of the last look over those of the first, before anything is predicted.
const OCTAVE: f64 = 2.0;

/// A prediction. Times are seconds since the render began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// When it was made.
    pub at: f64,
    /// The error then.
    pub error: f64,
    /// The error that it is about.
    pub target: f64,
    /// When that will be reached.
    pub seconds: Interval,
}

/// A prediction and what then happened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    /// What was said.
    pub prediction: Prediction,
    /// When the error was reached; `None` if the render ended before.
    pub reached: Option<f64>,
    /// When the render ended.
    pub ended: f64,
}

/// The next error of the [ladder](LADDER) below this one.
pub fn next_target(error: f64) -> Option<f64> {
    LADDER.into_iter().find(|target| *target < 0.95 * error)
}

/// When `target` will be reached. `None` before the second octave of samples, and where the error does not fall: where light is
/// found by few paths, the first looks have not met it yet, and their errors are too small.
pub fn predict(looks: &[Look], target: f64) -> Option<Prediction> {
    let (last, fit) = (looks.last()?, Fit::new(looks)?);
    if last.samples < OCTAVE * looks.first()?.samples {
        return None;
    }
    let (x, deviation) = fit.until(target)?;
    let x = x.max(0.0);
    // It is reached when it is measured to be, which depends on chance as any look does.
    let crossing = last.deviation / fit.slope;
    let spread = (deviation.powi(2) + crossing.powi(2) + (BEYOND * x).powi(2)).sqrt();
    let rate = pace(looks)?;
    let seconds =
        |x: f64, pace: f64| last.seconds + (last.samples * x.exp() - last.samples).max(0.0) / rate * pace;
    let z = crate::study::interval::Z90;
    let drift = (z * PACE).exp();
    let interval = Interval {
        value: seconds(x, 1.0),
        low: seconds(x - z * spread, 1.0 / drift),
        high: seconds(x + z * spread, drift),
    };
    let finite = interval.high.is_finite();
    finite.then_some(Prediction { at: last.seconds, error: last.error, target, seconds: interval })
}

/// The fitted line as seconds and errors, from the looks that it goes through on to `until` seconds; nothing before the
/// second look.
pub fn course(looks: &[Look], until: f64) -> Vec<[f64; 2]> {
    let (Some(last), Some(fit), Some(rate)) = (looks.last(), Fit::new(looks), pace(looks)) else {
        return Vec::new();
    };
    let first = looks.partition_point(|look| look.samples < last.samples * BACK);
    let past = looks[first..].iter().map(|look| [look.seconds, fit.error(look.samples)]);
    let ahead = (1..=STEPS).map(|i| {
        let seconds = last.seconds * (until / last.seconds).max(1.0).powf(f64::from(i) / f64::from(STEPS));
        [seconds, fit.error(last.samples + rate * (seconds - last.seconds))]
    });
    if looks.len() < 2 { Vec::new() } else { past.chain(ahead).collect() }
}

/// The line is drawn from this share of the samples on: about what a fit reaches back.
const BACK: f64 = 0.1;

/// Steps of the line beyond the last look.
const STEPS: u32 = 16;

/// Samples per second over the last half of the render: the first ones may have been slower, or another method's.
fn pace(looks: &[Look]) -> Option<f64> {
    let last = looks.last()?;
    let before = looks.iter().rfind(|look| look.seconds <= 0.5 * last.seconds);
    let (seconds, samples) = before.map_or((0.0, 0.0), |look| (look.seconds, look.samples));
    let rate = (last.samples - samples) / (last.seconds - seconds);
    (rate.is_finite() && rate > 0.0).then_some(rate)
}

/// When the error first was at `target` after `since` seconds, between two looks by the line through both.
pub fn reached(looks: &[Look], target: f64, since: f64) -> Option<f64> {
    let at = looks.iter().position(|look| look.seconds > since && look.error <= target)?;
    let after = looks[at];
    let Some(before) = at.checked_sub(1).map(|i| looks[i]) else { return Some(after.seconds) };
    let share = ((before.error / target).ln() / (before.error / after.error).ln()).clamp(0.0, 1.0);
    Some(before.seconds * (after.seconds / before.seconds).powf(share))
}

/// How often predictions held. What counts must not depend on what happened: those whose whole time was over when the render
/// ended, and those of a render that ended because the error was reached. All others are open.
pub fn score(kept: &[Kept]) -> PredictionScore {
    let mut score = PredictionScore::default();
    let (mut logs, mut timed) = (0.0, 0.0);
    for Kept { prediction, reached, ended } in kept {
        let over = prediction.seconds.high <= *ended;
        let stopped = reached.is_some_and(|at| at >= 0.999 * ended);
        if !over && !stopped {
            score.open += 1;
            continue;
        }
        score.known += 1;
        score.held += usize::from(reached.is_some_and(|at| prediction.seconds.holds(at)));
        if let Some(at) = reached {
            // Of what remained, not of what had passed already.
            let [said, was] = [prediction.seconds.value, *at].map(|t| (t - prediction.at).max(1e-3));
            (logs, timed) = (logs + (said / was).ln(), timed + 1.0);
        }
    }
    score.ratio = if timed > 0.0 { (logs / timed).exp() } else { 1.0 };
    score
}

#[cfg(test)]
mod tests {
    use super::*;

    fn looks() -> Vec<Look> {
        let look = |i: i32| {
            let samples = 100.0 * 1.3f64.powi(i);
            Look { seconds: samples / 100.0, samples, error: (samples / 100.0).powf(-0.6), deviation: 0.01 }
        };
        (0..12).map(look).collect()
    }

    #[test]
    fn what_is_predicted_comes_true_where_the_curve_is_a_line() {
        let looks = looks();
        let now = looks[7];
        let target = looks[11].error;
        let said = predict(&looks[..8], target).expect("eight looks");
        assert!(said.seconds.holds(looks[11].seconds), "{said:?}");
        assert!(said.seconds.low > now.seconds && said.at == now.seconds);
        let was = reached(&looks, target, now.seconds).expect("it is the last");
        assert!((was - looks[11].seconds).abs() < 1e-9);
        let score = score(&[
            Kept { prediction: said, reached: Some(was), ended: was },
            Kept { prediction: said, reached: None, ended: now.seconds },
            Kept { prediction: said, reached: None, ended: 1e6 },
        ]);
        assert_eq!((score.known, score.held, score.open), (2, 1, 1));
        assert!((score.ratio - 1.0).abs() < 0.1);
    }

    /// An error that was too small at first, because rare light had not been found, is no arrival.
    #[test]
    fn what_was_before_a_prediction_is_no_outcome_of_it() {
        let mut looks = looks();
        looks[1].error = 0.01;
        let (since, target) = (looks[5].seconds, looks[9].error * 1.000_001);
        assert!(reached(&looks, target, 0.0).is_some_and(|at| at < since));
        assert!(reached(&looks, target, since).is_some_and(|at| (at / looks[9].seconds - 1.0).abs() < 1e-3));
    }

    #[test]
    fn the_line_goes_on_to_the_target() {
        let looks = looks();
        let course = course(&looks[..8], looks[11].seconds);
        let [seconds, error] = course[course.len() - 1];
        assert!((seconds / looks[11].seconds - 1.0).abs() < 1e-9);
        assert!((error / looks[11].error - 1.0).abs() < 0.1, "{error} {}", looks[11].error);
        assert!(course.is_sorted_by(|a, b| a[0] <= b[0] && a[1] >= b[1]));
        assert!(super::course(&looks[..1], 9.0).is_empty() && super::course(&[], 9.0).is_empty());
    }

    #[test]
    fn nothing_is_said_before_the_first_look() {
        assert_eq!(predict(&[], 0.01), None);
        assert_eq!(predict(&looks()[..2], 0.01), None);
        assert_eq!(reached(&[], 0.01, 0.0), None);
        assert_eq!(
            (next_target(0.03), next_target(0.0200001), next_target(1e-9)),
            (Some(0.02), Some(0.01), None)
        );
        // What is reached is due now.
        let looks = looks();
        let said = predict(&looks, 2.0).expect("reached long ago");
        assert_eq!(said.seconds.value, looks[11].seconds);
    }
}
