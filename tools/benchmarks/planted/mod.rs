//! Whether regression renders find planted changes as often as they state, and raise no more false alarms than they state.
//!
//! For every case of a manifest a pool of renderings with independent seeds is made. A *trial* draws a reference and a run from it, never the
//! same rendering twice, and judges them as `pointillist regress run` does: the reference through a file, with the same looks, levels
//! and stops. Runs with a planted change are drawn from a pool of the changed scene, with other seeds. So a trial costs milliseconds,
//! and 1,000 runs of all cases need no more renderings than about ten real ones.
//!
//! | file | what |
//! |---|---|
//! | `plants.rs` | the changes, made in copies of the scenes' descriptions |
//! | `pool.rs` | renderings: in this process on the CPU, or by processes of a program on llvmpipe |
//! | `spirv.rs` | the broken device pass: a copy of the program in which a constant of a shader is another one |
//! | `trial.rs` | draws and judges |
//! | `power.rs` | binomial intervals, and the power that a statement promises for a change of another size |
//! | `study.rs`, `table.rs` | all cases; what is printed |
//!
//! The changes of the pools' mean brightness are measured, so that the promise is for the change that the trials really have.

mod plants;
mod pool;
mod power;
mod spirv;
mod study;
mod table;
mod trial;

use std::path::PathBuf;

use pointillist::regress::manifest::read_plan;
use pointillist::regress::run::choose;

use self::plants::Plant;
use self::study::PlantStudy;
use super::common::{Outcome, timed};

/// Which cases and changes, and how often.
#[derive(Clone, clap::Args)]
pub struct Arguments {
    /// Folder with a manifest, or with scenes
    #[arg(default_value = "tests/golden")]
    folder: PathBuf,
    /// Words that names of cases contain; all by default. The probability of a false alarm stays divided by all
    #[arg(long, num_args = 1.., value_name = "WORD")]
    cases: Vec<String>,
    /// Planted changes; all by default
    #[arg(long, value_enum, num_args = 1.., value_name = "PLANT")]
    plants: Vec<Plant>,
    /// Trials of each change in each case, 0 for none
    #[arg(long, default_value_t = 200)]
    trials: u64,
    /// Runs of all cases without a change, which also give the statements that the changes are compared with
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u64).range(20..))]
    clean: u64,
    /// Renderings of each pool; at least as many as a reference and the longest run have together
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(2..50_000))]
    pool: u32,
    /// Renderings of each pool by processes on llvmpipe, likewise
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(2..50_000))]
    device_pool: u32,
    /// Cases in which each change is planted: the first of the manifest that have something to change
    #[arg(long, default_value_t = 3)]
    each: usize,
    /// The program of which a copy gets the broken pass, built from this source
    #[arg(long, default_value = "target/release/pointillist")]
    program: PathBuf,
    /// Chooses the draws
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Renders, judges and prints both tables.
///
/// # Errors
/// When a case cannot be rendered; when there are more false alarms than stated, or fewer changes are found than promised.
pub fn run(arguments: &Arguments) -> Outcome {
    let plan = read_plan(&arguments.folder, None)?;
    let cases = choose(&plan, &arguments.cases)?;
    println!(
        "{}: {} of {} cases, pools of {} renderings, {} runs without a change, {} trials of each change",
        arguments.folder.display(),
        cases.len(),
        plan.cases.len(),
        arguments.pool,
        arguments.clean,
        arguments.trials
    );
    let mut study = PlantStudy::new(&plan, arguments);
    let (end, seconds) = timed(|| cases.into_iter().try_for_each(|case| study.case(case)));
    end?;
    let failures = table::print(&study);
    println!("{:.0} min", seconds / 60.0);
    match failures.as_slice() {
        [] => Ok(()),
        _ => Err(failures.join("; ").into()),
    }
}
