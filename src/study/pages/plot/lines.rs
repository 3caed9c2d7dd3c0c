//! Curves on two logarithmic axes, with bands, bars, dotted extensions, target lines and names at the ends.

use crate::study::Interval;
use crate::study::pages::escape::short;
use crate::study::pages::number::{THIN, clean};
use crate::study::pages::plot::axis::{Axis, label, percent_label};
use crate::study::pages::plot::{Look, Size, Svg};

/// One point of a curve.
#[derive(Clone, Debug)]
pub struct Dot {
    /// Abscissa.
    pub x: f64,
    /// Ordinate with its interval.
    pub y: Interval,
    /// What a pointer on it shows.
    pub note: String,
}

/// One curve.
#[derive(Clone, Debug)]
pub struct Series {
    /// Written at its end.
    pub name: String,
    /// Colour, marker, dash.
    pub look: Look,
    /// The measured points, from left to right.
    pub dots: Vec<Dot>,
    /// Where the fitted curve goes on, dotted; begins at the end of the measured part.
    pub beyond: Vec<[f64; 2]>,
    /// Markers on the dotted part.
    pub marked: bool,
    /// A secondary curve: thin, without a band.
    pub thin: bool,
}

/// A plot of curves.
#[derive(Clone, Debug, Default)]
pub struct Lines {
    /// What it shows, for those who hear it.
    pub label: String,
    /// Written at the horizontal axis.
    pub x_name: String,
    /// Written above the vertical axis. Its figures are shares, written as per cent.
    pub y_name: String,
    /// The curves.
    pub series: Vec<Series>,
    /// Ordinates to aim at.
    pub targets: Vec<f64>,
}

/// The places of a plot's parts.
struct Frame {
    size: Size,
    height: f64,
    x: Axis,
    y: Axis,
}

