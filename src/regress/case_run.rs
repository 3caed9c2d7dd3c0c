//! One case: its renderings, as many as are needed, and its verdict.

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::case_times::CaseTimes;
use super::evidence::Evidence;
use super::judgement::{Judgement, JudgementLevel, judge};
use super::plan::{CaseBudget, CaseRenderer, ReferenceSource, RegressCase, RegressPlan};
use super::provenance::{FileHashes, Provenance, StoredReference, stored};
use super::renderings::{CaseRenderings, CaseStop, RenderingTally};
use super::run_report::{CaseReport, CaseVerdict};
use super::sentence;
use super::sequential::Looks;
use crate::render::device::CPU;

/// First seed of a run. References have the seeds from 0 on.
const SEED_BASE: u32 = 1000;

/// Added to the first seed for a reference that is rendered in the same run: the program may be the same with another method.
const AGAINST_SEEDS: u32 = 1_000_000;

/// Largest first seed: all seeds of a run fit in 32 bits with it.
const LARGEST_FIRST_SEED: u32 = 2_000_000_000;

/// What all cases of a run share.
#[derive(Debug)]
pub struct CaseRunner<'a> {
    /// All cases.
    pub plan: &'a RegressPlan,
    /// Folder of the results: absolute.
    pub results: &'a Path,
    /// This program.
    pub program: &'a Path,
    /// First seed, if it was asked for.
    pub seed_base: Option<u32>,
    /// Hashes of files.
    pub hashes: &'a FileHashes,
}

/// What a case is compared with.
enum CaseReference {
    /// A picture on disk.
    File { path: PathBuf, stored: StoredReference },
    /// Another program.
    Rendered(Box<CaseRenderings>),
}

/// The outcome of a case that is not broken.
struct CaseOutcome {
    verdict: CaseVerdict,
    sentence: String,
    judgement: Option<Judgement>,
    evidence: Evidence,
    /// Renderings that it stands on, and their seeds.
    tally: RenderingTally,
    seeds: Range<u32>,
    reference: PathBuf,
}

/// Probability of a false alarm and tolerance of one look at a case: that of the whole run over all cases of the plan (Bonferroni), and over the
/// looks at the case.
pub fn level(plan: &RegressPlan, case: &RegressCase) -> JudgementLevel {
    let of_case = plan.false_alarm / plan.cases.len().max(1) as f64;
    JudgementLevel { false_alarm: looks(&case.budget).level(of_case), relative: case.tolerance.relative }
}

/// When a case is looked at.
pub fn looks(budget: &CaseBudget) -> Looks {
    Looks::of(budget.seeds, budget.most_seeds)
}

/// Whether more renderings are worth their time after this look: something is unlikely but not proven, or what is to be detected would not have been.
pub fn is_open(judgement: &Judgement, budget: &CaseBudget) -> bool {
    // NaN counts as not good enough.
    let detects = budget.detect.is_none_or(|wanted| judgement.detectable <= wanted);
    !judgement.changed && (judgement.undecided || !detects)
}

/// The first seed of a run that shares none with the reference.
fn first_seed(asked: Option<u32>, most: u32, reference: Option<&Range<u32>>) -> Result<u32, CaseStop> {
    let first = asked.unwrap_or(SEED_BASE);
    if first > LARGEST_FIRST_SEED {
        return Err(CaseStop::Broken(format!(
            "--seed-base {first} is too large: give {LARGEST_FIRST_SEED} or less"
        )));
    }
    match reference {
        Some(used) if first < used.end && used.start < first.saturating_add(most) => match asked {
            Some(_) => Err(CaseStop::Broken(format!(
                "seeds {first} to {} are partly those of the reference ({}..{}): give another --seed-base",
                first.saturating_add(most),
                used.start,
                used.end
            ))),
            None => Ok(used.end.min(LARGEST_FIRST_SEED).next_multiple_of(SEED_BASE)),
        },
        _ => Ok(first),
    }
}

/// Whether a run of a class that does not ask for bits begins with a look at them: the reference is the case's own, this program renders it, and
/// independent renderings were not asked for. A device that is certainly another one has other bits; so has another method, but its
/// reference is not its own.
fn can_have_same_bits(case: &RegressCase, stored: &StoredReference, seed_base: Option<u32>) -> bool {
    let CaseRenderer::Pointillist { device: asked, .. } = &case.renderer else { return false };
    let is_own = matches!(&case.reference, ReferenceSource::Stored(name) if *name == case.name);
    let is_cpu = |device: &Option<String>| device.as_deref() == Some(CPU);
    let is_other_device =
        asked.is_some() && stored.device.is_some() && is_cpu(asked) != is_cpu(&stored.device);
    is_own && seed_base.is_none() && stored.repeatable().is_some() && !is_other_device
}

