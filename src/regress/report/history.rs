//! What earlier runs found: `history.jsonl` in the folder of the results, a line of JSON for each run.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use miette::IntoDiagnostic;
use serde::{Deserialize, Serialize};

use crate::image::{ImageError, write};
use crate::regress::case_times::CaseTimes;
use crate::regress::run_report::{CaseReport, CaseVerdict, RunReport};
use crate::regress::timing::{CaseTiming, TimedFigure, TimingVerdict};
use crate::render::process::tell;

/// One run. Field names are JSON keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PastRun {
    /// When it began: RFC 3339, UTC.
    pub date: String,
    /// Version of the program.
    pub version: String,
    /// In the order of the manifest.
    pub cases: Vec<PastCase>,
}

/// One case of a run. Field names are JSON keys; numbers that are not finite are null.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PastCase {
    /// Name of the case.
    pub name: String,
    /// Device that rendered it, and its driver.
    pub device: String,
    /// The outcome.
    pub verdict: CaseVerdict,
    /// Brightness over that of the reference by channel.
    pub brightness: [Option<f64>; 3],
    /// Standard error of `brightness`.
    pub standard_error: [Option<f64>; 3],
    /// Probability of such a difference if nothing changed.
    pub p_value: Option<f64>,
    /// Wall clock of its renderings.
    pub seconds: f64,
    /// Times of its renderings. Lines of earlier versions have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<CaseTimes>,
    /// How they compare with those of another program, if that was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timing: Option<PastTiming>,
}

/// Times of a case against those of another program. Field names are JSON keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PastTiming {
    /// Hash of the other program's file.
    pub against_hash: String,
    /// The outcome.
    pub verdict: TimingVerdict,
    /// Ratios of the times with their intervals.
    pub figures: Vec<TimedFigure>,
}

/// The runs of a folder of results.
#[derive(Debug, Default)]
pub struct RunHistory {
    /// From the oldest to the latest.
    pub runs: Vec<PastRun>,
    /// Numbers of the lines that cannot be read, from 1.
    pub damaged: Vec<usize>,
}

/// Appends a run to the history in the folder of its results. A damaged line stays in the file and is told on standard error.
///
/// # Errors
/// When the file cannot be read or written; it names the file.
pub fn record(report: &RunReport, results: &Path) -> miette::Result<()> {
    let path = file(results);
    let mut bytes = contents(&path).into_diagnostic()?;
    let damaged = parse(&bytes).damaged;
    if !damaged.is_empty() {
        tell(&damage(&path, &damaged));
    }
    // A line that was cut short ends here.
    if bytes.last().is_some_and(|last| *last != b'\n') {
        bytes.push(b'\n');
    }
    bytes.extend(serde_json::to_vec(&PastRun::of(report)).into_diagnostic()?);
    bytes.push(b'\n');
    write::atomically(&path, &bytes).into_diagnostic()
}

/// Says which lines cannot be read.
pub fn damage(path: &Path, lines: &[usize]) -> String {
    let numbers: Vec<String> = lines.iter().map(usize::to_string).collect();
    let [plural, which, they] = if lines.len() == 1 { ["", "is", "it"] } else { ["s", "are", "them"] };
    let (path, numbers) = (path.display(), numbers.join(", "));
    format!(
        "{path}: line{plural} {numbers} {which} damaged and left out of the history; remove {they} to silence this"
    )
}

/// The file of the history.
pub fn file(results: &Path) -> PathBuf {
    results.join("history.jsonl")
}

impl RunHistory {
    /// The recorded runs and `report` as the latest, whether it has been recorded or not.
    ///
    /// # Errors
    /// [`ImageError::Read`] when there is a file that cannot be read.
    pub fn with(report: &RunReport, results: &Path) -> Result<Self, ImageError> {
        let mut history = parse(&contents(&file(results))?);
        history.runs.retain(|run| run.date != report.started);
        history.runs.push(PastRun::of(report));
        Ok(history)
    }

    /// What each run found of a case, from the oldest to the latest.
    pub fn of_case<'a>(&'a self, name: &'a str) -> impl Iterator<Item = (&'a PastRun, &'a PastCase)> {
        let find = move |run: &'a PastRun| Some((run, run.cases.iter().find(|case| case.name == name)?));
        self.runs.iter().filter_map(find)
    }
}

/// The bytes of a file, none if there is no file.
fn contents(path: &Path) -> Result<Vec<u8>, ImageError> {
    match std::fs::read(path) {
        Err(source) if source.kind() != ErrorKind::NotFound => {
            Err(ImageError::Read { path: path.to_path_buf(), source })
        }
        read => Ok(read.unwrap_or_default()),
    }
}

fn parse(bytes: &[u8]) -> RunHistory {
    let mut history = RunHistory::default();
    for (number, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
        if line.trim_ascii().is_empty() {
            continue;
        }
        match serde_json::from_slice(line) {
            Ok(run) => history.runs.push(run),
            Err(_) => history.damaged.push(number + 1),
        }
    }
    history
}

impl PastRun {
    fn of(report: &RunReport) -> Self {
        Self {
            date: report.started.clone(),
            version: report.version.clone(),
            cases: report.cases.iter().map(PastCase::of).collect(),
        }
    }
}

impl PastCase {
    fn of(case: &CaseReport) -> Self {
        let finite = |x: f64| x.is_finite().then_some(x);
        let channels = |i: usize| {
            let judgement = case.judgement.as_ref();
            judgement.map_or([None; 3], |j| j.brightness.map(|channel| finite(channel[i])))
        };
        Self {
            name: case.name.clone(),
            device: case.device.clone(),
            verdict: case.verdict,
            brightness: channels(0),
            standard_error: channels(1),
            p_value: case.judgement.as_ref().and_then(|j| finite(j.p_value)),
            seconds: finite(case.seconds).unwrap_or(0.0),
            times: case.times.clone().filter(is_finite),
            timing: case.timing.as_ref().map(PastTiming::of),
        }
    }
}

