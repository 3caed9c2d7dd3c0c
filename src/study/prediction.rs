//! Predicts the time to a target error while a picture is rendered, and scores past predictions.

use serde::{Deserialize, Serialize};

use crate::study::curve::{Checkpoint, PowerLaw};
use crate::study::data::PredictionScore;
use crate::study::interval::{Interval, Z90};

/// Round relative errors; without a target the next smaller one is predicted.
pub const LADDER: [f64; 12] = [0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002, 0.0001];

/// Standard deviation of the logarithm of the remaining time due to varying machine speed.
pub(super) const SPEED_DEVIATION: f64 = 0.05;

/// Extra standard deviation per e-fold of extrapolation, because a curve is only approximately a power law.
pub(super) const EXTRAPOLATION_DEVIATION: f64 = 0.1;

/// Least ratio of samples between first and last checkpoint for a prediction.
const MIN_RANGE: f64 = 2.0;

/// A prediction of the time to an error. Times are seconds since the render began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// When the prediction was made.
    pub at: f64,
    /// The error at that time.
    pub error: f64,
    /// Target error.
    pub target: f64,
    /// When the target will be reached.
    pub seconds: Interval,
}

/// A prediction and its outcome.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PredictionOutcome {
    /// The prediction.
    pub prediction: Prediction,
    /// When the target was reached; `None` if the render ended before.
    pub reached: Option<f64>,
    /// When the render ended.
    pub ended: f64,
    /// Class of the picture's light; `None` if unknown.
    #[serde(default)]
    pub light: Option<LightClass>,
}

/// Class of a picture's light, as far as it determines the accuracy of error estimates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightClass {
    /// Found by nearly all paths.
    Ordinary,
    /// A large part is found late, or not yet.
    Late,
    /// Part of the error is photon blur.
    Blurred,
}

impl LightClass {
    /// Name for the user.
    pub fn name(self) -> &'static str {
        match self {
            LightClass::Ordinary => "ordinary light",
            LightClass::Late => "light that is found late",
            LightClass::Blurred => "light that is blurred",
        }
    }
}

/// The next of the [round errors](LADDER) below this one.
pub fn next_target(error: f64) -> Option<f64> {
    LADDER.into_iter().find(|target| *target < 0.95 * error)
}

/// Predicts when `target` will be reached; `blurs`: the method has photon blur. `None` until the samples have doubled since the first
/// checkpoint, because light found by few paths is missing from the first errors, and if the error does not decrease.
pub fn predict(checkpoints: &[Checkpoint], target: f64, blurs: bool) -> Option<Prediction> {
    let (last, fit) = (checkpoints.last()?, PowerLaw::new(checkpoints, blurs)?);
    if last.samples < MIN_RANGE * checkpoints.first()?.samples {
        return None;
    }
    let (x, deviation) = fit.until(target)?;
    let x = x.max(0.0);
    // The target counts as reached when a checkpoint says so, and checkpoints are noisy.
    let crossing = last.deviation / fit.slope;
    let spread = (deviation.powi(2) + crossing.powi(2) + (EXTRAPOLATION_DEVIATION * x).powi(2)).sqrt();
    let rate = sampling_rate(checkpoints)?;
    let seconds =
        |x: f64, pace: f64| last.seconds + (last.samples * x.exp() - last.samples).max(0.0) / rate * pace;
    let z = Z90;
    let drift = (z * SPEED_DEVIATION).exp();
    let interval = Interval {
        value: seconds(x, 1.0),
        low: seconds(x - z * spread, 1.0 / drift),
        high: seconds(x + z * spread, drift),
    };
    let finite = interval.high.is_finite();
    finite.then_some(Prediction { at: last.seconds, error: last.error, target, seconds: interval })
}

/// The fitted power law as seconds and errors, through the recent checkpoints and on to `until` seconds; empty before the second
/// checkpoint.
pub fn predicted_curve(checkpoints: &[Checkpoint], until: f64, blurs: bool) -> Vec<[f64; 2]> {
    let (Some(last), Some(fit), Some(rate)) =
        (checkpoints.last(), PowerLaw::new(checkpoints, blurs), sampling_rate(checkpoints))
    else {
        return Vec::new();
    };
    let first = checkpoints.partition_point(|checkpoint| checkpoint.samples < last.samples * CURVE_START);
    let past =
        checkpoints[first..].iter().map(|checkpoint| [checkpoint.seconds, fit.error(checkpoint.samples)]);
    let ahead = (1..=CURVE_POINTS).map(|i| {
        let seconds =
            last.seconds * (until / last.seconds).max(1.0).powf(f64::from(i) / f64::from(CURVE_POINTS));
        [seconds, fit.error(last.samples + rate * (seconds - last.seconds))]
    });
    if checkpoints.len() < 2 { Vec::new() } else { past.chain(ahead).collect() }
}

/// The curve begins at this fraction of the samples, about as far back as a fit reaches.
const CURVE_START: f64 = 0.1;

/// Number of points beyond the last checkpoint.
const CURVE_POINTS: u32 = 16;

/// Samples per second over the last half of the render, since the beginning may have been slower.
fn sampling_rate(checkpoints: &[Checkpoint]) -> Option<f64> {
    let last = checkpoints.last()?;
    let before = checkpoints.iter().rfind(|checkpoint| checkpoint.seconds <= 0.5 * last.seconds);
    let (seconds, samples) = before.map_or((0.0, 0.0), |checkpoint| (checkpoint.seconds, checkpoint.samples));
    let rate = (last.samples - samples) / (last.seconds - seconds);
    (rate.is_finite() && rate > 0.0).then_some(rate)
}

/// Time after `since` at which the error first fell to `target`, interpolated between two checkpoints on logarithmic axes.
pub fn time_reached(checkpoints: &[Checkpoint], target: f64, since: f64) -> Option<f64> {
    let at =
        checkpoints.iter().position(|checkpoint| checkpoint.seconds > since && checkpoint.error <= target)?;
    let after = checkpoints[at];
    let Some(before) = at.checked_sub(1).map(|i| checkpoints[i]) else { return Some(after.seconds) };
    let share = ((before.error / target).ln() / (before.error / after.error).ln()).clamp(0.0, 1.0);
    Some(before.seconds * (after.seconds / before.seconds).powf(share))
}

/// Scores predictions by how often their intervals held. Whether a prediction counts must not depend on its outcome: those count whose
/// interval was over when the render ended, and those of a render that ended because it reached its target. All others are open.
pub fn score(outcomes: &[PredictionOutcome]) -> PredictionScore {
    let mut score = PredictionScore::default();
    let (mut logs, mut timed) = (0.0, 0.0);
    for PredictionOutcome { prediction, reached, ended, .. } in outcomes {
        let over = prediction.seconds.high <= *ended;
        let stopped = reached.is_some_and(|at| at >= 0.999 * ended);
        if !over && !stopped {
            score.open += 1;
            continue;
        }
        score.known += 1;
        score.held += usize::from(reached.is_some_and(|at| prediction.seconds.holds(at)));
        if let Some(at) = reached {
            // Ratios of the remaining time, excluding the time that had passed already.
            let [predicted, actual] = [prediction.seconds.value, *at].map(|t| (t - prediction.at).max(1e-3));
            (logs, timed) = (logs + (predicted / actual).ln(), timed + 1.0);
        }
    }
    score.ratio = if timed > 0.0 { (logs / timed).exp() } else { 1.0 };
    score
}
