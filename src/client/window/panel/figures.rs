//! Figures of the render and the display: counts, rates, frame times, and the time of every pass.

use std::sync::Arc;
use std::time::Duration;

use egui::{ComboBox, Grid, Id, ProgressBar, Ui};
use egui_plot::{HLine, Line, PlotPoints};

use crate::client::window::action::Action;
use crate::client::window::panel::data::PanelData;
use crate::client::window::panel::plots::still_plot;
use crate::client::window::panel::style;
use crate::client::window::statistics::FRAMES;

/// Shortest interval between updates of the displayed numbers, seconds.
const SETTLE: f64 = 0.1;

/// The displayed data, updated at most ten times a second so that numbers can be read.
pub(super) fn settled(ctx: &egui::Context, data: &PanelData) -> Arc<PanelData> {
    let (id, now) = (Id::new("settled figures"), ctx.input(|input| input.time));
    let kept = ctx.data(|memory| memory.get_temp::<(f64, Arc<PanelData>)>(id));
    if let Some((then, figures)) = kept
        && (0.0..SETTLE).contains(&(now - then))
        && figures.extent == data.extent
    {
        return figures;
    }
    let fresh = Arc::new(data.clone());
    ctx.data_mut(|memory| memory.insert_temp(id, (now, fresh.clone())));
    fresh
}

/// Draws the table.
pub(super) fn show(ui: &mut Ui, data: &PanelData, actions: &mut Vec<Action>) {
    let counts = &data.counts;
    let pixels = (f64::from(data.extent[0]) * f64::from(data.extent[1])).max(1.0);
    let samples = counts.camera_samples + counts.light_samples;
    let lod = |lod: Option<f32>| lod.map_or("–".to_owned(), |l| format!("{l:.2}"));
    let [width, height] = data.extent;
    let detail = if data.detail > 1 { format!(", shown at 1/{}", data.detail) } else { String::new() };
    Grid::new("figures").num_columns(2).min_col_width(96.0).spacing([8.0, 1.0]).show(ui, |ui| {
        let mut line = |name: &str, value: String| value_row(ui, name, value);
        line(
            "Samples",
            format!("{}, {} per pixel", count(samples as f64), significant(samples as f64 / pixels)),
        );
        line(
            "Camera / light",
            format!("{} / {}", count(counts.camera_samples as f64), count(counts.light_samples as f64)),
        );
        method(ui, data, actions);
        let mut line = |name: &str, value: String| value_row(ui, name, value);
        line("Light paths", count(counts.light_paths as f64));
        line("Traced", format!("{}/s", count(data.traced_per_second)));
        line("Rasterised", format!("{}/s", count(data.rasterised_per_second)));
        line("Limit", limit(data));
        line("Level of detail", format!("{} camera, {} light", lod(data.lods[0]), lod(data.lods[1])));
        line("Since last edit", time(data.elapsed));
        if let Some(last) = data.edit_latency {
            let p95 = data.edit_latency_p95.map_or(String::new(), |p| format!(", p95 {}", time(p)));
            line("Edit to picture", format!("{}{p95}", time(last)));
        }
        line("Resolution", format!("{width}×{height}{detail}"));
        line("Threads", data.threads.to_string());
        for tracer in &data.tracers {
            ui.colored_label(style::DIM, &tracer.address);
            ui.colored_label(if tracer.ill { style::ACCENT } else { style::BRIGHT }, &tracer.words);
            ui.end_row();
        }
    });
    let (used, size) = data.ring;
    let fill = used as f32 / size.max(1) as f32;
    ui.horizontal(|ui| {
        ui.colored_label(style::DIM, "Ring")
            .on_hover_text("Blocks that wait to be rasterised, of those that fit");
        let bar = ProgressBar::new(fill).desired_height(8.0).corner_radius(0.0).desired_width(130.0);
        ui.add(bar.fill(if fill > 0.9 { style::ACCENT } else { egui::Color32::from_gray(150) }));
        ui.colored_label(style::BRIGHT, format!("{used}/{size}"));
    });
    for words in [&data.reason, &data.plan, &data.device] {
        if !words.is_empty() {
            ui.colored_label(style::DIM, words);
        }
    }
}

