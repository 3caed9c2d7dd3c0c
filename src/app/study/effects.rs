//! Part 3: the cost of each of the tracer's effects in time and noise, and what the picture loses without it.

use std::sync::Arc;
use std::time::Duration;

use miette::{IntoDiagnostic, Result};

use super::folder::StudyFolder;
use super::pictures::{difference, linear, uri};
use super::renderer::{RenderLimit, StudyRender, StudyRenderer};
use super::{StudySession, TimeBudget, chosen};
use crate::app::explain::price;
use crate::app::run_spec::RunSpec;
use crate::app::{load, plan, process};
use crate::study::Interval;
use crate::study::data::EffectPrice;
use crate::study::measurement::Measurement;
use crate::tracer::effects::{self, Effect};
use crate::tracer::{Camera, Scene};

/// Turns between the specialised and the general code.
const TURNS: usize = 9;

/// Measures every effect that can be left out or added.
pub fn effects(session: &mut StudySession, budget: &TimeBudget) -> Result<()> {
    let StudySession { renderer, folder, reference } = session;
    let known = |name: &str, folder: &StudyFolder| {
        folder.has(|m| matches!(m, Measurement::Effect(price) if price.name == name))
    };
    if folder.measurements.iter().filter(|m| matches!(m, Measurement::Unused { .. })).count() >= TURNS {
        return Ok(());
    }
    let run = chosen(renderer);
    let plan = plan::plan(&renderer.desc, &run, &renderer.settings);
    let subject =
        price::Subject { desc: &renderer.desc, scene: &renderer.scene, camera: &renderer.camera, run: &run };
    let ratios = price::ratios(&plan, subject, price::THOROUGH)?;
    let on: Vec<Effect> = plan.iter().filter(|entry| entry.on).filter_map(|entry| entry.effect).collect();
    // Half a share for the picture with everything, one for each without something.
    let seconds = (budget.left() / (on.len() as f64 + 2.0) - 0.6).clamp(0.3, 10.0);
    let limit = RenderLimit::Time(Duration::from_secs_f64(seconds));
    let whole = renderer.trace(&run, limit)?;
    if whole.driven.interrupted {
        return Ok(());
    }
    let same = RenderLimit::Paths(whole.data.counts.paths());
    let (flip_whole, _) = difference(&linear(&whole.shown, &renderer.settings), &reference.shown);
    for (entry, turns) in plan.iter().zip(ratios) {
        if process::is_interrupted() {
            return Ok(());
        }
        let Some(effect) = entry.effect.filter(|effect| !known(effect.name(), folder)) else { continue };
        budget.say(&format!("the picture without {}", effect.name()));
        let time = Interval::of_median(&turns);
        let time = if entry.on { time.map(|ratio| ratio.map(|r| 1.0 / r)) } else { time };
        let [name, reason] = [effect.name().to_string(), entry.reason.to_string()];
        let mut price = EffectPrice { name, on: entry.on, reason, time, ..Default::default() };
        if entry.on
            && time.is_some()
            && let Some(without) = leave_out(renderer, &run, effect, same)?
        {
            let noise = |traced: &StudyRender| Some(traced.estimate()?.mean_square);
            if without.driven.interrupted {
                return Ok(());
            }
            price.variance = noise(&without).zip(noise(&whole)).map(|(without, with)| 1.0 - without / with);
            let shown = linear(&without.shown, &renderer.settings);
            price.loss = Some((difference(&shown, &reference.shown).0 - flip_whole).max(0.0));
            price.picture = uri(&shown);
        }
        folder.keep(Measurement::Effect(price))?;
    }
    unused(renderer, folder, &run)
}

/// The scene without an effect, rendered; `None` where it cannot be left out.
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

/// Measures what leaving out unused effects saves: the specialised against the general code, in turn.
fn unused(renderer: &StudyRenderer, folder: &mut StudyFolder, run: &RunSpec) -> Result<()> {
    let general = Arc::new(load::prepare(Scene::prepare_general, &renderer.desc, renderer.scene.kernel())?);
    let mut desc = renderer.desc.clone();
    desc.integrator.kind = run.integrator;
    let mut planned = price::runner(run, renderer.scene.clone(), renderer.camera.clone(), &desc);
    let mut everything = price::runner(run, general, renderer.camera.clone(), &desc);
    for run in [&mut planned, &mut everything] {
        run(price::THOROUGH.turn);
    }
    for _ in 0..TURNS {
        let ratio = everything(price::THOROUGH.turn) / planned(price::THOROUGH.turn);
        folder.keep(Measurement::Unused { ratio })?;
    }
    Ok(())
}
