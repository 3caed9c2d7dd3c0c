//! Two eyes: switched on and off, the layout of their pictures, how far apart they are and what they converge on, and the depths that are
//! comfortable to look at.

use std::ops::RangeInclusive;
use std::path::Path;

use egui::{Checkbox, Slider, SliderClamping, Ui};
use miette::{Result, miette};

use crate::client::ColorOutput;
use crate::client::window::action::ActionQueue;
use crate::client::window::keys::{ToolKey, Trigger, tool_at_cursor, tool_key};
use crate::client::window::panel::{PanelData, PanelTab, SectionPlace, choice, section, style, trimmed};
use crate::image::stereo::StereoLayout;
use crate::render::options::StereoOptions;
use crate::scene::desc::{StereoConvergence, StereoRig};
use crate::stream::Epoch;
use crate::viewer::editor::SeenDepth;
use crate::viewer::stereo::{layouts, refusal, refused_layout, refused_settings};
use crate::viewer::tools::tool::{Tool, ToolContext};

/// Ranges of the sliders, as multiples of the distance that the camera orbits about.
const INTEROCULAR: [f64; 2] = [1e-4, 1.0];
const CONVERGENCE: [f64; 2] = [1e-2, 1e2];

/// What the user can do with two eyes.
#[derive(Clone, Debug, PartialEq)]
pub enum StereoAction {
    /// Switches them on or off.
    Toggle,
    /// Shows their pictures in this layout.
    SetLayout(StereoLayout),
    /// Shows them in the next layout of the list.
    NextLayout,
    /// Sets the distance between them, world units.
    SetInterocular(f64),
    /// Sets what they look at.
    Converge(StereoConvergence),
    /// Lets them converge at the depth of the surface point at a place.
    ConvergeOn,
}

/// Two eyes as the panel shows them.
#[derive(Clone, Debug, PartialEq)]
struct ShownEyes {
    rig: StereoRig,
    layout: StereoLayout,
    /// The layouts that the window has.
    layouts: Vec<StereoLayout>,
    /// The distance that the camera orbits about, world units.
    reach: f64,
    /// What they see.
    seen: Option<SeenDepth>,
}

/// The eyes, and what one eye is shown with again.
#[derive(Default)]
pub struct StereoTool {
    /// `None` for one eye.
    shown: Option<ShownEyes>,
    /// The eyes that were switched off last.
    last: Option<StereoRig>,
    /// The encoding of the window with one eye.
    one_eyed: Option<ColorOutput>,
    /// What is seen in an epoch by these eyes in pictures of this size.
    seen: Option<(SeenKey, Option<SeenDepth>)>,
}

/// Epoch, eyes and size of pictures.
type SeenKey = (Epoch, StereoRig, [u32; 2]);

impl Tool for StereoTool {
    type Action = StereoAction;

    fn keys() -> Vec<ToolKey<StereoAction>> {
        use Trigger::{Char, Ctrl};
        let toggle = "stereo: see with two eyes, or with one";
        let next = "stereo: the next layout";
        let on = "stereo: converge the eyes on the point under the cursor";
        vec![
            tool_key("Ctrl+E", toggle, &[Ctrl('e', false)], StereoAction::Toggle)
                .below("pause the render, or go on"),
            tool_key("Y", next, &[Char('y')], StereoAction::NextLayout).below(toggle),
            tool_at_cursor("V", on, &[Char('v')], StereoAction::ConvergeOn).below(next),
        ]
    }

