//! Contents of each tab of the dock, section by section.

use egui::Ui;

use crate::client::window::action::Action;
use crate::client::window::panel::controls::PanelControls;
use crate::client::window::panel::data::PanelData;
use crate::client::window::panel::layout::PanelTab;
use crate::client::window::panel::tools::{PanelTools, SectionPlace};
use crate::client::window::panel::widgets::section;
use crate::client::window::panel::{error, figures, look, sections, style};

/// Draws the contents of a tab.
pub(super) fn show(
    ui: &mut Ui,
    tab: PanelTab,
    data: &PanelData,
    controls: &mut PanelControls,
    tools: &mut dyn PanelTools,
    actions: &mut Vec<Action>,
) {
    match tab {
        PanelTab::Render => render(ui, data, controls, tools, actions),
        PanelTab::Look => {
            tools.sections(SectionPlace::LookTop, ui);
            look::show(ui, controls);
        }
        PanelTab::Scene => scene(ui, data, tools, actions),
        PanelTab::Inspect => tools.sections(SectionPlace::Inspect, ui),
        PanelTab::Compare => tools.sections(SectionPlace::Compare, ui),
        PanelTab::Files => {
            sections::files(ui, actions);
            ui.separator();
            tools.sections(SectionPlace::Files, ui);
            ui.separator();
            sections::recent(ui, data, actions);
        }
    }
}

fn render(
    ui: &mut Ui,
    data: &PanelData,
    controls: &mut PanelControls,
    tools: &mut dyn PanelTools,
    actions: &mut Vec<Action>,
) {
    let settled = figures::settled(ui.ctx(), data);
    sections::picture_size(ui, data, actions);
    tools.sections(SectionPlace::RenderTop, ui);
    section(ui, "Error", true, |ui| {
        error::show(ui, data.error.as_deref(), &mut controls.target, data.method, actions);
    });
    section(ui, "Figures", true, |ui| figures::show(ui, &settled, actions));
    tools.sections(SectionPlace::RenderFigures, ui);
    sections::left_out(ui, &data.left_out);
    if data.rejected.total > 0 {
        section(ui, &format!("Rejected: {}", data.rejected.total), false, |ui| {
            sections::rejected(ui, &data.rejected);
        });
    }
    section(ui, "Frame times", true, |ui| figures::frame_times(ui, &settled));
    section(ui, "Passes", false, |ui| figures::passes(ui, &settled));
}

fn scene(ui: &mut Ui, data: &PanelData, tools: &mut dyn PanelTools, actions: &mut Vec<Action>) {
    match &data.selection {
        Some(selection) if selection.selected || selection.lens_from > 0 => {
            section(ui, "Selection", true, |ui| {
                if selection.selected {
                    tools.sections(SectionPlace::Selection, ui);
                }
                sections::selection(ui, selection, actions);
            });
        }
        _ => {
            ui.colored_label(style::DIM, "Click an object in the picture to change it.");
        }
    }
    tools.sections(SectionPlace::SceneEnd, ui);
}
