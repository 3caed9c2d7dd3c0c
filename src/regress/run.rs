//! A whole run: which cases, on how many threads, and what is kept of a run that was interrupted.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Instant, SystemTime};

use miette::{IntoDiagnostic, Result, WrapErr};
use serde::{Deserialize, Serialize};

use super::case_run::CaseRunner;
use super::plan::{CaseRenderer, RegressCase, RegressPlan};
use super::provenance::{CaseKey, FileHashes};
use super::run_report::{CaseReport, CaseVerdict, RunReport};
use super::timed_run::{TimingOptions, time_case};
use super::timing::TimingVerdict;
use crate::image::write::{atomically, same_file};
use crate::render::{calendar, process};
use crate::scene::suggest;

/// How the name of the mark of an unfinished run begins.
const MARK: &str = ".unfinished";

/// What the mark of a shard says that has come to its end and waits for `merge`.
const WAITS: &[u8] = b"waits for `regress merge`\n";

/// File in the folder of a case that says which key its renderings have.
const KEY: &str = "key.json";

/// How a plan is run.
#[derive(Clone, Debug)]
pub struct RegressOptions {
    /// Folder of the results.
    pub results: PathBuf,
    /// Words that names of cases contain; none for all cases.
    pub cases: Vec<String>,
    /// Which share of the cases.
    pub shard: Option<ShardOfCases>,
    /// The shard counts as unfinished until it is merged: called again, as by the scheduler of a farm, it keeps what it has.
    pub for_merge: bool,
    /// Keep nothing of a run that was interrupted.
    pub fresh: bool,
    /// First seed.
    pub seed_base: Option<u32>,
    /// Cases that are rendered at the same time.
    pub jobs: usize,
    /// This program, which renders in child processes: an absolute path.
    pub program: PathBuf,
    /// The file that holds its code, where the program is only a script that loads it.
    pub library: Option<PathBuf>,
    /// Another program whose times are compared with those of this one.
    pub timing: Option<TimingOptions>,
}

/// Every `of`-th case, beginning with the case of this number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShardOfCases {
    /// From 1 on.
    pub number: usize,
    /// Number of shards.
    pub of: usize,
}

