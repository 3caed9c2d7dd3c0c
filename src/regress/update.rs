//! Renders references, and says what changes by them.

use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Result, WrapErr};

use super::case_run::{CaseRunner, level};
use super::evidence::Evidence;
use super::judgement::judge;
use super::plan::{ReferenceSource, RegressCase, RegressPlan};
use super::provenance::{FileHashes, Provenance, StoredReference, stored};
use super::renderings::{CaseRenderings, CaseStop};
use super::run::choose;
use super::sentence;

/// What is updated.
#[derive(Clone, Debug)]
pub struct UpdateOptions {
    /// Words that names of cases contain; none for all cases.
    pub cases: Vec<String>,
    /// Why the references change; `None` only shows what would change.
    pub reason: Option<String>,
    /// This program, which renders in child processes: an absolute path.
    pub program: PathBuf,
}

/// What became of a reference.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UpdatedReference {
    /// Name of the case.
    pub name: String,
    /// Whether there is a new one.
    pub outcome: UpdateOutcome,
    /// What changes against the old reference, or why there is no new one.
    pub sentence: String,
}

/// Whether a reference was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpdateOutcome {
    /// It was written, or would have been.
    Written,
    /// The old one stays: it has the same bits, or is that of another case.
    Kept,
    /// It could not be rendered.
    Broken,
}

/// Renders the references of cases from their seeds 0, 1, …, and writes each with its provenance once all of its renderings are there.
/// `tell` gets the name of each case as it begins, and what became of it.
///
/// Returns the number of cases that Ctrl-C left out.
///
/// # Errors
/// For words that no case has, and for references that cannot be written.
pub fn update(
    plan: &RegressPlan,
    options: &UpdateOptions,
    tell: &dyn Fn(&str, Option<&UpdatedReference>),
) -> Result<usize> {
    let chosen = choose(plan, &options.cases)?;
    let hashes = FileHashes::default();
    for (at, case) in chosen.iter().enumerate() {
        tell(&case.name, None);
        let scratch = tempfile::tempdir().into_diagnostic().wrap_err("cannot make a temporary folder")?;
        let runner = CaseRunner {
            plan,
            results: scratch.path(),
            program: &options.program,
            seed_base: None,
            hashes: &hashes,
        };
        let (outcome, sentence) = match rendered(&runner, case) {
            Ok(Some((evidence, provenance))) => {
                compare_and_write(plan, case, options, &evidence, provenance)?
            }
            Ok(None) => (UpdateOutcome::Kept, kept(case)),
            Err(CaseStop::Broken(reason)) => (UpdateOutcome::Broken, reason),
            Err(CaseStop::Interrupted) => return Ok(chosen.len() - at),
        };
        tell(&case.name, Some(&UpdatedReference { name: case.name.clone(), outcome, sentence }));
    }
    Ok(0)
}

/// Renders the reference of a case, such that runs can compare bits; `None` if the case has none of its own.
fn rendered(runner: &CaseRunner<'_>, case: &RegressCase) -> Result<Option<(Evidence, Provenance)>, CaseStop> {
    match &case.reference {
        ReferenceSource::Stored(name) if *name == case.name => {}
        _ => return Ok(None),
    }
    let log = runner.results.join("log");
    let mut renderings =
        CaseRenderings::new(runner.plan, case, runner.program, [runner.results, &log], "reference")
            .repeatable(true);
    let seeds = 0..case.budget.reference_seeds;
    renderings.add(seeds.clone())?;
    let provenance = runner.provenance(case, renderings.tally(), seeds);
    Ok(Some((renderings.evidence()?, provenance)))
}

/// Why a case has no reference of its own.
fn kept(case: &RegressCase) -> String {
    match &case.reference {
        ReferenceSource::Stored(name) => format!("is compared with the reference of {name}"),
        ReferenceSource::Picture(path) => format!("is compared with {}", path.display()),
        ReferenceSource::Rendered { .. } => {
            "is compared with another program, which every run renders".into()
        }
    }
}

/// Compares a reference with the old one, and writes it if it is to be written.
fn compare_and_write(
    plan: &RegressPlan,
    case: &RegressCase,
    options: &UpdateOptions,
    evidence: &Evidence,
    provenance: Provenance,
) -> Result<(UpdateOutcome, String)> {
    let path = stored(plan, &case.name);
    let old = match path.exists() {
        true => Some(StoredReference::read(&path)),
        false => None,
    };
    let count = evidence.renderings;
    let sentence = match &old {
        None => format!("new reference of {count} renderings with {} samples per pixel", provenance.spp),
        Some(Err(error)) => format!("replaces a file that is no reference: {error}"),
        Some(Ok(old))
            if old.evidence.hashes == evidence.hashes && old.deterministic == provenance.deterministic =>
        {
            return Ok((
                UpdateOutcome::Kept,
                format!("all bits of {count} renderings are those of the old reference"),
            ));
        }
        // Both have the same seeds: their differences have less noise than the test allows for.
        Some(Ok(old)) => match judge(evidence, &old.evidence, level(plan, case)) {
            Ok(judgement) => sentence::of_judgement(&judgement, &case.budget, case.budget.reference_seeds),
            Err(error) => format!("cannot be compared with the old reference: {error}"),
        },
    };
    if let Some(reason) = &options.reason {
        write(&path, evidence, Provenance { reason: Some(reason.clone()), ..provenance })?;
    }
    Ok((UpdateOutcome::Written, sentence))
}

fn write(path: &Path, evidence: &Evidence, provenance: Provenance) -> Result<()> {
    if let Some(folder) = path.parent() {
        let made = std::fs::create_dir_all(folder).into_diagnostic();
        made.wrap_err_with(|| format!("cannot make the folder of the references, {}", folder.display()))?;
    }
    evidence.write(path, &provenance.attributes()).into_diagnostic()
}
