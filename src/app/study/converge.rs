//! Parts 1 and 2: every method at the same times, in turn, again and again.

use std::time::Duration;

use miette::Result;

use super::against::ReferencePicture;
use super::folder::StudyFolder;
use super::stage::{RenderLimit, StudyRenderer};
use super::{TimeBudget, pictures};
use crate::app::args::study::Peer;
use crate::app::{predictions, process, tell};
use crate::client::develop;
use crate::image::Grid;
use crate::image::compare::Picture;
use crate::scene::desc::IntegratorKind;
use crate::study::measurement::{FIGURES, Measurement, RenderMeasurement};

/// Seconds that pictures are given: those of the paper's Figures 3 and 4, and between.
pub const LADDER: [f64; 9] = [FIGURES[0], 0.1, FIGURES[1], 1.0, FIGURES[2], 10.0, FIGURES[3], 100.0, 300.0];

/// Pictures of one method and time after which more tell little.
const ENOUGH: usize = 6;

/// Seconds from which on the first error map of a time is kept for the page: the longest is shown.
const SHOWN: f64 = 0.3;

/// Seconds that judging a picture takes besides, about.
const JUDGING: f64 = 0.4;

/// Measures until the time is spent. All methods have had every time equally often, whenever it ends; a time that is n times as
/// long is repeated √n times less often.
///
/// # Errors
///
/// When nothing can be rendered or kept.
pub fn converge(
    stage: &mut StudyRenderer,
    folder: &mut StudyFolder,
    (against, methods): (&ReferencePicture, &[IntegratorKind]),
    clock: &TimeBudget,
) -> Result<()> {
    for kind in methods {
        // Pipelines, tables, pages of memory: once, before anything is timed.
        stage.trace(&stage.run(*kind, 0), RenderLimit::Time(Duration::from_millis(50)))?;
    }
    while let Some(budget) = next(folder, methods, against.longest, clock) {
        for kind in methods {
            let seed = 1 + runs(folder, *kind, budget) as u32 + (budget * 1000.0) as u32 * 100;
            let run = stage.run(*kind, seed);
            clock.say(&format!("{} for {budget:.2} s", kind.name()));
            let traced = stage.trace(&run, RenderLimit::Time(Duration::from_secs_f64(budget)))?;
            if traced.driven.interrupted {
                return Ok(());
            }
            predictions::log(&run, &traced.predictions);
            let mut run = against.judge_run(stage, &run, &traced, budget)?;
            let first = runs(folder, *kind, budget) == 0;
            run.picture = run.picture.filter(|_| first && (budget >= SHOWN || FIGURES.contains(&budget)));
            run.error_map = run.error_map.filter(|_| first && budget >= SHOWN);
            folder.keep(Measurement::Run(Box::new(run)))?;
        }
    }
    Ok(())
}

/// The time that is due next; `None` when all that fit have been measured often enough.
fn next(folder: &StudyFolder, methods: &[IntegratorKind], longest: f64, clock: &TimeBudget) -> Option<f64> {
    if process::is_interrupted() {
        return None;
    }
    let had = |budget: f64| methods.iter().map(|kind| runs(folder, *kind, budget)).min().unwrap_or(0);
    let cost = |budget: f64| methods.len() as f64 * (budget + JUDGING);
    let due = LADDER.into_iter().filter(|&b| b <= longest && had(b) < ENOUGH && cost(b) <= clock.left());
    let turn = |budget: f64| budget.sqrt() * (had(budget) + 1) as f64;
    due.min_by(|&a, &b| turn(a).total_cmp(&turn(b)))
}

/// Pictures of a method and time so far.
fn runs(folder: &StudyFolder, kind: IntegratorKind, budget: f64) -> usize {
    let name = kind.name();
    let same = |run: &RenderMeasurement| run.method == name && run.budget == budget;
    folder.measurements.iter().filter(|m| matches!(m, Measurement::Run(run) if same(run))).count()
}

/// Pictures of other programs.
///
/// # Errors
///
/// When one cannot be read or has another size.
pub fn peers(
    stage: &StudyRenderer,
    folder: &mut StudyFolder,
    against: &ReferencePicture,
    peers: &[Peer],
) -> Result<()> {
    for peer in peers {
        let same = |run: &RenderMeasurement| run.method == peer.name && run.seconds == peer.seconds;
        if folder.measurements.iter().any(|m| matches!(m, Measurement::Run(run) if same(run))) {
            continue;
        }
        let mut picture = Picture::read(&peer.file, None)
            .map_err(|error| miette::miette!("--peer {}: {error}", peer.name))?;
        let black = blacken(&mut picture.rgb);
        if black > 0 {
            tell(&format!("note: --peer {}: {black} pixels are not finite; they count as black", peer.name));
        }
        let shown = develop::shown(&picture.rgb, &stage.settings);
        let judged = against
            .judge(&picture.rgb, &shown)
            .map_err(|error| miette::miette!("--peer {}: {error}", peer.name))?;
        let run = RenderMeasurement {
            method: peer.name.clone(),
            peer: true,
            budget: peer.seconds,
            seconds: peer.seconds,
            picture: pictures::uri(&shown),
            ..judged
        };
        folder.keep(Measurement::Run(Box::new(run)))?;
    }
    Ok(())
}

/// Makes pixels black that are not finite, and counts them.
fn blacken(rgb: &mut Grid<[f32; 3]>) -> usize {
    let bad = rgb.pixels_mut().iter_mut().filter(|rgb| !rgb.iter().all(|c| c.is_finite()));
    bad.map(|rgb| *rgb = [0.0; 3]).count()
}
