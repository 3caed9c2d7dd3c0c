//! Joins the results of shards.

use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Result, WrapErr};

use super::case_run::broken_report;
use super::plan::{CaseRenderer, ReferenceSource, RegressCase, RegressPlan};
use super::provenance::{FileHashes, stored};
use super::run::{FinishedCase, choose, end_waiting_shards, results_folder};
use super::run_report::{CaseReport, CaseVerdict, RunReport};
use super::timing::CaseTiming;
use crate::image::write::{atomically, same_file};
use crate::render::calendar;

/// Collects the cases of a plan, or those whose names contain one of the words, from folders of results into one folder, and makes their
/// report. A case that no folder has, or only that of another scene, reference or manifest, is broken; of one that several have the
/// newest counts. With `fail_on_slower`, in per cent, a case that its shard has not timed is one that could not be timed. Once all
/// cases are merged, shards that waited for this are at their end: called again, they begin anew.
///
/// # Errors
/// For a word that no case has, a folder that does not exist, results of different builds of this program or times against different
/// builds of another one, and files that cannot be read or written.
pub fn merge(
    plan: &RegressPlan,
    words: &[String],
    parts: &[PathBuf],
    results: &Path,
    fail_on_slower: Option<f64>,
) -> Result<RunReport> {
    let chosen = choose(plan, words)?;
    if let Some(missing) = parts.iter().find(|part| !part.is_dir()) {
        let help = "give the --results folders of all shards";
        return Err(miette::miette!(help = help, "{} is not a folder", missing.display()));
    }
    let results = results_folder(plan, results)?;
    let hashes = FileHashes::default();
    let (mut build, mut other): (Option<Build<'_>>, Option<Build<'_>>) = (None, None);
    let (mut cases, mut is_complete) = (Vec::new(), true);
    for case in chosen {
        let wanted = hashes.key(plan, case, Path::new(""), None);
        let has_key = |finished: &FinishedCase| {
            let [a, b] = [&finished.key, &wanted].map(|key| (&key.case, &key.scene, &key.reference));
            a == b
        };
        let found: Vec<_> =
            parts.iter().filter_map(|part| Some((part, FinishedCase::read(part, &case.name)?))).collect();
        let reason = match found.is_empty() {
            true => "no folder of results has it: has every shard come to its end?",
            false => "its results are of another manifest, scene or reference: run its shard again",
        };
        // An older one may be left of another number of shards, or of a manifest with other cases.
        let of_plan = found.into_iter().filter(|(_, finished)| has_key(finished));
        let newest = of_plan.max_by_key(|(part, _)| FinishedCase::written(part, &case.name));
        let Some((part, mut finished)) = newest else {
            cases.push(broken_report(plan, case, reason.to_owned()));
            is_complete = false;
            continue;
        };
        let only_own = matches!(case.renderer, CaseRenderer::Pointillist { .. })
            && !matches!(case.reference, ReferenceSource::Rendered { .. });
        if only_own {
            same_build(&mut build, (part, finished.key.program.clone()), "rendered by")?;
        }
        if let Some(timing) = &finished.report.timing {
            same_build(&mut other, (part, timing.against_hash.clone()), "timed against")?;
        }
        localise(plan, case, &results, &mut finished.report);
        copy(part, &results, &finished)?;
        let mut report = finished.report;
        let can_be_timed = report.verdict != CaseVerdict::Broken
            && matches!(case.renderer, CaseRenderer::Pointillist { .. });
        if fail_on_slower.is_some() && can_be_timed && report.timing.is_none() {
            let reason = "its shard compared no times: run it with --time-against";
            report.timing = Some(CaseTiming::failed(["another program", ""], reason.to_owned()));
        }
        cases.push(report);
    }
    // A shard that waits keeps its renderings while there is something to merge again.
    if words.is_empty() && is_complete {
        parts.iter().try_for_each(|part| end_waiting_shards(part))?;
    }
    Ok(RunReport {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        folder: plan.folder.clone(),
        started: calendar::now(),
        seconds: cases.iter().map(|case| case.seconds).sum(),
        false_alarm: plan.false_alarm,
        fail_on_slower,
        cases,
    })
}

/// A folder of results, and the hash of a program that they are of.
type Build<'a> = (&'a PathBuf, String);

/// Checks that results are of the `known` build, which is theirs if there is none yet.
fn same_build<'a>(known: &mut Option<Build<'a>>, now: Build<'a>, how: &str) -> Result<()> {
    let (first, hash) = known.get_or_insert_with(|| now.clone());
    if *hash == now.1 {
        return Ok(());
    }
    Err(miette::miette!(
        help = "run all shards with the same build of the program",
        "{} and {} were {how} different builds",
        first.display(),
        now.0.display()
    ))
}

/// The path of the reference on this machine.
fn localise(plan: &RegressPlan, case: &RegressCase, results: &Path, report: &mut CaseReport) {
    if report.reference.is_some() {
        let path = match &case.reference {
            ReferenceSource::Stored(name) => stored(plan, name),
            ReferenceSource::Picture(path) => path.clone(),
            ReferenceSource::Rendered { .. } => results.join(format!("{}.against.exr", case.name)),
        };
        report.reference = Some(path.canonicalize().unwrap_or(path));
    }
}

/// Copies the files of a case.
fn copy(from: &Path, to: &Path, finished: &FinishedCase) -> Result<()> {
    for end in [".exr", ".against.exr", ".log"] {
        let name = format!("{}{end}", finished.report.name);
        let [source, target] = [from, to].map(|folder| folder.join(&name));
        if !source.is_file() || same_file(&source, &target) {
            continue;
        }
        let bytes = std::fs::read(&source).into_diagnostic();
        let bytes = bytes.wrap_err_with(|| format!("cannot read {}", source.display()))?;
        atomically(&target, &bytes).into_diagnostic()?;
    }
    finished.write(to)
}
