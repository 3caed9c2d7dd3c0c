//! The panel: display controls, figures, the selected object, actions. Pure egui over plain data.

mod actions;
mod controls;
mod effects;
mod error;
mod frame;
mod graph;
mod help;
mod known;
mod maps;
mod readout;
mod selection;
mod statistics;
pub mod style;

pub use known::{
    CostState, DEFAULT_TARGET, EffectCost, ErrorReadout, MapReadout, Overlay, Scale, Show, TARGETS,
};
pub use readout::{Effect, Parameter, Readout, Selection, Value};

use crate::client::settings::{Settings, SplatFilter};
use crate::color::Profile;

/// What the user changes in the panel; kept by the viewer.
#[derive(Clone, Debug)]
pub struct Controls {
    /// Display controls; never restart the server.
    pub settings: Settings,
    /// Splat filter; starts the film anew from the samples that are kept.
    pub filter: SplatFilter,
    /// A profile that was read from a file, to choose again after another one.
    pub own_profile: Option<Profile>,
    /// The panel is shown.
    pub visible: bool,
    /// The list of keys is shown.
    pub help: bool,
    /// What lies over the picture.
    pub show: Show,
    /// Relative error that 95 % of the picture shall stay below.
    pub target: f64,
}

/// What the user asks for in the panel.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Save the displayed picture.
    SavePng,
    /// Save the sums.
    SaveExr,
    /// Save camera and edits as a scene file that includes the original.
    SaveScene,
    /// Copy the command line that repeats this picture.
    CopyCommand,
    /// Take the last camera move back.
    Undo,
    /// Make it again.
    Redo,
    /// Back to the file's camera.
    ResetCamera,
    /// Field of view in degrees.
    SetFov(f64),
    /// The camera move is over: the next one is an entry of its own.
    EndMove,
    /// Change parameter `index` of the selection.
    Edit {
        /// Place in [`Selection::parameters`].
        index: usize,
        /// New value.
        value: Value,
    },
    /// Measure what the effects of the tracer cost.
    MeasureCosts,
    /// Forget the selection.
    Deselect,
    /// Leave an effect of the tracer out of the picture, or take it back in.
    SetEffect {
        /// Its name.
        name: &'static str,
        /// It takes part.
        on: bool,
    },
}

/// Draws the panel; returns what was asked for, in order. Changes `controls` in place.
///
/// Figures are taken over ten times a second only, so that they can be read; everything else is as fresh as `readout`.
pub fn show(ui: &mut egui::Ui, readout: &Readout, controls: &mut Controls) -> Vec<Action> {
    let ctx = ui.ctx().clone();
    style::apply(&ctx);
    let mut actions = Vec::new();
    maps::show(&ctx, &readout.overlay);
    if let Some(message) = &readout.message {
        frame::message(&ctx, message);
    }
    if controls.help {
        help::show(&ctx, &mut controls.help);
    }
    if !controls.visible {
        return actions;
    }
    let figures = statistics::settled(&ctx, readout);
    frame::floating(&ctx, |ui| {
        if let Some(selection) = &readout.selection {
            frame::section(ui, "Selection", true, |ui| selection::show(ui, selection, &mut actions));
        }
        frame::section(ui, "Error", true, |ui| {
            error::show(ui, readout.error.as_deref(), &mut controls.target);
        });
        frame::section(ui, "Figures", true, |ui| statistics::show(ui, &figures));
        frame::section(ui, "Display", true, |ui| controls::show(ui, controls));
        frame::section(ui, "Effects", false, |ui| {
            effects::show(ui, &readout.effects, readout.costs, &mut actions);
        });
        effects::left_out(ui, &readout.left_out);
        frame::section(ui, "Frame times", true, |ui| graph::show(ui, &figures));
        frame::section(ui, "Camera and files", true, |ui| actions::show(ui, readout, controls, &mut actions));
        frame::section(ui, "Passes", false, |ui| statistics::passes(ui, &figures));
    });
    actions
}
