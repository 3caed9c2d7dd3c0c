//! All cases of the study, one after the other.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;
use std::rc::Rc;

use clap::ValueEnum;

use pointillist::math::bits::mix;
use pointillist::regress::plan::{CaseRenderer, ReferenceSource, RegressCase, RegressPlan};
use pointillist::scene::{SceneDesc, load};

use super::super::common::{Outcome, median};
use super::Arguments;
use super::plants::Plant;
use super::pool::{Pool, change_of_brightness};
use super::power::Share;
use super::spirv::{NARROW_TENT, replace_constant};
use super::trial::{Trial, Trials, changed};

/// First seed of runs whose reference is that of another case: the two must not share seeds.
const SEEDS_OF_OTHERS: u32 = 1_000_000;

/// First seed of the first planted change.
const SEEDS_OF_PLANTS: u32 = 2_000_000;

/// Between the first seeds of planted changes.
const SEEDS_OF_A_PLANT: u32 = 100_000;

/// What becomes of a case without a change.
pub struct CleanRow {
    /// Name of the case.
    pub case: String,
    /// Runs that are changed.
    pub changed: Share,
    /// Part of the first looks with a p value below .05 and .01.
    pub small: [f64; 2],
    /// Median of the renderings of a run.
    pub renderings: f64,
    /// Median of what is stated to be detectable: the whole picture, an area.
    pub detectable: [f64; 2],
}

/// What becomes of a planted change in a case.
pub struct PlantedRow {
    /// The change.
    pub plant: Plant,
    /// Name of the case.
    pub case: String,
    /// Relative change of brightness and its standard error.
    pub change: [f64; 2],
    /// As for [`CleanRow`].
    pub detectable: [f64; 2],
    /// Power that is promised for a change of this size; for other seeds the probability of a false alarm that is allowed.
    pub promised: f64,
    /// Trials in which it is found.
    pub found: Share,
}

/// The study so far.
pub struct PlantStudy<'a> {
    /// All cases.
    pub plan: &'a RegressPlan,
    arguments: &'a Arguments,
    /// In how many cases each change was planted.
    planted_in: BTreeMap<Plant, usize>,
    /// The last reference that was rendered, by the name of its case.
    reference: Option<(String, Rc<Pool>)>,
    /// A program with a broken pass, and the folder that holds it.
    broken: Option<(PathBuf, tempfile::TempDir)>,
    /// For each run without a change whether some case is changed.
    pub red: Vec<bool>,
    /// Cases without a change.
    pub clean: Vec<CleanRow>,
    /// Planted changes.
    pub planted: Vec<PlantedRow>,
    /// Cases that were left out, and why.
    pub left_out: Vec<String>,
}

impl<'a> PlantStudy<'a> {
    /// Before the first case.
    pub fn new(plan: &'a RegressPlan, arguments: &'a Arguments) -> Self {
        Self {
            plan,
            arguments,
            planted_in: BTreeMap::new(),
            reference: None,
            broken: None,
            red: vec![false; arguments.clean as usize],
            clean: Vec::new(),
            planted: Vec::new(),
            left_out: Vec::new(),
        }
    }

    /// The changes that were asked for.
    fn plants(&self) -> Vec<Plant> {
        match self.arguments.plants.as_slice() {
            _ if self.arguments.trials == 0 => Vec::new(),
            [] => Plant::value_variants().to_vec(),
            some => some.to_vec(),
        }
    }

    /// The changes that were asked for and have been planted nowhere.
    pub fn unplanted(&self) -> Vec<Plant> {
        self.plants().into_iter().filter(|plant| !self.planted_in.contains_key(plant)).collect()
    }

