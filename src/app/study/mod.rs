//! `pointillist study`: what accuracy costs in time, on one scene and this machine.

mod about;
mod against;
mod collect;
mod converge;
mod display;
mod effects;
mod folder;
mod machine;
mod numeric;
mod pictures;
mod schemes;
mod stage;

use std::path::PathBuf;
use std::time::Instant;

use miette::Result;

use super::args::StudyArgs;
use super::args::study::Knob;
use super::run_spec::RunSpec;
use super::{method, predictions, process, tell};
use crate::scene::desc::IntegratorKind;
use crate::study::measurement::Measurement;
use crate::study::{analysis, pages};
use against::ReferencePicture;
use folder::StudyFolder;
use stage::StudyRenderer;

/// Shares of the budget: the reference, and each part.
const REFERENCE: f64 = 0.2;
const PARTS: [(Knob, f64); 5] = [
    (Knob::Methods, 0.7),
    (Knob::Effects, 0.5),
    (Knob::Display, 0.6),
    (Knob::Numeric, 0.1),
    (Knob::Replicates, 1.0),
];

/// What a part may still take.
pub struct TimeBudget {
    start: Instant,
    seconds: f64,
    quiet: bool,
}

impl TimeBudget {
    /// Seconds that are left; negative afterwards.
    pub fn left(&self) -> f64 {
        self.seconds - self.start.elapsed().as_secs_f64()
    }

    /// Says what is being measured.
    pub fn say(&self, text: &str) {
        if !self.quiet {
            tell(&format!("  {text}"));
        }
    }
}

/// Runs the subcommand.
///
/// # Errors
///
/// Whatever stops it; what was measured before is kept.
pub fn study(args: &StudyArgs) -> Result<()> {
    if args.predictions {
        return predictions::print();
    }
    if let (Some(folder), Some(output)) = (&args.collect, &args.output) {
        return collect::collect(folder, output);
    }
    let Some(scene) = &args.scene else { return Ok(()) };
    process::listen_for_interrupt();
    let budget = TimeBudget { start: Instant::now(), seconds: args.budget.as_secs_f64(), quiet: args.quiet };
    let mut stage = StudyRenderer::new(args, &about::source(args, scene.clone()))?;
    let path = args.output.clone().unwrap_or_else(|| {
        let stem = scene.file_stem().unwrap_or_default().to_string_lossy();
        PathBuf::from(format!("study-{stem}"))
    });
    let mut folder = StudyFolder::open(&path, &stage)?;
    budget.say("the reference");
    let against =
        ReferencePicture::find(&mut stage, &mut folder, args.against.as_deref(), REFERENCE * budget.seconds)?;
    let outcome = measure(args, &mut stage, (&mut folder, &against), &budget);
    if folder.has_grown() {
        folder.keep(Measurement::Command { command: about::command() })?;
    }
    let study = analysis::study(about::about(args, &stage, &folder), &folder.measurements);
    folder.publish(&study)?;
    if !args.quiet {
        super::report::print(&pages::terminal(&study), "the study");
        tell(&format!("page, table and figures: {}", folder.file("index.html").display()));
    }
    outcome
}

/// One part after another; each takes its share of what is left.
fn measure(
    args: &StudyArgs,
    stage: &mut StudyRenderer,
    (folder, against): (&mut StudyFolder, &ReferencePicture),
    budget: &TimeBudget,
) -> Result<()> {
    converge::peers(stage, folder, against, &args.peer)?;
    let wanted = |knob: Knob| args.knobs.is_empty() || args.knobs.contains(&knob);
    let methods = about::methods(args)?;
    let last = PARTS.iter().rposition(|(knob, _)| wanted(*knob));
    for (i, (knob, share)) in PARTS.into_iter().enumerate() {
        if !wanted(knob) || process::is_interrupted() {
            continue;
        }
        let share = if Some(i) == last { 1.0 } else { share };
        let clock = TimeBudget { start: Instant::now(), seconds: share * budget.left(), quiet: args.quiet };
        match knob {
            Knob::Methods => converge::converge(stage, folder, (against, &methods), &clock)?,
            Knob::Effects => effects::effects(stage, folder, against, &clock)?,
            Knob::Display => display::display(stage, folder, against, &clock)?,
            Knob::Numeric => numeric::numeric(stage, folder)?,
            Knob::Replicates => schemes::schemes(stage, folder, against, &clock)?,
        }
    }
    Ok(())
}

/// The method that `auto` chooses, which effects and display are measured with.
fn chosen(stage: &StudyRenderer) -> RunSpec {
    let mut run = stage.run(IntegratorKind::Auto, 1);
    method::choose(&mut run, &stage.scene, &stage.camera, stage.threads);
    run
}

/// The same, but for photon mapping, whose pictures have more than noise.
fn unbiased(stage: &StudyRenderer) -> RunSpec {
    let mut run = chosen(stage);
    if run.integrator == IntegratorKind::Photon {
        run.integrator = IntegratorKind::Bidirectional;
    }
    run
}
