//! Part 3: cost of each of the tracer's effects in time and noise, and the change of the picture without it.

use std::sync::Arc;
use std::time::Duration;

use miette::{IntoDiagnostic, Result};

use crate::cmd::study::folder::StudyFolder;
use crate::cmd::study::pictures::{difference, linear, uri};
use crate::cmd::study::renderer::{RenderLimit, StudyRender, StudyRenderer};
use crate::cmd::study::session::{StudySession, TimeBudget};
use crate::render::effect_plan::PlannedEffect;
use crate::render::effect_price;
use crate::render::run_spec::RunSpec;
use crate::render::{effect_plan, load, process};
use crate::study::Interval;
use crate::study::data::EffectPrice;
use crate::study::measurement::Measurement;
use crate::tracer::effects::{self, Effect};
use crate::tracer::{Camera, Scene};

/// Number of alternations between specialised and general code.
const TURNS: usize = 9;

/// Least and greatest seconds of a picture without an effect.
const PICTURE: [f64; 2] = [0.3, 10.0];

/// Overhead in seconds per picture, for preparing the scene and judging, plus part of the loading time.
const OVERHEAD: f64 = 0.5;

/// Measures every effect that can be removed or added, as far as the time allows: first the time of those that are on, then the change of
/// the picture without them, then those that are off.
pub fn effects(session: &mut StudySession, budget: &TimeBudget) -> Result<()> {
    let run = session.chosen();
    let StudySession { renderer, folder, .. } = session;
    if folder.measurements.iter().filter(|m| matches!(m, Measurement::Unused { .. })).count() >= TURNS {
        return Ok(());
    }
    let plan = effect_plan::plan(&renderer.desc, &run, &renderer.settings);
    let (on, off): (Vec<_>, Vec<_>) =
        plan.iter().filter(|entry| entry.effect.is_some()).partition(|entry| entry.on);
    // Two runners, each for all alternations and one warm-up; scenes are prepared anew if geometry changes.
    let effort = |n: usize, share: f64| {
        let seconds =
            |effort: effect_price::Effort| 2.0 * (effort.turns + 1) as f64 * effort.turn.as_secs_f64();
        match n as f64 * seconds(effect_price::THOROUGH) < share * budget.left() {
            true => effect_price::THOROUGH,
            false => effect_price::BRIEF,
        }
    };
    let effort_on = effort(on.len(), 0.4);
    budget.say("the time of each effect");
    for entry in &on {
        timed(renderer, folder, &run, entry, effort_on, budget)?;
    }
    pictures_without(session, &run, &on, budget)?;
    let StudySession { renderer, folder, .. } = session;
    let effort_off = effort(off.len(), 0.5);
    for entry in &off {
        timed(renderer, folder, &run, entry, effort_off, budget)?;
    }
    // The general code needs another preparation of the scene.
    if budget.left() > 1.0 + 1.5 * renderer.load_seconds { unused(renderer, folder, &run) } else { Ok(()) }
}

fn known(name: &str, folder: &StudyFolder) -> Option<EffectPrice> {
    folder.measurements.iter().rev().find_map(|measured| match measured {
        Measurement::Effect(price) if price.name == name => Some(price.clone()),
        _ => None,
    })
}

/// Measures the time of an effect, unless known or out of time.
fn timed(
    renderer: &StudyRenderer,
    folder: &mut StudyFolder,
    run: &RunSpec,
    entry: &PlannedEffect,
    effort: effect_price::Effort,
    budget: &TimeBudget,
) -> Result<()> {
    let Some(effect) = entry.effect.filter(|effect| known(effect.name(), folder).is_none()) else {
        return Ok(());
    };
    if process::is_interrupted() || budget.left() < 2.0 * renderer.load_seconds.min(0.5) {
        return Ok(());
    }
    let subject =
        effect_price::Subject { desc: &renderer.desc, scene: &renderer.scene, camera: &renderer.camera, run };
    let turns = effect_price::EffectTimer::new(subject, effort).ratios(entry)?;
    if process::is_interrupted() {
        return Ok(());
    }
    let time = Interval::of_median(&turns);
    let time = if entry.on { time.map(|ratio| ratio.map(|r| 1.0 / r)) } else { time };
    let [name, reason] = [effect.name().to_string(), entry.reason.to_string()];
    folder.keep(Measurement::Effect(EffectPrice { name, on: entry.on, reason, time, ..Default::default() }))
}