    /// Studies a case, unless chance has no part in it or another program renders it.
    ///
    /// # Errors
    /// When it cannot be rendered.
    pub fn case(&mut self, case: &RegressCase) -> Outcome {
        let source = match self.source(case) {
            Ok(source) => source,
            Err(reason) => {
                self.left_out.push(format!("{}: {reason}", case.name));
                return Ok(());
            }
        };
        let desc = load(&case.scene, &[])?.desc;
        let is_own = source.name == case.name;
        let size = self.arguments.pool.max(source.budget.reference_seeds + case.budget.most_seeds);
        let pool = if is_own {
            self.reference_pool(source, size)?
        } else {
            Rc::new(Pool::of_scene(case, &desc, SEEDS_OF_OTHERS..SEEDS_OF_OTHERS + size)?)
        };
        let reference = self.reference_pool(source, size)?;
        let trials = Trials {
            plan: self.plan,
            case,
            reference: &reference,
            reference_seeds: source.budget.reference_seeds,
            run: &pool,
            paired: is_own,
            seed: self.seed(case, "clean"),
        };
        let clean = trials.make(self.arguments.clean)?;
        self.add_clean(case, &clean);
        for plant in self.plants() {
            if self.planted_in.get(&plant).is_some_and(|&count| count >= self.arguments.each) {
                continue;
            }
            let seed = self.seed(case, &format!("{plant:?}"));
            let width = case.size.map_or(desc.film.width, |[width, _]| width);
            let Some(scene) = plant.scene(&desc, width) else { continue };
            let seeds = seeds_of(plant, size);
            let row = match plant {
                Plant::Device if !splats_gaussian(case, &desc) => continue,
                Plant::Device => self.broken_device(case, seed)?,
                Plant::Channel => {
                    let run = pool.swapped();
                    self.planted(plant, &Trials { run: &run, seed, ..trials }, &clean)?
                }
                _ => {
                    let run = Pool::of_scene(case, &scene, seeds)?;
                    self.planted(plant, &Trials { run: &run, paired: false, seed, ..trials }, &clean)?
                }
            };
            eprintln!("{}: {plant:?} found in {}", case.name, row.found);
            self.planted.push(row);
            *self.planted_in.entry(plant).or_default() += 1;
        }
        Ok(())
    }