impl PastTiming {
    fn of(timing: &CaseTiming) -> Self {
        let is_finite =
            |figure: &&TimedFigure| figure.seconds.iter().chain(&figure.certain).all(|x| x.is_finite());
        Self {
            against_hash: timing.against_hash.clone(),
            verdict: timing.verdict,
            figures: timing.figures.iter().filter(is_finite).cloned().collect(),
        }
    }
}

/// JSON has no other numbers.
fn is_finite(times: &CaseTimes) -> bool {
    let passes = times.passes.iter().map(|pass| pass.milliseconds);
    passes.chain(times.paths_per_trace_second).chain([times.seconds]).all(f64::is_finite)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regress::report::sample;

    #[test]
    fn runs_are_appended_and_read_back() {
        let results = tempfile::tempdir().expect("a folder");
        let mut report = sample::report();
        record(&report, results.path()).expect("recorded");
        report.started = "2026-12-01T08:00:00Z".into();
        if let Some(judgement) = &mut report.cases[0].judgement {
            judgement.brightness[1] = [f64::NAN, f64::INFINITY];
            judgement.p_value = f64::NAN;
        }
        report.cases[0].seconds = f64::NAN;
        record(&report, results.path()).expect("recorded");
        let text = std::fs::read_to_string(file(results.path())).expect("a file");
        assert_eq!(text.lines().count(), 2, "{text}");
        // The latest run counts once, recorded or not.
        let history = RunHistory::with(&report, results.path()).expect("read");
        assert!(history.runs.len() == 2 && history.damaged.is_empty(), "{history:?}");
        let found: Vec<_> = history.of_case("cornell").map(|(_, case)| case.clone()).collect();
        assert_eq!(found[0].brightness, [Some(1.005), Some(1.0), Some(1.0)]);
        assert_eq!(found[0].standard_error, [Some(6e-4), Some(6e-4), Some(7e-4)]);
        assert_eq!(
            (found[1].brightness[1], found[1].standard_error[1], found[1].p_value),
            (None, None, None)
        );
        assert_eq!(history.of_case("fog").next().map(|(_, case)| case.verdict), Some(CaseVerdict::Broken));
        assert_eq!(history.of_case("none").count(), 0);
        report.started = "2026-12-02T08:00:00Z".into();
        assert_eq!(RunHistory::with(&report, results.path()).expect("read").runs.len(), 3);
    }

    #[test]
    fn times_are_recorded_and_lines_without_them_are_read() {
        let results = tempfile::tempdir().expect("a folder");
        let mut report = sample::report();
        record(&report, results.path()).expect("recorded");
        assert!(!std::fs::read_to_string(file(results.path())).expect("a file").contains("times"));
        report.started = "2026-12-01T08:00:00Z".into();
        report.cases[0].times = Some(sample::times());
        report.cases[0].timing = Some(sample::slower());
        report.cases[1].times = Some(CaseTimes { seconds: f64::NAN, ..sample::times() });
        record(&report, results.path()).expect("recorded");
        report.started = "2026-12-02T08:00:00Z".into();
        let history = RunHistory::with(&report, results.path()).expect("read");
        assert!(history.runs.len() == 3 && history.damaged.is_empty(), "{history:?}");
        let of = |name| history.of_case(name).map(|(_, case)| case.clone()).collect::<Vec<_>>();
        let cornell = of("cornell");
        assert_eq!((&cornell[0].times, &cornell[0].timing), (&None, &None));
        assert_eq!(cornell[1].times, Some(sample::times()));
        let timing = cornell[1].timing.as_ref().expect("times against another program");
        assert_eq!((timing.verdict, &timing.figures), (TimingVerdict::Slower, &sample::slower().figures));
        assert!(of("prism").iter().all(|case| case.times.is_none()));
    }

    #[test]
    fn damaged_lines_are_kept_and_left_out() {
        let results = tempfile::tempdir().expect("a folder");
        let path = file(results.path());
        let report = sample::report();
        record(&report, results.path()).expect("recorded");
        let whole = std::fs::read_to_string(&path).expect("a file");
        // Cut short, no JSON, no UTF-8, and another object, without a line feed at the end.
        let cut = &whole[..whole.len() / 2];
        let damaged = [whole.as_bytes(), cut.as_bytes(), &b"\n???\n\n\xff\xfe\n{\"date\": 1}"[..]].concat();
        std::fs::write(&path, &damaged).expect("written");
        record(&RunReport { started: "2026-12-01T08:00:00Z".into(), ..report.clone() }, results.path())
            .expect("recorded");
        let after = std::fs::read(&path).expect("a file");
        assert!(after.starts_with(&damaged), "nothing was lost");
        let history = RunHistory::with(&report, results.path()).expect("read");
        assert_eq!(history.damaged, [2, 3, 5, 6]);
        assert_eq!(history.runs.len(), 2);
        let said = damage(&path, &history.damaged);
        assert!(said.contains("history.jsonl: lines 2, 3, 5, 6 are damaged"), "{said}");
    }

    #[test]
    fn a_file_that_cannot_be_read_is_an_error() {
        let results = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(file(results.path())).expect("a folder");
        let report = sample::report();
        assert!(matches!(RunHistory::with(&report, results.path()), Err(ImageError::Read { .. })));
        let error = record(&report, results.path()).expect_err("a folder is no file");
        assert!(format!("{error}").contains("history.jsonl"), "{error}");
    }
}
