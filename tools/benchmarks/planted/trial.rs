//! Trials: a reference and a run drawn from pools, and judged as `pointillist regress run` does.

use std::path::Path;

use rayon::prelude::*;

use pointillist::image::{Grid, ImageError};
use pointillist::math::bits::mix;
use pointillist::math::random::Random;
use pointillist::regress::case_run::{is_open, level, looks};
use pointillist::regress::evidence::Evidence;
use pointillist::regress::judgement::judge;
use pointillist::regress::plan::{RegressCase, RegressPlan};

use super::super::common::{Outcome, median};
use super::pool::Pool;
use super::power::{Share, Statement};

/// Draws and judges.
pub struct Trials<'a> {
    /// All cases, over which the probability of a false alarm is divided.
    pub plan: &'a RegressPlan,
    /// The case.
    pub case: &'a RegressCase,
    /// Renderings of the reference.
    pub reference: &'a Pool,
    /// How many of them a reference has.
    pub reference_seeds: u32,
    /// Renderings of runs.
    pub run: &'a Pool,
    /// Both pools are of the same renderings, changed or not: no trial has one of them on both sides.
    pub paired: bool,
    /// Chooses the draws.
    pub seed: u64,
}

/// The end of a trial.
#[derive(Clone, Copy, Debug)]
pub struct Trial {
    /// The case is changed.
    pub changed: bool,
    /// P value of the first look.
    pub first_p: f64,
    /// Renderings of the run at the last look.
    pub renderings: u32,
    /// Change of brightness that would have been found with 90 %, and that of one area.
    pub detectable: [f64; 2],
}

impl Trials<'_> {
    /// So many trials, on all cores.
    ///
    /// # Errors
    /// When a reference cannot be written to a temporary folder.
    pub fn make(&self, count: u64) -> Outcome<Vec<Trial>> {
        let folder = tempfile::tempdir()?;
        let trials = (0..count).into_par_iter().map(|number| {
            let path = folder.path().join(format!("{number}.exr"));
            let trial = self.judge(number, &path);
            // All references together would take gigabytes.
            let _ = std::fs::remove_file(&path);
            trial
        });
        Ok(trials.collect::<Result<_, _>>()?)
    }

    /// One trial; its reference goes through a file, as a stored one does.
    fn judge(&self, number: u64, path: &Path) -> Result<Trial, ImageError> {
        let mut random = Random(mix(self.seed ^ mix(number)));
        let budget = &self.case.budget;
        let sizes = [self.reference_seeds, budget.most_seeds].map(|n| n as usize);
        let [reference, run] = if self.paired {
            let mut both = drawn(self.run.renderings.len(), sizes[0] + sizes[1], &mut random);
            let run = both.split_off(sizes[0]);
            [both, run]
        } else {
            [(self.reference, sizes[0]), (self.run, sizes[1])]
                .map(|(pool, count)| drawn(pool.renderings.len(), count, &mut random))
        };
        evidence(self.reference, &reference)?.write(path, &[])?;
        let (reference, _) = Evidence::read(path)?;
        let level = level(self.plan, self.case);
        let mut first_p = None;
        let looks = looks(budget).renderings;
        let mut look = 0;
        loop {
            let renderings = looks[look];
            let judgement = judge(&evidence(self.run, &run[..renderings as usize])?, &reference, level)?;
            let first_p = *first_p.get_or_insert(judgement.p_value);
            if is_open(&judgement, budget) && look + 1 < looks.len() {
                look += 1;
                continue;
            }
            let detectable = [judgement.detectable, judgement.detectable_area];
            return Ok(Trial { changed: judgement.changed, first_p, renderings, detectable });
        }
    }

    /// By how much less than those of independent renderings the differences of so many draws vary, of the run and of the reference: two pools
    /// are drawn from without replacement.
    pub fn spread(&self, renderings: [f64; 2]) -> f64 {
        if self.paired {
            // Parts of one pool differ as independent renderings do.
            return 1.0;
        }
        let sum = |sizes: [f64; 2]| 1.0 / sizes[0] + 1.0 / sizes[1];
        let pools = [self.run, self.reference].map(|pool| pool.renderings.len() as f64);
        (1.0 - sum(pools) / sum(renderings)).max(0.0).sqrt()
    }

    /// What trials without a change state: medians.
    pub fn statement(&self, clean: &[Trial]) -> Statement {
        let level = level(self.plan, self.case);
        let middle = |value: fn(&Trial) -> f64| median(clean.iter().map(value).collect());
        Statement {
            detectable: middle(|trial| trial.detectable[0]),
            relative: level.relative,
            false_alarm: level.false_alarm,
            renderings: [middle(|trial| f64::from(trial.renderings)), f64::from(self.reference_seeds)],
        }
    }
}

/// How many are changed.
pub fn changed(trials: &[Trial]) -> Share {
    Share { found: trials.iter().filter(|trial| trial.changed).count() as u64, trials: trials.len() as u64 }
}

/// `count` different numbers below `all`, in random order.
fn drawn(all: usize, count: usize, random: &mut Random) -> Vec<usize> {
    let mut order: Vec<usize> = (0..all).collect();
    for i in 0..count.min(all) {
        let other = i + random.below(all - i);
        order.swap(i, other);
    }
    order.truncate(count);
    order
}

/// The evidence of these renderings of a pool.
fn evidence(pool: &Pool, numbers: &[usize]) -> Result<Evidence, ImageError> {
    let grids: Vec<&Grid<[f32; 3]>> = numbers.iter().map(|&i| &pool.renderings[i]).collect();
    Evidence::of_grids(&grids)
}
