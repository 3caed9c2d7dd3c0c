//! Statistics of a command: a table on standard output, and JSON for `--json`.

use std::io::Write;
use std::path::Path;

use miette::{IntoDiagnostic, Result, WrapErr};
use serde::Serialize;

use crate::image::write::{atomically, check_place, same_file};
use crate::math::quantile::nearest_rank;
use crate::render::process::tell;

/// Seconds by stage; wall clock, except `trace`.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    pub load: f64,
    /// Building the acceleration structure and tables.
    pub prepare: f64,
    /// Choosing the method, with `--integrator auto`.
    pub choose: f64,
    /// Opening the device, concurrently with `load` and `prepare`.
    pub open_device: f64,
    /// From the render command to the last sample on the film.
    pub render: f64,
    /// Tracing time summed over all threads.
    pub trace: f64,
    /// Part of `render` that the client spent taking and rasterising samples.
    pub rasterise: f64,
    /// Mips, reconstruction and tone mapping of the picture.
    pub display: f64,
    /// Feature buffers and noise filter.
    pub denoise: f64,
    /// Reading back and writing files.
    pub write: f64,
    /// From the start of the program.
    pub total: f64,
}

/// Nearest-rank percentiles. Field names are JSON keys.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Percentiles {
    pub p50: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
}

impl Percentiles {
    /// The percentiles of an ascending list; 0 of an empty one.
    pub fn of(sorted: &[f64]) -> Self {
        let at = |p| nearest_rank(sorted, p).unwrap_or(0.0);
        Self { p50: at(0.5), p95: at(0.95), p99: at(0.99) }
    }
}

/// Writes statistics as JSON to `path`, or to standard output if it is `-`.
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

/// Prints a table, called `what`, unless the statistics go to standard output, and writes the statistics for `--json`.
pub fn publish(table: &str, what: &str, figures: &impl Serialize, json: Option<&Path>) -> Result<()> {
    if json != Some(Path::new("-")) {
        print(table, what);
    }
    json.map_or(Ok(()), |path| write_json(figures, path))
}

/// Checks before any measurement that the `--json` file can be written and is not the scene.
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

/// Writes to standard output. A closed pipe is not an error; returns false then.
pub fn print(text: &str, what: &str) -> bool {
    let is_read = std::io::stdout().write_all(text.as_bytes()).is_ok();
    if !is_read {
        tell(&format!("nobody reads {what}"));
    }
    is_read
}

/// Whether the path is standard output (`-`), a device or a pipe, which are written in place rather than replaced.
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