/// Progress of a run.
#[derive(Clone, Copy, Debug)]
pub enum RegressEvent<'a> {
    /// A case begins.
    Begins(&'a str),
    /// A case is done, by this run or by the interrupted one.
    Ends(&'a CaseReport),
    /// The times of a case are compared with those of another program.
    Times(&'a str),
    /// They are compared, by this run or by the interrupted one. There are none of a broken case, nor of one that another program renders.
    Timed(&'a CaseReport),
}

/// The end of a run.
#[derive(Clone, Debug)]
pub struct RegressOutcome {
    /// The cases that are finished.
    pub report: RunReport,
    /// Cases that Ctrl-C kept from being finished.
    pub unfinished: usize,
}

/// A finished case in the folder of the results, with what it depends on.
#[derive(Serialize, Deserialize)]
pub(super) struct FinishedCase {
    pub(super) key: CaseKey,
    #[serde(flatten)]
    pub(super) report: CaseReport,
}

impl FinishedCase {
    /// The case in a folder of results; `None` if it is not there or cannot be read.
    pub(super) fn read(results: &Path, name: &str) -> Option<Self> {
        serde_json::from_str(&std::fs::read_to_string(case_file(results, name)).ok()?).ok()
    }

    /// When the case in a folder of results was written; `None` if it is not there.
    pub(super) fn written(results: &Path, name: &str) -> Option<SystemTime> {
        case_file(results, name).metadata().ok()?.modified().ok()
    }

    /// Writes it into a folder of results.
    pub(super) fn write(&self, results: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).into_diagnostic()? + "\n";
        atomically(&case_file(results, &self.report.name), text.as_bytes()).into_diagnostic()
    }
}

fn case_file(results: &Path, name: &str) -> PathBuf {
    results.join(format!("{name}.json"))
}

/// Runs the cases of a plan, and tells what happens meanwhile.
///
/// A run that was killed or interrupted leaves a mark: the next one with the same shard goes on. It keeps finished cases that are not broken and
/// single renderings, as long as neither case, scene, reference nor program have changed.
///
/// # Errors
/// For words that no case has, and for results that cannot be written. What is wrong with a case is in its report.
pub fn run(
    plan: &RegressPlan,
    options: &RegressOptions,
    tell: &(dyn Fn(RegressEvent<'_>) + Sync),
) -> Result<RegressOutcome> {
    let (start, started) = (Instant::now(), calendar::now());
    let chosen = choose(plan, &options.cases)?;
    let chosen: Vec<&RegressCase> = match options.shard {
        Some(shard) => chosen.into_iter().skip(shard.number - 1).step_by(shard.of.max(1)).collect(),
        None => chosen,
    };
    let results = results_folder(plan, &options.results)?;
    let mark = results.join(match options.shard {
        Some(shard) => format!("{MARK}-{}-of-{}", shard.number, shard.of),
        None => MARK.to_owned(),
    });
    let goes_on = mark.exists() && !options.fresh;
    atomically(&mark, b"").into_diagnostic()?;
    let hashes = FileHashes::of_library(options.library.clone());
    let run = PlanRun {
        runner: CaseRunner {
            plan,
            results: &results,
            program: &options.program,
            seed_base: options.seed_base,
            hashes: &hashes,
        },
        goes_on,
        tell,
    };
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || -> Result<()> {
        while let Some((at, case)) =
            Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|at| Some((at, *chosen.get(at)?)))
        {
            let Some(report) = run.case(case)? else { break };
            done.lock().unwrap_or_else(PoisonError::into_inner).push((at, report));
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let others: Vec<_> = (1..options.jobs.min(chosen.len())).map(|_| scope.spawn(work)).collect();
        let own = work();
        let failed = |_| Err(miette::miette!("a thread of the run ended unexpectedly"));
        others.into_iter().map(|other| other.join().unwrap_or_else(failed)).fold(own, Result::and)
    })?;
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(at, _)| *at);
    let mut cases: Vec<CaseReport> = done.into_iter().map(|(_, report)| report).collect();
    let mut unfinished = chosen.len() - cases.len();
    match &options.timing {
        Some(timing) if unfinished == 0 => unfinished = run.time(&chosen, &mut cases, timing)?,
        Some(_) => {}
        None => cases.iter_mut().try_for_each(|case| forget_timing(&results, case))?,
    }
    match unfinished {
        0 if options.for_merge => atomically(&mark, WAITS).into_diagnostic()?,
        0 => remove_mark(&mark)?,
        _ => {}
    }
    let report = RunReport {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        folder: plan.folder.clone(),
        started,
        seconds: start.elapsed().as_secs_f64(),
        false_alarm: plan.false_alarm,
        fail_on_slower: None,
        cases,
    };
    Ok(RegressOutcome { report, unfinished })
}

/// Removes the times of an interrupted run that compared them, as this one does not.
fn forget_timing(results: &Path, case: &mut CaseReport) -> Result<()> {
    if case.timing.take().is_none() {
        return Ok(());
    }
    match FinishedCase::read(results, &case.name) {
        Some(finished) => FinishedCase { report: case.clone(), ..finished }.write(results),
        None => Ok(()),
    }
}

fn remove_mark(mark: &Path) -> Result<()> {
    let removed = std::fs::remove_file(mark).into_diagnostic();
    removed.wrap_err_with(|| format!("cannot remove {}", mark.display()))
}

/// Ends the runs of shards that wait for `merge`; those that were interrupted stay unfinished.
///
/// # Errors
/// For a folder that cannot be read, and marks that cannot be removed.
pub(super) fn end_waiting_shards(results: &Path) -> Result<()> {
    let cannot_read = || format!("cannot read {}", results.display());
    for entry in results.read_dir().into_diagnostic().wrap_err_with(cannot_read)? {
        let path = entry.into_diagnostic().wrap_err_with(cannot_read)?.path();
        let is_mark = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(MARK));
        if is_mark && std::fs::read(&path).is_ok_and(|text| text == WAITS) {
            remove_mark(&path)?;
        }
    }
    Ok(())
}

/// The cases whose names contain one of the words; all without words.
///
/// # Errors
/// For a word that no name contains.
pub fn choose<'a>(plan: &'a RegressPlan, words: &[String]) -> Result<Vec<&'a RegressCase>> {
    let names: Vec<&str> = plan.cases.iter().map(|case| case.name.as_str()).collect();
    if let Some(word) = words.iter().find(|word| !names.iter().any(|name| name.contains(*word))) {
        let help = suggest::nearest_or(word, names, "`pointillist regress list` shows all names");
        return Err(miette::miette!(help = help, "no case has {word} in its name"));
    }
    // The exact name of a case is not also a part of other names.
    let wanted = |case: &&RegressCase| {
        words.is_empty()
            || words.iter().any(|word| match names.contains(&word.as_str()) {
                true => case.name == *word,
                false => case.name.contains(word),
            })
    };
    Ok(plan.cases.iter().filter(wanted).collect())
}

