//! The first commit whose picture has changed: `git bisect` in a temporary worktree, with a case judged at each step.
//!
//! The manifest and the reference are those of the folder that was named, at every step; scenes and renderers are those of the revision, as far as
//! they are in the repository. Their paths are those of the user's checkout with its top level replaced by that of the worktree.

mod tree;

use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};
use std::time::Duration;

use miette::{IntoDiagnostic, Result, WrapErr};

pub use self::tree::BisectCommit;
use self::tree::{BisectAnswer, GitTree, commit, top_level};
use super::case_run::CaseRunner;
use super::child::run_child_unless;
use super::plan::{CaseRenderer, ReferenceSource, RegressCase, RegressPlan};
use super::provenance::FileHashes;
use super::renderings::CaseStop;
use super::run::choose;
use super::run_report::CaseVerdict;
use crate::render::process;

/// What is searched for, and where.
#[derive(Clone, Debug)]
pub struct BisectOptions {
    /// Name of a case, or a word that only one name contains.
    pub case: String,
    /// A revision whose picture is that of the reference.
    pub good: String,
    /// A later one whose picture has changed.
    pub bad: String,
    /// Shell command that builds the renderer at the top level of the worktree.
    pub build: Option<String>,
    /// A folder of the repository; `None` for the one that holds the scenes.
    pub repository: Option<PathBuf>,
    /// This program: an absolute path.
    pub program: PathBuf,
}

/// What a revision's picture is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BisectStep {
    /// That of the reference: the sentence of its judgement.
    Equal(String),
    /// Another: the sentence of its judgement.
    Changed(String),
    /// It could not be built, rendered or compared, for this reason.
    Skipped(String),
}

/// The end of a search.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BisectOutcome {
    /// The first changed commit, and the sentence of its judgement.
    First(BisectCommit, String),
    /// One of these is the first changed commit: all but the last could not be judged.
    OneOf(Vec<BisectCommit>),
    /// Ctrl-C.
    Interrupted,
}

/// Finds the first changed commit. `tell` gets each commit as its turn begins, and what it turned out to be.
///
/// The user's checkout stays as it is, with all that is not committed; the worktree is removed at the end and after Ctrl-C.
///
/// # Errors
///
/// For a case, repository or revision that there is not; when neither scene nor renderer are in the repository; when the good revision has changed
/// already or the bad one has not, or one of both cannot be judged.
pub fn bisect(
    plan: &RegressPlan,
    options: &BisectOptions,
    tell: &dyn Fn(&BisectCommit, Option<&BisectStep>),
) -> Result<BisectOutcome> {
    let case = match choose(plan, std::slice::from_ref(&options.case))?[..] {
        [case] => case,
        ref several => {
            let names: Vec<&str> = several.iter().map(|case| case.name.as_str()).collect();
            let help = format!("name one of {}", names.join(", "));
            return Err(miette::miette!(help = help, "{} is in the names of several cases", options.case));
        }
    };
    let folder = plan.folder.canonicalize().into_diagnostic();
    let folder = folder.wrap_err_with(|| format!("cannot open {}", plan.folder.display()))?;
    match search(plan, case, &folder, options, tell) {
        Ok(outcome) => Ok(outcome),
        Err(CaseStop::Interrupted) => Ok(BisectOutcome::Interrupted),
        Err(CaseStop::Broken(reason)) => Err(miette::miette!("{reason}")),
    }
}

fn search(
    plan: &RegressPlan,
    case: &RegressCase,
    folder: &Path,
    options: &BisectOptions,
    tell: &dyn Fn(&BisectCommit, Option<&BisectStep>),
) -> Result<BisectOutcome, CaseStop> {
    let repository = top_level(options.repository.as_deref().unwrap_or(folder)).map_err(|reason| {
        CaseStop::Broken(format!("{reason}; --repository names one that holds the scenes or the renderer"))
    })?;
    let of = |revision: &str| commit(&repository, revision).map_err(CaseStop::Broken);
    let (good, bad) = (of(&options.good)?, of(&options.bad)?);
    if good.hash == bad.hash {
        let both = format!("--good {} and --bad {} are the same commit", options.good, options.bad);
        return Err(CaseStop::Broken(both));
    }
    let tree = GitTree::new(repository.clone(), &good.hash).map_err(CaseStop::Broken)?;
    let site = BisectSite::new(plan, case, folder, options, tree)?;
    let judged = |commit: &BisectCommit| {
        tell(commit, None);
        let step = site.step(commit)?;
        tell(commit, Some(&step));
        Ok(step)
    };
    match judged(&good)? {
        BisectStep::Equal(_) => {}
        BisectStep::Changed(sentence) => {
            return Err(CaseStop::Broken(format!(
                "the good revision {} has changed already: {sentence}; give an earlier one with --good",
                options.good
            )));
        }
        BisectStep::Skipped(reason) => return Err(unjudged("good", &options.good, &reason)),
    }
    let mut sentences = HashMap::new();
    match judged(&bad)? {
        BisectStep::Changed(sentence) => sentences.insert(bad.hash.clone(), sentence),
        BisectStep::Equal(sentence) => {
            return Err(CaseStop::Broken(format!(
                "the bad revision {} has the picture of the reference: {sentence}; what is not committed is no part of it",
                options.bad
            )));
        }
        BisectStep::Skipped(reason) => return Err(unjudged("bad", &options.bad, &reason)),
    };
    let ask = |words: &[&str]| site.tree.bisect(words).map_err(CaseStop::Broken);
    let mut answer = ask(&["start", "--no-checkout", &bad.hash, &good.hash, "--"])?;
    loop {
        answer = match answer {
            BisectAnswer::First(hash) => {
                let sentence = sentences.remove(&hash).unwrap_or_default();
                return Ok(BisectOutcome::First(of(&hash)?, sentence));
            }
            BisectAnswer::OneOf(hashes) => {
                return Ok(BisectOutcome::OneOf(
                    hashes.iter().map(|hash| of(hash)).collect::<Result<_, _>>()?,
                ));
            }
            BisectAnswer::Next(hash) => match judged(&of(&hash)?)? {
                BisectStep::Equal(_) => ask(&["good", &hash])?,
                BisectStep::Changed(sentence) => {
                    sentences.insert(hash.clone(), sentence);
                    ask(&["bad", &hash])?
                }
                BisectStep::Skipped(_) => ask(&["skip", &hash])?,
            },
        };
    }
}

