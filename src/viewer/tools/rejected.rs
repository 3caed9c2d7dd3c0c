//! Values that the tracer has rejected since the last edit.

use std::convert::Infallible;

use egui::{Label, RichText, Sense, Ui};

use crate::client::window::action::ActionQueue;
use crate::client::window::panel::{PanelData, SectionPlace, section, style};
use crate::render::rejected::RejectedReport;
use crate::viewer::tools::tool::{Tool, ToolContext};

/// The list of rejected values.
#[derive(Default)]
pub struct RejectedView(RejectedReport);

impl Tool for RejectedView {
    type Action = Infallible;

    fn update(&mut self, context: &mut ToolContext<'_>, _: &mut PanelData) {
        self.0 = context.session.rejected(context.editor);
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, _: &mut ActionQueue<Infallible>) {
        if place == SectionPlace::Render && self.0.total > 0 {
            section(ui, &format!("Rejected: {}", self.0.total), false, |ui| show(ui, &self.0));
        }
    }
}

/// Lists the values; a click copies the command that reproduces one.
fn show(ui: &mut Ui, report: &RejectedReport) {
    for example in &report.examples {
        let words = format!("path {}: {}", example.index, example.what);
        let label = Label::new(RichText::new(words).color(style::ACCENT)).wrap().sense(Sense::click());
        if ui.add(label).on_hover_text(format!("Click to copy:\n{}", example.replay)).clicked() {
            ui.ctx().copy_text(example.replay.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;
    use crate::render::rejected::RejectedExample;

    /// A click on the count opens the list, which stays open while the count grows.
    #[test]
    fn rejected_values_are_listed_at_a_click() {
        let draw = |ui: &mut Ui, tool: &mut RejectedView| {
            tool.section(SectionPlace::Render, ui, &mut ActionQueue::default());
        };
        let what = "light sample infinite".to_owned();
        let examples = vec![RejectedExample { index: 7, what, replay: "pointillist replay".into() }];
        let tool = RejectedView(RejectedReport { total: 3, examples, ..RejectedReport::default() });
        let mut harness = Harness::builder().build_ui_state(draw, tool);
        harness.run_steps(2);
        let line = "path 7: light sample infinite";
        assert!(harness.query_by_label(line).is_none(), "folded at first");
        harness.get_by_label("Rejected: 3").click();
        harness.run_steps(2);
        harness.get_by_label(line);
        harness.state_mut().0.total = 4;
        harness.run_steps(2);
        harness.get_by_label("Rejected: 4");
        harness.get_by_label(line);
        harness.state_mut().0.total = 0;
        harness.run_steps(2);
        assert!(harness.query_by_label(line).is_none());
    }
}