impl CaseRunner<'_> {
    /// Renders and judges a case. Files of single renderings are in `results/NAME/`, its log is `results/NAME.log`.
    ///
    /// # Errors
    /// Only when Ctrl-C was pressed: a case that cannot be rendered or compared is [`CaseVerdict::Broken`].
    pub fn run(&self, case: &RegressCase) -> Result<CaseReport, CaseStop> {
        let (place, log) = (self.results.join(&case.name), self.results.join(format!("{}.log", case.name)));
        let mut tried = self.renderings(case, [&place, &log], "seed");
        let outcome = match self.outcome(case, &mut tried, [&place, &log]) {
            Ok(outcome) => self.write(case, &outcome).map(|()| outcome),
            Err(stop) => Err(stop),
        };
        let mut report = broken_report(self.plan, case, String::new());
        report.log = log.is_file().then(|| format!("{}.log", case.name).into());
        match outcome {
            Ok(outcome) => {
                report.verdict = outcome.verdict;
                report.sentence = outcome.sentence;
                report.judgement = outcome.judgement;
                report.picture = Some(format!("{}.exr", case.name).into());
                report.reference = Some(outcome.reference);
                describe(&mut report, &outcome.tally);
            }
            Err(CaseStop::Broken(reason)) => {
                report.sentence = reason;
                describe(&mut report, tried.tally());
            }
            Err(CaseStop::Interrupted) => return Err(CaseStop::Interrupted),
        }
        Ok(report)
    }

    /// Compares bits where they can be the same, and expectations where they are not. Bits that differ are a change only where the class asks
    /// for them.
    fn outcome(
        &self,
        case: &RegressCase,
        tried: &mut CaseRenderings,
        files: [&Path; 2],
    ) -> Result<CaseOutcome, CaseStop> {
        let reference = self.reference(case, files)?;
        let (mut differ, mut lost_seconds) = (None, 0.0);
        if let CaseReference::File { path, stored } = &reference {
            if case.tolerance.same_bits || can_have_same_bits(case, stored, self.seed_base) {
                match self.same_bits(case, stored, path, files, tried)? {
                    Ok(same) => return Ok(same),
                    Err(told) => differ = Some(told).filter(|_| case.tolerance.same_bits),
                }
            }
            lost_seconds = tried.tally().seconds;
            // Made as the reference was: methods with photons have another bias where the order is not fixed.
            *tried = self.renderings(case, files, "seed").repeatable(stored.deterministic);
        }
        let mut outcome = self.judged(case, reference, tried)?;
        outcome.tally.seconds += lost_seconds;
        if let Some(differ) = differ {
            outcome.verdict = CaseVerdict::Changed;
            outcome.sentence = format!("{differ}; with other seeds: {}", outcome.sentence);
        }
        Ok(outcome)
    }

    /// None yet, by the case's own renderer.
    fn renderings(&self, case: &RegressCase, files: [&Path; 2], kind: &str) -> CaseRenderings {
        CaseRenderings::new(self.plan, case, self.program, files, kind)
    }

    /// Opens the reference.
    fn reference(&self, case: &RegressCase, files: [&Path; 2]) -> Result<CaseReference, CaseStop> {
        match &case.reference {
            ReferenceSource::Stored(name) => {
                let path = stored(self.plan, name);
                if !path.exists() {
                    return Err(CaseStop::Broken(format!(
                        "there is no reference {}: `pointillist regress update {} {name} --reason …` renders it",
                        path.display(),
                        self.plan.folder.display()
                    )));
                }
                let stored = StoredReference::read(&path).map_err(CaseStop::broken)?;
                Ok(CaseReference::File { path, stored })
            }
            ReferenceSource::Picture(path) => {
                let evidence = Evidence::of_single(path).map_err(CaseStop::broken)?;
                let stored = StoredReference { evidence, seeds: None, deterministic: false, device: None };
                Ok(CaseReference::File { path: path.clone(), stored })
            }
            ReferenceSource::Rendered { renderer, spp } => {
                let renderings = self.renderings(case, files, "against");
                Ok(CaseReference::Rendered(Box::new(renderings.by(renderer, *spp))))
            }
        }
    }

    /// Renders the reference's own seeds: the outcome if all bits are the same, else how many renderings differ. The first one that does is the
    /// last, unless the class asks for bits.
    fn same_bits(
        &self,
        case: &RegressCase,
        reference: &StoredReference,
        path: &Path,
        files: [&Path; 2],
        tried: &mut CaseRenderings,
    ) -> Result<Result<CaseOutcome, String>, CaseStop> {
        let Some(seeds) = reference.repeatable() else {
            let message =
                "was not made for a comparison of bits: `pointillist regress update` renders it anew";
            return Err(CaseStop::Broken(format!("the reference {} {message}", path.display())));
        };
        let seeds = seeds.start..seeds.end.min(seeds.start.saturating_add(case.budget.seeds));
        *tried = self.renderings(case, files, "bits").repeatable(true);
        let mut differ = 0;
        for (seed, then) in seeds.clone().zip(&reference.evidence.hashes) {
            tried.add([seed])?;
            differ += u32::from(tried.hashes().last() != Some(then));
            if differ > 0 && !case.tolerance.same_bits {
                break;
            }
        }
        let count = tried.tally().count;
        if differ > 0 {
            return Ok(Err(format!(
                "{differ} of {count} renderings have other bits than those of the reference"
            )));
        }
        Ok(Ok(CaseOutcome {
            verdict: CaseVerdict::SameBits,
            sentence: format!("all bits of {count} renderings are those of the reference"),
            judgement: None,
            evidence: tried.evidence()?,
            tally: tried.tally().clone(),
            seeds,
            reference: absolute(path),
        }))
    }

    /// Compares expectations, with more renderings while the answer is open.
    fn judged(
        &self,
        case: &RegressCase,
        mut reference: CaseReference,
        tried: &mut CaseRenderings,
    ) -> Result<CaseOutcome, CaseStop> {
        let budget = &case.budget;
        let used = match &reference {
            CaseReference::File { stored, .. } => stored.seeds.as_ref(),
            CaseReference::Rendered(_) => None,
        };
        let first = first_seed(self.seed_base, budget.most_seeds, used)?;
        let level = level(self.plan, case);
        let looks = looks(budget).renderings;
        for (look, &count) in looks.iter().enumerate() {
            tried.add(first + tried.tally().count..first + count)?;
            let now = tried.evidence()?;
            let against = first + AGAINST_SEEDS..first + AGAINST_SEEDS + count;
            if let CaseReference::Rendered(renderings) = &mut reference {
                renderings.add(against.start + renderings.tally().count..against.end)?;
            }
            let made;
            let then = match &reference {
                CaseReference::File { stored, .. } => &stored.evidence,
                CaseReference::Rendered(renderings) => {
                    made = renderings.evidence()?;
                    &made
                }
            };
            let judgement = judge(&now, then, level).map_err(CaseStop::broken)?;
            if is_open(&judgement, budget) && look + 1 < looks.len() {
                continue;
            }
            let verdict =
                if judgement.changed { CaseVerdict::Changed } else { CaseVerdict::EqualWithinNoise };
            let sentence = sentence::of_judgement(&judgement, budget, count);
            let path = match &reference {
                CaseReference::File { path, .. } => absolute(path),
                CaseReference::Rendered(renderings) => {
                    let path = self.results.join(format!("{}.against.exr", case.name));
                    let mut provenance = self.provenance(case, renderings.tally(), against);
                    if let ReferenceSource::Rendered { spp, .. } = &case.reference {
                        provenance.spp = *spp;
                    }
                    then.write(&path, &provenance.attributes()).map_err(CaseStop::broken)?;
                    path
                }
            };
            return Ok(CaseOutcome {
                verdict,
                sentence,
                judgement: Some(judgement),
                evidence: now,
                tally: tried.tally().clone(),
                seeds: first..first + count,
                reference: path,
            });
        }
        Err(CaseStop::Broken("no rendering was asked for: give `seeds` of 2 or more".into()))
    }

    /// Writes the evidence of this run.
    fn write(&self, case: &RegressCase, outcome: &CaseOutcome) -> Result<(), CaseStop> {
        let path = self.results.join(format!("{}.exr", case.name));
        let attributes = self.provenance(case, &outcome.tally, outcome.seeds.clone()).attributes();
        outcome.evidence.write(&path, &attributes).map_err(CaseStop::broken)
    }

    /// How renderings of a case were made.
    pub fn provenance(&self, case: &RegressCase, tally: &RenderingTally, seeds: Range<u32>) -> Provenance {
        let scene = case.scene.strip_prefix(&self.plan.folder).unwrap_or(&case.scene);
        // Where this program and its results were says nothing of the picture.
        let here = |word: &String| match Path::new(word) {
            path if path == self.program || path.starts_with(self.results) => {
                path.file_name().unwrap_or_default().to_string_lossy().into_owned()
            }
            _ => word.clone(),
        };
        Provenance {
            reason: None,
            scene: scene.display().to_string(),
            scene_hash: self.hashes.scene(&case.scene),
            command: tally.command.iter().map(here).collect::<Vec<_>>().join(" "),
            device: tally.device.clone().unwrap_or_else(|| device(&case.renderer)),
            seeds,
            spp: case.budget.spp,
            deterministic: tally.deterministic,
        }
    }
}

