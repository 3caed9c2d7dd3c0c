//! The light mix: intensity and tint of each light group, and colour targets. The mix itself, which is a part of the picture, is
//! [`LightMix`](crate::viewer::light_mix::LightMix).

use std::path::PathBuf;

use egui::{Button, Context, Slider, SliderClamping, Ui};
use miette::{IntoDiagnostic, Result};

use crate::client::window::action::{Action, ActionQueue};
use crate::client::window::keys::{ToolKey, Trigger, tool_key};
use crate::client::window::panel::{
    FileChooser, PanelData, PanelTab, PictureArea, SectionPlace, ToolPresence, section, style,
};
use crate::render::light_groups;
use crate::viewer::light_mix::{LightMixData, groups_of};
use crate::viewer::tools::tool::{Tool, ToolContext};

/// File extensions of example pictures.
const IMAGES: [&str; 10] = ["png", "exr", "jpg", "jpeg", "hdr", "pfm", "bmp", "tga", "webp", "ktx2"];

/// What the user can do with the light mix.
#[derive(Clone, Debug, PartialEq)]
pub enum MixAction {
    /// Switches the tracing of light groups on or off.
    Toggle,
    /// Sets the factors of a group on linear R, G, B.
    Set { group: usize, factor: [f32; 3] },
    /// Shows one group alone, or all of them again.
    Solo(usize),
    /// Resets all factors to 1.
    Reset,
    /// Sets whether the fit changes intensities only and keeps tints.
    KeepColors(bool),
    /// Asks for an example picture.
    ChooseImage,
    /// Fits the mix to this picture.
    Like(PathBuf),
    /// Adds the pixel at a place as a colour target.
    AddTarget,
    /// Sets the colour of a target, display-linear R, G, B.
    SetTarget { place: usize, color: [f32; 3] },
    /// Removes a target.
    ForgetTarget(usize),
}

/// The controls of the light mix.
#[derive(Default)]
pub struct LightMixTool {
    data: LightMixData,
    dialog: FileChooser,
}

impl Tool for LightMixTool {
    type Action = MixAction;

    fn keys() -> Vec<ToolKey<MixAction>> {
        let toggle = "mix the lights, or end the mix";
        let toggle = tool_key("Ctrl+L", toggle, &[Trigger::Ctrl('l', false)], MixAction::Toggle);
        vec![toggle.below("move, turn or scale the selected object")]
    }

    fn perform(&mut self, action: MixAction, context: &mut ToolContext<'_>) -> Result<Option<String>> {
        let mut message = None;
        match action {
            MixAction::Toggle => return toggle(context).map(Some),
            MixAction::ChooseImage => {
                let folder = std::env::current_dir().into_diagnostic()?;
                self.dialog.ask_file("Match an image", &folder, ("Images", &IMAGES));
                return Ok(None);
            }
            MixAction::AddTarget => {
                let pixel = context.place()?.map(|at| at as u32);
                context.picture.mix.add_target(pixel, &context.panel.controls.settings)?;
                return Ok(Some("now choose its colour in the tab Scene".to_owned()));
            }
            MixAction::Like(path) => {
                context.picture.mix.look_like(&path, &context.panel.controls.settings)?;
                message = Some(format!("the lights are mixed like {}", path.display()));
            }
            MixAction::SetTarget { place, color } => {
                context.picture.mix.set_target(place, color);
                context.picture.mix.meet_targets(&context.panel.controls.settings)?;
            }
            MixAction::Set { group, factor } => context.picture.mix.set(group, factor),
            MixAction::Solo(group) => context.picture.mix.solo(group),
            MixAction::Reset => context.picture.mix.reset(),
            MixAction::KeepColors(keeps) => context.picture.mix.keep_colors(keeps),
            MixAction::ForgetTarget(place) => context.picture.mix.forget_target(place),
        }
        // The mix is another sum of the same pictures.
        context.picture.request_repaint();
        Ok(message)
    }

    fn update(&mut self, context: &mut ToolContext<'_>, _: &mut PanelData) {
        if context.panel.controls.layout.shows(PanelTab::Scene) {
            context.picture.offer_mix(context.session, context.editor);
        }
        self.data = context.picture.mix.data();
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, queue: &mut ActionQueue<MixAction>) {
        if place == SectionPlace::SceneEnd {
            section(ui, "Light mix", true, |ui| show(ui, &self.data, queue));
        }
    }

    fn over_picture(&mut self, ctx: &Context, _: PictureArea, queue: &mut ActionQueue<MixAction>) {
        if let Some(path) = self.dialog.show(ctx) {
            queue.ask(MixAction::Like(path));
        }
    }

    fn presence(&self, _: &ToolContext<'_>) -> ToolPresence {
        if self.dialog.is_open() { ToolPresence::Modal } else { ToolPresence::Hidden }
    }
}

