//! Statistics of a run, and of the error of its picture.

use std::path::PathBuf;

use serde::Serialize;

use crate::client::Denoise;
use crate::render::adaptive::AdaptiveReport;
use crate::render::effect_plan::PlannedEffect;
use crate::render::figures::{Seconds, human};
use crate::render::light_groups::LightGroupReport;
use crate::render::rejected::RejectedReport;
use crate::render::run_spec::{ChoiceReport, RunSpec};
use crate::render::stereo_error::EyeErrors;
use crate::scene::desc::PhotonUse;
use crate::study::curve::PowerLaw;
use crate::study::format::{percent, round_percent};
use crate::study::prediction::Prediction;
use crate::study::{ErrorEstimate, ErrorQuantile, ErrorStatus, ErrorTarget, Interval, LateLight};

/// Report of a finished run. Field names are JSON keys.
#[derive(Clone, Debug, Serialize)]
pub struct RenderReport {
    pub version: &'static str,
    pub scene: PathBuf,
    pub width: u32,
    pub height: u32,
    pub integrator: &'static str,
    /// Reason for the method, if the choice was automatic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub auto: Option<ChoiceReport>,
    /// Every effect, on or off, and why.
    pub plan: Vec<PlannedEffect>,
    /// Effects that were forced off.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<&'static str>,
    /// Result of `--check-plan`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plan_check: Option<PlanCheck>,
    pub camera_samples: u64,
    pub light_samples: u64,
    pub camera_paths: u64,
    pub light_paths: u64,
    /// Paths (camera, light, or pairs of both) per texel of the film, overscan included.
    pub samples_per_pixel: f64,
    /// Paths per second of rendering.
    pub samples_per_second: f64,
    /// Paths per second of one tracer thread's tracing time.
    pub paths_per_trace_second: f64,
    pub seconds: Seconds,
    /// Error of the picture; `None` if the run was not divided into replicates, and with two eyes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<ErrorReport>,
    /// Errors of the pictures of two eyes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub eyes: Option<EyeErrors>,
    /// Distribution of camera paths by adaptive sampling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<AdaptiveReport>,
    /// Light groups with layers in the files.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub light_groups: Vec<LightGroupReport>,
    /// Values that were negative or not finite, by cause and origin.
    pub rejected: RejectedReport,
    /// Fraction of the light that firefly reweighting withholds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub withheld: Option<f64>,
    /// The device that rasterised the picture.
    pub device: String,
    /// Name and version of its driver; `None` on the CPU.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub driver: Option<String>,
    pub threads: usize,
    /// SIMD instruction set of the ray traversal. The picture does not depend on it.
    pub simd: &'static str,
    pub seed: u32,
    /// Samples were rasterised in index order.
    pub deterministic: bool,
    /// Ctrl-C ended the run early.
    pub interrupted: bool,
    /// Largest resident memory in bytes, if the system reports it.
    pub peak_memory_bytes: Option<u64>,
    pub warnings: Vec<String>,
    pub outputs: Vec<PathBuf>,
}

/// Result of `--check-plan`: comparison of specialised and general code.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PlanCheck {
    /// Paths that were traced twice.
    pub paths: u64,
    /// Paths whose samples differ by rounding, where the arithmetic differs by design.
    pub different: u64,
}

impl RenderReport {
    /// A summary of the run in one line.
    pub fn summary(&self) -> String {
        let mut line = format!(
            "{}×{}, {}, {:.1} samples per pixel in {:.1} s ({} paths/s; {} per tracing second), {}",
            self.width,
            self.height,
            self.integrator,
            self.samples_per_pixel,
            self.seconds.render,
            human(self.samples_per_second),
            human(self.paths_per_trace_second),
            self.device
        );
        if let Some(PlanCheck { paths, different }) = self.plan_check {
            line.push_str(&format!("; plan checked on {paths} paths"));
            if different > 0 {
                line.push_str(&format!(" ({different} differ by a rounding)"));
            }
        }
        if !self.left_out.is_empty() {
            line.push_str(&format!("; without {}", self.left_out.join(", ")));
        }
        if let Some(AdaptiveReport { density: [least, _, most], .. }) = self.adaptive {
            line.push_str(&format!(
                "; adaptive, {least:.2} to {most:.2} times the mean density of camera paths"
            ));
        }
        if let Some(error) = &self.error {
            line.push_str(&error.summary());
        }
        if let Some(eyes) = &self.eyes {
            line.push_str(&eyes.summary());
        }
        if let Some(withheld) = self.withheld {
            line.push_str(&format!(
                "; fireflies reweighted: the picture lacks {} of the light",
                percent(withheld)
            ));
        }
        if self.interrupted {
            line.push_str("; stopped by Ctrl-C, the picture holds what was there");
        }
        if let Some(rejected) = self.rejected.summary() {
            line.push_str(&format!("; {rejected}"));
        }
        line
    }
}

/// Fraction of the squared error from which on the photon blur is reported.
const WORTH_TELLING: f64 = 0.01;

