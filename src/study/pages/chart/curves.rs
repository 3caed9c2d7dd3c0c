//! Curves on two logarithmic axes, with bands, whiskers, dotted extrapolations and target lines.

use maud::{Markup, html};

use super::scale::{Scale, percent_label, tick_label};
use super::style::MethodStyle;
use super::{ChartSize, Drawing, path, px, text, tooltip};
use crate::study::Interval;

pub struct ChartPoint {
    pub x: f64,
    pub y: Interval,
    /// Tooltip text.
    pub note: String,
}

pub struct ChartCurve {
    pub name: String,
    pub style: MethodStyle,
    /// Measured points, from left to right.
    pub points: Vec<ChartPoint>,
    /// Dotted extrapolation, beginning at the last measured point.
    pub beyond: Vec<[f64; 2]>,
    /// Whether the extrapolation has markers.
    pub marked: bool,
    /// A secondary curve: thin, without a band.
    pub thin: bool,
}

/// A chart of curves with relative values.
pub struct CurveChart {
    /// Description for screen readers.
    pub label: &'static str,
    pub x_name: &'static str,
    pub y_name: &'static str,
    pub curves: Vec<ChartCurve>,
    /// Ordinates of target lines.
    pub targets: Vec<f64>,
}

impl ChartCurve {
    /// A curve of the drawable points: finite and positive.
    pub fn new(name: &str, style: MethodStyle, points: impl Iterator<Item = ChartPoint>) -> Self {
        let drawable = |p: ChartPoint| {
            let y = p.y.cleaned()?;
            (p.x > 0.0 && p.x.is_finite() && y.value > 0.0).then_some(ChartPoint { y, ..p })
        };
        let mut points: Vec<ChartPoint> = points.filter_map(drawable).collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        Self { name: name.into(), style, points, beyond: Vec::new(), marked: false, thin: false }
    }
}

/// Straight line on logarithmic axes through the centre of the points, from the last one to `end`.
pub fn extension(points: &[ChartPoint], slope: Option<Interval>, end: f64) -> Vec<[f64; 2]> {
    let Some((slope, last)) = slope.and_then(|slope| slope.cleaned()).zip(points.last()) else {
        return Vec::new();
    };
    let offsets = points.iter().map(|p| p.y.value.ln() - slope.value * p.x.ln());
    let offset = offsets.sum::<f64>() / points.len() as f64;
    let at = |x: f64| [x, (offset + slope.value * x.ln()).exp()];
    if end.is_finite() && end > last.x { vec![at(last.x), at(end)] } else { Vec::new() }
}

impl CurveChart {
    pub fn is_empty(&self) -> bool {
        self.curves.iter().all(|c| c.points.is_empty())
    }

    /// Scales that contain all points, between these ends. Interval bounds far away, which carry no information, are clipped, since they
    /// would flatten everything else.
    fn scales(&self, x_ends: [f64; 2], y_ends: [f64; 2]) -> [Scale; 2] {
        let points = || self.curves.iter().flat_map(|c| &c.points);
        let beyond = || self.curves.iter().flat_map(|c| &c.beyond);
        let reach = |p: &ChartPoint| [p.y.low.max(p.y.value / 3.0), p.y.value, p.y.high.min(p.y.value * 3.0)];
        let xs = points().map(|p| p.x).chain(beyond().map(|b| b[0]));
        let ys = points().flat_map(reach).chain(beyond().map(|b| b[1]));
        [Scale::logarithmic(xs, x_ends), Scale::logarithmic(ys, y_ends)]
    }