impl Lines {
    /// True if there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        !self.series.iter().any(|s| s.dots.iter().any(drawn))
    }

    /// The drawing.
    pub fn draw(&self, size: Size) -> Svg {
        let frame = self.frame(size);
        let mut svg = Svg::new(size, frame.height);
        self.axes(&mut svg, &frame);
        for series in &self.series {
            curve(&mut svg, &frame, series);
        }
        match size {
            Size::Wide => self.names_at_ends(&mut svg, &frame),
            Size::Narrow => self.names_below(&mut svg, &frame),
            Size::Thumb => {}
        }
        svg
    }

    fn frame(&self, size: Size) -> Frame {
        let longest = self.series.iter().map(|s| s.name.chars().count().min(26)).max().unwrap_or(0);
        let (left, right, top, plot) = match size {
            Size::Wide => (58.0, 34.0 + size.character() * longest as f64, 26.0, 320.0),
            Size::Narrow => (46.0, 8.0, 24.0, 230.0),
            Size::Thumb => (38.0, 6.0, 6.0, 112.0),
        };
        let below = match size {
            Size::Wide => 44.0,
            Size::Narrow => 42.0 + 18.0 * self.series.len().div_ceil(2) as f64,
            Size::Thumb => 20.0,
        };
        let dots = || self.series.iter().flat_map(|s| s.dots.iter().filter(|d| drawn(d)));
        let beyond = || self.series.iter().flat_map(|s| s.beyond.iter().copied());
        let reach = |d: &Dot| {
            // A bound far away is cut: it says “unknown”, and would press everything else flat.
            let (low, high) = (d.y.low.max(d.y.value / 3.0), d.y.high.min(d.y.value * 3.0));
            [low, d.y.value, high]
        };
        let xs = dots().map(|d| d.x).chain(beyond().map(|b| b[0]));
        let ys = dots().flat_map(reach).chain(beyond().map(|b| b[1]));
        Frame {
            size,
            height: top + plot + below,
            x: Axis::log(xs, [left, size.width() - right]),
            y: Axis::log(ys, [top + plot, top]),
        }
    }

    fn axes(&self, svg: &mut Svg, frame: &Frame) {
        let ([left, right], [bottom, top]) = (frame.x.ends, frame.y.ends);
        let thumb = frame.size == Size::Thumb;
        for (x, written) in frame.x.ticks(if thumb { 44.0 } else { 40.0 }) {
            let at = frame.x.at(x);
            svg.line(
                [at, bottom],
                [at, if written { top } else { bottom - 4.0 }],
                if written { "grid" } else { "axis" },
            );
            if written {
                svg.text([at, bottom + 15.0], "c dim", &label(x));
            }
        }
        for (y, written) in frame.y.ticks(if thumb { 22.0 } else { 26.0 }) {
            let at = frame.y.at(y);
            svg.line(
                [left, at],
                [if written { right } else { left + 4.0 }, at],
                if written { "grid" } else { "axis" },
            );
            if written {
                svg.text([left - 6.0, at + 4.0], "e dim", &percent_label(y));
            }
        }
        for &target in self.targets.iter().filter(|t| frame.y.holds(**t)) {
            let at = frame.y.at(target);
            svg.line([left, at], [right, at], "target");
        }
        svg.line([left, bottom], [right, bottom], "axis");
        svg.line([left, bottom], [left, top], "axis");
        if !thumb {
            svg.text([4.0, 13.0], "strong", &self.y_name);
            svg.text([right, bottom + 34.0], "e strong", &self.x_name);
        }
        if self.is_empty() {
            svg.text([(left + right) / 2.0, (top + bottom) / 2.0], "c dim", "no measurements");
        }
    }

    fn names_at_ends(&self, svg: &mut Svg, frame: &Frame) {
        let end = |s: &Series| {
            let last = s.dots.iter().rfind(|d| drawn(d)).map(|d| [d.x, d.y.value]);
            s.beyond.last().copied().or(last).map(|[x, y]| [frame.x.at(x), frame.y.at(y)])
        };
        let mut names: Vec<(&Series, [f64; 2])> =
            self.series.iter().filter_map(|s| Some((s, end(s)?))).collect();
        names.sort_by(|a, b| a.1[1].total_cmp(&b.1[1]));
        let places = apart(
            &names.iter().map(|(_, e)| e[1]).collect::<Vec<_>>(),
            17.0,
            frame.y.ends[1],
            frame.y.ends[0],
        );
        let x = frame.x.ends[1];
        for ((series, end), y) in names.into_iter().zip(places) {
            svg.line([end[0] + 6.0, end[1]], [x + 8.0, y], "leader");
            svg.open(series.look.class, "");
            svg.marker(series.look.marker, [x + 15.0, y], 4.0, series.look.hollow);
            svg.close();
            svg.text([x + 24.0, y + 4.0], "", &short(&series.name, 26));
        }
    }

    fn names_below(&self, svg: &mut Svg, frame: &Frame) {
        let top = frame.y.ends[0] + 52.0;
        for (i, series) in self.series.iter().enumerate() {
            let at = [12.0 + 166.0 * (i % 2) as f64, top + 18.0 * (i / 2) as f64];
            svg.open(series.look.class, "");
            svg.path(&[[at[0] - 9.0, at[1]], [at[0] + 9.0, at[1]]], "line");
            svg.marker(series.look.marker, at, 4.0, series.look.hollow);
            svg.close();
            svg.text([at[0] + 15.0, at[1] + 4.0], "", &short(&series.name, 23));
        }
    }
}

fn drawn(dot: &Dot) -> bool {
    dot.x > 0.0 && dot.x.is_finite() && dot.y.value > 0.0 && clean(&dot.y).is_some()
}

