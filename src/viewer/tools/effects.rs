//! The effects of scene and display: switched on and off, and their costs, measured on another thread at the user's request.

use std::sync::mpsc::{Receiver, channel};

use egui::{Align, Button, Checkbox, Layout, RichText, Ui};
use miette::{IntoDiagnostic, Result};

use crate::client::Settings;
use crate::client::window::action::ActionQueue;
use crate::client::window::keys::{ToolKey, tool_key};
use crate::client::window::panel::{PanelData, SectionPlace, section, style};
use crate::job::{Job, StopFlag};
use crate::render::effect_plan::{Cost, EffectSide, PlannedEffect};
use crate::render::effect_price;
use crate::scene::desc::IntegratorKind;
use crate::server::Priority;
use crate::tracer::effects::{self, Effect, refusal};
use crate::viewer::editor::SceneEditor;
use crate::viewer::panel::ViewerPanel;
use crate::viewer::session::RenderSession;
use crate::viewer::tools::tool::{Tool, ToolContext, ViewChange};

/// What the user can do with effects.
#[derive(Clone, Debug, PartialEq)]
pub enum EffectAction {
    /// Switches the effect of this name on or off.
    Set { name: &'static str, on: bool },
    /// Measures the costs of the tracer's effects.
    Measure,
}

/// A line of the list of effects.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectRow {
    /// Name of the effect.
    pub name: &'static str,
    /// Whether it is simulated.
    pub on: bool,
    /// Object in the scene that needs the effect, with its location, or why none does.
    pub reason: String,
    /// Whether the user can switch it.
    pub can_switch: bool,
    /// Measured cost, if known.
    pub cost: Option<EffectCost>,
}

/// State of the effects' costs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CostState {
    /// Never measured.
    #[default]
    Unknown,
    /// Being measured.
    Measuring,
    /// Valid for the present scene.
    Fresh,
    /// The scene was edited since they were measured.
    Stale,
}

/// Cost of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EffectCost {
    /// If on: fraction of the tracing time saved without it.
    Share(f64),
    /// If off: relative increase of the tracing time with a small example of it.
    More(f64),
}

/// The list of effects.
#[derive(Default)]
pub struct EffectList {
    costs: EffectCosts,
    /// The rows without costs, and the method and settings that they are valid for; `None` after an edit.
    known: Option<(IntegratorKind, Settings, Vec<EffectRow>)>,
    /// The rows as the panel shows them.
    shown: Vec<EffectRow>,
    /// Names of the effects that are forced off.
    left_out: Vec<&'static str>,
}

impl Tool for EffectList {
    type Action = EffectAction;

    fn keys() -> Vec<ToolKey<EffectAction>> {
        let meaning = "measure what the effects cost";
        vec![tool_key("", meaning, &[], EffectAction::Measure).below("show the tab Files")]
    }

    fn perform(&mut self, action: EffectAction, context: &mut ToolContext<'_>) -> Result<Option<String>> {
        let ToolContext { session, editor, panel, has_edited, .. } = context;
        match action {
            EffectAction::Measure => self.costs.measure(session, editor, panel.plan(session, editor))?,
            // The files of the picture name the effects that are left out.
            EffectAction::Set { name, on } => match Effect::named(name) {
                Some(effect) => {
                    editor.switch(effect)?;
                    session.set_effects(editor);
                    *has_edited = true;
                }
                None => panel.change_settings(|settings| settings.switch(name, on)),
            },
        }
        Ok(None)
    }

    fn forget(&mut self, change: ViewChange) {
        if change == ViewChange::Edited {
            self.known = None;
            self.costs.edited();
        }
    }

    fn poll(&mut self, _: &mut ToolContext<'_>) -> bool {
        self.costs.take()
    }

    fn update(&mut self, context: &mut ToolContext<'_>, _: &mut PanelData) {
        self.shown = self.rows(context.session, context.editor, context.panel);
        self.left_out = context.session.run_spec().left_out().collect();
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, queue: &mut ActionQueue<EffectAction>) {
        if place == SectionPlace::Render {
            section(ui, "Effects", false, |ui| show(ui, &self.shown, self.costs.state(), queue));
            // Below the switches, so that their layout does not jump.
            if !self.left_out.is_empty() {
                ui.colored_label(style::ACCENT, format!("without {}", self.left_out.join(", ")));
                ui.add_space(4.0);
            }
        }
    }

    fn is_busy(&self) -> bool {
        self.costs.is_measuring()
    }
}

impl EffectList {
    /// List of effects, with costs where known.
    fn rows(&mut self, session: &RenderSession, editor: &SceneEditor, panel: &ViewerPanel) -> Vec<EffectRow> {
        let (method, settings) = (session.run_spec().integrator, &panel.controls.settings);
        let mut rows = match &self.known {
            Some((for_method, for_settings, rows)) if *for_method == method && for_settings == settings => {
                rows.clone()
            }
            _ => {
                let plan = panel.plan(session, editor);
                let rows: Vec<_> = plan.into_iter().map(|entry| effect_row(entry, method, editor)).collect();
                self.known = Some((method, settings.clone(), rows.clone()));
                rows
            }
        };
        for (place, row) in rows.iter_mut().enumerate() {
            row.cost = self.costs.of(place, row.name);
        }
        rows
    }
}