fn value_row(ui: &mut Ui, name: &str, value: String) {
    ui.colored_label(style::DIM, name);
    ui.colored_label(style::BRIGHT, value);
    ui.end_row();
}

/// Selects the method.
fn method(ui: &mut Ui, data: &PanelData, actions: &mut Vec<Action>) {
    ui.colored_label(style::DIM, "Light transport");
    let automatic = format!("automatic: {}", data.method);
    let shown = if data.chooses_method { automatic.as_str() } else { data.method };
    ComboBox::from_id_salt("light transport").selected_text(shown).show_ui(ui, |ui| {
        let choices = std::iter::once(None).chain(data.methods.iter().copied().map(Some));
        for choice in choices {
            let is_chosen = choice == Some(data.method).filter(|_| !data.chooses_method);
            let response = ui.selectable_label(is_chosen, choice.unwrap_or("automatic"));
            if response.on_hover_text("Another method begins with no samples").clicked() {
                actions.push(Action::SetMethod(choice));
            }
        }
    });
    ui.end_row();
}

/// Which side limits convergence: tracer or display.
fn limit(data: &PanelData) -> String {
    let (used, size) = data.ring;
    if data.is_paused {
        return "paused: Space goes on".to_owned();
    }
    let drawing = (100.0 * data.drawing).round().min(100.0);
    match 10 * used > 9 * size {
        true => format!("display, at work {drawing} %: the tracer waits"),
        false => format!("tracer; the display is at work {drawing} %"),
    }
}

/// Draws the time of every pass, with a bar for its share of the sum.
pub(super) fn passes(ui: &mut Ui, data: &PanelData) {
    let sum: f64 = data.passes.iter().map(|(_, ms)| ms).sum();
    if data.passes.is_empty() {
        ui.colored_label(style::DIM, "Not timed.");
        return;
    }
    Grid::new("passes").num_columns(3).spacing([8.0, 1.0]).show(ui, |ui| {
        for (name, ms) in &data.passes {
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

/// Draws the times of the last frames against the budget, and their percentiles.
pub(super) fn frame_times(ui: &mut Ui, data: &PanelData) {
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

/// Writes a count or rate with three significant digits and a decimal prefix.
fn count(value: f64) -> String {
    let steps = [(1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k")];
    // 999.7 k would be written as 1000 k, so the next prefix begins where rounding reaches it.
    match steps.iter().find(|(step, _)| value >= 0.9995 * step) {
        Some((step, prefix)) => format!("{} {prefix}", significant(value / step)),
        None => format!("{value:.0}"),
    }
}

/// Writes three significant digits.
fn significant(value: f64) -> String {
    let decimals = if value < 9.995 { 2 } else { usize::from(value < 99.95) };
    format!("{value:.decimals$}")
}

/// Writes a time in the unit that suits it.
fn time(time: Duration) -> String {
    match time.as_secs_f64() {
        s if s < 1.0 => format!("{:.0} ms", s * 1e3),
        s if s < 60.0 => format!("{s:.1} s"),
        s => format!("{:.0} min {:02.0} s", (s / 60.0).floor(), (s % 60.0).floor()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_have_three_digits() {
        let cases = [
            (0.0, "0"),
            (999.0, "999"),
            (999.7, "1.00 k"),
            (12_345.0, "12.3 k"),
            (999_600.0, "1.00 M"),
            (2.5e9, "2.50 G"),
        ];
        for (value, text) in cases {
            assert_eq!(count(value), text);
        }
        assert_eq!(time(Duration::from_millis(33)), "33 ms");
        assert_eq!(time(Duration::from_secs_f64(125.9)), "2 min 05 s");
    }
}
