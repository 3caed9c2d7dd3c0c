//! The figures of a run, and of the error of its picture.

use std::path::PathBuf;

use serde::Serialize;

use crate::client::Denoise;
use crate::render::adaptive::AdaptiveReport;
use crate::render::effect_plan::PlannedEffect;
use crate::render::figures::{Seconds, human};
use crate::render::light_groups::LightGroupReport;
use crate::render::rejected::RejectedReport;
use crate::render::run_spec::{ChoiceReport, RunSpec};
use crate::scene::desc::IntegratorKind;
use crate::study::curve::PowerLaw;
use crate::study::format::{percent, round_percent};
use crate::study::prediction::Prediction;
use crate::study::{ErrorEstimate, ErrorQuantile, ErrorStatus, ErrorTarget, Interval, LateLight};

/// Everything that is said about a finished run. The names of the fields are the keys in JSON.
#[derive(Clone, Debug, Serialize)]
pub struct RenderReport {
    pub version: &'static str,
    pub scene: PathBuf,
    pub width: u32,
    pub height: u32,
    pub integrator: &'static str,
    /// The reason for the method, if the program chose it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub auto: Option<ChoiceReport>,
    /// Every effect, on or off, and why.
    pub plan: Vec<PlannedEffect>,
    /// Effects that were forced off.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<&'static str>,
    /// What `--check-plan` has found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plan_check: Option<PlanCheck>,
    pub camera_samples: u64,
    pub light_samples: u64,
    pub camera_paths: u64,
    pub light_paths: u64,
    /// Paths (from either end, or pairs) per texel of the film, overscan included.
    pub samples_per_pixel: f64,
    /// Paths per second of rendering.
    pub samples_per_second: f64,
    /// Paths per second that one tracer thread spent tracing.
    pub paths_per_trace_second: f64,
    pub seconds: Seconds,
    /// The error of the picture. It is unknown if the run was not divided into replicates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<ErrorReport>,
    /// Where adaptive sampling has placed camera paths.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<AdaptiveReport>,
    /// The groups of lights of which the files have layers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub light_groups: Vec<LightGroupReport>,
    /// Values that were not numbers from 0 on, by cause and origin.
    pub rejected: RejectedReport,
    /// Share of the light that the picture lacks because fireflies were reweighted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub withheld: Option<f64>,
    /// The device that rasterised the picture.
    pub device: String,
    pub threads: usize,
    /// Instructions that traced the rays. The picture does not depend on them.
    pub simd: &'static str,
    pub seed: u32,
    /// Samples were rasterised in index order.
    pub deterministic: bool,
    /// Ctrl-C ended the run early.
    pub interrupted: bool,
    /// Largest resident memory in bytes, where the system tells.
    pub peak_memory_bytes: Option<u64>,
    pub warnings: Vec<String>,
    pub outputs: Vec<PathBuf>,
}

/// Result of `--check-plan`: paths traced by special and by general code.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PlanCheck {
    /// Paths that were traced twice.
    pub paths: u64,
    /// Paths whose samples differ by a rounding, where the arithmetic differs by design.
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

/// Share of the squared error from which it is worth telling that it is blur.
const WORTH_TELLING: f64 = 0.01;

/// The error of the unblurred picture, each figure with its 90 % interval. The names of the fields are the keys in JSON.
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
    /// How much of the light single samples carry, and what other methods find more.
    pub light: LateLight,
    /// The share of the squared error that is the blur of photons, which the figures count; of the methods that blur, where it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blur: Option<f64>,
    /// What the picture lacks and the figures count, if it is worth telling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unfound: Option<String>,
    /// Why the figures cannot be trusted, if light is still being found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warning: Option<String>,
    /// The error of the picture through the noise filter, if it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub denoised: Option<DenoisedError>,
    /// What these figures do not contain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub besides: Option<&'static str>,
    /// The quantile of `target`, `prediction` and `curve`.
    pub quantile: &'static str,
    /// The same quantile as a value.
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

/// The error of the picture through the noise filter, as in [`ErrorReport`], but for bias that both randomisations share: it is not stated where there is some.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DenoisedError {
    pub median: Interval,
    pub p95: Interval,
    pub p99: Interval,
    pub rel_mse: Interval,
}

impl ErrorReport {
    /// The figures of a run that has ended and shows its picture through this noise filter; `None` where there was too little to know
    /// anything.
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
            besides: match run.integrator {
                _ if run.reweighted.is_some() => Some("the reweighting of fireflies"),
                _ if filter != Denoise::Off => Some("the noise filter, of the picture without it"),
                _ if state.blur.is_some() => None,
                IntegratorKind::Photon => Some("the blur of photon mapping"),
                IntegratorKind::Vcm if run.photons.caustics => Some("the blur of merged photons"),
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

    /// The same with the error of the picture through the noise filter.
    pub fn with_filtered(self, filtered: Option<&ErrorEstimate>) -> Self {
        let denoised = |error: &ErrorEstimate| {
            let [median, p95, p99] = error.relative;
            DenoisedError { median, p95, p99, rel_mse: error.rel_mse }
        };
        Self { denoised: filtered.map(denoised), ..self }
    }

    /// The part of the summary of a run that tells the error.
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
            let Interval { value, low, high } =
                [denoised.median, denoised.p95, denoised.p99][self.at.index()];
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
