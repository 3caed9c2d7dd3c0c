//! Part 3: what each effect of the tracer costs in time and noise, and what the picture loses without it.

use std::sync::Arc;
use std::time::Duration;

use miette::{IntoDiagnostic, Result};

use super::against::ReferencePicture;
use super::folder::StudyFolder;
use super::pictures::{difference, linear, uri};
use super::stage::{RenderLimit, StudyRenderer};
use super::{TimeBudget, chosen};
use crate::app::explain::price;
use crate::app::run_spec::RunSpec;
use crate::app::{load, plan, process};
use crate::study::Interval;
use crate::study::data::EffectPrice;
use crate::study::measurement::Measurement;
use crate::tracer::effects::{self, Effect};
use crate::tracer::{Camera, Scene};

/// Turns between the scene as planned and the code for everything.
const TURNS: usize = 9;

/// Measures every effect that can be left out or added.
///
/// # Errors
///
/// When a scene without an effect cannot be prepared or rendered.
pub fn effects(
    stage: &mut StudyRenderer,
    folder: &mut StudyFolder,
    against: &ReferencePicture,
    clock: &TimeBudget,
) -> Result<()> {
    let known = |name: &str, folder: &StudyFolder| {
        folder.measurements.iter().any(|m| matches!(m, Measurement::Effect(price) if price.name == name))
    };
    if folder.measurements.iter().filter(|m| matches!(m, Measurement::Unused { .. })).count() >= TURNS {
        return Ok(());
    }
    let run = chosen(stage);
    let plan = plan::plan(&stage.desc, &run, &stage.settings);
    let subject = price::Subject { desc: &stage.desc, scene: &stage.scene, camera: &stage.camera, run: &run };
    let ratios = price::ratios(&plan, subject, price::THOROUGH)?;
    let on: Vec<Effect> = plan.iter().filter(|entry| entry.on).filter_map(|entry| entry.effect).collect();
    // Half a share for the picture with everything, one for each without something.
    let seconds = (clock.left() / (on.len() as f64 + 2.0) - 0.6).clamp(0.3, 10.0);
    let limit = RenderLimit::Time(Duration::from_secs_f64(seconds));
    let whole = stage.trace(&run, limit)?;
    if whole.driven.interrupted {
        return Ok(());
    }
    let same = RenderLimit::Paths(whole.data.counts.paths());
    let (flip_whole, _) =
        difference(&linear(&whole.shown, &stage.settings).unwrap_or_default(), &against.shown);
    for (entry, turns) in plan.iter().zip(ratios) {
        if process::is_interrupted() {
            return Ok(());
        }
        let Some(effect) = entry.effect.filter(|effect| !known(effect.name(), folder)) else { continue };
        clock.say(&format!("the picture without {}", effect.name()));
        let time =
            Interval::of_median(&turns).map(|ratio| if entry.on { ratio.map(|r| 1.0 / r) } else { ratio });
        let reason = entry.reason.to_string();
        let mut price =
            EffectPrice { name: effect.name().to_string(), on: entry.on, reason, time, ..Default::default() };
        if entry.on
            && time.is_some()
            && let Some(without) = leave_out(stage, &run, effect, same)?
        {
            let noise = |traced: &super::stage::StudyRender| {
                let figures = traced.state.checkpoints.last().map(|_| traced.state.estimate.mean_square)?;
                Some(figures)
            };
            if without.driven.interrupted {
                return Ok(());
            }
            price.variance = noise(&without).zip(noise(&whole)).map(|(without, with)| 1.0 - without / with);
            let shown = linear(&without.shown, &stage.settings).unwrap_or_default();
            price.loss = Some((difference(&shown, &against.shown).0 - flip_whole).max(0.0));
            price.picture = uri(&shown);
        }
        folder.keep(Measurement::Effect(price))?;
    }
    unused(stage, folder, &run)
}

/// The scene without an effect, rendered; `None` where it cannot be left out.
fn leave_out(
    stage: &mut StudyRenderer,
    run: &RunSpec,
    effect: Effect,
    limit: RenderLimit,
) -> Result<Option<super::stage::StudyRender>> {
    let mut other = stage.desc.clone();
    other.integrator.kind = run.integrator;
    if effects::without(&mut other, effect).is_err() {
        return Ok(None);
    }
    let scene = Arc::new(stage.scene.edited(&other).into_diagnostic()?);
    let camera = Camera::of(&other).into_diagnostic()?;
    let run = RunSpec { integrator: other.integrator.kind, photons: other.integrator.photons, ..run.clone() };
    stage.trace_other(&run, (scene, camera), limit).map(Some)
}

/// What leaving out unused effects saves: the scene as planned against the code for everything, in turn.
fn unused(stage: &StudyRenderer, folder: &mut StudyFolder, run: &RunSpec) -> Result<()> {
    let general = Arc::new(load::prepare(Scene::prepare_general, &stage.desc, stage.scene.kernel())?);
    let mut desc = stage.desc.clone();
    desc.integrator.kind = run.integrator;
    let mut planned = price::runner(run, stage.scene.clone(), stage.camera.clone(), &desc);
    let mut everything = price::runner(run, general, stage.camera.clone(), &desc);
    for run in [&mut planned, &mut everything] {
        run(price::THOROUGH.turn);
    }
    for _ in 0..TURNS {
        let ratio = everything(price::THOROUGH.turn) / planned(price::THOROUGH.turn);
        folder.keep(Measurement::Unused { ratio })?;
    }
    Ok(())
}
