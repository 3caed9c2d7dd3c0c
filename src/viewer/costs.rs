//! Costs of effects, measured on another thread at the user's request.

use std::sync::mpsc::{Receiver, channel};

use miette::{IntoDiagnostic, Result};

use crate::client::window::panel::{CostState, EffectCost};
use crate::job::{Job, StopFlag};
use crate::render::effect_plan::{Cost, EffectSide, PlannedEffect};
use crate::render::effect_price;
use crate::server::Priority;
use crate::viewer::editor::SceneEditor;
use crate::viewer::session::RenderSession;

/// The measurement in progress and the costs found last.
#[derive(Default)]
pub struct EffectCosts {
    running: Option<RunningMeasurement>,
    known: Vec<(&'static str, Cost)>,
    /// Scene, view or method have changed since the measurement began.
    stale: bool,
}

/// A measurement that times one effect after another.
struct RunningMeasurement {
    measured: Receiver<PlannedEffect>,
    job: Job<()>,
}

impl EffectCosts {
    /// Begins to measure the cost of each of the tracer's effects for this scene, view and method.
    pub fn measure(
        &mut self,
        session: &RenderSession,
        editor: &SceneEditor,
        plan: Vec<PlannedEffect>,
    ) -> Result<()> {
        if self.is_measuring() {
            return Ok(());
        }
        let (scene, camera) = (editor.scene(), editor.camera(session.size())?);
        let (desc, run) = (editor.desc().clone(), session.run_spec().clone());
        let (sender, measured) = channel();
        let work = move |stop: &StopFlag| {
            Priority::Background.apply();
            let subject = effect_price::Subject { desc: &desc, scene: &scene, camera: &camera, run: &run };
            let mut timer = effect_price::EffectTimer::new(subject, effect_price::BRIEF);
            for mut entry in plan.into_iter().filter(|entry| entry.side == EffectSide::Tracer) {
                // If the scene cannot be prepared without an effect, that effect has no cost.
                let _ = timer.charge(&mut entry);
                if stop.is_set() || sender.send(entry).is_err() {
                    return;
                }
            }
        };
        let job = Job::start("measuring costs", work).into_diagnostic()?;
        (self.running, self.stale) = (Some(RunningMeasurement { measured, job }), false);
        self.known.clear();
        Ok(())
    }

    /// Whether costs are known, and whether they are still valid for the present scene.
    pub fn state(&self) -> CostState {
        match (&self.running, self.known.is_empty(), self.stale) {
            (Some(_), ..) => CostState::Measuring,
            (None, true, _) => CostState::Unknown,
            (None, false, true) => CostState::Stale,
            (None, false, false) => CostState::Fresh,
        }
    }

    /// Whether a measurement is under way.
    pub fn is_measuring(&self) -> bool {
        self.running.is_some()
    }

    /// Marks the costs as stale after a change of scene, view or method.
    pub fn edited(&mut self) {
        self.stale = true;
    }

    /// Takes over new measurements; true if there are any.
    pub fn take(&mut self) -> bool {
        let Some(running) = &self.running else { return false };
        let known = self.known.len();
        let is_over = running.job.is_finished();
        self.known.extend(running.measured.try_iter().map(|entry| (entry.name, entry.cost)));
        if is_over && let Some(running) = self.running.take() {
            let _ = running.job.wait().inspect_err(|panic| tracing::error!("{panic}"));
        }
        is_over || self.known.len() > known
    }

    /// Cost of the effect at this index of the plan. The tracer's effects come first; some of the client's have the same names.
    pub fn of(&self, place: usize, name: &str) -> Option<EffectCost> {
        let (_, cost) = self.known.get(place).filter(|(known, _)| *known == name)?;
        cost.share.map(EffectCost::Share).or(cost.if_on_share.map(EffectCost::More))
    }
}
