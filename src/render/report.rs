//! The figures of a run, and of the error of its picture, for people and for `--json`.

use std::io::Write;
use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Result, WrapErr};
use serde::Serialize;

use crate::client::Denoise;
use crate::image::write::{atomically, check_place, same_file};
use crate::math::quantile::nearest_rank;
use crate::render::adaptive::AdaptiveReport;
use crate::render::light_groups::LightGroupReport;
use crate::render::plan::PlannedEffect;
use crate::render::process::tell;
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

/// Seconds by stage; wall clock, except `trace`.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    pub load: f64,
    /// Building the acceleration structure and tables.
    pub prepare: f64,
    /// Choosing the method, with `--integrator auto`.
    pub choose: f64,
    /// Opening the device; runs beside `load` and `prepare`.
    pub open_device: f64,
    /// From the render command to the last sample on the film.
    pub render: f64,
    /// Time the tracer threads spent tracing, added up.
    pub trace: f64,
    /// Time the client spent taking samples and rasterising, part of `render`.
    pub rasterise: f64,
    /// Mips, reconstruction and tone mapping of the picture.
    pub display: f64,
    /// Features and noise filter.
    pub denoise: f64,
    /// Reading back and writing files.
    pub write: f64,
    /// From the start of the program.
    pub total: f64,
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

/// Percentiles of a list, by nearest rank. Field names are JSON keys.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Percentiles {
    pub p50: f64,
    /// 95 % of the values are at most this.
    pub p95: f64,
    /// 99 % of them.
    pub p99: f64,
}

impl Percentiles {
    /// The percentiles of an ascending list; 0 of an empty one.
    pub fn of(sorted: &[f64]) -> Self {
        let at = |p| nearest_rank(sorted, p).unwrap_or(0.0);
        Self { p50: at(0.5), p95: at(0.95), p99: at(0.99) }
    }
}

/// Writes figures as JSON to `path`, or to standard output if it is `-`.
///
/// # Errors
///
/// When the file cannot be written; an existing file is replaced only once the new one is complete.
pub fn write_json(figures: &impl Serialize, path: &Path) -> Result<()> {
    let text = serde_json::to_string_pretty(figures).into_diagnostic()? + "\n";
    if path == Path::new("-") {
        let written = std::io::stdout().write_all(text.as_bytes());
        return written.into_diagnostic().wrap_err("cannot write the report to standard output");
    }
    if is_special(path) {
        let written = std::fs::OpenOptions::new().write(true).open(path);
        let written = written.and_then(|mut file| file.write_all(text.as_bytes()));
        return written.into_diagnostic().wrap_err_with(|| format!("cannot write {}", path.display()));
    }
    atomically(path, text.as_bytes()).into_diagnostic()
}

/// Prints a table, called `what`, unless the figures go to standard output, and writes the figures where `--json` says.
pub fn publish(table: &str, what: &str, figures: &impl Serialize, json: Option<&Path>) -> Result<()> {
    if json != Some(Path::new("-")) {
        print(table, what);
    }
    json.map_or(Ok(()), |path| write_json(figures, path))
}

/// Checks, before anything is measured, that `--json` can be written, and that it is no scene.
pub fn check_json(json: Option<&Path>, scene: &Path) -> Result<()> {
    let Some(json) = json.filter(|path| !is_special(path)) else { return Ok(()) };
    check_place(json).into_diagnostic()?;
    if same_file(json, scene) {
        return Err(miette::miette!("--json {} would overwrite the scene", json.display()));
    }
    let is_scene = json.extension().is_some_and(|e| e.eq_ignore_ascii_case("xml"));
    if is_scene {
        return Err(miette::miette!(
            help = "`--json -` is standard output",
            "--json {} would overwrite a scene: give the name of a file for the figures",
            json.display()
        ));
    }
    Ok(())
}

/// Writes to standard output. Nobody may be reading any more: that is no error, and false is returned.
pub fn print(text: &str, what: &str) -> bool {
    let is_read = std::io::stdout().write_all(text.as_bytes()).is_ok();
    if !is_read {
        tell(&format!("nobody reads {what}"));
    }
    is_read
}

/// True for standard output (`-`), devices, pipes: what is written into, not replaced.
pub fn is_special(path: &Path) -> bool {
    let other = |m: std::fs::Metadata| !m.is_file() && !m.is_dir();
    path == Path::new("-") || std::fs::metadata(path).is_ok_and(other)
}

/// A rate or count with three digits and a decimal suffix.
pub fn human(value: f64) -> String {
    match value {
        v if v >= 1e9 => format!("{:.2} G", v / 1e9),
        v if v >= 1e6 => format!("{:.2} M", v / 1e6),
        v if v >= 1e3 => format!("{:.1} k", v / 1e3),
        v => format!("{v:.0}"),
    }
}
