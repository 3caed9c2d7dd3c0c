//! The figures as tidy CSV: one figure per line, named by its part, its subject and what it is.

use crate::study::Interval;
use crate::study::data::{Method, Point, Study};
use crate::study::pages::escape::cell;

/// The columns.
pub const HEAD: &str =
    "scene,part,subject,peer,setting,seconds,samples_per_pixel,runs,figure,unit,value,low,high,measured";

/// What a line is about.
#[derive(Clone, Default)]
struct Line<'a> {
    part: &'a str,
    subject: &'a str,
    peer: bool,
    setting: String,
    seconds: Option<f64>,
    samples: Option<f64>,
    runs: Option<usize>,
    measured: bool,
}

struct Table<'a> {
    study: &'a Study,
    text: String,
}

/// All curves, prices and costs. Shares are shares (0.01 is 1 %), times are seconds unless the unit says otherwise; `low` and
/// `high` bound 90 %; what is no number is left empty.
pub fn csv(study: &Study) -> String {
    let mut table = Table { study, text: format!("{HEAD}\n") };
    for method in &study.methods {
        curve(&mut table, method);
        prices(&mut table, method);
    }
    effects(&mut table);
    display(&mut table);
    numeric(&mut table);
    outcome(&mut table);
    table.text
}

impl Table<'_> {
    fn add(&mut self, line: &Line<'_>, figure: &str, unit: &str, value: Option<Interval>) {
        let Some(i) = value else { return };
        let cells = [
            cell(&self.study.scene),
            line.part.into(),
            cell(line.subject),
            line.peer.to_string(),
            cell(&line.setting),
            line.seconds.map_or_else(String::new, number),
            line.samples.map_or_else(String::new, number),
            line.runs.map_or_else(String::new, |n| n.to_string()),
            figure.into(),
            unit.into(),
            number(i.value),
            number(i.low),
            number(i.high),
            line.measured.to_string(),
        ];
        self.text += &(cells.join(",") + "\n");
    }
}

/// The shortest text that reads back as the same number.
fn number(x: f64) -> String {
    match x {
        x if !x.is_finite() => String::new(),
        x if x != 0.0 && !(1e-5..1e15).contains(&x.abs()) => format!("{x:e}"),
        x => format!("{x}"),
    }
}

fn curve(table: &mut Table<'_>, m: &Method) {
    for p in &m.points {
        point(table, m, p);
    }
    let line = Line { part: "method", subject: &m.name, peer: m.peer, measured: true, ..Line::default() };
    table.add(&line, "slope_seconds", "1", m.slope);
    table.add(&line, "slope_samples", "1", m.slope_samples);
    table.add(&line, "efficiency", "1/s", m.efficiency);
}

fn point(table: &mut Table<'_>, m: &Method, p: &Point) {
    let line = Line {
        part: "curve",
        subject: &m.name,
        peer: m.peer,
        setting: number(p.budget),
        seconds: Some(p.seconds),
        samples: Some(p.samples_per_pixel),
        runs: Some(p.runs),
        measured: true,
    };
    let squares = [
        ("rel_mse", Some(p.rel_mse)),
        ("rel_mse_trimmed", Some(p.rel_mse_trimmed)),
        ("noise", p.noise),
        ("bias", p.bias),
    ];
    for (name, value) in squares {
        table.add(&line, name, "1", value);
    }
    for (i, name) in ["relative_median", "relative_p95", "relative_p99"].into_iter().enumerate() {
        table.add(&line, name, "1", p.relative.as_ref().map(|r| r[i]));
    }
    for (name, unit, x) in [
        ("smape", "1", p.smape),
        ("flip", "1", p.flip),
        ("trace_seconds", "s", Interval::exact(p.trace_seconds)),
        ("splat_seconds", "s", Interval::exact(p.splat_seconds)),
        ("display_seconds", "s", Interval::exact(p.display_seconds)),
    ] {
        table.add(&line, name, unit, Some(x));
    }
}

fn prices(table: &mut Table<'_>, m: &Method) {
    for price in &m.prices {
        let line = Line {
            part: "price",
            subject: &m.name,
            peer: m.peer,
            setting: number(price.error),
            measured: price.measured,
            ..Line::default()
        };
        // A price that is not there is a finding too: its value is empty.
        table.add(&line, "seconds_to_error", "s", Some(price.seconds.unwrap_or(Interval::exact(f64::NAN))));
    }
}

fn effects(table: &mut Table<'_>) {
    let study = table.study;
    for e in &study.effects {
        let setting = if e.on { "on" } else { "off" };
        let line = Line {
            part: "effect",
            subject: &e.name,
            setting: setting.into(),
            measured: true,
            ..Line::default()
        };
        table.add(&line, "time_ratio", "1", e.time);
        table.add(&line, "variance_share", "1", e.variance.map(Interval::exact));
        table.add(&line, "flip_without", "1", e.loss.map(Interval::exact));
    }
    let line = Line { part: "effect", subject: "unused", measured: true, ..Line::default() };
    table.add(&line, "speed_ratio", "1", study.unused_effects);
}

fn display(table: &mut Table<'_>) {
    let study = table.study;
    for d in &study.display {
        let line = Line {
            part: "display",
            subject: &d.knob,
            setting: d.setting.clone(),
            samples: Some(d.samples_per_pixel),
            measured: true,
            ..Line::default()
        };
        table.add(
            &line,
            if d.per_sample { "time_per_million_samples" } else { "time_per_repaint" },
            "ms",
            d.milliseconds,
        );
        table.add(&line, "rel_mse", "1", d.rel_mse.map(Interval::exact));
        table.add(&line, "flip", "1", d.flip.map(Interval::exact));
    }
}

fn numeric(table: &mut Table<'_>) {
    let study = table.study;
    for n in &study.numeric {
        let setting = format!("{} : {}", n.forms[1], n.forms[0]);
        let line = Line { part: "numeric", subject: &n.choice, setting, measured: true, ..Line::default() };
        table.add(&line, "time_ratio", "1", Some(n.time));
        table.add(&line, "error_ratio", "1", Some(n.error));
    }
    for s in &study.schemes {
        let setting = if s.used { "used" } else { "" };
        let line = Line {
            part: "scheme",
            subject: &s.name,
            setting: setting.into(),
            measured: true,
            ..Line::default()
        };
        table.add(&line, "error_ratio", "1", Some(s.error));
        table.add(&line, "stated_over_true", "1", Some(s.stated));
    }
}

fn outcome(table: &mut Table<'_>) {
    let study = table.study;
    let exact = |x: f64| Some(Interval::exact(x));
    if let Some(p) = &study.predictions {
        let line = Line { part: "prediction", measured: true, ..Line::default() };
        table.add(&line, "known", "1", exact(p.known as f64));
        table.add(&line, "held", "1", exact(p.held as f64));
        table.add(&line, "open", "1", exact(p.open as f64));
        table.add(&line, "predicted_over_true", "1", exact(p.ratio));
    }
    for s in &study.stability {
        let mut line = Line { part: "stability", subject: &s.method, measured: true, ..Line::default() };
        table.add(&line, "paths", "1", exact(s.paths as f64));
        table.add(&line, "energy_ratio", "1", s.energy);
        for (cause, count, _) in &s.rejected {
            line.setting.clone_from(cause);
            table.add(&line, "rejected", "1", exact(*count as f64));
        }
    }
}
