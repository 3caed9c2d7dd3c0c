//! Charts as SVG: curves on logarithmic axes, rows of bars or dots with their intervals, a map of regions.
//!
//! A page contains each chart twice, for wide and for narrow screens, and shows the one that fits. Tooltips are the browser's own.
//! Drawing never fails: non-finite values are left out, values beyond an axis are clamped to its end.

mod bars;
mod curves;
mod regions;
mod scale;
mod style;

use maud::{Markup, PreEscaped, html};

pub use bars::{BarChart, BarMark, BarPanel, BarRow};
pub use curves::{ChartCurve, ChartPoint, CurveChart, extension};
pub use regions::RegionMap;
pub use scale::{percent_label, tick_label};
pub use style::{MethodStyle, PLAIN, key, style_of, styled};

/// Style sheet of all charts, included once per page, and in every standalone drawing.
pub const STYLE: &str = include_str!("chart.css");

/// Width that a chart is drawn for, so that its text keeps its size on screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChartSize {
    /// 720 units, for 720 pixels.
    Wide,
    /// 340 units, for telephones.
    Narrow,
    /// 240 units, for lists.
    Thumbnail,
}

impl ChartSize {
    fn width(self) -> f64 {
        [720.0, 340.0, 240.0][self as usize]
    }

    /// Mean width of a character in chart text.
    fn character(self) -> f64 {
        if self == Self::Wide { 6.7 } else { 5.9 }
    }
}

pub struct Drawing {
    size: ChartSize,
    width: f64,
    height: f64,
    body: Markup,
}

impl Drawing {
    /// The drawing for a page that contains [`STYLE`].
    pub fn inline(&self, label: &str) -> Markup {
        let class = ["chart wide", "chart narrow", "chart thumbnail"][self.size as usize];
        html! {
            svg class=(class) viewBox={ "0 0 " (px(self.width)) " " (px(self.height)) } role="img" aria-label=(label) {
                (self.body)
            }
        }
    }

    /// The drawing as a standalone file including its style; light or dark according to the reader's preference.
    pub fn standalone(&self, title: &str) -> String {
        let [width, height] = [self.width, self.height].map(px);
        let svg = html! {
            svg xmlns="http://www.w3.org/2000/svg" class="chart wide" viewBox={ "0 0 " (width) " " (height) }
                width=(width) height=(height) role="img" {
                title { (shortened(title, 120)) }
                style { (PreEscaped(STYLE)) }
                rect.paper width=(width) height=(height) rx="6" {}
                (self.body)
            }
        };
        svg.into_string() + "\n"
    }
}

/// `text` without control characters, which XML does not allow, in at most `length` characters; `…` marks a cut.
pub fn shortened(text: &str, length: usize) -> String {
    let text: String =
        text.chars().filter(|c| !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}')).collect();
    match text.chars().count() <= length {
        true => text,
        false => text.chars().take(length.saturating_sub(1)).chain(['…']).collect(),
    }
}

/// Formats a coordinate with one decimal; non-finite numbers become 0.
fn px(x: f64) -> String {
    let x = if x.is_finite() { x.clamp(-1e5, 1e5) } else { 0.0 };
    let text = format!("{x:.1}");
    text.strip_suffix(".0").unwrap_or(&text).to_string()
}

/// A polyline, or the area it encloses.
fn path(class: &str, points: &[[f64; 2]]) -> Markup {
    let steps: Vec<String> = points.iter().map(|[x, y]| format!("{} {}", px(*x), px(*y))).collect();
    html! { @if !steps.is_empty() { path class=(class) d={ "M" (steps.join("L")) } {} } }
}

/// Text element; class `end` is right-aligned at the position, `middle` is centred.
fn text(class: &str, [x, y]: [f64; 2], text: &str) -> Markup {
    html! { text class=(class) x=(px(x)) y=(px(y)) { (shortened(text, 60)) } }
}

/// Tooltip of a mark.
fn tooltip(text: &str) -> Markup {
    html! { title { (shortened(text, 200)) } }
}
