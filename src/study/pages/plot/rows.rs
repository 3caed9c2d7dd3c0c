//! Rows of bars or dots with their intervals, in one panel or several beside one another.

use crate::study::Interval;
use crate::study::pages::escape::short;
use crate::study::pages::number::clean;
use crate::study::pages::plot::axis::Axis;
use crate::study::pages::plot::{Size, Svg};

/// How a figure is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A bar from 0, on a linear axis.
    Bar,
    /// The row's marker, on a logarithmic axis.
    Dot,
}

/// One column of a plot of rows.
#[derive(Clone)]
pub struct Panel {
    /// Written above it.
    pub title: String,
    /// The kind.
    pub mark: Mark,
    /// What is written at ticks.
    pub tick: fn(f64) -> String,
    /// What is written at a figure.
    pub figure: fn(&Interval) -> String,
    /// Where a line stands to compare with, such as 1 for ratios.
    pub base: Option<f64>,
}

/// One row.
#[derive(Clone, Debug)]
pub struct Row {
    /// Begins a new group with this heading.
    pub group: Option<String>,
    /// Written at its left, or above it.
    pub name: String,
    /// Class of its colour.
    pub class: &'static str,
    /// Its marker.
    pub marker: usize,
    /// Hollow marker or pale bar.
    pub hollow: bool,
    /// One per panel.
    pub figures: Vec<Option<Interval>>,
}

/// A plot of rows.
#[derive(Clone, Default)]
pub struct Rows {
    /// What it shows, for those who hear it.
    pub label: String,
    /// The columns.
    pub panels: Vec<Panel>,
    /// The rows.
    pub rows: Vec<Row>,
}

struct Frame {
    size: Size,
    left: f64,
    pitch: f64,
    top: f64,
    /// Per panel: the axis, and where its figures are written.
    axes: Vec<Axis>,
    bottom: f64,
}

/// Room for a written figure.
const WRITTEN: f64 = 62.0;
/// Height of a group's heading.
const HEADING: f64 = 24.0;