/// What is known of the renderings of a case.
fn describe(report: &mut CaseReport, tally: &RenderingTally) {
    report.renderings = tally.count;
    report.seconds = tally.seconds;
    report.times = CaseTimes::of(&tally.times);
    report.command.clone_from(&tally.command);
    if let Some(device) = &tally.device {
        report.device.clone_from(device);
    }
}

fn absolute(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}

/// The report of a case of which there is only the reason why it is broken.
pub(super) fn broken_report(plan: &RegressPlan, case: &RegressCase, reason: String) -> CaseReport {
    CaseReport {
        name: case.name.clone(),
        scene: case.scene.strip_prefix(&plan.folder).unwrap_or(&case.scene).to_path_buf(),
        method: method(&case.renderer),
        device: device(&case.renderer),
        command: Vec::new(),
        verdict: CaseVerdict::Broken,
        sentence: reason,
        judgement: None,
        tolerance: case.tolerance.class.clone(),
        renderings: 0,
        spp: case.budget.spp,
        seconds: 0.0,
        picture: None,
        reference: None,
        log: None,
        times: None,
        timing: None,
    }
}

/// The method that is asked for, or what the renderer is called.
pub fn method(renderer: &CaseRenderer) -> String {
    match renderer {
        CaseRenderer::Pointillist { method, .. } => method.clone().unwrap_or_else(|| "of the scene".into()),
        CaseRenderer::Command { name, .. } => name.clone(),
    }
}