    pub fn draw(&self, size: ChartSize) -> Drawing {
        let (left, top, plot, legend_columns) = match size {
            ChartSize::Wide => (58.0, 26.0, 320.0, 4),
            ChartSize::Narrow => (46.0, 24.0, 230.0, 2),
            ChartSize::Thumbnail => (38.0, 6.0, 112.0, usize::MAX),
        };
        let thumbnail = size == ChartSize::Thumbnail;
        let (right, bottom) = (size.width() - 10.0, top + plot);
        let scales = self.scales([left, right], [bottom, top]);
        let legend = self.curves.len().div_ceil(legend_columns) as f64;
        let height = bottom + if thumbnail { 20.0 } else { 46.0 + 18.0 * legend };
        let body = html! {
            @for x in scales[0].ticks(44.0) {
                @let at = scales[0].at(x);
                (path("grid", &[[at, bottom], [at, top]]))
                (text("middle dim", [at, bottom + 15.0], &tick_label(x)))
            }
            @for y in scales[1].ticks(24.0) {
                @let at = scales[1].at(y);
                (path("grid", &[[left, at], [right, at]]))
                (text("end dim", [left - 6.0, at + 4.0], &percent_label(100.0 * y)))
            }
            @for target in self.targets.iter().filter(|t| scales[1].holds(**t)) {
                @let at = scales[1].at(*target);
                (path("target", &[[left, at], [right, at]]))
            }
            (path("axis", &[[left, top], [left, bottom], [right, bottom]]))
            @for curve in &self.curves { (curve.draw(&scales, if thumbnail { 2.5 } else { 4.0 })) }
            @if !thumbnail {
                (text("strong", [4.0, 13.0], self.y_name))
                (text("end strong", [right, bottom + 34.0], self.x_name))
                @for (i, curve) in self.curves.iter().enumerate() {
                    @let column = (size.width() - 12.0) / legend_columns as f64;
                    @let at = [16.0 + column * (i % legend_columns) as f64, bottom + 52.0 + 18.0 * (i / legend_columns) as f64];
                    (curve.legend(at, (column / size.character()) as usize - 5))
                }
            }
        };
        Drawing { size, width: size.width(), height, body }
    }
}

impl ChartCurve {
    fn draw(&self, [x, y]: &[Scale; 2], r: f64) -> Markup {
        let at = |p: &ChartPoint, value: f64| [x.at(p.x), y.at(value)];
        let upper = self.points.iter().map(|p| at(p, p.y.high));
        let band: Vec<[f64; 2]> = upper.chain(self.points.iter().rev().map(|p| at(p, p.y.low))).collect();
        let line: Vec<[f64; 2]> = self.points.iter().map(|p| at(p, p.y.value)).collect();
        let beyond: Vec<[f64; 2]> = self.beyond.iter().map(|b| [x.at(b[0]), y.at(b[1])]).collect();
        let hollow = MethodStyle { hollow: true, ..self.style };
        html! {
            g class=(self.style.class) {
                @if !self.thin && self.points.len() > 1 { (path("band", &band)) }
                g stroke-dasharray=(self.style.dash) { (path(if self.thin { "thin" } else { "line" }, &line)) }
                (path("beyond", &beyond))
                @if self.marked { @for place in beyond.iter().skip(1) { (hollow.marker(*place, 3.5)) } }
                @for p in &self.points {
                    @let place = at(p, p.y.value);
                    g {
                        (tooltip(&format!("{}: {}", self.name, p.note)))
                        @if p.y.high > p.y.low { (path("whisker", &[at(p, p.y.low), at(p, p.y.high)])) }
                        (self.style.marker(place, if self.thin { 0.7 * r } else { r }))
                        circle.hit cx=(px(place[0])) cy=(px(place[1])) r="10" {}
                    }
                }
            }
        }
    }

    fn legend(&self, [x, y]: [f64; 2], characters: usize) -> Markup {
        let name = super::shortened(&self.name, characters);
        html! {
            g class=(self.style.class) {
                path.line stroke-dasharray=(self.style.dash) d={ "M" (px(x - 10.0)) " " (px(y)) "h20" } {}
                (self.style.marker([x, y], 4.0))
            }
            (text("", [x + 15.0, y + 4.0], &name))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::pages::chart::style::PLAIN;

    #[test]
    fn extensions_keep_the_slope_and_curves_only_what_can_be_drawn() {
        let point = |x: f64| ChartPoint { x, y: Interval::exact(x.powf(-0.5)), note: String::new() };
        let curve = ChartCurve::new("path", PLAIN, [4.0, f64::NAN, 1.0, -1.0].map(point).into_iter());
        assert_eq!(curve.points.iter().map(|p| p.x).collect::<Vec<_>>(), [1.0, 4.0]);
        let line = extension(&curve.points, Some(Interval::exact(-0.5)), 100.0);
        assert!((line[0][1] - 0.5).abs() < 1e-9 && (line[1][1] - 0.1).abs() < 1e-9);
        assert!(extension(&[], Some(Interval::exact(-0.5)), 9.0).is_empty());
    }
}