fn unjudged(which: &str, revision: &str, reason: &str) -> CaseStop {
    CaseStop::Broken(format!("the {which} revision {revision} cannot be judged: {reason}"))
}

/// The case in the worktree.
struct BisectSite {
    plan: RegressPlan,
    case: RegressCase,
    program: PathBuf,
    build: Option<String>,
    tree: GitTree,
}

impl BisectSite {
    /// Moves what is in the repository to the worktree, which must have the good revision.
    fn new(
        plan: &RegressPlan,
        case: &RegressCase,
        folder: &Path,
        options: &BisectOptions,
        tree: GitTree,
    ) -> Result<Self, CaseStop> {
        let moved = |path: &Path| Some(tree.path.join(path.strip_prefix(&tree.repository).ok()?));
        let is_built = options.build.is_some();
        // A program that nobody builds and no revision has is that of the user's checkout.
        let moved_file = |path: &Path| moved(path).filter(|path| is_built || path.exists());
        let mut depends = false;
        let (mut plan, mut case) = (plan.clone(), case.clone());
        let scene = case.scene.strip_prefix(&plan.folder).unwrap_or(&case.scene).to_path_buf();
        depends |= moved(&normalised(&folder.join(&scene))).is_some();
        plan.folder = moved(folder).unwrap_or_else(|| folder.to_path_buf());
        case.scene = match scene.is_absolute() {
            true => moved(&normalised(&scene)).unwrap_or(scene),
            false => plan.folder.join(scene),
        };
        let mut program = options.program.clone();
        let mut move_words = |renderer: &mut CaseRenderer| match renderer {
            CaseRenderer::Pointillist { .. } => {
                if let Some(built) = moved(&options.program).filter(|_| is_built) {
                    (program, depends) = (built, true);
                }
            }
            CaseRenderer::Command { words, .. } => {
                for word in words.iter_mut().filter(|word| word.contains('/') && !word.contains('{')) {
                    let own = normalised(&folder.join(&*word));
                    if let Some(there) = moved_file(&own) {
                        (*word, depends) = (there.display().to_string(), true);
                    } else if own.exists() {
                        *word = own.display().to_string();
                    }
                }
            }
        };
        move_words(&mut case.renderer);
        if let ReferenceSource::Rendered { renderer, .. } = &mut case.reference {
            move_words(renderer);
        }
        if !depends {
            return Err(CaseStop::Broken(format!(
                "{} has neither its scene nor its renderer in {}: nothing can change from revision to revision (a renderer that is built \
                 needs --build)",
                case.name,
                tree.repository.display()
            )));
        }
        Ok(Self { plan, case, program, build: options.build.clone(), tree })
    }

    /// Builds, renders and judges a revision.
    fn step(&self, commit: &BisectCommit) -> Result<BisectStep, CaseStop> {
        if process::is_interrupted() {
            return Err(CaseStop::Interrupted);
        }
        self.tree.check_out(&commit.hash).map_err(CaseStop::Broken)?;
        let results = self.tree.place.path().join(&commit.hash);
        std::fs::create_dir_all(results.join(&self.case.name)).map_err(CaseStop::broken)?;
        if let Some(build) = &self.build {
            let shell = if cfg!(windows) { ["cmd", "/C"] } else { ["/bin/sh", "-c"] };
            let words = [shell[0], shell[1], build].map(String::from);
            let (log, unlimited) = (results.join("build.log"), Duration::MAX);
            let built = run_child_unless(&words, &self.tree.path, &log, unlimited, &process::is_interrupted);
            match built {
                Err(_) if process::is_interrupted() => return Err(CaseStop::Interrupted),
                Err(reason) => return Ok(BisectStep::Skipped(format!("the build {reason}"))),
                Ok(()) => {}
            }
        }
        let hashes = FileHashes::default();
        let runner = CaseRunner {
            plan: &self.plan,
            results: &results,
            program: &self.program,
            seed_base: None,
            hashes: &hashes,
        };
        let report = runner.run(&self.case)?;
        std::fs::remove_dir_all(&results).map_err(CaseStop::broken)?;
        Ok(match report.verdict {
            CaseVerdict::SameBits | CaseVerdict::EqualWithinNoise => BisectStep::Equal(report.sentence),
            CaseVerdict::Changed => BisectStep::Changed(report.sentence),
            CaseVerdict::Broken => BisectStep::Skipped(report.sentence),
        })
    }
}

/// A path without `.` and `..`, as far as its words say.
pub(super) fn normalised(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => {
                out.pop();
            }
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_compared_without_detours() {
        assert_eq!(normalised(Path::new("/a/b/../c/./d")), Path::new("/a/c/d"));
        assert_eq!(normalised(Path::new("/../a")), Path::new("/a"));
    }
}