/// Makes the folder of the results, and returns its absolute path.
///
/// # Errors
/// When it cannot be made, or is that of scenes or references.
pub(super) fn results_folder(plan: &RegressPlan, results: &Path) -> Result<PathBuf> {
    for (other, what) in [(&plan.folder, "scenes"), (&plan.references, "references")] {
        if same_file(results, other)
            || results.canonicalize().ok().is_some_and(|real| other.canonicalize().ok() == Some(real))
        {
            return Err(miette::miette!(
                help = "give --results a folder of its own",
                "results in {} would be mixed with {what}",
                results.display()
            ));
        }
    }
    std::fs::create_dir_all(results)
        .and_then(|()| results.canonicalize())
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot make the folder of the results, {}", results.display()))
}

/// What the threads of a run share.
struct PlanRun<'a> {
    runner: CaseRunner<'a>,
    goes_on: bool,
    tell: &'a (dyn Fn(RegressEvent<'_>) + Sync),
}

impl PlanRun<'_> {
    /// Runs a case, or takes what the interrupted run has of it; `None` after Ctrl-C.
    fn case(&self, case: &RegressCase) -> Result<Option<CaseReport>> {
        if process::is_interrupted() {
            return Ok(None);
        }
        let CaseRunner { plan, results, program, seed_base, hashes } = self.runner;
        (self.tell)(RegressEvent::Begins(&case.name));
        let key = hashes.key(plan, case, program, seed_base);
        let kept = FinishedCase::read(results, &case.name).filter(|_| self.goes_on);
        let kept = kept.filter(|kept| kept.key == key && kept.report.verdict != CaseVerdict::Broken);
        let report = match kept {
            Some(kept) => kept.report,
            None => {
                let place = results.join(&case.name);
                self.make_place(case, &key)?;
                let Ok(report) = self.runner.run(case) else { return Ok(None) };
                FinishedCase { key, report: report.clone() }.write(results)?;
                let removed = std::fs::remove_dir_all(&place);
                removed.into_diagnostic().wrap_err_with(|| format!("cannot remove {}", place.display()))?;
                report
            }
        };
        (self.tell)(RegressEvent::Ends(&report));
        Ok(Some(report))
    }

    /// Compares the times of all cases with those of another program, one after the other; the number of those that Ctrl-C left out.
    fn time(
        &self,
        chosen: &[&RegressCase],
        cases: &mut [CaseReport],
        options: &TimingOptions,
    ) -> Result<usize> {
        let results = self.runner.results;
        let hash = self.runner.hashes.file(&options.against);
        for (at, (case, report)) in chosen.iter().zip(cases.iter_mut()).enumerate() {
            (self.tell)(RegressEvent::Times(&case.name));
            let kept = report.timing.take().filter(|timing| {
                self.goes_on && timing.against_hash == hash && timing.verdict != TimingVerdict::Untimed
            });
            let is_timed = report.verdict != CaseVerdict::Broken
                && matches!(case.renderer, CaseRenderer::Pointillist { .. });
            report.timing = match kept {
                Some(kept) => Some(kept),
                None if !is_timed => None,
                None => match time_case(&self.runner, case, options, &report.device) {
                    Ok(timing) => Some(timing),
                    Err(_) => return Ok(chosen.len() - at),
                },
            };
            if let Some(mut finished) = FinishedCase::read(results, &case.name) {
                finished.report.timing.clone_from(&report.timing);
                finished.write(results)?;
            }
            (self.tell)(RegressEvent::Timed(report));
        }
        Ok(0)
    }

    /// Makes the folder of single renderings; those of an interrupted run with the same key stay.
    fn make_place(&self, case: &RegressCase, key: &CaseKey) -> Result<()> {
        let results = self.runner.results;
        let place = results.join(&case.name);
        let known = std::fs::read_to_string(place.join(KEY)).ok();
        if place.exists() && known.is_none() && place.read_dir().is_ok_and(|mut all| all.next().is_some()) {
            return Err(miette::miette!(
                help = "give --results a folder of its own",
                "{} is not of a regression run and stays as it is, but its name is needed",
                place.display()
            ));
        }
        let text = serde_json::to_string(key).into_diagnostic()?;
        if self.goes_on && known.as_ref() == Some(&text) {
            return Ok(());
        }
        let names =
            [".json", ".exr", ".against.exr", ".log"].map(|end| results.join(format!("{}{end}", case.name)));
        let make = || -> std::io::Result<()> {
            for old in names.iter().filter(|old| old.exists()) {
                std::fs::remove_file(old)?;
            }
            if place.exists() {
                std::fs::remove_dir_all(&place)?;
            }
            std::fs::create_dir(&place)
        };
        make().into_diagnostic().wrap_err_with(|| format!("cannot make room for {}", place.display()))?;
        atomically(&place.join(KEY), text.as_bytes()).into_diagnostic()
    }
}
