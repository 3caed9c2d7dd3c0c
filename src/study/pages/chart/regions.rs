//! A grid over the picture: the method of least error in each region.

use maud::{Markup, html};

use super::style::{MethodStyle, key};
use super::{ChartSize, Drawing, px, tooltip};
use crate::study::data::RegionWinners;
use crate::study::format::{THIN, percent_of, significant};

pub struct RegionMap<'a> {
    pub regions: &'a RegionWinners,
    /// Name and style of each method.
    pub methods: Vec<(&'a str, MethodStyle)>,
    /// Height of the picture over its width.
    pub aspect: f64,
    /// `data:` URI of the picture shown behind the map.
    pub picture: Option<&'a str>,
}

/// Classes of strength by the ratio of the second-best method's error to the best one's, with their names.
const STRENGTHS: [(f64, &str, &str); 4] = [
    (4.0, "a4", "×4 and more"),
    (2.0, "a3", "×2–4"),
    (1.25, "a2", "×1.25–2"),
    (f64::NEG_INFINITY, "a1", "less than ×1.25"),
];

impl RegionMap<'_> {
    /// Columns and rows; empty if the map is too fine to be legible, or incomplete.
    fn grid(&self) -> [usize; 2] {
        let [columns, rows] = self.regions.grid;
        let sound = columns.checked_mul(rows).is_some_and(|n| n <= self.regions.winner.len().min(10_000));
        if sound { [columns, rows] } else { [0, 0] }
    }

    pub fn shares(&self) -> Vec<f64> {
        let [columns, rows] = self.grid();
        let cells = &self.regions.winner[..columns * rows];
        let share = |i: usize| cells.iter().filter(|w| **w == i).count() as f64 / cells.len().max(1) as f64;
        (0..self.methods.len()).map(share).collect()
    }

    pub fn draw(&self) -> Drawing {
        let width = ChartSize::Narrow.width();
        let height = width * if self.aspect.is_finite() { self.aspect.clamp(0.1, 4.0) } else { 1.0 };
        let [columns, rows] = self.grid();
        let cell = [width / columns.max(1) as f64, height / rows.max(1) as f64];
        let body = html! {
            @if let Some(uri) = self.picture {
                image width=(px(width)) height=(px(height)) preserveAspectRatio="none" href=(uri) {}
            }
            @for i in 0..columns * rows {
                (self.cell(i, [(i % columns) as f64 * cell[0], (i / columns) as f64 * cell[1]], cell))
            }
        };
        Drawing { size: ChartSize::Thumbnail, width, height, body }
    }

    fn cell(&self, i: usize, [x, y]: [f64; 2], [width, height]: [f64; 2]) -> Markup {
        let Some((name, style)) = self.regions.winner.get(i).and_then(|w| self.methods.get(*w)) else {
            return html! {};
        };
        let margin = self.regions.margin.get(i).copied().unwrap_or(1.0);
        let strength = STRENGTHS.iter().find(|(least, ..)| margin >= *least).map_or("a1", |s| s.1);
        html! {
            g class=(style.class) {
                (tooltip(&format!("{name}, by ×{THIN}{}", significant(margin, 2))))
                rect class={ "cell " (strength) } x=(px(x)) y=(px(y)) width=(px(width)) height=(px(height)) {}
                @if width.min(height) > 9.0 { (style.marker([x + width / 2.0, y + height / 2.0], 3.0)) }
            }
        }
    }

    /// Legend of colours, markers and strengths.
    pub fn legend(&self) -> Markup {
        html! {
            ul.legend {
                @for ((name, style), share) in self.methods.iter().zip(self.shares()) {
                    li { (key(*style)) " " (name) ": " (percent_of(share)) " of the picture" }
                }
                li { "Mean square error of the second-best method:" }
                @for (_, class, words) in STRENGTHS.iter().rev() {
                    li { svg.chart.key viewBox="0 0 14 14" aria-hidden="true" { g.n0 { rect class={ "cell " (class) } width="14" height="14" {} } } " " (words) }
                }
            }
        }
    }
}
