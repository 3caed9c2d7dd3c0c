//! Frame times of the last frames, against the budget.

use egui::Ui;
use egui_plot::{HLine, Line, Plot, PlotPoints};

use crate::client::window::panel::{Readout, style};
use crate::client::window::statistics::FRAMES;

/// Draws the graph and the percentiles under it.
pub(super) fn show(ui: &mut Ui, readout: &Readout) {
    let budget = readout.budget.as_secs_f64() * 1e3;
    let [p50, p95, p99] = readout.percentiles;
    let top = (1.25 * f64::from(p99)).max(1.5 * budget).max(1.0);
    let start = FRAMES.saturating_sub(readout.frames.len());
    let points: PlotPoints<'_> = readout
        .frames
        .iter()
        .enumerate()
        .map(|(i, ms)| [(start + i) as f64, f64::from(*ms).min(top)])
        .collect();
    Plot::new("frame times")
        .height(54.0)
        .show_axes(false)
        .show_grid(false)
        .show_x(false)
        .show_y(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .set_margin_fraction(egui::Vec2::ZERO)
        .default_x_bounds(0.0, (FRAMES - 1) as f64)
        .default_y_bounds(0.0, top)
        .auto_bounds(false)
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