    fn perform(&mut self, action: StereoAction, context: &mut ToolContext<'_>) -> Result<Option<String>> {
        match (action, context.editor.rig()) {
            (StereoAction::Toggle, Some(_)) => return self.close(context).map(Some),
            (StereoAction::Toggle, None) => {
                let usual =
                    StereoOptions { layout: None, interocular: None, convergence: Default::default() };
                return self.open(usual, context).map(Some);
            }
            (StereoAction::SetLayout(layout), _) => {
                context.panel.change_settings(|settings| settings.stereo = layout);
            }
            (StereoAction::NextLayout, Some(_)) => {
                let all = layouts(context.picture.most_layers());
                let present = context.panel.controls.settings.stereo;
                let place = all.iter().position(|layout| *layout == present).unwrap_or_default();
                let next = all[(place + 1) % all.len()];
                context.panel.change_settings(|settings| settings.stereo = next);
                return Ok(Some(next.label().to_owned()));
            }
            (_, None) => return Err(miette!("there is one eye: switch stereo on first (Ctrl+E)")),
            (StereoAction::SetInterocular(interocular), Some(rig)) => {
                change(StereoRig { interocular, ..rig }, context)?;
            }
            (StereoAction::Converge(convergence), Some(rig)) => {
                change(StereoRig { convergence, ..rig }, context)?;
            }
            (StereoAction::ConvergeOn, Some(rig)) => {
                let pick = context.editor.pick(context.place()?, context.session.size());
                let distance = pick.map(|pick| context.editor.depth(pick.position));
                let Some(distance) = distance.filter(|distance| *distance > 0.0) else {
                    return Err(miette!("there is nothing here to converge on"));
                };
                change(StereoRig { convergence: StereoConvergence::OffAxis { distance }, ..rig }, context)?;
                return Ok(Some(format!("the eyes converge at a distance of {} units", short(distance))));
            }
        }
        Ok(None)
    }

    fn open_scene(&mut self, _: &Path) -> Option<String> {
        self.last = None;
        None
    }

    fn update(&mut self, context: &mut ToolContext<'_>, _: &mut PanelData) {
        self.shown = context.editor.rig().map(|rig| ShownEyes {
            rig,
            layout: context.panel.controls.settings.stereo,
            layouts: layouts(context.picture.most_layers()),
            reach: context.editor.pose().distance(),
            seen: self.seen_depth(rig, context),
        });
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, queue: &mut ActionQueue<StereoAction>) {
        if place == SectionPlace::SceneEnd {
            section(ui, "Stereo", true, |ui| show(ui, self.shown.as_ref(), queue));
        }
    }
}

impl StereoTool {
    /// Opens the eyes that are asked for, or without numbers those that were switched off last; returns a message.
    ///
    /// # Errors
    ///
    /// What two eyes do not go with, and those of the rig.
    pub fn open(&mut self, wanted: StereoOptions, context: &mut ToolContext<'_>) -> Result<String> {
        let run = context.session.run_spec();
        let is_remote = context.session.tracers.server().is_none();
        if let Some(why) = refusal(run.deterministic, is_remote, context.options.tev.is_some()) {
            return Err(miette!("stereo: {why}"));
        }
        if let Some(why) =
            wanted.layout.and_then(|layout| refused_layout(layout, context.picture.most_layers()))
        {
            return Err(miette!("stereo: {why}"));
        }
        if context.picture.mix.is_on() {
            return Err(miette!("a light mix goes with one eye only: end it first (Ctrl+L)"));
        }
        match self.last.filter(|_| wanted.interocular.is_none()) {
            Some(last) => context.editor.set_rig(Some(last))?,
            None => {
                let size = context.session.size();
                context.editor.open_eyes(wanted.interocular, wanted.convergence, size)?;
            }
        }
        self.one_eyed = Some(context.panel.controls.settings.output);
        let mut told: Vec<String> = context.editor.rig().iter().map(ToString::to_string).collect();
        context.panel.change_settings(|settings| {
            settings.stereo = wanted.layout.unwrap_or(settings.stereo);
            told.extend(refused_settings(settings));
        });
        context.has_edited = true;
        Ok(told.join("; "))
    }

    /// Closes the right eye, and shows with one eye what was shown with it before; returns a message.
    pub fn close(&mut self, context: &mut ToolContext<'_>) -> Result<String> {
        self.last = context.editor.rig().or(self.last);
        context.editor.set_rig(None)?;
        if let Some(one_eyed) = self.one_eyed.take() {
            context.panel.change_settings(|settings| settings.output = one_eyed);
        }
        context.has_edited = true;
        Ok("the picture is that of one eye".to_owned())
    }

    /// Returns to the eyes that the command line asks for; the display settings are those already.
    pub fn start_over(&mut self, context: &mut ToolContext<'_>) -> Result<()> {
        (self.last, self.one_eyed) = (None, None);
        context.has_edited |= context.editor.rig().is_some();
        context.editor.set_rig(None)?;
        match context.options.stereo {
            Some(wanted) => self.open(wanted, context).map(drop),
            None => Ok(()),
        }
    }

