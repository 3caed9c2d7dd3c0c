//! Figures of the render and the display: counts, rates, latencies; and the method, which can be chosen there.

use std::time::{Duration, Instant};

use egui::{ComboBox, Grid, ProgressBar, Ui};
use miette::Result;

use crate::client::lod::level_of_detail;
use crate::client::window::action::ActionQueue;
use crate::client::window::panel::{PanelData, SectionPlace, section, style};
use crate::remote::{Health, TracerStatus};
use crate::scene::desc::IntegratorKind;
use crate::viewer::screen::Screen;
use crate::viewer::tools::tool::{Tool, ToolContext};

/// Shortest interval between updates of the displayed numbers, so that they can be read.
const SETTLE: Duration = Duration::from_millis(100);

/// The line of the table where the method is chosen.
const METHOD: &str = "Light transport";

/// What the user can do in the table of figures.
#[derive(Clone, Debug, PartialEq)]
pub enum FigureAction {
    /// Selects the integrator of this name; `None` for the automatic choice.
    SetMethod(Option<&'static str>),
}

/// When figures were last updated.
#[derive(Clone, Copy, Debug, Default)]
pub struct FigureClock(Option<Instant>);

impl FigureClock {
    /// Whether an update is due now, which is then taken for made.
    pub fn take_due(&mut self, now: Instant) -> bool {
        let is_due = self.0.is_none_or(|last| now.saturating_duration_since(last) >= SETTLE);
        self.0 = if is_due { Some(now) } else { self.0 };
        is_due
    }
}

/// The figures as the panel shows them.
#[derive(Default)]
pub struct FigureTable {
    clock: FigureClock,
    /// Names and values, in order.
    rows: Vec<(&'static str, String)>,
    /// The method that the user has chosen; `None` while the choice is automatic.
    chosen: Option<&'static str>,
    tracers: Vec<TracerStatus>,
    /// Blocks in the lanes, and their capacity.
    ring: (usize, usize),
    /// Reason for the method, how tracer and display share the CPU, and the device; empty where there is nothing to say.
    notes: [String; 3],
}

impl Tool for FigureTable {
    type Action = FigureAction;

    fn perform(&mut self, action: FigureAction, context: &mut ToolContext<'_>) -> Result<Option<String>> {
        let FigureAction::SetMethod(name) = action;
        context.has_edited |= context.session.set_method(name);
        Ok(None)
    }

