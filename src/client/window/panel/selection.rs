//! The selected object's values.

use egui::{Slider, SliderClamping, Ui};

use crate::client::window::panel::{Action, Selection, Value, style};

/// Draws what can be changed; pushes an edit for every change.
pub(super) fn show(ui: &mut Ui, selection: &Selection, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        ui.colored_label(style::ACCENT, &selection.name);
        if selection.selected && ui.button("Deselect").on_hover_text("Selects nothing  X").clicked() {
            actions.push(Action::Deselect);
        }
    });
    if selection.parameters.is_empty() {
        ui.colored_label(style::DIM, "Nothing of it can be changed.");
    }
    for (index, parameter) in selection.parameters.iter().enumerate() {
        ui.horizontal(|ui| {
            if let Some(value) = edit(ui, parameter.value) {
                actions.push(Action::Edit { index, value });
            }
            ui.colored_label(style::DIM, &parameter.label);
        });
    }
}

/// A widget for the value; the new one when the user changes it.
fn edit(ui: &mut Ui, value: Value) -> Option<Value> {
    let (changed, next) = match value {
        Value::Scale(mut factor) => {
            let slider = Slider::new(&mut factor, 0.0..=1000.0).logarithmic(true).smallest_positive(1e-3);
            let response = ui.add(slider.clamping(SliderClamping::Edits).max_decimals(3).suffix("×"));
            (response.changed(), Value::Scale(factor))
        }
        Value::Color(mut rgb) => {
            (ui.color_edit_button_rgb(&mut rgb).changed(), Value::Color(rgb.map(|c| c.clamp(0.0, 1.0))))
        }
        Value::Number { mut value, min, max } => {
            let slider = Slider::new(&mut value, min..=max).clamping(SliderClamping::Edits).max_decimals(4);
            (ui.add(slider).changed(), Value::Number { value, min, max })
        }
    };
    (changed && next != value).then_some(next)
}
