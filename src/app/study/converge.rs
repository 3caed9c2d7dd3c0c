//! Parts 1 and 2: renders every method for the same times, in turn, again and again.

use std::fmt::Display;
use std::time::Duration;

use miette::Result;

use super::folder::StudyFolder;
use super::renderer::RenderLimit;
use super::{StudySession, TimeBudget};
use crate::app::args::study::Peer;
use crate::app::{predictions, process, tell};
use crate::client::develop;
use crate::image::Grid;
use crate::image::compare::Picture;
use crate::scene::desc::IntegratorKind;
use crate::study::measurement::{FIGURES, Measurement, RenderMeasurement};

/// Seconds that pictures are rendered for: those of Figures 3 and 4 of the paper, and some between.
pub const LADDER: [f64; 9] = [FIGURES[0], 0.1, FIGURES[1], 1.0, FIGURES[2], 10.0, FIGURES[3], 100.0, 300.0];

/// Pictures of one method and time; more would add little.
const ENOUGH: usize = 6;

/// Least seconds of a picture whose error map is kept; the page shows the longest.
const SHOWN: f64 = 0.3;

/// Approximate seconds that measuring the errors of a picture takes.
const JUDGING: f64 = 0.4;

/// Measures until the budget is spent. Whenever it ends, all methods have been rendered equally often; a time that is n times as long
/// is repeated √n times less often.
pub fn converge(session: &mut StudySession, methods: &[IntegratorKind], budget: &TimeBudget) -> Result<()> {
    let StudySession { renderer, folder, reference } = session;
    for kind in methods {
        // Warms up pipelines, tables and memory before anything is timed.
        renderer.trace(&renderer.run(*kind, 0), RenderLimit::Time(Duration::from_millis(50)))?;
    }
    while let Some(seconds) = next(folder, methods, reference.longest, budget) {
        for kind in methods {
            let seed = 1 + runs(folder, *kind, seconds) as u32 + (seconds * 1000.0) as u32 * 100;
            let run = renderer.run(*kind, seed);
            budget.say(&format!("{} for {seconds:.2} s", kind.name()));
            let traced = renderer.trace(&run, RenderLimit::Time(Duration::from_secs_f64(seconds)))?;
            if traced.driven.interrupted {
                return Ok(());
            }
            predictions::log(&run, &traced.predictions);
            let mut run = reference.judge_run(renderer, &run, &traced, seconds)?;
            let first = runs(folder, *kind, seconds) == 0;
            run.picture = run.picture.filter(|_| first && (seconds >= SHOWN || FIGURES.contains(&seconds)));
            run.error_map = run.error_map.filter(|_| first && seconds >= SHOWN);
            folder.keep(Measurement::Run(Box::new(run)))?;
        }
    }
    Ok(())
}

/// The time that is due next; `None` when all times that fit have been measured often enough.
fn next(folder: &StudyFolder, methods: &[IntegratorKind], longest: f64, budget: &TimeBudget) -> Option<f64> {
    if process::is_interrupted() {
        return None;
    }
    let had = |budget: f64| methods.iter().map(|kind| runs(folder, *kind, budget)).min().unwrap_or(0);
    let cost = |budget: f64| methods.len() as f64 * (budget + JUDGING);
    let due = LADDER.into_iter().filter(|&b| b <= longest && had(b) < ENOUGH && cost(b) <= budget.left());
    let turn = |budget: f64| budget.sqrt() * (had(budget) + 1) as f64;
    due.min_by(|&a, &b| turn(a).total_cmp(&turn(b)))
}

/// Pictures of a method and time so far.
fn runs(folder: &StudyFolder, kind: IntegratorKind, budget: f64) -> usize {
    let name = kind.name();
    let same = |run: &RenderMeasurement| run.method == name && run.budget == budget;
    folder.measurements.iter().filter(|m| matches!(m, Measurement::Run(run) if same(run))).count()
}

/// Measures the errors of pictures of other programs.
pub fn peers(session: &mut StudySession, peers: &[Peer]) -> Result<()> {
    let StudySession { renderer, folder, reference } = session;
    for peer in peers {
        let same = |run: &RenderMeasurement| run.method == peer.name && run.seconds == peer.seconds;
        if folder.has(|m| matches!(m, Measurement::Run(run) if same(run))) {
            continue;
        }
        let failed = |error: &dyn Display| miette::miette!("--peer {}: {error}", peer.name);
        let mut picture = Picture::read(&peer.file, None).map_err(|error| failed(&error))?;
        let black = blacken(&mut picture.rgb);
        if black > 0 {
            tell(&format!("note: --peer {}: {black} pixels are not finite; they count as black", peer.name));
        }
        let shown = develop::shown(&picture.rgb, &renderer.settings);
        let judged = reference.judge(&picture.rgb, &shown).map_err(|error| failed(&error))?;
        folder.keep(Measurement::Run(Box::new(RenderMeasurement {
            method: peer.name.clone(),
            peer: true,
            budget: peer.seconds,
            seconds: peer.seconds,
            ..judged
        })))?;
    }
    Ok(())
}

/// Makes pixels black that are not finite and counts them.
fn blacken(rgb: &mut Grid<[f32; 3]>) -> usize {
    let bad = rgb.pixels_mut().iter_mut().filter(|rgb| !rgb.iter().all(|c| c.is_finite()));
    bad.map(|rgb| *rgb = [0.0; 3]).count()
}