/// Measures the change of the picture without each effect, most expensive first, until half of the time is used.
fn pictures_without(
    session: &mut StudySession,
    run: &RunSpec,
    on: &[&PlannedEffect],
    budget: &TimeBudget,
) -> Result<()> {
    let StudySession { renderer, folder, judge, .. } = session;
    let mut wanted: Vec<(Effect, EffectPrice)> = on
        .iter()
        .filter_map(|entry| entry.effect)
        .filter_map(|effect| Some((effect, known(effect.name(), folder)?)))
        .filter(|(_, price)| price.time.is_some() && price.loss.is_none())
        .collect();
    let time = |price: &EffectPrice| price.time.map_or(0.0, |time| time.value);
    wanted.sort_by(|a, b| time(&b.1).total_cmp(&time(&a.1)));
    let Some(reference) = judge.shown(renderer).cloned() else { return Ok(()) };
    // Half a share for the picture with all effects, one for each without one.
    let overhead = OVERHEAD + renderer.load_seconds.min(2.0);
    let seconds =
        (0.8 * budget.left() / (wanted.len() as f64 + 1.0) - overhead).clamp(PICTURE[0], PICTURE[1]);
    if wanted.is_empty() || budget.left() < 2.0 * (seconds + overhead) {
        return Ok(());
    }
    let whole = renderer.trace(run, RenderLimit::Time(Duration::from_secs_f64(seconds)))?;
    if whole.driven.interrupted {
        return Ok(());
    }
    let same = RenderLimit::Paths(whole.data.counts.paths());
    let settings = renderer.settings.clone();
    let shown = renderer.show(&settings)?;
    let (flip_whole, _) = difference(&linear(&shown, &settings), &reference);
    for (effect, mut price) in wanted {
        if process::is_interrupted() || budget.left() < 1.5 * seconds + overhead {
            return Ok(());
        }
        budget.say(&format!("the picture without {}", effect.name()));
        let Some(without) = leave_out(renderer, run, effect, same)? else { continue };
        if without.driven.interrupted {
            return Ok(());
        }
        let noise = |traced: &StudyRender| Some(traced.estimate()?.mean_square);
        price.variance = noise(&without).zip(noise(&whole)).map(|(without, with)| 1.0 - without / with);
        let shown = linear(&renderer.show(&settings)?, &settings);
        price.loss = Some((difference(&shown, &reference).0 - flip_whole).max(0.0));
        price.picture = uri(&shown);
        folder.keep(Measurement::Effect(price))?;
    }
    Ok(())
}

/// Renders the scene without an effect; `None` if it cannot be left out.
fn leave_out(
    renderer: &mut StudyRenderer,
    run: &RunSpec,
    effect: Effect,
    limit: RenderLimit,
) -> Result<Option<StudyRender>> {
    let mut other = renderer.desc.clone();
    other.integrator.kind = run.integrator;
    if effects::without(&mut other, effect).is_err() {
        return Ok(None);
    }
    let scene = Arc::new(renderer.scene.edited(&other).into_diagnostic()?);
    let camera = Camera::of(&other).into_diagnostic()?;
    let run = RunSpec { integrator: other.integrator.kind, photons: other.integrator.photons, ..run.clone() };
    renderer.trace_other(&run, scene, camera, limit).map(Some)
}

/// Measures what specialisation saves: code without the unused effects against general code, alternately.
fn unused(renderer: &StudyRenderer, folder: &mut StudyFolder, run: &RunSpec) -> Result<()> {
    let general = Arc::new(load::prepare(Scene::prepare_general, &renderer.desc, renderer.scene.kernel())?);
    let mut desc = renderer.desc.clone();
    desc.integrator.kind = run.integrator;
    let mut planned = effect_price::runner(run, renderer.scene.clone(), renderer.camera.clone(), &desc);
    let mut everything = effect_price::runner(run, general, renderer.camera.clone(), &desc);
    for run in [&mut planned, &mut everything] {
        run(effect_price::THOROUGH.turn);
    }
    for _ in 0..TURNS {
        let ratio = everything(effect_price::THOROUGH.turn) / planned(effect_price::THOROUGH.turn);
        folder.keep(Measurement::Unused { ratio })?;
    }
    Ok(())
}