    /// What is seen in the present epoch, while the panel shows it.
    fn seen_depth(&mut self, rig: StereoRig, context: &ToolContext<'_>) -> Option<SeenDepth> {
        if !context.panel.controls.layout.shows(PanelTab::Scene) {
            return None;
        }
        let size = context.session.size();
        let key = (context.session.epoch(), rig, size);
        if self.seen.as_ref().is_none_or(|(known, _)| *known != key) {
            self.seen = Some((key, context.editor.seen_depth(size)));
        }
        self.seen.and_then(|(_, seen)| seen)
    }
}

/// Sees with these eyes from the next epoch on.
fn change(rig: StereoRig, context: &mut ToolContext<'_>) -> Result<()> {
    let before = context.editor.rig();
    context.editor.set_rig(Some(rig))?;
    context.has_edited |= before != Some(rig);
    Ok(())
}

/// Draws the section.
fn show(ui: &mut Ui, shown: Option<&ShownEyes>, queue: &mut ActionQueue<StereoAction>) {
    let mut is_on = shown.is_some();
    let hint = "Traces the pictures of two eyes at once  Ctrl+E";
    if ui.checkbox(&mut is_on, "Two eyes").on_hover_text(hint).changed() {
        queue.ask(StereoAction::Toggle);
    }
    let Some(ShownEyes { rig, layout, layouts, reach, seen }) = shown else { return };
    let mut next = *layout;
    let hint = "How the pictures of both eyes become one; nothing is traced anew  Y";
    let kinds: Vec<_> = layouts.iter().map(|layout| (layout.label(), *layout)).collect();
    choice(ui, ("Layout", hint), &mut next, &StereoLayout::default(), &kinds);
    if next != *layout {
        queue.ask(StereoAction::SetLayout(next));
    }
    let swapped = match layout {
        StereoLayout::SideBySide => Some(StereoLayout::CrossEyed),
        StereoLayout::CrossEyed => Some(StereoLayout::SideBySide),
        _ => None,
    };
    let mut is_swapped = *layout == StereoLayout::CrossEyed;
    let swap = ui.add_enabled(swapped.is_some(), Checkbox::new(&mut is_swapped, "Swap eyes"));
    let swap = swap.on_hover_text("The right eye's picture at the left, for a viewer who squints");
    let swap = swap.on_disabled_hover_text(
        "Only pictures side by side are exchanged: glasses and screens have one order of the eyes",
    );
    if let Some(swapped) = swapped.filter(|_| swap.changed()) {
        queue.ask(StereoAction::SetLayout(swapped));
    }
    let hint = "Distance between the eyes, units of the scene: the larger, the deeper";
    slide(
        ui,
        ("between the eyes", hint),
        rig.interocular,
        range(INTEROCULAR, *reach, rig.interocular),
        |n| {
            queue.ask(StereoAction::SetInterocular(n));
        },
    );
    let mut is_parallel = rig.convergence == StereoConvergence::Parallel;
    match rig.convergence {
        StereoConvergence::Parallel => {}
        StereoConvergence::OffAxis { distance } => {
            let hint =
                "What is at this distance has the same place for both eyes, in the plane of the screen";
            slide(ui, ("converged on", hint), distance, range(CONVERGENCE, *reach, distance), |distance| {
                queue.ask(StereoAction::Converge(StereoConvergence::OffAxis { distance }));
            });
        }
    }
    ui.horizontal_wrapped(|ui| {
        let hint = "The eyes look at infinity: everything is in front of the screen";
        if ui.checkbox(&mut is_parallel, "Parallel").on_hover_text(hint).changed() {
            let convergence = match is_parallel {
                true => StereoConvergence::Parallel,
                false => StereoConvergence::OffAxis { distance: *reach },
            };
            queue.ask(StereoAction::Converge(convergence));
        }
        let hint = "Click a place that shall lie in the plane of the screen  V";
        if ui.button("Converge on…").on_hover_text(hint).clicked() {
            queue.ask_at_place(StereoAction::ConvergeOn);
        }
    });
    if let Some(seen) = seen {
        let color = if seen.is_comfortable() { style::DIM } else { style::ACCENT };
        ui.colored_label(color, guide(seen)).on_hover_text(seen.comfortable.to_string());
    }
    ui.colored_label(style::DIM, "Without noise filter and masking; the error is that of the left eye.");
}

