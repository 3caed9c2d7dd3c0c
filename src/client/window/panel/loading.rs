//! The loading screen of the window before its first scene.

use egui::{Align2, Area, Id, ProgressBar, RichText, Ui};

use super::style;

/// Loading progress.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadingData {
    /// The scene.
    pub name: String,
    /// Present step, such as the file being read.
    pub what: String,
    /// Number of files read, and number of files known to be referenced by the scene.
    pub files: [usize; 2],
}

/// Width of the text and the bar, points.
const WIDTH: f32 = 320.0;

/// Draws scene name, progress bar and present step in the middle of the window.
pub fn show_loading(ui: &mut Ui, data: &LoadingData) {
    let ctx = ui.ctx().clone();
    style::apply(&ctx);
    let width = WIDTH.min(ctx.content_rect().width() - 16.0).max(1.0);
    let area = Area::new(Id::new("loading")).fade_in(false).interactable(false);
    area.anchor(Align2::CENTER_CENTER, [0.0, 0.0]).show(&ctx, |ui| {
        ui.set_width(width);
        ui.label(RichText::new(&data.name).color(style::BRIGHT).heading());
        let [done, total] = data.files;
        let share = done as f32 / total.max(1) as f32;
        ui.add(ProgressBar::new(share).desired_width(width).desired_height(4.0).fill(style::ACCENT));
        ui.add(egui::Label::new(RichText::new(&data.what).color(style::DIM)).truncate());
    });
}
