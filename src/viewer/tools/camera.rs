//! The camera: field of view, lens, and the places that it looks at and is focused on. Moves by mouse and keys are gestures of the
//! window.

use egui::{Slider, SliderClamping, Ui};
use glam::UVec2;
use miette::{Result, miette};
use winit::keyboard::KeyCode;

use crate::client::window::action::{Action, ActionQueue};
use crate::client::window::keys::{ToolKey, Trigger, tool_at_cursor, tool_key};
use crate::client::window::navigation::{FOV, Gesture};
use crate::client::window::panel::{PanelData, SectionPlace, section, style};
use crate::viewer::editor::parameters::SceneParameter;
use crate::viewer::tools::parameters;
use crate::viewer::tools::tool::{Tool, ToolContext};

/// What the user can do with the camera.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraAction {
    /// Turns it to the surface point at a place.
    LookAt,
    /// Focuses the lens at the distance of the surface point at a place.
    FocusOn,
    /// Moves it back to where the scene file puts it.
    Reset,
    /// Sets the field of view, in degrees.
    SetFov(f64),
    /// Sets a parameter of the lens to a new value.
    EditLens(SceneParameter),
}

/// The camera as the panel shows it.
#[derive(Default)]
pub struct CameraTool {
    /// Field of view in degrees, 0 when not known or not to be changed.
    fov: f64,
    /// Position, target, field of view.
    words: String,
    /// Parameters of the lens.
    lens: Vec<SceneParameter>,
}

impl Tool for CameraTool {
    type Action = CameraAction;

    fn keys() -> Vec<ToolKey<CameraAction>> {
        use Trigger::{Char, Key};
        let look = "look at the point under the cursor";
        let focus = "focus the lens on the point under the cursor";
        let reset = &[Char('r'), Key(KeyCode::Home)];
        vec![
            tool_at_cursor("F, double click", look, &[Char('f')], CameraAction::LookAt)
                .below("wider field of view"),
            tool_at_cursor("L", focus, &[Char('l')], CameraAction::FocusOn).below(look),
            tool_key("R, Home", "the file's camera", reset, CameraAction::Reset).below(focus),
        ]
    }

    fn perform(&mut self, action: CameraAction, context: &mut ToolContext<'_>) -> Result<Option<String>> {
        let size = context.session.size();
        match action {
            CameraAction::LookAt => {
                if let Some(view) = context.panel.controls.settings.look_around() {
                    let view = view.turned_to(context.cursor_place()?.shown, UVec2::from(size).as_vec2());
                    context.panel.change_settings(|settings| settings.post.look_around.view = Some(view));
                    context.redraws = true;
                } else if let Some(pick) = context.editor.pick(context.place()?, size) {
                    context.editor.end_change();
                    context.has_edited |= context.editor.gesture(Gesture::Focus(pick.position), size);
                    context.editor.end_change();
                }
            }
            CameraAction::FocusOn => {
                let Some(pick) = context.editor.pick(context.place()?, size) else {
                    return Err(miette!("there is nothing here to focus on"));
                };
                context.has_edited |= context.editor.focus_at(pick.position)?;
                return Ok(Some("focused".to_owned()));
            }
            CameraAction::Reset => context.has_edited |= context.editor.reset_camera(),
            CameraAction::SetFov(fov) => context.has_edited |= context.editor.set_fov(fov),
            CameraAction::EditLens(parameter) => context.has_edited |= context.editor.edit(parameter)?,
        }
        Ok(None)
    }

    fn update(&mut self, context: &mut ToolContext<'_>, _: &mut PanelData) {
        self.fov = if context.editor.has_fov() { context.editor.fov() } else { 0.0 };
        self.words = context.editor.camera_words();
        self.lens = context.editor.lens_parameters();
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, queue: &mut ActionQueue<CameraAction>) {
        if place == SectionPlace::SceneEnd {
            section(ui, "Camera", true, |ui| show(ui, self, queue));
        }
    }
}

/// Draws the section.
fn show(ui: &mut Ui, camera: &CameraTool, queue: &mut ActionQueue<CameraAction>) {
    if camera.fov > 0.0 {
        ui.horizontal(|ui| {
            let mut fov = camera.fov;
            let slider = Slider::new(&mut fov, FOV.0..=FOV.1).clamping(SliderClamping::Edits);
            let response = ui.add(slider.fixed_decimals(1).suffix("°")).on_hover_text("Field of view  [ ]");
            if response.changed() && fov != camera.fov {
                queue.ask(CameraAction::SetFov(fov));
            }
            if response.drag_stopped() || response.lost_focus() {
                queue.ask_window(Action::EndMove);
            }
            ui.colored_label(style::DIM, "field of view");
        });
    }
    if !camera.words.is_empty() {
        ui.small(&camera.words);
    }
    parameters::show(ui, &camera.lens, queue, CameraAction::EditLens);
    ui.horizontal_wrapped(|ui| {
        if ui.button("Reset").on_hover_text("Back to the file's camera  R").clicked() {
            queue.ask(CameraAction::Reset);
        }
        let hint = "Click a place that the camera turns to and orbits about  F";
        if ui.button("Look at…").on_hover_text(hint).clicked() {
            queue.ask_at_place(CameraAction::LookAt);
        }
        let hint = "Click a place that the lens is focused on  L";
        if ui.button("Focus on…").on_hover_text(hint).clicked() {
            queue.ask_at_place(CameraAction::FocusOn);
        }
    });
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;
    use crate::client::window::action::UserAction;

    #[test]
    fn buttons_do_what_they_say() {
        let draw = |ui: &mut Ui, queue: &mut ActionQueue<CameraAction>| {
            let camera = CameraTool { fov: 39.3, words: "at 1 2 3".into(), lens: Vec::new() };
            show(ui, &camera, queue);
        };
        let mut harness = Harness::builder().build_ui_state(draw, ActionQueue::default());
        harness.run_steps(2);
        assert_eq!(harness.state_mut().take(), [], "nothing comes by itself");
        for (label, action) in [
            ("Reset", UserAction::Tool(CameraAction::Reset)),
            ("Look at…", UserAction::AskPlace(CameraAction::LookAt)),
            ("Focus on…", UserAction::AskPlace(CameraAction::FocusOn)),
        ] {
            harness.get_by_label(label).click();
            harness.run_steps(2);
            assert_eq!(harness.state_mut().take(), [action]);
        }
    }
}
