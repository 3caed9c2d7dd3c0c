//! The plan of effects, with switches for what can be left out.

use egui::{Checkbox, Ui};

use crate::client::window::panel::{Action, Effect, style};

/// Draws one line for each effect; the reason stands under the pointer.
pub(super) fn show(ui: &mut Ui, effects: &[Effect], actions: &mut Vec<Action>) {
    for effect in effects {
        let mut on = effect.on;
        let color = if effect.on { style::BRIGHT } else { style::DIM };
        let name = egui::RichText::new(effect.name).color(color);
        let line = ui.add_enabled(effect.can_switch, Checkbox::new(&mut on, name));
        let line = line.on_hover_text(&effect.reason).on_disabled_hover_text(&effect.reason);
        if line.changed() && on != effect.on {
            actions.push(Action::SetEffect { name: effect.name, on });
        }
    }
}

/// Says what is forced off, below the switches, so that no switch moves away from the pointer.
pub(super) fn left_out(ui: &mut Ui, names: &[&str]) {
    if !names.is_empty() {
        ui.colored_label(style::ACCENT, format!("without {}", names.join(", ")));
        ui.add_space(4.0);
    }
}
