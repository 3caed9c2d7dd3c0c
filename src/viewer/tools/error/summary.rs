//! The error of the picture as the panel states it: from the observer to texts and curves.

use crate::accounting::observer::Observer;
use crate::image::stereo::Eye;
use crate::render::method;
use crate::render::run_spec::RunSpec;
use crate::scene::desc::IntegratorKind;
use crate::study::format::{duration, percent, remaining, round_percent};
use crate::study::prediction::{predicted_curve, time_reached};
use crate::study::{ErrorEstimate, ErrorQuantile, ErrorStatus, Interval, TileSubset, joint_estimate};

/// The relative error of the picture: now, so far, and predicted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ErrorSummary {
    /// Median, 95 % and 99 % quantiles of the error with their 90 % intervals, as text. `None` before the first checkpoint.
    pub quantiles: Option<[[String; 2]; 3]>,
    /// Error of the denoised picture (95 % quantile) as text; `None` if the picture is not denoised.
    pub filtered: Option<String>,
    /// `[seconds, error]` of every checkpoint; error at the 95 % quantile.
    pub checkpoints: Vec<[f64; 2]>,
    /// The fitted line, extended to the target: `[seconds, error]`.
    pub fit: Vec<[f64; 2]>,
    /// Predicted time at which the target is reached, in seconds since the render began, and the ends of its 90 % interval.
    pub prediction: Option<[f64; 3]>,
    /// The prediction as text, or why there is none.
    pub message: String,
    /// Why the error is unreliable.
    pub warning: Option<String>,
    /// Light missing from the picture and included in the error, if significant.
    pub unfound: Option<UnfoundSummary>,
    /// Seconds since the render began.
    pub seconds: f64,
}

/// Light missing from the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct UnfoundSummary {
    /// Amount and kind, as text.
    pub text: String,
    /// Name of a method that finds it, if any.
    pub method: Option<&'static str>,
}

/// The error of the picture for the panel. `ended`: the render has ended. `filtered`: error estimate of the denoised picture, if that is
/// displayed.
pub fn error_summary(
    observer: &Observer,
    run: &RunSpec,
    target: f64,
    ended: bool,
    filtered: Option<Option<&ErrorEstimate>>,
) -> ErrorSummary {
    let state = observer.state();
    let filtered = filtered.map(|error| filtered_words(error.filter(|_| run.states_filtered_error(&state))));
    let seconds = observer.elapsed().as_secs_f64();
    ErrorSummary { filtered, ..summary(&state, target, seconds, ended, run.is_blurred()) }
}

/// The errors of the pictures of the left and of the right eye, and of both together, in words that follow the error of the `worse` one; `None`
/// before the first checkpoint of each.
pub fn eye_words(worse: Eye, states: [&ErrorStatus; 2]) -> Option<String> {
    if states.iter().any(|state| state.checkpoints.is_empty()) {
        return None;
    }
    let at = ErrorQuantile::P95.index();
    let [left, right] = states.map(|state| percent(state.estimate.relative[at].value));
    let [both, interval] = in_words(joint_estimate(states, TileSubset::All).relative[at]);
    let worse = worse.name();
    Some(format!(
        "That is the {worse} eye's picture, the worse one. Left {left}, right {right}, both {both} ({interval})"
    ))
}

fn filtered_words(error: Option<&ErrorEstimate>) -> String {
    match error.map(|error| in_words(error.relative[ErrorQuantile::P95.index()])) {
        Some([value, interval]) => format!("{value} ({interval}) through the noise filter"),
        None => "The error through the noise filter is not known".to_owned(),
    }
}

