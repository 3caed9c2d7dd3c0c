//! Log of the predictions made during renders on this machine, with their outcomes.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

use miette::{IntoDiagnostic, Result, WrapErr};
use serde::{Deserialize, Serialize};

use crate::render::process::tell;
use crate::render::run_spec::RunSpec;
use crate::study::data::PredictionScore;
use crate::study::prediction::{LightClass, PredictionOutcome, score};

/// Log size in bytes at which a new log begins; the previous one is kept beside it.
const MAX_BYTES: u64 = 8 << 20;

/// One line of the log.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct LogLine {
    scene: String,
    method: String,
    size: [u32; 2],
    #[serde(flatten)]
    kept: PredictionOutcome,
}

/// State directory of the program: `$POINTILLIST_STATE`, else in the system's state directory. `None` without a home directory.
pub fn folder() -> Option<PathBuf> {
    let folder = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let own = folder("POINTILLIST_STATE");
    let state = || Some(folder("XDG_STATE_HOME")?.join("pointillist"));
    let home = || Some(folder("HOME")?.join(".local/state/pointillist"));
    own.or_else(state).or_else(home)
}

/// Path of the log.
pub fn file() -> Option<PathBuf> {
    Some(folder()?.join("predictions.jsonl"))
}

/// Appends the outcomes of a render's predictions. A failure to write is only logged at the level `info`, because the picture matters more.
pub fn log(run: &RunSpec, kept: &[PredictionOutcome]) {
    if kept.is_empty() {
        return;
    }
    if let Err(error) = append(run, kept) {
        tracing::info!("predictions are not logged: {error}");
    }
}

fn append(run: &RunSpec, kept: &[PredictionOutcome]) -> std::io::Result<()> {
    let Some(path) = file() else { return Ok(()) };
    let mut text = String::new();
    for &kept in kept {
        let line = LogLine {
            scene: run.scene.display().to_string(),
            method: run.integrator.name().to_string(),
            size: [run.film.width, run.film.height],
            kept,
        };
        text += &(serde_json::to_string(&line)? + "\n");
    }
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    if std::fs::metadata(&path).is_ok_and(|m| m.len() > MAX_BYTES) {
        std::fs::rename(&path, path.with_extension("old.jsonl"))?;
    }
    // A single write, so that renders that end at the same time do not mix their lines.
    std::fs::OpenOptions::new().create(true).append(true).open(&path)?.write_all(text.as_bytes())
}

/// Reads the log. Malformed lines are counted and skipped.
fn read() -> Result<(Vec<LogLine>, usize)> {
    let no_home = || {
        let help = "set POINTILLIST_STATE to a folder";
        miette::miette!(help = help, "there is no home folder for the log of predictions")
    };
    let path = file().ok_or_else(no_home)?;
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
        Err(error) => {
            return Err(error).into_diagnostic().wrap_err_with(|| format!("cannot read {}", path.display()));
        }
    };
    let lines: Vec<Option<LogLine>> = text.lines().map(|line| serde_json::from_str(line).ok()).collect();
    let broken = lines.iter().filter(|line| line.is_none()).count();
    Ok((lines.into_iter().flatten().collect(), broken))
}

/// `pointillist study --predictions`: prints how often the prediction intervals were right.
pub fn print() -> Result<()> {
    let (lines, broken) = read()?;
    let place = file().map(|path| path.display().to_string()).unwrap_or_default();
    if lines.is_empty() {
        tell(&format!("no prediction yet in {place}: render something for some seconds"));
        return Ok(());
    }
    let mut groups: BTreeMap<String, Vec<PredictionOutcome>> = BTreeMap::new();
    for line in &lines {
        groups.entry(format!("{} {}", line.scene, line.method)).or_default().push(line.kept);
    }
    let mut text = format!(
        "{:48} {:>6} {:>6} {:>7} {:>6}  stated/true\n",
        "predictions of 90 %", "known", "held", "", "open"
    );
    let mut classes: BTreeMap<Option<LightClass>, Vec<PredictionOutcome>> = BTreeMap::new();
    for line in &lines {
        classes.entry(line.kept.light).or_default().push(line.kept);
    }
    let name = |light: Option<LightClass>| light.map_or("light of no known class", LightClass::name);
    let classes = classes.into_iter().map(|(light, kept)| (name(light).to_string(), kept));
    let all = lines.iter().map(|line| line.kept).collect();
    for (name, kept) in groups.into_iter().chain(classes).chain([("all".to_string(), all)]) {
        let PredictionScore { known, held, open, ratio } = score(&kept);
        let share = match known {
            0 => "–".to_string(),
            _ => format!("{:.0} %", 100.0 * held as f64 / known as f64),
        };
        text += &format!("{name:48} {known:>6} {held:>6} {share:>7} {open:>6}  {ratio:.2}\n");
    }
    if broken > 0 {
        text += &format!("{broken} lines of {place} cannot be read\n");
    }
    crate::render::figures::print(&text, "the predictions");
    Ok(())
}
