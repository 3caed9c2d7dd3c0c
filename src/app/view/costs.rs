//! What the effects cost, measured beside the window when somebody asks for it.

use std::sync::mpsc::{Receiver, TryRecvError, channel};

use miette::{IntoDiagnostic, Result};

use crate::app::explain::price;
use crate::app::plan::{Cost, EffectSide, PlannedEffect};
use crate::app::run_spec::RunSpec;
use crate::app::view::viewer::Viewer;
use crate::client::window::panel::{CostState, Effect, EffectCost};
use crate::server::Priority;

/// A measurement under way, and what the last one found.
#[derive(Default)]
pub struct Costs {
    running: Option<Receiver<Vec<PlannedEffect>>>,
    known: Vec<(&'static str, Cost)>,
    /// Something has been edited since the last measurement was begun.
    stale: bool,
}

impl Costs {
    /// How figures stand to the scene as it is.
    pub fn state(&self) -> CostState {
        match (&self.running, self.known.is_empty(), self.stale) {
            (Some(_), ..) => CostState::Measuring,
            (None, true, _) => CostState::Unknown,
            (None, false, true) => CostState::Stale,
            (None, false, false) => CostState::Fresh,
        }
    }

    /// A measurement is under way.
    pub fn is_measuring(&self) -> bool {
        self.running.is_some()
    }

    /// Scene, view or method have changed.
    pub fn edited(&mut self) {
        self.stale = true;
    }

    /// Takes over what was measured; true when there is something new to show.
    pub fn take(&mut self) -> bool {
        let Some(running) = &self.running else { return false };
        match running.try_recv() {
            Err(TryRecvError::Empty) => return false,
            // The scene without an effect could not be made ready: there is nothing to tell.
            Err(TryRecvError::Disconnected) => {}
            Ok(plan) => {
                let traced = plan.into_iter().filter(|entry| entry.side == EffectSide::Tracer);
                self.known = traced.map(|entry| (entry.name, entry.cost)).collect();
            }
        }
        self.running = None;
        true
    }

    /// What the effect at this place of the plan costs: the tracer's come first, and the client has some of the same name.
    fn of(&self, place: usize, name: &str) -> Option<EffectCost> {
        let (_, cost) = self.known.get(place).filter(|(known, _)| *known == name)?;
        cost.share.map(EffectCost::Share).or(cost.if_on_share.map(EffectCost::More))
    }
}

impl Viewer {
    /// Begins to measure what the tracer's effects cost in this scene, seen from here, by this method.
    ///
    /// # Errors
    ///
    /// When the camera cannot be used or the system gives no thread.
    pub fn measure_costs(&mut self) -> Result<()> {
        if self.costs.is_measuring() {
            return Ok(());
        }
        let (scene, camera) = (self.user.scene(), self.user.camera(self.size)?);
        let (desc, mut plan) = (self.user.desc().clone(), self.list());
        let run = RunSpec { film: self.spec(), ..self.plan.run.clone() };
        let (sender, receiver) = channel();
        let work = move || {
            Priority::Background.apply();
            let charged = price::charge(&mut plan, &desc, (&scene, &camera), (&run, price::BRIEF));
            if charged.is_ok() {
                // Nobody listens any more when the window has closed.
                let _ = sender.send(plan);
            }
        };
        std::thread::Builder::new().name("price".to_owned()).spawn(work).into_diagnostic()?;
        (self.costs.running, self.costs.stale) = (Some(receiver), false);
        Ok(())
    }

    /// The plan as the panel lists it, with what is known of costs.
    pub fn priced_effects(&mut self) -> Vec<Effect> {
        let mut effects = self.effects();
        for (place, effect) in effects.iter_mut().enumerate() {
            effect.cost = self.costs.of(place, effect.name);
        }
        effects
    }
}
