//! The selected object, or the media and the lights without a shape: picked in the picture, edited in the tab Scene.

use egui::Ui;
use miette::Result;

use crate::client::window::action::ActionQueue;
use crate::client::window::keys::{ToolKey, Trigger, tool_key};
use crate::client::window::panel::{PanelData, PanelTab, SectionPlace, style};
use crate::scene::edit::medium_name;
use crate::tracer::MediumPick;
use crate::viewer::editor::parameters::{SceneParameter, Selection};
use crate::viewer::tools::parameters;
use crate::viewer::tools::tool::{Tool, ToolContext};

/// What the user can do with the selection.
#[derive(Clone, Debug, PartialEq)]
pub enum SelectionAction {
    /// Clears it.
    Clear,
    /// Sets a parameter to a new value.
    Edit(SceneParameter),
}

/// The selection as the panel shows it.
#[derive(Default)]
pub struct SelectionTool {
    shown: Option<Selection>,
}

impl Tool for SelectionTool {
    type Action = SelectionAction;

    fn keys() -> Vec<ToolKey<SelectionAction>> {
        let clear = tool_key("X", "select nothing", &[Trigger::Char('x')], SelectionAction::Clear);
        vec![clear.below("select an object")]
    }

    fn perform(&mut self, action: SelectionAction, context: &mut ToolContext<'_>) -> Result<Option<String>> {
        match action {
            SelectionAction::Clear => context.editor.select(None),
            SelectionAction::Edit(parameter) => context.has_edited |= context.editor.edit(parameter)?,
        }
        Ok(None)
    }

    fn click(&mut self, place: [f64; 2], context: &mut ToolContext<'_>) -> Result<()> {
        let size = context.session.size();
        let medium = context.editor.pick_medium(place, size);
        let shape = match medium {
            Some(medium) => medium.shape,
            None => context.editor.pick(place, size).map(|pick| pick.shape),
        };
        context.editor.select(shape);
        let layout = &context.panel.controls.layout;
        let hint = layout.is_open && !layout.shows(PanelTab::Scene) && !layout.shows(PanelTab::Inspect);
        let name = match (context.editor.selection(), medium) {
            (Some(selection), _) if selection.selected => Some(format!("{} is selected", selection.name)),
            (_, Some(MediumPick { medium, shape: None })) => {
                Some(format!("Here is {}", medium_name(context.editor.desc(), medium)))
            }
            _ => None,
        };
        if let Some(name) = name.filter(|_| hint) {
            context.panel.host.say(format!("{name}: the tab Scene changes it"));
        }
        Ok(())
    }

    fn update(&mut self, context: &mut ToolContext<'_>, data: &mut PanelData) {
        self.shown = context.editor.selection();
        data.has_selection = self.shown.is_some();
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, queue: &mut ActionQueue<SelectionAction>) {
        if let Some(selection) = self.shown.as_ref().filter(|_| place == SectionPlace::Selection) {
            show(ui, selection, queue);
        }
    }
}

/// Draws the parameters of the selection; every change requests an edit.
fn show(ui: &mut Ui, selection: &Selection, queue: &mut ActionQueue<SelectionAction>) {
    ui.horizontal(|ui| {
        ui.colored_label(style::ACCENT, &selection.name);
        if selection.selected && ui.button("Deselect").on_hover_text("Selects nothing  X").clicked() {
            queue.ask(SelectionAction::Clear);
        }
    });
    if selection.parameters.is_empty() {
        ui.colored_label(style::DIM, "Nothing of it can be changed.");
    }
    parameters::show(ui, &selection.parameters, queue, SelectionAction::Edit);
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;
    use crate::client::window::action::{Action, UserAction};
    use crate::viewer::editor::parameters::{EditedValue, ParameterValue};

    /// Untouched values ask for nothing. A switch asks for its other state, as a change of its own; a point shows its three numbers.
    #[test]
    fn parameters_are_edited() {
        let parameter =
            |label: &str, value| SceneParameter { label: label.into(), edits: EditedValue::Position, value };
        let position = ParameterValue::Vector { value: [1.25, -2.5, 0.125], step: 0.01 };
        let number = ParameterValue::Number { value: 1.504_6, min: 1.0, max: 3.0 };
        let parameters = vec![
            parameter("position", position),
            parameter("emission", ParameterValue::Scale(1.7)),
            parameter("reflectance", ParameterValue::Color([0.123_456, 0.5, 0.000_1])),
            parameter("interior index", number),
            parameter("textures", ParameterValue::Switch(true)),
        ];
        let selection = Selection { name: "wall".into(), selected: true, parameters };
        let draw = move |ui: &mut Ui, queue: &mut ActionQueue<SelectionAction>| show(ui, &selection, queue);
        let mut harness = Harness::builder().build_ui_state(draw, ActionQueue::default());
        harness.run_steps(3);
        assert_eq!(harness.state_mut().take(), []);
        harness.get_by_role(egui::accesskit::Role::CheckBox).click();
        harness.run_steps(2);
        let switched = SelectionAction::Edit(parameter("textures", ParameterValue::Switch(false)));
        assert_eq!(
            harness.state_mut().take(),
            [UserAction::Tool(switched), UserAction::Window(Action::EndMove)]
        );
        harness.get_by_label("Deselect").click();
        harness.run_steps(2);
        assert_eq!(harness.state_mut().take(), [UserAction::Tool(SelectionAction::Clear)]);
    }
}
