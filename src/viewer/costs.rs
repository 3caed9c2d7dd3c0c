//! What the effects cost, measured beside the window when the user asks for it.

use std::sync::mpsc::{Receiver, channel};

use miette::{IntoDiagnostic, Result};

use crate::client::window::panel::{CostState, EffectCost};
use crate::job::{Job, StopFlag};
use crate::render::effect_plan::{Cost, EffectSide, PlannedEffect};
use crate::render::effect_price;
use crate::server::Priority;
use crate::viewer::editor::SceneEditor;
use crate::viewer::session::RenderSession;

/// A measurement under way, and the costs that the last one found.
#[derive(Default)]
pub struct EffectCosts {
    running: Option<RunningMeasurement>,
    known: Vec<(&'static str, Cost)>,
    /// Something has been edited since the last measurement was begun.
    stale: bool,
}

/// Measures one effect after the other.
struct RunningMeasurement {
    measured: Receiver<PlannedEffect>,
    job: Job<()>,
}

impl EffectCosts {
    /// Begins to measure what the tracer's effects cost in this scene, seen from here, by this method.
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
                // An effect without which the scene cannot be prepared has no cost.
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

    /// Whether the costs are known for the scene as it is.
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

    /// Scene, view or method have changed.
    pub fn edited(&mut self) {
        self.stale = true;
    }

    /// Takes over what was measured since the last call; true when there is something new to show.
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

    /// The cost of the effect at this place of the plan. The tracer's effects come first; the client has some of the same name.
    pub fn of(&self, place: usize, name: &str) -> Option<EffectCost> {
        let (_, cost) = self.known.get(place).filter(|(known, _)| *known == name)?;
        cost.share.map(EffectCost::Share).or(cost.if_on_share.map(EffectCost::More))
    }
}