/// Error of the picture before reconstruction, each value with its 90 % interval. Field names are JSON keys.
#[derive(Clone, Debug, Serialize)]
pub struct ErrorReport {
    /// Median relative error over the picture.
    pub median: Interval,
    /// 95th percentile of the relative error over the picture.
    pub p95: Interval,
    /// 99th percentile of the relative error over the picture.
    pub p99: Interval,
    /// Mean of the squared error over the squared luminance plus 0.01.
    pub rel_mse: Interval,
    /// Concentration of the light in single samples, and light that only other methods find.
    pub light: LateLight,
    /// Fraction of the squared error due to photon blur, which the values include; for methods with photons, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blur: Option<f64>,
    /// Light missing from the picture and included in the values, if significant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unfound: Option<String>,
    /// Why the values are unreliable, if light is still being found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warning: Option<String>,
    /// Error of the denoised picture, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub denoised: Option<ErrorIntervals>,
    /// Errors not included in these values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub besides: Option<&'static str>,
    /// Name of the quantile of `target`, `prediction` and `curve`.
    pub quantile: &'static str,
    /// The same quantile as an enum value.
    #[serde(skip)]
    pub at: ErrorQuantile,
    /// Error target, from `--error` or the window.
    pub target: Option<f64>,
    /// Whether the target was reached, at which a render stops.
    pub reached: bool,
    /// Predicted time to the target, or to the next round error.
    pub prediction: Option<Prediction>,
    /// Slope of log error over log samples.
    pub slope: Option<Interval>,
    /// `[seconds, paths, error]` of every checkpoint.
    pub curve: Vec<[f64; 3]>,
}

/// Errors as in [`ErrorReport`]: of the denoised picture, excluding bias common to both randomisations (they are not stated if there is any), or of the
/// pictures of both eyes together.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ErrorIntervals {
    pub median: Interval,
    pub p95: Interval,
    pub p99: Interval,
    pub rel_mse: Interval,
}

impl From<&ErrorEstimate> for ErrorIntervals {
    fn from(error: &ErrorEstimate) -> Self {
        let [median, p95, p99] = error.relative;
        Self { median, p95, p99, rel_mse: error.rel_mse }
    }
}

impl ErrorIntervals {
    /// The error at a quantile.
    pub fn at(&self, quantile: ErrorQuantile) -> Interval {
        [self.median, self.p95, self.p99][quantile.index()]
    }
}

impl ErrorReport {
    /// Values of a finished run that displays its picture with this noise filter; `None` if there were too few samples.
    pub fn new(
        state: &ErrorStatus,
        run: &RunSpec,
        target: Option<ErrorTarget>,
        at: ErrorQuantile,
        reached: bool,
        filter: Denoise,
    ) -> Option<Self> {
        state.checkpoints.last()?;
        let [median, p95, p99] = state.held_out.relative;
        Some(Self {
            median,
            p95,
            p99,
            rel_mse: state.held_out.rel_mse,
            light: state.late,
            blur: state.blur,
            denoised: None,
            unfound: state.late.unfound(),
            warning: state.late.warning(),
            besides: match run.integrator.traits().photons {
                _ if run.reweighted.is_some() => Some("the reweighting of fireflies"),
                _ if filter != Denoise::Off => Some("the noise filter, of the picture without it"),
                _ if state.blur.is_some() => None,
                PhotonUse::Gathered => Some("the blur of photon mapping"),
                PhotonUse::Merged if run.photons.caustics => Some("the blur of merged photons"),
                _ => None,
            },
            quantile: at.share(),
            at,
            target: target.map(|target| target.error),
            reached,
            prediction: state.prediction,
            slope: PowerLaw::new(&state.checkpoints, run.is_blurred()).map(|fit| fit.slope()),
            curve: state.checkpoints.iter().map(|c| [c.seconds, c.samples, c.error]).collect(),
        })
    }

    /// Adds the error of the denoised picture.
    pub fn with_filtered(self, filtered: Option<&ErrorEstimate>) -> Self {
        Self { denoised: filtered.map(ErrorIntervals::from), ..self }
    }

    /// Part of the run's summary about the error.
    pub fn summary(&self) -> String {
        let Interval { value, low, high } = [self.median, self.p95, self.p99][self.at.index()];
        let [value, low, high] = [value, low, high].map(percent);
        let low = low.trim_end_matches(" %");
        let mut text =
            format!("; error {value} or less in {} of the picture (90 %: {low}–{high})", self.quantile);
        if let Some(besides) = self.besides {
            text += &format!(" besides {besides}");
        }
        if let Some(denoised) = &self.denoised {
            let Interval { value, low, high } = denoised.at(self.at);
            let [value, low, high] = [value, low, high].map(percent);
            text +=
                &format!(", {value} through the noise filter (90 %: {}–{high})", low.trim_end_matches(" %"));
        }
        match self.target {
            Some(_) if self.reached => text += ", as asked for",
            Some(target) => text += &format!(", not the {} that were asked for", round_percent(target)),
            None => {}
        }
        if let Some(blur) = self.blur.filter(|blur| *blur > WORTH_TELLING) {
            text += &format!("; the blur of photons is {} of the mean squared error", percent(blur));
        }
        for more in self.unfound.iter().chain(&self.warning) {
            text += &format!("; {more}");
        }
        text += &format!("; the largest sample carries {} of the light", percent(self.light.largest.one));
        text
    }
}