    /// The case whose reference a case is compared with, or why it is left out.
    fn source<'c>(&self, case: &'c RegressCase) -> Result<&'c RegressCase, String>
    where
        'a: 'c,
    {
        let ReferenceSource::Stored(name) = &case.reference else {
            return Err("it is compared with another program".into());
        };
        let others = self.plan.cases.iter().find(|other| other.name == *name);
        let source = if *name == case.name { Some(case) } else { others };
        let source = source.ok_or(format!("its reference {name} is that of no case"))?;
        for case in [case, source] {
            if matches!(case.renderer, CaseRenderer::Command { .. }) {
                return Err(format!("another program renders {}", case.name));
            }
            if case.tolerance.same_bits {
                return Err(format!("{} compares bits, in which chance has no part", case.name));
            }
        }
        Ok(source)
    }

    /// The pool of references of a case, which is kept for the next case.
    fn reference_pool(&mut self, case: &RegressCase, size: u32) -> Outcome<Rc<Pool>> {
        match &self.reference {
            Some((name, pool)) if *name == case.name => Ok(pool.clone()),
            _ => {
                let pool = Rc::new(Pool::of_scene(case, &load(&case.scene, &[])?.desc, 0..size)?);
                self.reference = Some((case.name.clone(), pool.clone()));
                Ok(pool)
            }
        }
    }

    fn add_clean(&mut self, case: &RegressCase, trials: &[Trial]) {
        for (red, trial) in self.red.iter_mut().zip(trials) {
            *red |= trial.changed;
        }
        let below = |p: f64| {
            trials.iter().filter(|trial| trial.first_p < p).count() as f64 / trials.len().max(1) as f64
        };
        self.clean.push(CleanRow {
            case: case.name.clone(),
            changed: changed(trials),
            small: [below(0.05), below(0.01)],
            renderings: median(trials.iter().map(|trial| f64::from(trial.renderings)).collect()),
            detectable: medians(trials),
        });
    }

    /// Trials of a change against what trials without it state.
    fn planted(&self, plant: Plant, trials: &Trials<'_>, clean: &[Trial]) -> Outcome<PlantedRow> {
        let made = trials.make(self.arguments.trials)?;
        let change = change_of_brightness(trials.reference, trials.run, trials.paired);
        let statement = trials.statement(clean);
        Ok(PlantedRow {
            plant,
            case: trials.case.name.clone(),
            change,
            detectable: medians(clean),
            promised: match plant {
                Plant::Seed => self.plan.false_alarm / self.plan.cases.len() as f64,
                _ => statement.power(change[0], trials.spread(statement.renderings)),
            },
            found: changed(&made),
        })
    }

    /// Trials of a program with a broken pass against the program without, both on llvmpipe.
    fn broken_device(&mut self, case: &RegressCase, seed: u64) -> Outcome<PlantedRow> {
        let program = self.arguments.program.canonicalize().map_err(|error| {
            let path = self.arguments.program.display();
            format!("cannot open the program {path}: {error}; build it, or name it by --program")
        })?;
        let broken = match &self.broken {
            Some((path, _)) => path.clone(),
            None => {
                let folder = tempfile::tempdir()?;
                let path = folder.path().join("pointillist-broken");
                let splat =
                    include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/glsl/spv/splat_color.frag.spv"));
                let mut bytes = std::fs::read(&program)?;
                let copies = replace_constant(&mut bytes, splat, [NARROW_TENT, 0.0])
                    .map_err(|error| format!("{}: {error}", program.display()))?;
                eprintln!("broke {copies} copies of splat_color.frag in {}", path.display());
                std::fs::write(&path, &bytes)?;
                std::fs::set_permissions(&path, std::fs::metadata(&program)?.permissions())?;
                self.broken = Some((path.clone(), folder));
                path
            }
        };
        let budget = &case.budget;
        let size = self.arguments.device_pool.max(budget.reference_seeds + budget.most_seeds);
        let reference = Pool::of_program(self.plan, case, &program, 0..size)?;
        let run = Pool::of_program(self.plan, case, &broken, seeds_of(Plant::Device, size))?;
        let trials = Trials {
            plan: self.plan,
            case,
            reference: &reference,
            reference_seeds: budget.reference_seeds,
            run: &reference,
            paired: true,
            seed,
        };
        let clean = trials.make(self.arguments.trials)?;
        let trials = Trials { run: &run, paired: false, seed: mix(seed), ..trials };
        self.planted(Plant::Device, &trials, &clean)
    }

    /// Chooses the draws of the trials of a case of this kind.
    fn seed(&self, case: &RegressCase, kind: &str) -> u64 {
        let text = [case.name.as_str(), "\n", kind].concat();
        text.bytes().fold(mix(self.arguments.seed), |seed, byte| mix(seed ^ u64::from(byte)))
    }
}

/// Seeds of the renderings with a planted change.
fn seeds_of(plant: Plant, size: u32) -> Range<u32> {
    let first = SEEDS_OF_PLANTS + plant as u32 * SEEDS_OF_A_PLANT;
    first..first + size
}

/// Whether a case uses the constant that is broken: that of the filter where neither scene nor options ask for one.
fn splats_gaussian(case: &RegressCase, desc: &SceneDesc) -> bool {
    let asks = match &case.renderer {
        CaseRenderer::Pointillist { options, .. } => options.iter().any(|word| word.starts_with("--filter")),
        CaseRenderer::Command { .. } => true,
    };
    desc.film.rfilter.is_none() && !asks
}

/// Medians of what trials state to be detectable.
fn medians(trials: &[Trial]) -> [f64; 2] {
    [0, 1].map(|k| median(trials.iter().map(|trial| trial.detectable[k]).collect()))
}
