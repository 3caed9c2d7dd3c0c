//! `pointillist study`: what accuracy costs in time, on one scene and this machine.

mod about;
mod converge;
mod display;
mod effects;
mod folder;
mod numeric;
mod pictures;
mod reference;
mod renderer;
mod schemes;

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
use folder::StudyFolder;
use reference::ReferencePicture;
use renderer::StudyRenderer;

/// Share of the budget for the reference.
const REFERENCE: f64 = 0.2;
/// Parts in their order, with shares of what is left of the budget, and what is missing without them.
const PARTS: [(Knob, f64, &str); 5] = [
    (Knob::Methods, 0.7, "convergence, prices, pictures, predictions, stability: --knobs methods"),
    (Knob::Effects, 0.5, "effects: --knobs effects"),
    (Knob::Display, 0.6, "display: --knobs display"),
    (Knob::Numeric, 0.1, "numeric choices: --knobs numeric"),
    (Knob::Replicates, 1.0, "replicates: --knobs replicates"),
];

/// A study that is being measured.
pub struct StudySession {
    renderer: StudyRenderer,
    folder: StudyFolder,
    reference: ReferencePicture,
}

/// The time that a part of the study may take.
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

    /// Tells the user what is being measured.
    pub fn say(&self, text: &str) {
        if !self.quiet {
            tell(&format!("  {text}"));
        }
    }
}

pub fn study(args: &StudyArgs) -> Result<()> {
    if args.predictions {
        return predictions::print();
    }
    if let (Some(folder), Some(output)) = (&args.collect, &args.output) {
        return folder::collect(folder, output);
    }
    let Some(scene) = &args.scene else { return Ok(()) };
    process::listen_for_interrupt();
    let budget = TimeBudget { start: Instant::now(), seconds: args.budget.as_secs_f64(), quiet: args.quiet };
    let mut renderer = StudyRenderer::new(args, &about::source(args, scene.clone()))?;
    let path = args.output.clone().unwrap_or_else(|| {
        let stem = scene.file_stem().unwrap_or_default().to_string_lossy();
        PathBuf::from(format!("study-{stem}"))
    });
    let mut folder = StudyFolder::open(&path, &renderer)?;
    budget.say("the reference");
    let given = args.against.as_deref();
    let reference = ReferencePicture::find(&mut renderer, &mut folder, given, REFERENCE * budget.seconds)?;
    let mut session = StudySession { renderer, folder, reference };
    let outcome = measure(args, &mut session, &budget);
    let StudySession { renderer, mut folder, .. } = session;
    if folder.has_grown() {
        folder.keep(Measurement::Command { command: about::command() })?;
    }
    let study = analysis::study(about::about(args, &renderer, &folder), &folder.measurements);
    folder.publish(&study)?;
    if !args.quiet {
        super::report::print(&pages::terminal(&study), "the study");
        let page = folder.file("index.html");
        tell(&format!("the page is {}; tables and charts are beside it", page.display()));
    }
    outcome
}

/// Measures one part after another; each takes its share of what is left.
fn measure(args: &StudyArgs, session: &mut StudySession, budget: &TimeBudget) -> Result<()> {
    converge::peers(session, &args.peer)?;
    let methods = about::methods(args)?;
    let last = PARTS.iter().rposition(|(knob, ..)| wanted(args, *knob));
    for (i, (knob, share, _)) in PARTS.into_iter().enumerate() {
        if !wanted(args, knob) || process::is_interrupted() {
            continue;
        }
        let share = if Some(i) == last { 1.0 } else { share };
        let part = TimeBudget { start: Instant::now(), seconds: share * budget.left(), quiet: args.quiet };
        match knob {
            Knob::Methods => converge::converge(session, &methods, &part)?,
            Knob::Effects => effects::effects(session, &part)?,
            Knob::Display => display::display(session, &part)?,
            Knob::Numeric => numeric::numeric(session)?,
            Knob::Replicates => schemes::schemes(session, &part)?,
        }
    }
    Ok(())
}

/// True if a part is asked for.
fn wanted(args: &StudyArgs, knob: Knob) -> bool {
    args.knobs.is_empty() || args.knobs.contains(&knob)
}

/// A run by the method that `auto` chooses, for measuring effects and display.
fn chosen(renderer: &StudyRenderer) -> RunSpec {
    let mut run = renderer.run(IntegratorKind::Auto, 1);
    method::choose(&mut run, &renderer.scene, &renderer.camera, renderer.threads);
    run
}

/// The same by an unbiased method: bidirectional path tracing in place of photon mapping.
fn unbiased(renderer: &StudyRenderer) -> RunSpec {
    let mut run = chosen(renderer);
    if run.integrator.has_photons() {
        run.integrator = IntegratorKind::Bidirectional;
    }
    run
}