fn curve(svg: &mut Svg, frame: &Frame, series: &Series) {
    let dots: Vec<&Dot> = series.dots.iter().filter(|d| drawn(d)).collect();
    let at = |d: &Dot, y: f64| [frame.x.at(d.x), frame.y.at(y)];
    svg.open(series.look.class, "");
    if !series.thin && dots.len() > 1 && dots.iter().any(|d| d.y.high > d.y.low) {
        let upper = dots.iter().map(|d| at(d, d.y.high));
        let lower = dots.iter().rev().map(|d| at(d, d.y.low));
        svg.path(&upper.chain(lower).collect::<Vec<_>>(), "band");
    }
    let middle: Vec<[f64; 2]> = dots.iter().map(|d| at(d, d.y.value)).collect();
    svg.path(&middle, if series.thin { "thin" } else { "line" });
    let beyond: Vec<[f64; 2]> = series.beyond.iter().map(|[x, y]| [frame.x.at(*x), frame.y.at(*y)]).collect();
    svg.path(&beyond, "fit");
    if series.marked {
        for place in beyond.iter().skip(1) {
            svg.marker(series.look.marker, *place, 3.5, true);
        }
    }
    let r = if frame.size == Size::Thumb { 2.5 } else { 4.0 };
    for dot in dots {
        svg.open("", &format!("{}: {}", series.name, dot.note));
        if dot.y.high > dot.y.low {
            svg.line(at(dot, dot.y.low), at(dot, dot.y.high), "whisker");
        }
        svg.marker(
            series.look.marker,
            at(dot, dot.y.value),
            if series.thin { 0.7 * r } else { r },
            series.look.hollow,
        );
        svg.close();
    }
    svg.close();
}

/// Moves sorted places as little as one sweep each way does, so that they are `room` apart and between the ends.
fn apart(wanted: &[f64], room: f64, top: f64, bottom: f64) -> Vec<f64> {
    let mut places = wanted.to_vec();
    let mut least = top;
    for place in &mut places {
        *place = place.max(least);
        least = *place + room;
    }
    let mut most = bottom;
    for place in places.iter_mut().rev() {
        *place = place.min(most);
        most = *place - room;
    }
    places
}

/// The straight line of logarithms with a given slope through the middle of the points, from the last one to `end`.
pub fn extension(dots: &[Dot], slope: Option<&Interval>, end: f64) -> Vec<[f64; 2]> {
    let Some(slope) = slope.and_then(clean) else { return Vec::new() };
    let logs: Vec<[f64; 2]> = dots.iter().filter(|d| drawn(d)).map(|d| [d.x.ln(), d.y.value.ln()]).collect();
    let Some(last) = logs.last() else { return Vec::new() };
    let n = logs.len() as f64;
    let offset = logs.iter().map(|[x, y]| y - slope.value * x).sum::<f64>() / n;
    let at = |x: f64| [x.exp(), (offset + slope.value * x).exp()];
    if end.is_finite() && end > last[0].exp() { vec![at(last[0]), at(end.ln())] } else { Vec::new() }
}

/// How a share is called in a note.
pub fn note(seconds: &str, error: &str) -> String {
    format!("{error} after {seconds}").replace(THIN, "\u{a0}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_keep_apart_and_inside() {
        assert_eq!(apart(&[10.0, 11.0, 12.0], 10.0, 0.0, 100.0), [10.0, 20.0, 30.0]);
        assert_eq!(apart(&[95.0, 96.0], 10.0, 0.0, 100.0), [90.0, 100.0]);
    }

    #[test]
    fn the_fit_goes_on_with_its_slope() {
        let dot = |x: f64| Dot { x, y: Interval::exact(x.powf(-0.5)), note: String::new() };
        let line = extension(&[dot(1.0), dot(4.0)], Some(&Interval::exact(-0.5)), 100.0);
        assert!((line[0][1] - 0.5).abs() < 1e-9 && (line[1][1] - 0.1).abs() < 1e-9);
        assert!(extension(&[], Some(&Interval::exact(-0.5)), 9.0).is_empty());
    }
}
