//! The times of the last frames, and of every pass.

use std::convert::Infallible;
use std::time::{Duration, Instant};

use egui::{Grid, Ui};
use egui_plot::{HLine, Line, PlotPoints};

use crate::client::window::action::ActionQueue;
use crate::client::window::panel::{PanelData, SectionPlace, section, still_plot, style};
use crate::client::window::statistics::FRAMES;
use crate::viewer::tools::figures::FigureClock;
use crate::viewer::tools::tool::{Tool, ToolContext};

/// The times as the panel shows them.
#[derive(Default)]
pub struct FrameTimePlot {
    clock: FigureClock,
    /// Times of the last frames, oldest first, milliseconds.
    frames: Vec<f32>,
    /// p50, p95, p99 of `frames`, milliseconds.
    percentiles: [f32; 3],
    /// Target duration of a frame.
    budget: Duration,
    /// Name and milliseconds of every pass in the last timed frame.
    passes: Vec<(&'static str, f64)>,
}

impl Tool for FrameTimePlot {
    type Action = Infallible;

    fn update(&mut self, context: &mut ToolContext<'_>, _: &mut PanelData) {
        if self.clock.take_due(Instant::now()) {
            let metrics = &context.metrics;
            self.frames = metrics.intervals.iter().collect();
            self.percentiles = metrics.intervals.percentiles([50.0, 95.0, 99.0]);
            self.budget = context.picture.budget();
            self.passes = metrics.passes.clone();
        }
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, _: &mut ActionQueue<Infallible>) {
        if place == SectionPlace::Render {
            section(ui, "Frame times", true, |ui| frame_times(ui, self));
            section(ui, "Passes", false, |ui| passes(ui, &self.passes));
        }
    }
}

/// Draws the times of the last frames against the budget, and their percentiles.
fn frame_times(ui: &mut Ui, data: &FrameTimePlot) {
    let budget = data.budget.as_secs_f64() * 1e3;
    let [p50, p95, p99] = data.percentiles;
    let top = (1.25 * f64::from(p99)).max(1.5 * budget).max(1.0);
    let start = FRAMES.saturating_sub(data.frames.len());
    let points: PlotPoints<'_> =
        data.frames.iter().enumerate().map(|(i, ms)| [(start + i) as f64, f64::from(*ms).min(top)]).collect();
    still_plot("frame times", 54.0)
        .show_axes(false)
        .show_grid(false)
        .default_x_bounds(0.0, (FRAMES - 1) as f64)
        .default_y_bounds(0.0, top)
        .show(ui, |plot| {
            plot.set_plot_bounds_y(0.0..=top);
            plot.hline(HLine::new("budget", budget).color(style::ACCENT).width(1.0));
            plot.line(Line::new("frame", points).color(style::BRIGHT).width(1.0));
        });
    ui.horizontal(|ui| {
        for (name, ms) in [("p50", p50), ("p95", p95), ("p99", p99)] {
            let over = f64::from(ms) > budget && budget > 0.0;
            ui.colored_label(style::DIM, name);
            ui.colored_label(if over { style::ACCENT } else { style::BRIGHT }, format!("{ms:.1}"));
        }
        ui.colored_label(style::DIM, format!("ms, budget {budget:.1}"));
    });
}

/// Draws the time of every pass, with a bar for its share of the sum.
fn passes(ui: &mut Ui, passes: &[(&'static str, f64)]) {
    let sum: f64 = passes.iter().map(|(_, ms)| ms).sum();
    if passes.is_empty() {
        ui.colored_label(style::DIM, "Not timed.");
        return;
    }
    Grid::new("passes").num_columns(3).spacing([8.0, 1.0]).show(ui, |ui| {
        for (name, ms) in passes {
            ui.colored_label(style::DIM, *name);
            ui.colored_label(style::BRIGHT, format!("{ms:.2} ms"));
            let (bar, _) = ui.allocate_exact_size(egui::vec2(100.0, 8.0), egui::Sense::hover());
            let part = if sum > 0.0 { (ms / sum).clamp(0.0, 1.0) as f32 } else { 0.0 };
            let filled = egui::Rect::from_min_size(bar.min, egui::vec2(bar.width() * part, bar.height()));
            ui.painter().rect_filled(filled, 0.0, egui::Color32::from_gray(150));
            ui.end_row();
        }
        ui.colored_label(style::DIM, "sum");
        ui.colored_label(style::BRIGHT, format!("{sum:.2} ms"));
        ui.end_row();
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_times_are_shown_without_a_panic() {
        let times = FrameTimePlot {
            frames: vec![f32::NAN, f32::INFINITY, -1.0, 0.0],
            percentiles: [f32::NAN, f32::INFINITY, 0.0],
            passes: vec![("nothing", f64::NAN)],
            ..FrameTimePlot::default()
        };
        let draw = move |ui: &mut Ui| {
            frame_times(ui, &times);
            passes(ui, &times.passes);
        };
        egui_kittest::Harness::new_ui(draw).run_steps(2);
    }
}