/// One row of the list of effects. A forced effect can be switched back; any other can be forced off or on where that is possible.
fn effect_row(entry: PlannedEffect, method: IntegratorKind, editor: &SceneEditor) -> EffectRow {
    let on_display = entry.client.as_ref().is_some_and(|effect| effect.can_switch);
    let can_switch = entry.effect.map_or(on_display, |effect| {
        let is_forced = editor.forced().iter().any(|forced| forced.effect == effect);
        let can_add = effects::force_on(&mut editor.desc().clone(), effect).is_ok();
        is_forced || entry.on && refusal(effect, method).is_none() || !entry.on && can_add
    });
    let place = entry.place.map_or(String::new(), |place| format!(" ({place})"));
    EffectRow { name: entry.name, on: entry.on, reason: entry.reason + &place, can_switch, cost: None }
}

/// The measurement in progress and the costs found last.
#[derive(Default)]
struct EffectCosts {
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
    fn measure(
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
    fn state(&self) -> CostState {
        match (&self.running, self.known.is_empty(), self.stale) {
            (Some(_), ..) => CostState::Measuring,
            (None, true, _) => CostState::Unknown,
            (None, false, true) => CostState::Stale,
            (None, false, false) => CostState::Fresh,
        }
    }

    /// Whether a measurement is under way.
    fn is_measuring(&self) -> bool {
        self.running.is_some()
    }

    /// Marks the costs as stale after a change of scene, view or method.
    fn edited(&mut self) {
        self.stale = true;
    }

    /// Takes over new measurements; true if there are any.
    fn take(&mut self) -> bool {
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
    fn of(&self, place: usize, name: &str) -> Option<EffectCost> {
        let (_, cost) = self.known.get(place).filter(|(known, _)| *known == name)?;
        cost.share.map(EffectCost::Share).or(cost.if_on_share.map(EffectCost::More))
    }
}

/// Draws one line per effect, with a switch and, once measured, its cost; the tooltip gives the reason.
fn show(ui: &mut Ui, effects: &[EffectRow], costs: CostState, queue: &mut ActionQueue<EffectAction>) {
    ui.horizontal(|ui| {
        let idle = costs != CostState::Measuring;
        let hint =
            "Traces this view with each effect of the tracer and without it, in turn, for a second or so";
        if ui.add_enabled(idle, Button::new("Measure costs")).on_hover_text(hint).clicked() {
            queue.ask(EffectAction::Measure);
        }
        let note = match costs {
            CostState::Unknown => "",
            CostState::Measuring => "measuring …",
            CostState::Fresh => "share of the tracing time",
            CostState::Stale => "before the last change",
        };
        ui.colored_label(style::DIM, note);
    });
    for effect in effects {
        ui.horizontal(|ui| {
            let mut on = effect.on;
            let color = if effect.on { style::BRIGHT } else { style::DIM };
            let name = RichText::new(effect.name).color(color);
            let line = ui.add_enabled(effect.can_switch, Checkbox::new(&mut on, name));
            let line = line.on_hover_text(&effect.reason).on_disabled_hover_text(&effect.reason);
            if line.changed() && on != effect.on {
                queue.ask(EffectAction::Set { name: effect.name, on });
            }
            let (text, hint) = match effect.cost {
                None => return,
                Some(EffectCost::Share(share)) => {
                    (format!("{:.0} %", 100.0 * share), "Share of the tracing time that is saved without it")
                }
                Some(EffectCost::More(more)) => (
                    format!("×{:.2}", 1.0 + more),
                    "Time of a path with a small example of it, beside the present one",
                ),
            };
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let fresh = effect.on && costs != CostState::Stale;
                ui.colored_label(if fresh { style::BRIGHT } else { style::DIM }, text).on_hover_text(hint);
            });
        });
    }
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;
    use crate::client::window::action::UserAction;

    fn harness(costs: CostState) -> Harness<'static, ActionQueue<EffectAction>> {
        let effect = |name, on, can_switch, cost| EffectRow {
            name,
            on,
            reason: "glass".into(),
            can_switch,
            cost: Some(cost),
        };
        let rows = [
            effect("dispersion", true, true, EffectCost::Share(0.124)),
            effect("lens", false, true, EffectCost::More(0.317)),
            effect("glare", false, false, EffectCost::Share(0.5)),
        ];
        let draw = move |ui: &mut Ui, queue: &mut ActionQueue<EffectAction>| show(ui, &rows, costs, queue);
        let mut harness = Harness::builder().build_ui_state(draw, ActionQueue::default());
        harness.run_steps(2);
        harness
    }

    fn click(
        harness: &mut Harness<'static, ActionQueue<EffectAction>>,
        label: &str,
    ) -> Vec<UserAction<EffectAction>> {
        harness.get_by_label(label).click();
        harness.run_steps(2);
        harness.state_mut().take()
    }

    /// What can be left out has a switch, what cannot has none.
    #[test]
    fn effects_are_switched_and_costs_measured_on_request() {
        let mut fresh = harness(CostState::Fresh);
        for what in ["12 %", "×1.32", "share of the tracing time"] {
            fresh.get_by_label(what);
        }
        let switched = EffectAction::Set { name: "dispersion", on: false };
        assert_eq!(click(&mut fresh, "dispersion"), [UserAction::Tool(switched)]);
        assert_eq!(click(&mut fresh, "glare"), []);
        assert_eq!(click(&mut fresh, "Measure costs"), [UserAction::Tool(EffectAction::Measure)]);
        harness(CostState::Stale).get_by_label("before the last change");
        let mut busy = harness(CostState::Measuring);
        busy.get_by_label("measuring …");
        assert_eq!(click(&mut busy, "Measure costs"), []);
    }
}
