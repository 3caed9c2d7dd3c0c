//! The buttons, and the camera in words.

use egui::{Slider, Ui};

use crate::client::window::navigation::FOV;
use crate::client::window::panel::{Action, Controls, Readout, style};

/// Draws the buttons.
pub(super) fn show(ui: &mut Ui, readout: &Readout, controls: &mut Controls, actions: &mut Vec<Action>) {
    if readout.fov > 0.0 {
        ui.horizontal(|ui| {
            let mut fov = readout.fov;
            let slider = Slider::new(&mut fov, FOV.0..=FOV.1).clamping(egui::SliderClamping::Edits);
            let response = ui.add(slider.fixed_decimals(1).suffix("°")).on_hover_text("Field of view  [ ]");
            if response.changed() && fov != readout.fov {
                actions.push(Action::SetFov(fov));
            }
            if response.drag_stopped() || response.lost_focus() {
                actions.push(Action::EndMove);
            }
            ui.colored_label(style::DIM, "field of view");
        });
    }
    if !readout.camera.is_empty() {
        ui.small(&readout.camera);
    }
    let mut row = |ui: &mut Ui, buttons: &[(&str, &str, Action)]| {
        ui.horizontal_wrapped(|ui| {
            for (text, hint, action) in buttons {
                if ui.button(*text).on_hover_text(*hint).clicked() {
                    actions.push(action.clone());
                }
            }
        });
    };
    row(
        ui,
        &[
            ("Undo", "Takes the last camera move back  Ctrl+Z", Action::Undo),
            ("Redo", "Makes it again  Ctrl+Shift+Z", Action::Redo),
            ("Reset", "Back to the file's camera  R", Action::ResetCamera),
        ],
    );
    row(
        ui,
        &[
            ("PNG", "Saves the picture as it is shown, without the panel  P", Action::SavePng),
            ("EXR", "Saves the sums of both streams  E", Action::SaveExr),
            (
                "Scene",
                "Saves camera and changes as XML that includes the original  Ctrl+S",
                Action::SaveScene,
            ),
            ("Copy command", "Copies the command line that repeats this picture  C", Action::CopyCommand),
        ],
    );
    ui.horizontal(|ui| {
        if ui.button("Keys").on_hover_text("Lists the keys  ?").clicked() {
            controls.help = !controls.help;
        }
        if ui.button("Hide").on_hover_text("Hides the panel  Tab").clicked() {
            controls.visible = false;
        }
    });
}
