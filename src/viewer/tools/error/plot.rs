//! The plot of the error against time.

use egui::Ui;
use egui_plot::{AxisHints, GridInput, GridMark, HLine, Line, MarkerShape, PlotPoints, PlotUi, Points};

use crate::client::window::panel::{still_plot, style, trimmed};
use crate::viewer::tools::error::summary::ErrorSummary;

/// Height of the plot, points.
const HEIGHT: f32 = 132.0;

/// Labelled times on the axis, in seconds.
const TIMES: [(f64, &str); 14] = [
    (1e-3, "1 ms"),
    (1e-2, "10 ms"),
    (0.1, "0.1 s"),
    (1.0, "1 s"),
    (10.0, "10 s"),
    (60.0, "1 min"),
    (600.0, "10 min"),
    (3600.0, "1 h"),
    (36e3, "10 h"),
    (86_400.0, "1 d"),
    (864e3, "10 d"),
    (864e4, "100 d"),
    (864e5, "1 kd"),
    (864e6, "10 kd"),
];

/// Colour of the reference picture's curve.
const COMPARED: egui::Color32 = egui::Color32::from_rgb(110, 170, 220);

/// Plots error against time on logarithmic axes, the fitted line up to the target, and the predicted time of reaching it.
pub fn show(ui: &mut Ui, error: &ErrorSummary, compared: &[[f64; 2]], target: f64) {
    let [x, y] = bounds(error, compared, target).unwrap_or_else(|| empty(target));
    let time = |mark: GridMark, _: &std::ops::RangeInclusive<f64>| time_name(mark.value);
    let percent = |mark: GridMark, _: &std::ops::RangeInclusive<f64>| error_name(mark.value);
    let axis = |axis: AxisHints<'static>| axis.tick_label_color(style::DIM);
    let columns = axis(AxisHints::new_x()).formatter(time).label_spacing(34.0..=46.0);
    let rows = axis(AxisHints::new_y()).formatter(percent).label_spacing(12.0..=18.0).min_thickness(34.0);
    still_plot("error against time", HEIGHT)
        .custom_x_axes(vec![columns])
        .custom_y_axes(vec![rows])
        .x_grid_spacer(times)
        .y_grid_spacer(errors)
        .grid_spacing(10.0..=200.0)
        .show(ui, |plot| {
            plot.set_plot_bounds_x(x[0]..=x[1]);
            plot.set_plot_bounds_y(y[0]..=y[1]);
            draw(plot, error, compared, target);
        });
}

fn draw(plot: &mut PlotUi<'_>, error: &ErrorSummary, compared: &[[f64; 2]], target: f64) {
    let line = |points: &[[f64; 2]]| -> PlotPoints<'static> { logs(points).collect() };
    plot.hline(HLine::new("target", target.log10()).color(style::ACCENT.gamma_multiply(0.7)).width(1.0));
    plot.line(Line::new("compared", line(compared)).color(COMPARED).width(1.0));
    plot.line(Line::new("fit", line(&error.fit)).color(style::DIM).width(1.0));
    plot.line(Line::new("error", line(&error.checkpoints)).color(style::BRIGHT).width(1.0));
    plot.points(Points::new("checkpoints", line(&error.checkpoints)).color(style::BRIGHT).radius(1.5));
    if let Some([due, low, high]) = error.prediction {
        let bar = line(&[[low.max(error.seconds.min(due)), target], [high, target]]);
        plot.line(Line::new("interval", bar).color(style::ACCENT).width(4.0));
        let mark = Points::new("due", line(&[[due, target]])).shape(MarkerShape::Diamond);
        plot.points(mark.color(style::ACCENT).radius(4.5));
    }
}

/// Decimal logarithms of all points that are positive and finite.
fn logs(points: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> + '_ {
    let usable = |point: &&[f64; 2]| point.iter().all(|v| *v > 0.0 && v.is_finite());
    points.iter().filter(usable).map(|point| point.map(f64::log10))
}

/// Default axis ranges before the first checkpoint, as logarithms.
fn empty(target: f64) -> [[f64; 2]; 2] {
    let least = target.clamp(1e-4, 0.1).log10();
    [[-0.1, 2.1], [least - 0.12, least.max(-2.0) + 1.6]]
}