/// Draws a slider of a length with its label; `changed` gets what the user sets.
fn slide(
    ui: &mut Ui,
    (name, hint): (&str, &str),
    value: f64,
    range: RangeInclusive<f64>,
    changed: impl FnOnce(f64),
) {
    ui.horizontal(|ui| {
        let mut next = value;
        let slider = Slider::new(&mut next, range).logarithmic(true).clamping(SliderClamping::Edits);
        let response = ui.add(slider.max_decimals(5)).on_hover_text(hint);
        if response.changed() && next != value && next > 0.0 {
            changed(next);
        }
        ui.colored_label(style::DIM, name);
    });
}

/// The range of a slider, which holds its value.
fn range(multiples: [f64; 2], reach: f64, value: f64) -> RangeInclusive<f64> {
    let [low, high] = multiples.map(|n| n * reach);
    low.min(value)..=high.max(value)
}

/// The depths that are seen and those that are comfortable, in one line.
fn guide(SeenDepth { range, comfortable }: &SeenDepth) -> String {
    let far = match comfortable.far {
        f64::INFINITY => " on".to_owned(),
        far => format!(" to {}", short(far)),
    };
    let comfortable = format!("comfortable from {}{far}", short(comfortable.near));
    match range {
        Some([near, far]) => format!("Depths {} to {}; {comfortable}", short(*near), short(*far)),
        None => format!("Nothing is seen; {comfortable}"),
    }
}

/// Three digits.
fn short(n: f64) -> String {
    let digits = (2.0 - n.abs().log10().floor()).clamp(0.0, 6.0);
    trimmed(n, digits as usize)
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;
    use crate::client::window::action::UserAction;
    use crate::scene::desc::{ComfortableDepth, StereoScreen};

    fn eyes(near: f64) -> ShownEyes {
        let rig = StereoRig { interocular: 0.05, convergence: StereoConvergence::OffAxis { distance: 1.5 } };
        let comfortable =
            ComfortableDepth { near: 0.75, far: f64::INFINITY, screen: StereoScreen::default() };
        let seen = SeenDepth { range: Some([near, 12.34]), comfortable };
        ShownEyes { rig, layout: StereoLayout::SideBySide, layouts: layouts(1), reach: 1.5, seen: Some(seen) }
    }

    #[test]
    fn buttons_do_what_they_say() {
        let draw = |ui: &mut Ui, queue: &mut ActionQueue<StereoAction>| show(ui, Some(&eyes(1.0)), queue);
        let mut harness = Harness::builder().build_ui_state(draw, ActionQueue::default());
        harness.run_steps(3);
        assert_eq!(harness.state_mut().take(), [], "nothing comes by itself");
        harness.get_by_label("Depths 1 to 12.3; comfortable from 0.75 on");
        for (label, action) in [
            ("Two eyes", UserAction::Tool(StereoAction::Toggle)),
            ("Swap eyes", UserAction::Tool(StereoAction::SetLayout(StereoLayout::CrossEyed))),
            ("Parallel", UserAction::Tool(StereoAction::Converge(StereoConvergence::Parallel))),
            ("Converge on…", UserAction::AskPlace(StereoAction::ConvergeOn)),
        ] {
            harness.get_by_label(label).click();
            harness.run_steps(2);
            assert_eq!(harness.state_mut().take(), [action]);
        }
    }

    #[test]
    fn what_is_too_near_is_told() {
        let seen = |near| eyes(near).seen.expect("something");
        assert!(seen(0.8).is_comfortable() && !seen(0.5).is_comfortable());
        assert_eq!(guide(&seen(0.5)), "Depths 0.5 to 12.3; comfortable from 0.75 on");
        let nothing = SeenDepth { range: None, ..seen(1.0) };
        assert!(nothing.is_comfortable() && guide(&nothing).starts_with("Nothing is seen"));
    }

    #[test]
    fn one_eye_is_a_switch_alone() {
        let draw = |ui: &mut Ui, queue: &mut ActionQueue<StereoAction>| show(ui, None, queue);
        let mut harness = Harness::builder().build_ui_state(draw, ActionQueue::default());
        harness.run_steps(2);
        assert!(harness.query_by_label("Parallel").is_none());
        harness.get_by_label("Two eyes").click();
        harness.run_steps(2);
        assert_eq!(harness.state_mut().take(), [UserAction::Tool(StereoAction::Toggle)]);
    }
}