/// Switches the tracing of separate light groups on or off; returns a message.
fn toggle(context: &mut ToolContext<'_>) -> Result<String> {
    context.check_one_eye("a light mix")?;
    let ToolContext { session, picture, editor, panel, has_edited, .. } = context;
    if picture.mix.is_on() {
        session.set_light_groups(Vec::new())?;
        picture.mix.end();
        *has_edited = true;
        return Ok("all lights are as they are in the scene".to_owned());
    }
    let groups = groups_of(editor.desc(), &editor.scene(), session.run_spec())?;
    session.set_light_groups(groups.clone())?;
    let made = picture.mix_groups(groups, session.run_spec()).into_diagnostic();
    if made.is_err() {
        session.set_light_groups(Vec::new())?;
    }
    made?;
    *has_edited = true;
    if !panel.controls.layout.shows(PanelTab::Scene) {
        panel.controls.layout.bring(PanelTab::Scene);
    }
    let summary = light_groups::summary(picture.mix.groups(), session.run_spec(), picture.group_memory());
    Ok(format!("lights are mixed in the tab Scene: {summary}"))
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
fn show(ui: &mut Ui, mix: &LightMixData, queue: &mut ActionQueue<MixAction>) {
    if !mix.is_on {
        let hint =
            "Traces the picture anew with one of each group of lights; from then on lights change at once";
        if ui.button("Mix lights").on_hover_text(hint).clicked() {
            queue.ask(MixAction::Toggle);
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
                queue.ask(MixAction::Set { group, factor: tint.map(|c| c * value) });
            }
            let solo = ui.selectable_label(mix.solo == Some(group), "Solo");
            if solo.on_hover_text("Shows these lights alone, or all again").clicked() {
                queue.ask(MixAction::Solo(group));
            }
        });
    }
    ui.horizontal(|ui| {
        let changed =
            mix.solo.is_some() || mix.groups.iter().any(|row| (row.intensity, row.tint) != (1.0, [1.0; 3]));
        if ui.add_enabled(changed, Button::new("Reset")).on_hover_text("All lights as they are").clicked() {
            queue.ask(MixAction::Reset);
        }
        let hint = "Renders without groups of lights, which is faster, and shows all lights as they are";
        if ui.button("End the mix").on_hover_text(hint).clicked() {
            queue.ask(MixAction::Toggle);
        }
    });
    if ui.button("Save the layers").on_hover_text("An EXR file with the picture of each group  E").clicked() {
        queue.ask_window(Action::SaveExr);
    }
    ui.separator();
    ui.horizontal(|ui| {
        let hint = "Finds the lights with which the picture looks most like an image file: one painted over a saved picture, or EXR";
        if ui.button("Match an image…").on_hover_text(hint).clicked() {
            queue.ask(MixAction::ChooseImage);
        }
        let hint = "Click a place in the picture; then choose the colour that it should have";
        if ui.button("Match a place…").on_hover_text(hint).clicked() {
            queue.ask_at_place(MixAction::AddTarget);
        }
        let mut keeps = mix.keeps_colors;
        if ui.checkbox(&mut keeps, "keep colours").on_hover_text("Changes intensities only").changed() {
            queue.ask(MixAction::KeepColors(keeps));
        }
    });
    for (place, target) in mix.targets.iter().enumerate() {
        ui.horizontal(|ui| {
            let mut color = target.color;
            if ui.color_edit_button_rgb(&mut color).changed() && differs(color, target.color) {
                queue.ask(MixAction::SetTarget { place, color });
            }
            let [x, y] = target.pixel;
            ui.colored_label(style::DIM, format!("at {x}, {y}"));
            if ui.small_button("×").on_hover_text("Forgets this place").clicked() {
                queue.ask(MixAction::ForgetTarget(place));
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;
    use crate::client::window::action::UserAction;
    use crate::viewer::light_mix::{MixGroupRow, MixTargetRow};

    fn harness(data: LightMixData) -> Harness<'static, ActionQueue<MixAction>> {
        let draw = move |ui: &mut Ui, queue: &mut ActionQueue<MixAction>| show(ui, &data, queue);
        let mut harness = Harness::builder().build_ui_state(draw, ActionQueue::default());
        harness.run_steps(3);
        harness
    }

    fn taken(harness: &mut Harness<'static, ActionQueue<MixAction>>) -> Vec<UserAction<MixAction>> {
        harness.run_steps(2);
        harness.state_mut().take()
    }

    /// The light mix by its widgets: intensity by the slider's field, a light alone, all as they are.
    #[test]
    fn lights_are_mixed() {
        let summary = "2 groups of lights: key, sky; their films take 4.0 MiB".to_owned();
        let mut data = LightMixData { summary: summary.clone(), ..LightMixData::default() };
        let mut off = harness(data.clone());
        off.get_by_label(&summary);
        off.get_by_label("Mix lights").click();
        assert_eq!(taken(&mut off), [UserAction::Tool(MixAction::Toggle)]);
        let row = |name: &str, intensity, tint| MixGroupRow {
            name: name.to_owned(),
            emitters: vec!["lamp".to_owned()],
            intensity,
            tint,
        };
        data.is_on = true;
        data.groups = vec![row("key", 2.0, [1.0, 0.5, 0.25]), row("sky", 1.0, [1.0; 3])];
        data.targets = vec![MixTargetRow { pixel: [12, 34], color: [0.2; 3] }];
        let mut on = harness(data);
        // Told by the name of its light.
        on.get_by_role_and_label(egui::accesskit::Role::Slider, "key");
        on.get_all_by_label("Solo").nth(1).expect("one for each light").click();
        assert_eq!(taken(&mut on), [UserAction::Tool(MixAction::Solo(1))]);
        on.get_by_label("at 12, 34");
        for (label, action) in [
            ("Reset", UserAction::Tool(MixAction::Reset)),
            ("keep colours", UserAction::Tool(MixAction::KeepColors(true))),
            ("Match a place…", UserAction::AskPlace(MixAction::AddTarget)),
            ("Save the layers", UserAction::Window(Action::SaveExr)),
            ("End the mix", UserAction::Tool(MixAction::Toggle)),
        ] {
            on.get_by_label(label).click();
            assert_eq!(taken(&mut on), [action]);
        }
    }
}