/// Axis ranges, as logarithms; `None` without a checkpoint.
fn bounds(error: &ErrorSummary, compared: &[[f64; 2]], target: f64) -> Option<[[f64; 2]; 2]> {
    let due = error.prediction.map(|[_, _, high]| [high, target]);
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    let seen = logs(&error.checkpoints).chain(logs(compared));
    for point in seen.chain(logs(due.as_slice()).collect::<Vec<_>>()) {
        for (range, value) in range.iter_mut().zip(point) {
            *range = [range[0].min(value), range[1].max(value)];
        }
    }
    let [x, y] = range;
    let y = [y[0].min(target.max(1e-9).log10()), y[1]];
    (x[1] >= x[0]).then(|| [[x[0] - 0.08, (x[1] + 0.1).max(x[0] + 0.5)], [y[0] - 0.12, y[1] + 0.12]])
}

/// Grid lines at the labelled times, and between them if there is room.
fn times(input: GridInput) -> Vec<GridMark> {
    let named = TIMES.iter().map(|(seconds, _)| (seconds.log10(), 1.0));
    let between = [0.2, 0.5, 2.0, 5.0, 20.0, 120.0, 300.0, 1200.0, 7200.0, 18_000.0];
    within(input, named.chain(between.map(|seconds: f64| (seconds.log10(), 0.31))))
}

/// Grid lines at 1, 2 and 5 times powers of ten.
fn errors(input: GridInput) -> Vec<GridMark> {
    let decades = (-7..=2).flat_map(|decade| {
        [(1.0, 1.0), (2.0f64, 0.31), (5.0, 0.31)].map(|(step, size)| (f64::from(decade) + step.log10(), size))
    });
    within(input, decades)
}

fn within(input: GridInput, marks: impl Iterator<Item = (f64, f64)>) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let inside = marks.filter(|(value, _)| (low..=high).contains(value));
    inside.map(|(value, step_size)| GridMark { value, step_size }).collect()
}

/// Formats a time given as a logarithm.
fn time_name(log: f64) -> String {
    let named = TIMES.iter().find(|(seconds, _)| (seconds.log10() - log).abs() < 1e-6);
    let seconds = 10f64.powf(log);
    match named {
        Some((_, name)) => (*name).to_owned(),
        None if seconds < 59.0 => format!("{} s", trimmed(seconds, 5)),
        None if seconds < 3599.0 => format!("{} min", trimmed(seconds / 60.0, 5)),
        None => format!("{} h", trimmed(seconds / 3600.0, 5)),
    }
}

/// Formats an error given as a logarithm.
fn error_name(log: f64) -> String {
    format!("{} %", trimmed(100.0 * 10f64.powf(log), 5))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_have_sensible_names() {
        let input = |low: f64, high: f64| GridInput { bounds: (low, high), base_step_size: 0.1 };
        let names: Vec<String> = times(input(-0.2, 3.0))
            .iter()
            .filter(|m| m.step_size == 1.0)
            .map(|m| time_name(m.value))
            .collect();
        assert_eq!(names, ["1 s", "10 s", "1 min", "10 min"]);
        assert_eq!(
            [20f64, 300.0, 7200.0, 0.5].map(|s| time_name(s.log10())),
            ["20 s", "5 min", "2 h", "0.5 s"]
        );
        let names: Vec<String> = errors(input(-2.8, -0.9)).iter().map(|m| error_name(m.value)).collect();
        assert_eq!(names, ["0.2 %", "0.5 %", "1 %", "2 %", "5 %", "10 %"]);
    }

    #[test]
    fn axes_hold_everything_that_is_drawn() {
        let mut error =
            ErrorSummary { checkpoints: vec![[1.0, 0.2], [10.0, 0.05]], ..ErrorSummary::default() };
        error.prediction = Some([300.0, 200.0, 500.0]);
        let [x, y] = bounds(&error, &[], 0.01).expect("checkpoints");
        assert!(x[0] < 0.0 && x[1] > 500f64.log10() && y[0] < -2.0 && y[1] > 0.2f64.log10());
        error.checkpoints = vec![[f64::NAN, 0.0], [0.0, f64::INFINITY]];
        error.prediction = None;
        assert_eq!(bounds(&error, &[], 0.01), None);
    }
}
