//! The figures of a run, for people and for `--json`.

use std::io::Write;
use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Result, WrapErr};
use serde::Serialize;

pub use super::error_report::ErrorReport;
use super::plan::PlannedEffect;
use super::run_spec::ChoiceReport;
use super::tell;
use crate::image::write::{atomically, check_place, same_file};
use crate::math::quantile::nearest_rank;

/// Everything that is said about a finished run. Field names are the JSON keys.
#[derive(Clone, Debug, Serialize)]
pub struct RenderReport {
    /// Version of the program.
    pub version: &'static str,
    /// The scene file.
    pub scene: PathBuf,
    /// Picture width in pixels.
    pub width: u32,
    /// Picture height in pixels.
    pub height: u32,
    /// Method of light transport.
    pub integrator: &'static str,
    /// Why, where the program chose it.
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
    /// Samples of the camera stream that reached the film.
    pub camera_samples: u64,
    /// Samples of the light stream that reached the film.
    pub light_samples: u64,
    /// Paths started at the camera.
    pub camera_paths: u64,
    /// Paths started at lights.
    pub light_paths: u64,
    /// Paths (from either end, or pairs) per texel of the film, overscan included.
    pub samples_per_pixel: f64,
    /// The same per second of rendering.
    pub samples_per_second: f64,
    /// The same per second that one tracer thread spent tracing.
    pub paths_per_trace_second: f64,
    /// Seconds by stage.
    pub seconds: Seconds,
    /// How wrong the picture is; absent for an undivided run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<ErrorReport>,
    /// Samples that were not finite, by cause.
    pub rejected: Rejected,
    /// Where the picture was rasterised.
    pub device: String,
    /// Tracer threads.
    pub threads: usize,
    /// Instructions that walked the rays; the picture does not depend on them.
    pub simd: &'static str,
    /// Seed of the sequence.
    pub seed: u32,
    /// Samples were rasterised in index order.
    pub deterministic: bool,
    /// Ctrl-C ended the run early.
    pub interrupted: bool,
    /// Largest resident memory in bytes, where the system tells.
    pub peak_memory_bytes: Option<u64>,
    /// Warnings about the scene.
    pub warnings: Vec<String>,
    /// Files written.
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

impl From<[u64; 2]> for PlanCheck {
    fn from([paths, different]: [u64; 2]) -> Self {
        Self { paths, different }
    }
}

/// Seconds by stage; wall clock, except `trace`.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// Reading the scene.
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
    /// Reading back and writing files.
    pub write: f64,
    /// From the start of the program.
    pub total: f64,
}

/// Samples that were rejected at the sink.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Rejected {
    /// All of them.
    pub total: u64,
    /// Count per cause.
    pub by_cause: std::collections::BTreeMap<String, u64>,
    /// The first few, so that each can be replayed.
    pub examples: Vec<RejectedExample>,
}

/// One rejected sample.
#[derive(Clone, Debug, Serialize)]
pub struct RejectedExample {
    /// Index of its path in the sequence.
    pub index: u64,
    /// What was wrong with it.
    pub cause: String,
    /// The command that traces this path alone.
    pub replay: String,
}

impl RenderReport {
    /// One line for a person.
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
        if let Some(error) = &self.error {
            line.push_str(&error.summary());
        }
        if self.interrupted {
            line.push_str("; stopped by Ctrl-C, the picture holds what was there");
        }
        if self.rejected.total > 0 {
            line.push_str(&format!("; {} samples rejected", self.rejected.total));
            if let Some(first) = self.rejected.examples.first() {
                line.push_str(&format!(", the first because of {}: {}", first.cause, first.replay));
            }
        }
        line
    }
}

/// Percentiles of a list, by nearest rank. Field names are JSON keys.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 95 % of the values are at most this.
    pub p95: f64,
}

impl Percentiles {
    /// The percentiles of an ascending list; 0 of an empty one.
    pub fn of(sorted: &[f64]) -> Self {
        let at = |p| nearest_rank(sorted, p).unwrap_or(0.0);
        Self { p50: at(0.5), p95: at(0.95) }
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

/// Checks, before anything is measured, that `--json` can be written, and that it is no scene.
///
/// # Errors
///
/// When the place cannot be written, or is the scene.
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

/// Writes to standard output. Nobody may be reading any more: that is no error.
pub fn print(text: &str, what: &str) {
    if std::io::stdout().write_all(text.as_bytes()).is_err() {
        tell(&format!("nobody reads {what}"));
    }
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
