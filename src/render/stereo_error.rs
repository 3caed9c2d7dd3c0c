//! The stated error of the pictures of two eyes, in the report of a run and in the metadata of its files.

use serde::Serialize;

use crate::render::report::{ErrorIntervals, ErrorReport};
use crate::render::run_spec::RunEnd;
use crate::study::format::percent;
use crate::study::interval::Interval;
use crate::study::{ErrorQuantile, ErrorStatus, TileSubset, joint_estimate};

/// Errors of the pictures of both eyes. Field names are JSON keys.
#[derive(Clone, Debug, Serialize)]
pub struct EyeErrors {
    /// Error of the left eye's picture.
    pub left: ErrorReport,
    /// Error of the right eye's picture.
    pub right: ErrorReport,
    /// Error of both pictures together: quantiles over the tiles of both, and the mean of relMSE. The intervals are those of fully correlated
    /// errors.
    pub both: ErrorIntervals,
}

impl EyeErrors {
    /// The errors by the reports and states of the left and of the right eye's picture; `None` if there were too few samples for one of them.
    pub fn new(reports: [Option<ErrorReport>; 2], states: [&ErrorStatus; 2]) -> Option<Self> {
        let [left, right] = reports;
        let (left, right) = (left?, right?);
        let both = ErrorIntervals::from(&joint_estimate(states, subset(left.target.is_some())));
        Some(Self { left, right, both })
    }

    /// Part of the run's summary about the errors.
    pub fn summary(&self) -> String {
        let of_eye = |error: &ErrorReport| error.summary().trim_start_matches("; ").to_owned();
        let at = self.left.at;
        let [rel_mse, low, high] = [self.both.rel_mse.value, self.both.rel_mse.low, self.both.rel_mse.high];
        format!(
            "; left eye: {}; right eye: {}; both eyes: error {}, relMSE {rel_mse:.2e} (90 %: {low:.2e}–{high:.2e})",
            of_eye(&self.left),
            of_eye(&self.right),
            in_words(self.both.at(at), at),
        )
    }
}

/// The tiles whose error is stated.
fn subset(has_target: bool) -> TileSubset {
    if has_target { TileSubset::HeldOut } else { TileSubset::All }
}

/// The error of both pictures at a quantile.
fn in_words(error: Interval, at: ErrorQuantile) -> String {
    let [value, low, high] = [error.value, error.low, error.high].map(percent);
    let (low, share) = (low.trim_end_matches(" %"), at.share());
    format!(
        "{value} or less in {share} of both pictures (90 %: {low}–{high}, as for fully correlated errors of the eyes)"
    )
}

/// Outcome of a run for two eyes, for the metadata of its files.
#[derive(Clone, Debug)]
pub struct StereoEnd {
    /// For the pictures of the left and of the right eye.
    pub eyes: [RunEnd; 2],
    /// For pictures that are composed of both.
    pub both: RunEnd,
}

impl StereoEnd {
    /// The outcome of a run with the states of the left and of the right eye's picture, if they are known. `has_target`: the run stops at an
    /// error.
    pub fn new(
        outcome: RunEnd,
        states: Option<[&ErrorStatus; 2]>,
        has_target: bool,
        at: ErrorQuantile,
    ) -> Self {
        let known = states.filter(|states| states.iter().all(|status| !status.checkpoints.is_empty()));
        let Some(states) = known else {
            return Self { eyes: [outcome.clone(), outcome.clone()], both: outcome };
        };
        let mut eyes = states.map(|status| {
            let mut eye = outcome.clone();
            eye.describe(status, at);
            eye
        });
        // Views of one file inherit the attributes of the first that they do not have themselves.
        let names: Vec<&'static str> = eyes[1].notes.iter().map(|(name, _)| *name).collect();
        complete(&mut eyes[0], &names);
        let names: Vec<&'static str> = eyes[0].notes.iter().map(|(name, _)| *name).collect();
        complete(&mut eyes[1], &names);
        let [left, right] = &eyes;
        let compared = left.notes.iter().map(|(name, of_left)| {
            let of_right = right.notes.iter().find(|(other, _)| other == name);
            let of_right = of_right.map_or(NONE, |(_, note)| note);
            (*name, format!("left eye: {of_left}; right eye: {of_right}"))
        });
        let mut both = RunEnd { notes: compared.collect(), ..outcome };
        let joint = ErrorIntervals::from(&joint_estimate(states, subset(has_target)));
        let note = in_words(joint.at(at), at);
        for end in eyes.iter_mut().chain([&mut both]) {
            end.notes.push(("errorOfBothEyes", note.clone()));
        }
        Self { eyes, both }
    }
}

impl StereoEnd {
    /// As `self`, after this change of the outcome for every picture.
    pub fn with(mut self, change: impl Fn(&mut RunEnd)) -> Self {
        self.eyes.iter_mut().chain([&mut self.both]).for_each(change);
        self
    }
}

/// What a note says that only the other eye's picture has.
const NONE: &str = "none";

/// Adds the notes of these names that `end` lacks.
fn complete(end: &mut RunEnd, names: &[&'static str]) {
    for name in names {
        if end.notes.iter().all(|(known, _)| known != name) {
            end.notes.push((*name, NONE.to_owned()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::LateLight;
    use crate::study::curve::Checkpoint;

    fn status(missing: Option<f64>) -> ErrorStatus {
        let late = LateLight { missing, ..LateLight::default() };
        ErrorStatus { checkpoints: vec![Checkpoint::default()], late, ..ErrorStatus::default() }
    }

    fn names(end: &RunEnd) -> Vec<&'static str> {
        end.notes.iter().map(|(name, _)| *name).collect()
    }

    /// A warning that one eye alone has is not taken for one of the other, whose view of an EXR file would inherit it.
    #[test]
    fn views_have_the_same_notes() {
        let outcome = RunEnd { prefix: true, ..RunEnd::default() };
        for states in [[status(Some(0.2)), status(None)], [status(None), status(Some(0.2))]] {
            let end = StereoEnd::new(outcome.clone(), Some(states.each_ref()), false, ErrorQuantile::P95);
            let [left, right] = &end.eyes;
            let mut sorted = [names(left), names(right), names(&end.both)];
            sorted.iter_mut().for_each(|names| names.sort_unstable());
            assert_eq!(sorted[0], ["error", "errorOfBothEyes", "largestSample", "unfound"]);
            assert!(sorted[0] == sorted[1] && sorted[1] == sorted[2], "{sorted:?}");
            let unfound = end.eyes.iter().flat_map(|eye| &eye.notes).filter(|(name, _)| *name == "unfound");
            assert_eq!(unfound.filter(|(_, note)| note == NONE).count(), 1);
            let composed = end.both.notes.iter().find(|(name, _)| *name == "unfound");
            assert!(composed.is_some_and(|(_, note)| {
                note.starts_with("left eye: ") && note.contains("; right eye: ") && note.contains(NONE)
            }));
        }
        let unknown = StereoEnd::new(outcome, None, false, ErrorQuantile::P95);
        assert!(unknown.both.prefix && unknown.both.notes.is_empty() && unknown.eyes[1].notes.is_empty());
    }
}
