//! The error of a picture among the figures of its run.

use serde::Serialize;

use super::run_spec::RunSpec;
use crate::scene::desc::IntegratorKind;
use crate::study::curve::{Checkpoint, PowerLaw};
use crate::study::format::{percent, round_percent};
use crate::study::prediction::Prediction;
use crate::study::{ErrorQuantile, ErrorStatus, ErrorTarget, Interval};

/// How wrong the unblurred picture is, each figure with its 90 % interval. Field names are JSON keys.
#[derive(Clone, Debug, Serialize)]
pub struct ErrorReport {
    /// Relative error that half of the picture stays below.
    pub median: Interval,
    /// Relative error that 95 % of the picture stay below.
    pub p95: Interval,
    /// Relative error that 99 % of the picture stay below.
    pub p99: Interval,
    /// Mean of the squared error over the squared luminance plus 0.01.
    pub rel_mse: Interval,
    /// What these figures do not contain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub besides: Option<&'static str>,
    /// The quantile of `target`, `prediction` and `curve`.
    pub quantile: &'static str,
    /// The same quantile.
    #[serde(skip)]
    pub at: ErrorQuantile,
    /// The target, from `--error` or the window.
    pub target: Option<f64>,
    /// The target was reached; a render stops there.
    pub reached: bool,
    /// When the target, or the next round error, would have been reached.
    pub prediction: Option<Prediction>,
    /// Slope of the logarithms of error and samples.
    pub slope: Option<Interval>,
    /// Seconds, paths and error of every checkpoint.
    pub curve: Vec<[f64; 3]>,
}

impl ErrorReport {
    /// The figures of a run that has ended; `None` where there was too little to know anything.
    pub fn new(
        state: &ErrorStatus,
        run: &RunSpec,
        target: Option<ErrorTarget>,
        at: ErrorQuantile,
        reached: bool,
    ) -> Option<Self> {
        state.checkpoints.last()?;
        let [median, p95, p99] = state.held_out.relative;
        Some(Self {
            median,
            p95,
            p99,
            rel_mse: state.held_out.rel_mse,
            besides: (run.integrator == IntegratorKind::Photon).then_some("the blur of photon mapping"),
            quantile: at.share(),
            at,
            target: target.map(|target| target.error),
            reached,
            prediction: state.prediction,
            slope: PowerLaw::new(&state.checkpoints).map(|fit| fit.slope()),
            curve: state
                .checkpoints
                .iter()
                .map(|&Checkpoint { seconds, samples, error, .. }| [seconds, samples, error])
                .collect(),
        })
    }

    /// For the summary of a run.
    pub fn summary(&self) -> String {
        let Interval { value, low, high } = [self.median, self.p95, self.p99][self.at.index()];
        let [value, low, high] = [value, low, high].map(percent);
        let low = low.trim_end_matches(" %");
        let mut text =
            format!("; error {value} or less in {} of the picture (90 %: {low}–{high})", self.quantile);
        if let Some(besides) = self.besides {
            text += &format!(" besides {besides}");
        }
        match self.target {
            Some(_) if self.reached => text += ", as asked for",
            Some(target) => text += &format!(", not the {} that were asked for", round_percent(target)),
            None => {}
        }
        text
    }
}
