//! `pointillist study`: accuracy against time, for one scene on this machine.

mod about;
mod converge;
mod display;
mod effects;
mod folder;
mod judge;
mod numeric;
mod options;
mod pictures;
mod pools;
mod renderer;
mod schemes;
mod session;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "in a test a panic is the message")]
mod tests;

use std::path::PathBuf;
use std::time::Instant;

use miette::Result;

use crate::cmd::args::StudyArgs;
use crate::cmd::args::study::StudySection;
use crate::render::process::tell;
use crate::render::{predictions, process};
use crate::study::measurement::Measurement;
use crate::study::{analysis, pages};
use folder::StudyFolder;
use judge::Judge;
use renderer::StudyRenderer;
use session::{PARTS, StudySession, TimeBudget, wanted};

/// A study of fewer seconds gives [`BRIEF_SHARE`] of them to the methods.
const BRIEF: f64 = 45.0;
const BRIEF_SHARE: f64 = 0.8;

/// Seconds reserved for page, tables and charts.
const PUBLISHING: f64 = 0.5;

/// Runs the subcommand.
///
/// # Errors
///
/// When the scene or the folder cannot be used; what was measured before is kept.
pub fn study(args: &StudyArgs) -> Result<()> {
    if args.predictions {
        return predictions::print();
    }
    if let (Some(folder), Some(output)) = (&args.collect, &args.output) {
        return folder::collect(folder, output);
    }
    let Some(scene) = &args.scene else { return Ok(()) };
    process::listen_for_interrupt();
    let seconds = args.budget.as_secs_f64();
    let seconds = seconds - PUBLISHING.min(0.1 * seconds);
    let budget = TimeBudget { start: Instant::now(), seconds, quiet: args.quiet };
    let mut renderer = StudyRenderer::new(args, &about::source(args, scene.clone()))?;
    let path = args.output.clone().unwrap_or_else(|| {
        let stem = scene.file_stem().unwrap_or_default().to_string_lossy();
        PathBuf::from(format!("study-{stem}"))
    });
    let mut folder = StudyFolder::open(&path, &renderer)?;
    let judge = Judge::open(&renderer, &mut folder, args.against.as_deref())?;
    budget.say("the trial of --integrator auto");
    let choice = about::choose(&mut renderer, &mut folder)?;
    let mut session = StudySession { renderer, folder, judge, choice };
    let outcome = measure(args, &mut session, &budget);
    let StudySession { renderer, mut folder, .. } = session;
    if folder.has_grown() {
        folder.keep(Measurement::Command { command: about::command() })?;
    }
    let study = analysis::study(about::about(args, &renderer, &folder), &folder.measurements);
    folder.publish(&study)?;
    if !args.quiet {
        crate::render::figures::print(&pages::terminal(&study), "the study");
        let page = folder.file("index.html");
        tell(&format!("the page is {}; tables and charts are beside it", page.display()));
    }
    outcome
}

/// Measures one part after another; each takes its fraction of the remaining time.
fn measure(args: &StudyArgs, session: &mut StudySession, budget: &TimeBudget) -> Result<()> {
    let methods = about::methods(args, session)?;
    let last = PARTS.iter().rposition(|(knob, ..)| wanted(args, *knob));
    for (i, (knob, share, _)) in PARTS.into_iter().enumerate() {
        if !wanted(args, knob) || process::is_interrupted() || budget.left() <= 0.0 {
            continue;
        }
        let share = match knob {
            _ if Some(i) == last => 1.0,
            // In a brief study the answer has priority.
            StudySection::Methods if budget.seconds < BRIEF => BRIEF_SHARE,
            _ => share,
        };
        let part = TimeBudget { start: Instant::now(), seconds: share * budget.left(), quiet: args.quiet };
        match knob {
            StudySection::Methods => converge::converge(session, methods.clone(), &part)?,
            StudySection::Effects => effects::effects(session, &part)?,
            StudySection::Options => options::options(session, &part)?,
            StudySection::Display => display::display(session, &part)?,
            StudySection::Numeric => numeric::numeric(session, &part)?,
            StudySection::Replicates => schemes::schemes(session, &part)?,
        }
    }
    converge::peers(session, &args.peer)
}