/// The error for the panel, `seconds` after the render began.
fn summary(state: &ErrorStatus, target: f64, seconds: f64, ended: bool, blurs: bool) -> ErrorSummary {
    let Some(last) = state.checkpoints.last() else {
        let message = "not known yet: after 4 samples per pixel".to_owned();
        return ErrorSummary { message, seconds, ..ErrorSummary::default() };
    };
    let error = state.estimate.relative[ErrorQuantile::P95.index()].value;
    let said = state.prediction.filter(|said| said.target == target && !ended);
    let goal = round_percent(target);
    let message = match said {
        _ if error <= target => {
            let at = time_reached(&state.checkpoints, target, f64::NEG_INFINITY).unwrap_or(last.seconds);
            format!("{goal} reached after {}", duration(at))
        }
        Some(said) if said.seconds.high > seconds => {
            format!("{goal} in about {}", remaining(seconds, said.seconds))
        }
        Some(_) => format!("{goal} is due"),
        None if ended => format!("the render ended before {goal}"),
        None => format!("{goal}: not known when"),
    };
    let until = said.map_or(last.seconds, |said| said.seconds.value);
    ErrorSummary {
        quantiles: Some(state.estimate.relative.map(in_words)),
        filtered: None,
        checkpoints: state.checkpoints.iter().map(|c| [c.seconds, c.error]).collect(),
        fit: predicted_curve(&state.checkpoints, until, blurs),
        prediction: said.map(|said| [said.seconds.value, said.seconds.low, said.seconds.high]),
        message,
        unfound: state.late.unfound().map(|text| UnfoundSummary {
            text,
            method: state.late.kind().and_then(method::that_finds).map(IntegratorKind::name),
        }),
        warning: state.late.warning(),
        seconds,
    }
}

/// Value and interval: `2.31 %` and `2.19–2.44 %`.
fn in_words(figure: Interval) -> [String; 2] {
    let [value, low, high] = [figure.value, figure.low, figure.high].map(percent);
    [value, format!("{}–{high}", low.trim_end_matches(" %"))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::curve::Checkpoint;
    use crate::study::prediction::Prediction;

    fn state() -> ErrorStatus {
        let checkpoint = |i: i32| {
            let samples = 1e5 * 1.25f64.powi(i);
            Checkpoint {
                seconds: samples / 1e5,
                samples,
                error: 0.1 * (samples / 1e5).powf(-0.6),
                deviation: 0.02,
            }
        };
        let checkpoints: Vec<Checkpoint> = (0..8).map(checkpoint).collect();
        let error = checkpoints[7].error;
        let seconds = Interval { value: 52.0, low: 46.0, high: 65.0 };
        ErrorStatus {
            estimate: ErrorEstimate { relative: [Interval::exact(error); 3], ..ErrorEstimate::default() },
            prediction: Some(Prediction { at: checkpoints[7].seconds, error, target: 0.01, seconds }),
            checkpoints,
            ..ErrorStatus::default()
        }
    }

    #[test]
    fn both_eyes_are_told() {
        let left = ErrorStatus { map: (2, vec![0.02; 4]), ..state() };
        let right = ErrorStatus { map: (2, vec![0.03; 4]), ..state() };
        let said = eye_words(Eye::Right, [&left, &right]).expect("checkpoints");
        let value = percent(left.estimate.relative[1].value);
        assert!(said.starts_with("That is the right eye's picture, the worse one."), "{said}");
        assert!(said.contains(&format!("Left {value}, right {value}, both 3.0")), "{said}");
        assert_eq!(eye_words(Eye::Left, [&left, &ErrorStatus::default()]), None);
    }

    #[test]
    fn the_panel_says_what_is_known() {
        let nothing = summary(&ErrorStatus::default(), 0.01, 0.5, false, false);
        assert_eq!(
            (nothing.message.as_str(), nothing.quantiles),
            ("not known yet: after 4 samples per pixel", None)
        );
        let state = state();
        let said = summary(&state, 0.01, 10.0, false, false);
        assert_eq!(said.message, "1 % in about 42 s (90 %: 36–55 s)");
        assert_eq!((said.prediction, said.checkpoints.len()), (Some([52.0, 46.0, 65.0]), 8));
        assert!((said.fit[said.fit.len() - 1][0] - 52.0).abs() < 1e-9);
        assert_eq!(summary(&state, 0.01, 70.0, false, false).message, "1 % is due");
        assert_eq!(summary(&state, 0.01, 70.0, true, false).message, "the render ended before 1 %");
        assert_eq!(summary(&state, 0.1, 10.0, false, false).message, "10 % reached after 1.0 s");
        // Until the observer takes over the new target.
        assert_eq!(summary(&state, 0.005, 10.0, false, false).message, "0.5 %: not known when");
    }
}
