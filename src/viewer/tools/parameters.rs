//! Widgets for the editable parameters of the scene.

use egui::{DragValue, Label, RichText, Slider, SliderClamping, Ui};

use crate::client::window::action::{Action, ActionQueue};
use crate::client::window::panel::style;
use crate::viewer::editor::parameters::{ParameterValue, SceneParameter};

/// Draws parameters with their labels; `edit` is the action that sets one to a new value.
pub fn show<A>(
    ui: &mut Ui,
    parameters: &[SceneParameter],
    queue: &mut ActionQueue<A>,
    edit: impl Fn(SceneParameter) -> A,
) {
    for parameter in parameters {
        ui.horizontal(|ui| {
            let (value, ended) = field(ui, parameter.value);
            if let Some(value) = value {
                queue.ask(edit(SceneParameter { value, ..parameter.clone() }));
            }
            if ended {
                queue.ask_window(Action::EndMove);
            }
            // What is cut off at the edge of the panel is shown when the pointer rests on it.
            ui.add(Label::new(RichText::new(&parameter.label).color(style::DIM)).truncate());
        });
    }
}

/// Draws a widget for a value; returns the new value when the user changes it, and whether a change has ended.
fn field(ui: &mut Ui, value: ParameterValue) -> (Option<ParameterValue>, bool) {
    let (response, next) = match value {
        ParameterValue::Scale(mut factor) => {
            let slider = Slider::new(&mut factor, 0.0..=1000.0).logarithmic(true).smallest_positive(1e-3);
            let response = ui.add(slider.clamping(SliderClamping::Edits).max_decimals(3).suffix("×"));
            (response, ParameterValue::Scale(factor))
        }
        ParameterValue::Color(mut rgb) => {
            let response = ui.color_edit_button_rgb(&mut rgb);
            // The button rounds its value, so only a visible difference counts as a change.
            let near = |(a, b): (&f32, &f32)| (a - b).abs() < 1e-3;
            let same = matches!(value, ParameterValue::Color(before) if before.iter().zip(&rgb).all(near));
            let next = ParameterValue::Color(rgb.map(|c| c.clamp(0.0, 1.0)));
            (response, if same { value } else { next })
        }
        ParameterValue::Number { mut value, min, max } => {
            let slider = Slider::new(&mut value, min..=max).clamping(SliderClamping::Edits).max_decimals(4);
            (ui.add(slider), ParameterValue::Number { value, min, max })
        }
        ParameterValue::Switch(mut on) => (ui.checkbox(&mut on, ""), ParameterValue::Switch(on)),
        ParameterValue::Vector { mut value, step } => {
            let [x, y, z] = value.each_mut().map(|v| ui.add(DragValue::new(v).speed(step).max_decimals(4)));
            (x | y | z, ParameterValue::Vector { value, step })
        }
    };
    let changed = response.changed() && next != value;
    let ended = response.drag_stopped()
        || response.lost_focus()
        || matches!(value, ParameterValue::Switch(_)) && changed;
    (changed.then_some(next), ended)
}
