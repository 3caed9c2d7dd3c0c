//! The plan of effects, with switches for what can be left out, and what each costs once somebody has asked.

use egui::{Align, Checkbox, Layout, RichText, Ui};

use crate::client::window::panel::{Action, CostState, Effect, EffectCost, style};

/// Draws one line for each effect; the reason stands under the pointer.
pub(super) fn show(ui: &mut Ui, effects: &[Effect], costs: CostState, actions: &mut Vec<Action>) {
    measure(ui, costs, actions);
    for effect in effects {
        ui.horizontal(|ui| {
            let mut on = effect.on;
            let color = if effect.on { style::BRIGHT } else { style::DIM };
            let name = RichText::new(effect.name).color(color);
            let line = ui.add_enabled(effect.can_switch, Checkbox::new(&mut on, name));
            let line = line.on_hover_text(&effect.reason).on_disabled_hover_text(&effect.reason);
            if line.changed() && on != effect.on {
                actions.push(Action::SetEffect { name: effect.name, on });
            }
            let Some(cost) = effect.cost else { return };
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let (text, hint) = words(cost);
                let fresh = effect.on && costs == CostState::Fresh;
                ui.colored_label(if fresh { style::BRIGHT } else { style::DIM }, text).on_hover_text(hint);
            });
        });
    }
}

/// The button that asks for costs, and how old they are.
fn measure(ui: &mut Ui, costs: CostState, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let idle = costs != CostState::Measuring;
        let hint =
            "Traces this view with each effect of the tracer and without it, in turn, for a second or so";
        if ui.add_enabled(idle, egui::Button::new("Measure costs")).on_hover_text(hint).clicked() {
            actions.push(Action::MeasureCosts);
        }
        let note = match costs {
            CostState::Unknown => "",
            CostState::Measuring => "measuring …",
            CostState::Fresh => "share of the tracing time",
            CostState::Stale => "before the last change",
        };
        ui.colored_label(style::DIM, note);
    });
}

fn words(cost: EffectCost) -> (String, &'static str) {
    match cost {
        EffectCost::Share(share) => {
            (format!("{:.0} %", 100.0 * share), "Share of the tracing time that is saved without it")
        }
        EffectCost::More(more) => (
            format!("×{:.2}", 1.0 + more),
            "Time of a path with a small example of it, beside the present one",
        ),
    }
}

/// Says what is forced off, below the switches, so that no switch moves away from the pointer.
pub(super) fn left_out(ui: &mut Ui, names: &[&str]) {
    if !names.is_empty() {
        ui.colored_label(style::ACCENT, format!("without {}", names.join(", ")));
        ui.add_space(4.0);
    }
}
