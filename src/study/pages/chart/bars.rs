//! Rows of bars or dots with intervals, in one or several adjacent panels.

use maud::{Markup, html};

use super::scale::Scale;
use super::style::MethodStyle;
use super::{ChartSize, Drawing, path, px, text, tooltip};
use crate::study::Interval;

/// Mark of a panel's values.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum BarMark {
    /// A bar from 0, on a linear scale.
    Bar,
    /// The row's marker at the value, on a logarithmic scale.
    Dot,
}

/// A column of a bar chart.
pub struct BarPanel {
    pub title: String,
    mark: BarMark,
    /// Label of a tick.
    tick: fn(f64) -> String,
    /// Label of a value.
    number: fn(&Interval) -> String,
}

pub struct BarRow {
    /// If given, the row begins a group with this heading.
    pub group: Option<String>,
    pub name: String,
    /// Colour and marker; a hollow marker means pale bars.
    pub style: MethodStyle,
    /// One value per panel.
    pub values: Vec<Option<Interval>>,
}

pub struct BarChart {
    /// Description for screen readers.
    pub label: String,
    pub panels: Vec<BarPanel>,
    pub rows: Vec<BarRow>,
}

/// Largest width of a value's label.
const NUMBER: f64 = 62.0;
/// Height of a group's heading.
const HEADING: f64 = 24.0;

impl BarChart {
    pub fn is_empty(&self) -> bool {
        !self.rows.iter().flat_map(|r| &r.values).any(|v| v.is_some_and(|v| v.cleaned().is_some()))
    }

    /// Draws the chart. A wide one has the row names at the left, a narrow one above each row.
    pub fn draw(&self, size: ChartSize) -> Drawing {
        let wide = size == ChartSize::Wide;
        let longest = self.rows.iter().map(|r| r.name.chars().count()).max().unwrap_or(0).min(40);
        let (left, pitch) = if wide { (16.0 + size.character() * longest as f64, 21.0) } else { (4.0, 39.0) };
        let top = if self.panels.iter().all(|p| p.title.is_empty()) { 4.0 } else { 24.0 };
        let groups = self.rows.iter().filter(|r| r.group.is_some()).count() as f64;
        let bottom = top + pitch * self.rows.len() as f64 + HEADING * groups + 4.0;
        let scales: Vec<Scale> = (0..self.panels.len()).map(|i| self.scale(i, left, size)).collect();
        let rows = self.rows.iter().scan(top, |y, row| {
            let heading = *y;
            let begin = heading + if row.group.is_some() { HEADING } else { 0.0 };
            *y = begin + pitch;
            Some((row, heading, begin))
        });
        let body = html! {
            @for (panel, scale) in self.panels.iter().zip(&scales) { (panel.axis(scale, size, top, bottom)) }
            @for (row, heading, y) in rows {
                @if let Some(group) = &row.group { (text("strong", [4.0, heading + 15.0], group)) }
                @let middle = y + if wide { pitch / 2.0 } else { 27.0 };
                @if wide { (text("end", [left - 6.0, middle + 4.0], &super::shortened(&row.name, 40))) }
                @else { (text("", [left + 6.0, y + 15.0], &row.name)) }
                @for ((panel, scale), value) in self.panels.iter().zip(&scales).zip(&row.values) {
                    (panel.value(scale, row, value.and_then(|v| v.cleaned()), middle))
                }
            }
        };
        Drawing { size, width: size.width(), height: bottom + 24.0, body }
    }

    fn scale(&self, i: usize, left: f64, size: ChartSize) -> Scale {
        let panel = &self.panels[i];
        let share = (size.width() - left) / self.panels.len() as f64;
        let values = || self.rows.iter().filter_map(|r| r.values.get(i)?.as_ref()?.cleaned());
        let longest = values().map(|v| (panel.number)(&v).chars().count()).max().unwrap_or(1);
        let number = (size.character() * longest as f64 + 6.0).min(NUMBER);
        let ends = [left + share * i as f64 + 6.0, left + share * (i + 1) as f64 - 8.0 - number];
        match panel.mark {
            BarMark::Bar => Scale::linear(values().flat_map(|v| [v.value, v.low, v.high]), ends),
            BarMark::Dot => {
                let near = |v: Interval| [v.value, v.low.max(v.value / 4.0), v.high.min(v.value * 4.0)];
                Scale::logarithmic(values().flat_map(near), ends)
            }
        }
    }
}

impl BarPanel {
    /// A column with functions that format ticks and values.
    pub fn new(
        title: impl Into<String>,
        mark: BarMark,
        tick: fn(f64) -> String,
        number: fn(&Interval) -> String,
    ) -> Self {
        Self { title: title.into(), mark, tick, number }
    }

    fn axis(&self, scale: &Scale, size: ChartSize, top: f64, bottom: f64) -> Markup {
        // Labels that would touch the previous one are left out.
        let ticks = scale.ticks(if size == ChartSize::Wide { 46.0 } else { 40.0 }).into_iter();
        let ticks = ticks.scan(f64::NEG_INFINITY, |end, x| {
            let (at, label) = (scale.at(x), (self.tick)(x));
            let half = size.character() * label.chars().count() as f64 / 2.0;
            let fits = at - half > *end;
            *end = if fits { at + half + 4.0 } else { *end };
            Some((at, fits.then_some(label)))
        });
        html! {
            @for (at, label) in ticks {
                (path("grid", &[[at, top - 2.0], [at, bottom]]))
                @if let Some(label) = label { (text("middle dim", [at, bottom + 15.0], &label)) }
            }
            @if self.mark == BarMark::Bar && scale.holds(0.0) {
                (path("axis", &[[scale.at(0.0), top - 2.0], [scale.at(0.0), bottom]]))
            }
            (text("strong", [scale.ends[0] - 2.0, 13.0], &self.title))
        }
    }

    fn value(&self, scale: &Scale, row: &BarRow, value: Option<Interval>, y: f64) -> Markup {
        let place = [scale.ends[1] + 6.0, y + 4.0];
        let Some(value) = value else { return text("dim", place, "—") };
        let ([low, middle, high], zero) =
            ([value.low, value.value, value.high].map(|x| scale.at(x)), scale.at(0.0));
        let bar = self.mark == BarMark::Bar;
        html! {
            g class=(row.style.class) {
                (tooltip(&format!("{}: {}", row.name, (self.number)(&value))))
                @if bar {
                    rect class=(if row.style.hollow { "bar pale" } else { "bar" }) x=(px(zero.min(middle))) y=(px(y - 5.0))
                        width=(px((middle - zero).abs())) height="10" {}
                }
                @if value.high > value.low {
                    @let class = if bar { "whisker over" } else { "whisker" };
                    (path(class, &[[low, y], [high, y]]))
                    @for end in [low, high] { (path(class, &[[end, y - 3.0], [end, y + 3.0]])) }
                }
                @if !bar && value.value > 0.0 { (row.style.marker([middle, y], 4.5)) }
            }
            (text("", place, &(self.number)(&value)))
        }
    }
}