impl Rows {
    /// True if there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        !self.rows.iter().any(|r| r.figures.iter().flatten().any(|f| clean(f).is_some()))
    }

    /// The drawing.
    pub fn draw(&self, size: Size) -> Svg {
        let frame = self.frame(size);
        let mut svg = Svg::new(size, frame.bottom + 24.0);
        for (panel, axis) in self.panels.iter().zip(&frame.axes) {
            scale(&mut svg, &frame, panel, axis);
        }
        let mut y = frame.top;
        for row in &self.rows {
            if let Some(group) = &row.group {
                svg.text([4.0, y + 15.0], "strong", &short(group, 46));
                y += HEADING;
            }
            self.row(&mut svg, &frame, row, y);
            y += frame.pitch;
        }
        svg
    }

    fn frame(&self, size: Size) -> Frame {
        let longest = self.rows.iter().map(|r| r.name.chars().count()).max().unwrap_or(0).min(40);
        let (left, pitch) = match size {
            Size::Wide => (16.0 + size.character() * longest as f64, 21.0),
            _ => (4.0, 39.0),
        };
        let top = if self.panels.iter().all(|p| p.title.is_empty()) { 4.0 } else { 24.0 };
        let groups = self.rows.iter().filter(|r| r.group.is_some()).count() as f64;
        let share = (size.width() - left) / self.panels.len().max(1) as f64;
        let axis = |(i, panel): (usize, &Panel)| {
            let ends = [
                left + share * i as f64 + 6.0,
                left + share * (i + 1) as f64 - 8.0 - self.written(panel, i, size),
            ];
            let all = self.rows.iter().filter_map(|r| clean(r.figures.get(i)?.as_ref()?));
            match panel.mark {
                Mark::Bar => Axis::linear(all.flat_map(|f| [f.value, f.low, f.high]), ends),
                Mark::Dot => {
                    let near =
                        all.flat_map(|f| [f.value, f.low.max(f.value / 4.0), f.high.min(f.value * 4.0)]);
                    Axis::log(near.chain(panel.base), ends)
                }
            }
        };
        let axes = self.panels.iter().enumerate().map(axis).collect();
        Frame {
            size,
            left,
            pitch,
            top,
            axes,
            bottom: top + pitch * self.rows.len() as f64 + HEADING * groups + 4.0,
        }
    }

    /// Room for the figures of a panel that are written in words.
    fn written(&self, panel: &Panel, i: usize, size: Size) -> f64 {
        let figures = self.rows.iter().filter_map(|r| r.figures.get(i)?.as_ref());
        let longest = figures.map(|f| (panel.figure)(f).chars().count()).max().unwrap_or(0);
        (size.character() * longest as f64 + 6.0).min(WRITTEN)
    }

    fn row(&self, svg: &mut Svg, frame: &Frame, row: &Row, y: f64) {
        let wide = frame.size == Size::Wide;
        let middle = y + if wide { frame.pitch / 2.0 } else { 27.0 };
        if wide {
            svg.text([frame.left - 6.0, middle + 4.0], "e", &short(&row.name, 40));
        } else {
            svg.text([frame.left + 6.0, y + 15.0], "", &short(&row.name, 52));
        }
        for ((panel, axis), figure) in self.panels.iter().zip(&frame.axes).zip(&row.figures) {
            let place = [axis.ends[1] + 6.0, middle + 4.0];
            let Some(f) = figure.as_ref().and_then(clean) else {
                svg.text(place, "dim", "—");
                continue;
            };
            svg.open(row.class, &format!("{}: {}", row.name, (panel.figure)(&f)));
            mark(svg, panel, axis, row, &f, middle);
            svg.close();
            svg.text(place, "", &(panel.figure)(&f));
        }
    }
}

fn mark(svg: &mut Svg, panel: &Panel, axis: &Axis, row: &Row, f: &Interval, y: f64) {
    let [low, value, high] = [f.low, f.value, f.high].map(|x| axis.at(x));
    let over = if panel.mark == Mark::Bar { "whisker over" } else { "whisker" };
    if panel.mark == Mark::Bar {
        let zero = axis.at(0.0);
        let class = if row.hollow { "bar pale" } else { "bar" };
        svg.rect([zero.min(value), y - 5.0], [(value - zero).abs(), 10.0], class);
    }
    if f.high > f.low {
        svg.line([low, y], [high, y], over);
        for end in [low, high] {
            svg.line([end, y - 3.0], [end, y + 3.0], over);
        }
    }
    if panel.mark == Mark::Dot && (f.value > 0.0) {
        svg.marker(row.marker, [value, y], 4.5, row.hollow);
    }
}

fn scale(svg: &mut Svg, frame: &Frame, panel: &Panel, axis: &Axis) {
    let bottom = frame.bottom;
    let ticks = axis.ticks(if frame.size == Size::Wide { 46.0 } else { 40.0 });
    let mut free = f64::NEG_INFINITY;
    for (x, written) in ticks.into_iter().filter(|t| t.1) {
        let at = axis.at(x);
        svg.line([at, frame.top - 2.0], [at, bottom], "grid");
        let text = (panel.tick)(x);
        let half = frame.size.character() * text.chars().count() as f64 / 2.0;
        if written && at - half > free {
            svg.text([at, bottom + 15.0], "c dim", &text);
            free = at + half + 4.0;
        }
    }
    let base = panel.base.or((panel.mark == Mark::Bar).then_some(0.0));
    if let Some(base) = base.filter(|b| axis.holds(*b)) {
        svg.line([axis.at(base), frame.top - 2.0], [axis.at(base), bottom], "axis");
    }
    svg.text([axis.ends[0] - 2.0, 13.0], "strong", &panel.title);
}