/// The device that is asked for.
pub fn device(renderer: &CaseRenderer) -> String {
    match renderer {
        CaseRenderer::Pointillist { device, .. } => device.clone().unwrap_or_else(|| "best device".into()),
        CaseRenderer::Command { name, .. } => name.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Grid;
    use crate::regress::manifest::read_plan;

    /// A run never renders a seed of its reference: the two would not be independent.
    #[test]
    fn seeds_are_not_those_of_the_reference() {
        assert_eq!(first_seed(None, 32, None), Ok(1000));
        assert_eq!(first_seed(None, 32, Some(&(0..32))), Ok(1000));
        assert_eq!(first_seed(None, 32, Some(&(1010..1020))), Ok(2000));
        assert_eq!(first_seed(Some(40), 32, Some(&(0..32))), Ok(40));
        assert!(matches!(first_seed(Some(31), 32, Some(&(0..32))), Err(CaseStop::Broken(_))));
    }

    /// Bits are looked at only where they can be the same: other cases waste no rendering.
    #[test]
    fn bits_are_compared_where_they_can_be_the_same() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
        write("a.xml", "<scene version=\"3.0.0\"/>");
        let manifest = "[[case]]\nscene = \"a.xml\"\ndevices = [\"cpu\", \"llvmpipe\"]\none_reference = [\"devices\"]\n\
                        [renderer.peer]\ncommand = [\"peer\", \"{scene}\", \"{output}\", \"{seed}\"]\n\
                        [[case]]\nname = \"peer\"\nscene = \"a.xml\"\nrenderer = \"peer\"\n";
        write("regress.toml", manifest);
        let plan = read_plan(folder.path(), None).expect("a plan");
        let [cpu, llvmpipe, peer] = &plan.cases[..] else { panic!("{plan:?}") };
        let pixels = Grid::try_filled(2, 2, [1.0; 3]).expect("memory");
        let evidence = Evidence::of_grids(&[&pixels, &pixels]).expect("one size");
        let stored = StoredReference {
            evidence,
            seeds: Some(0..2),
            deterministic: true,
            device: Some("cpu".to_owned()),
        };
        assert!(can_have_same_bits(cpu, &stored, None));
        assert!(!can_have_same_bits(cpu, &stored, Some(5000)), "independent renderings are asked for");
        assert!(!can_have_same_bits(llvmpipe, &stored, None), "the reference is that of another case");
        assert!(!can_have_same_bits(peer, &stored, None), "nothing is known of the order of another program");
        let mut other = stored.clone();
        other.device = Some("llvmpipe (LLVM 15.0.6, 256 bits), a driver".to_owned());
        assert!(!can_have_same_bits(cpu, &other, None), "the device is another one");
        other = StoredReference { deterministic: false, ..stored.clone() };
        assert!(!can_have_same_bits(cpu, &other, None), "it was rendered in any order");
        other = StoredReference { seeds: Some(0..3), ..stored };
        assert!(!can_have_same_bits(cpu, &other, None), "there are not as many hashes as seeds");
    }
}
