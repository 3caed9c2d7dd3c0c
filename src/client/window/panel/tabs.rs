//! Contents of each tab of the dock, section by section.

use egui::Ui;

use crate::client::window::action::Action;
use crate::client::window::panel::controls::PanelControls;
use crate::client::window::panel::data::PanelData;
use crate::client::window::panel::layout::PanelTab;
use crate::client::window::panel::tools::{PanelTools, SectionPlace};
use crate::client::window::panel::widgets::section;
use crate::client::window::panel::{look, sections, style};

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
        PanelTab::Render => {
            sections::picture_size(ui, data, actions);
            tools.sections(SectionPlace::Render, ui);
        }
        PanelTab::Look => {
            tools.sections(SectionPlace::LookTop, ui);
            look::show(ui, controls);
        }
        PanelTab::Scene => scene(ui, data, tools),
        PanelTab::Inspect => tools.sections(SectionPlace::Inspect, ui),
        PanelTab::Compare => tools.sections(SectionPlace::Compare, ui),
        PanelTab::Files => {
            tools.sections(SectionPlace::FilesTop, ui);
            ui.separator();
            tools.sections(SectionPlace::Files, ui);
            ui.separator();
            tools.sections(SectionPlace::FilesEnd, ui);
        }
    }
}

fn scene(ui: &mut Ui, data: &PanelData, tools: &mut dyn PanelTools) {
    match data.has_selection {
        true => section(ui, "Selection", true, |ui| tools.sections(SectionPlace::Selection, ui)),
        false => _ = ui.colored_label(style::DIM, "Click an object in the picture to change it."),
    }
    tools.sections(SectionPlace::SceneEnd, ui);
}
