//! The light mix: intensity and tint of each light group, and colour targets.

use egui::{Button, Slider, SliderClamping, Ui};

use crate::client::window::action::Action;
use crate::client::window::keys::CursorAction;
use crate::client::window::panel::style;

/// The light mix of the viewer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightMixData {
    /// Whether light groups are traced.
    pub is_on: bool,
    /// Description of the groups and their memory, or why there are none.
    pub summary: String,
    /// The groups.
    pub groups: Vec<MixGroupRow>,
    /// The group shown alone (solo).
    pub solo: Option<usize>,
    /// Colour targets.
    pub targets: Vec<MixTargetRow>,
    /// Whether the fit changes intensities only and keeps tints.
    pub keeps_colors: bool,
}

/// A light group.
#[derive(Clone, Debug, PartialEq)]
pub struct MixGroupRow {
    /// Its name.
    pub name: String,
    /// The names of its lights.
    pub emitters: Vec<String>,
    /// Intensity factor.
    pub intensity: f32,
    /// Additional factors on linear R, G, B; the largest is 1.
    pub tint: [f32; 3],
}

/// A colour target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MixTargetRow {
    /// The pixel.
    pub pixel: [u32; 2],
    /// Display-linear R, G, B.
    pub color: [f32; 3],
}

/// Largest intensity of the slider.
const MOST: f32 = 64.0;

/// Whether two colours differ by more than the rounding of the colour button.
fn differs(a: [f32; 3], b: [f32; 3]) -> bool {
    a.iter().zip(b).any(|(a, b)| (a - b).abs() >= ROUNDED)
}

/// Change of a component by the colour button's rounding to 8 bits.
const ROUNDED: f32 = 5e-3;

/// Draws the section.
pub(super) fn show(ui: &mut Ui, mix: &LightMixData, actions: &mut Vec<Action>) {
    if !mix.is_on {
        let hint =
            "Traces the picture anew with one of each group of lights; from then on lights change at once";
        if ui.button("Mix lights").on_hover_text(hint).clicked() {
            actions.push(Action::ToggleLightMix);
        }
        ui.colored_label(style::DIM, &mix.summary);
        return;
    }
    for (group, row) in mix.groups.iter().enumerate() {
        ui.horizontal(|ui| {
            let (mut tint, mut value) = (row.tint, row.intensity);
            let slider = Slider::new(&mut value, 0.0..=MOST).logarithmic(true).smallest_positive(1e-3);
            let slider = ui.add(slider.clamping(SliderClamping::Edits).max_decimals(3).suffix("×"));
            let shown = mix.solo.is_none_or(|solo| solo == group);
            let label = ui.colored_label(if shown { style::BRIGHT } else { style::DIM }, &row.name);
            let label = label.on_hover_text(row.emitters.join(", "));
            let slider = slider.labelled_by(label.id);
            let colored = ui.color_edit_button_rgb(&mut tint).on_hover_text("Tint of these lights");
            if slider.changed() || colored.changed() && differs(tint, row.tint) {
                actions.push(Action::SetMix { group, factor: tint.map(|c| c * value) });
            }
            let solo = ui.selectable_label(mix.solo == Some(group), "Solo");
            if solo.on_hover_text("Shows these lights alone, or all again").clicked() {
                actions.push(Action::SoloMix(group));
            }
        });
    }
    ui.horizontal(|ui| {
        let changed =
            mix.solo.is_some() || mix.groups.iter().any(|row| (row.intensity, row.tint) != (1.0, [1.0; 3]));
        if ui.add_enabled(changed, Button::new("Reset")).on_hover_text("All lights as they are").clicked() {
            actions.push(Action::ResetMix);
        }
        let hint = "Renders without groups of lights, which is faster, and shows all lights as they are";
        if ui.button("End the mix").on_hover_text(hint).clicked() {
            actions.push(Action::ToggleLightMix);
        }
    });
    if ui.button("Save the layers").on_hover_text("An EXR file with the picture of each group  E").clicked() {
        actions.push(Action::SaveExr);
    }
    ui.separator();
    ui.horizontal(|ui| {
        let hint = "Finds the lights with which the picture looks most like an image file: one painted over a saved picture, or EXR";
        if ui.button("Match an image…").on_hover_text(hint).clicked() {
            actions.push(Action::MixDialog);
        }
        let hint = "Click a place in the picture; then choose the colour that it should have";
        if ui.button("Match a place…").on_hover_text(hint).clicked() {
            actions.push(Action::AskPlace(CursorAction::MixTarget));
        }
        let mut keeps = mix.keeps_colors;
        if ui.checkbox(&mut keeps, "keep colours").on_hover_text("Changes intensities only").changed() {
            actions.push(Action::KeepMixColors(keeps));
        }
    });
    for (place, target) in mix.targets.iter().enumerate() {
        ui.horizontal(|ui| {
            let mut color = target.color;
            if ui.color_edit_button_rgb(&mut color).changed() && differs(color, target.color) {
                actions.push(Action::SetMixTarget { place, color });
            }
            let [x, y] = target.pixel;
            ui.colored_label(style::DIM, format!("at {x}, {y}"));
            if ui.small_button("×").on_hover_text("Forgets this place").clicked() {
                actions.push(Action::ForgetMixTarget(place));
            }
        });
    }
}