    fn update(&mut self, context: &mut ToolContext<'_>, _: &mut PanelData) {
        if self.clock.take_due(Instant::now()) {
            self.read(context);
        }
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, queue: &mut ActionQueue<FigureAction>) {
        if place == SectionPlace::Render {
            section(ui, "Figures", true, |ui| show(ui, self, queue));
        }
    }
}

impl FigureTable {
    /// Reads the figures.
    fn read(&mut self, context: &mut ToolContext<'_>) {
        let ToolContext { session, picture, metrics, paused, rests_for_pictures, .. } = context;
        let (run, counts) = (session.run_spec(), picture.counts());
        let rates = metrics.rates(session.traced(), picture.rasterised);
        let [width, height] = session.size();
        let (samples, pixels) = (counts.samples() as f64, (f64::from(width) * f64::from(height)).max(1.0));
        let method = run.integrator.name();
        self.chosen = (!session.chooses_method()).then_some(method);
        self.ring = session.fill();
        self.tracers = session.tracers.status();
        let lods = [counts.camera_samples, counts.light_samples].map(|samples| {
            level_of_detail(&run.film, samples).map_or("–".to_owned(), |lod| format!("{lod:.2}"))
        });
        let detail =
            if picture.detail() > 1 { format!(", shown at 1/{}", picture.detail()) } else { String::new() };
        self.rows = vec![
            ("Samples", format!("{}, {} per pixel", count(samples), significant(samples / pixels))),
            (
                "Camera / light",
                format!("{} / {}", count(counts.camera_samples as f64), count(counts.light_samples as f64)),
            ),
            (METHOD, self.chosen.map_or(format!("automatic: {method}"), str::to_owned)),
            ("Light paths", count(counts.light_paths as f64)),
            ("Traced", format!("{}/s", count(rates.traced))),
            ("Rasterised", format!("{}/s", count(rates.rasterised))),
            (
                "Limit",
                match (paused, *rests_for_pictures) {
                    (Some(_), _) => "paused: Space goes on".to_owned(),
                    (None, true) => "the reading of the scene's pictures: the tracer rests".to_owned(),
                    (None, false) => limit(self.ring, rates.drawing),
                },
            ),
            ("Level of detail", format!("{} camera, {} light", lods[0], lods[1])),
            ("Since last edit", time(session.elapsed())),
        ];
        if let Some(last) = metrics.recent_edits.last() {
            let [last, p95] = [last, metrics.recent_edits.percentiles([95.0])[0]].map(milliseconds);
            self.rows.push(("Edit to picture", format!("{}, p95 {}", time(last), time(p95))));
        }
        self.rows.push(("Resolution", format!("{width}×{height}{detail}")));
        self.rows.push(("Threads", session.tracers.threads().to_string()));
        let device = picture.screen.as_ref().and_then(Screen::gpu).map(|gpu| gpu.info().clone());
        self.notes = [
            run.auto.as_ref().map_or(String::new(), |chosen| chosen.reason.clone()),
            session.processor_sharing.clone(),
            device.map_or(String::new(), |d| match d.driver.contains(&d.name) {
                true => d.driver,
                false => format!("{} ({})", d.name, d.driver),
            }),
        ];
    }
}

/// Draws the table.
fn show(ui: &mut Ui, figures: &FigureTable, queue: &mut ActionQueue<FigureAction>) {
    Grid::new("figures").num_columns(2).min_col_width(96.0).spacing([8.0, 1.0]).show(ui, |ui| {
        for (name, value) in &figures.rows {
            ui.colored_label(style::DIM, *name);
            match *name {
                METHOD => method(ui, value, figures.chosen, queue),
                _ => _ = ui.colored_label(style::BRIGHT, value),
            }
            ui.end_row();
        }
        for TracerStatus { address, health, words, .. } in &figures.tracers {
            let color = if *health == Health::Ill { style::ACCENT } else { style::BRIGHT };
            ui.colored_label(style::DIM, address);
            ui.colored_label(color, words);
            ui.end_row();
        }
    });
    let (used, size) = figures.ring;
    let fill = used as f32 / size.max(1) as f32;
    ui.horizontal(|ui| {
        ui.colored_label(style::DIM, "Ring")
            .on_hover_text("Blocks that wait to be rasterised, of those that fit");
        let bar = ProgressBar::new(fill).desired_height(8.0).corner_radius(0.0).desired_width(130.0);
        ui.add(bar.fill(if fill > 0.9 { style::ACCENT } else { egui::Color32::from_gray(150) }));
        ui.colored_label(style::BRIGHT, format!("{used}/{size}"));
    });
    for words in figures.notes.iter().filter(|words| !words.is_empty()) {
        ui.colored_label(style::DIM, words);
    }
}

/// Selects the method.
fn method(ui: &mut Ui, shown: &str, chosen: Option<&'static str>, queue: &mut ActionQueue<FigureAction>) {
    ComboBox::from_id_salt("light transport").selected_text(shown).show_ui(ui, |ui| {
        let named = IntegratorKind::candidates().map(|kind| Some(kind.name()));
        for choice in std::iter::once(None).chain(named) {
            let is_chosen = choice.is_some() && choice == chosen;
            let response = ui.selectable_label(is_chosen, choice.unwrap_or("automatic"));
            if response.on_hover_text("Another method begins with no samples").clicked() {
                queue.ask(FigureAction::SetMethod(choice));
            }
        }
    });
}

/// Which side limits convergence: tracer or display. `drawing`: fraction of the time that the display draws.
fn limit((used, size): (usize, usize), drawing: f64) -> String {
    let drawing = (100.0 * drawing).round().min(100.0);
    match 10 * used > 9 * size {
        true => format!("display, at work {drawing} %: the tracer waits"),
        false => format!("tracer; the display is at work {drawing} %"),
    }
}

fn milliseconds(milliseconds: f32) -> Duration {
    Duration::try_from_secs_f32(milliseconds * 1e-3).unwrap_or_default()
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
    use egui_kittest::kittest::Queryable;

    use super::*;
    use crate::client::window::action::UserAction;

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

    /// A clock that has not run yet and a stream without capacity give figures that no table expects.
    #[test]
    fn hostile_figures_are_written_without_a_panic() {
        for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0] {
            assert!(!count(odd).is_empty() && !significant(odd).is_empty());
            assert!(limit((5, 0), odd).starts_with("display"));
            assert_eq!(milliseconds(odd as f32), Duration::ZERO);
        }
    }

    #[test]
    fn figures_settle() {
        let (mut clock, start) = (FigureClock::default(), Instant::now());
        let due = [0, 20, 90, 110, 150, 220].map(|ms| clock.take_due(start + Duration::from_millis(ms)));
        assert_eq!(due, [true, false, false, true, false, true]);
    }

    #[test]
    fn another_method_can_be_chosen() {
        let table = FigureTable {
            rows: vec![("Traced", "1.23 M/s".into()), (METHOD, "automatic: path".into())],
            ring: (5, 0),
            ..FigureTable::default()
        };
        let draw = move |ui: &mut Ui, queue: &mut ActionQueue<FigureAction>| show(ui, &table, queue);
        let mut harness = egui_kittest::Harness::builder().build_ui_state(draw, ActionQueue::default());
        harness.run_steps(2);
        harness.get_by_label("1.23 M/s");
        harness.get_by_role(egui::accesskit::Role::ComboBox).click();
        harness.run_steps(2);
        harness.get_by_label("bidirectional").click();
        harness.run_steps(2);
        let chosen = FigureAction::SetMethod(Some("bidirectional"));
        assert_eq!(harness.state_mut().take(), [UserAction::Tool(chosen)]);
    }
}
