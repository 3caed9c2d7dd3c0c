//! The numbers of a study as tidy CSV: one number per line, with part, subject and quantity.

use serde::Serialize;

use crate::study::Interval;
use crate::study::data::{CurvePoint, MethodResult, Study};

/// Header line, written even if there are no lines.
const HEAD: &[u8] =
    b"scene,part,subject,peer,setting,seconds,samples_per_pixel,runs,figure,unit,value,low,high,measured\n";

/// A line, or the common fields of several lines.
#[derive(Clone, Default, Serialize)]
struct CsvLine<'a> {
    scene: &'a str,
    part: &'a str,
    subject: &'a str,
    peer: bool,
    setting: String,
    seconds: String,
    samples_per_pixel: String,
    runs: String,
    figure: &'a str,
    unit: &'a str,
    value: String,
    low: String,
    high: String,
    measured: bool,
}

struct CsvText<'a> {
    scene: &'a str,
    writer: csv::Writer<Vec<u8>>,
}

impl<'a> CsvText<'a> {
    /// Common fields of the lines about one subject.
    fn about(&self, part: &'a str, subject: &'a str, setting: impl Into<String>) -> CsvLine<'a> {
        let (scene, setting) = (self.scene, setting.into());
        CsvLine { scene, part, subject, setting, measured: true, ..CsvLine::default() }
    }

    /// Adds a line for each number that is present.
    fn add(&mut self, about: &CsvLine<'a>, numbers: &[(&'a str, &'a str, Option<Interval>)]) {
        for &(figure, unit, interval) in numbers {
            let Some(interval) = interval else { continue };
            let [value, low, high] = [interval.value, interval.low, interval.high].map(number);
            // Writing to memory cannot fail.
            let _ = self.writer.serialize(CsvLine { figure, unit, value, low, high, ..about.clone() });
        }
    }
}

/// Shortest text that parses back to the same number; empty if there is none.
fn number(x: f64) -> String {
    match x {
        x if !x.is_finite() => String::new(),
        x if x != 0.0 && !(1e-5..1e15).contains(&x.abs()) => format!("{x:e}"),
        x => format!("{x}"),
    }
}

fn exact(x: f64) -> Option<Interval> {
    Some(Interval::exact(x))
}

/// All curves, times and costs. Shares are shares (0.01 is 1 %), times are seconds unless the unit says otherwise; `low` and `high`
/// bound 90 %.
pub fn csv(study: &Study) -> String {
    let writer = csv::WriterBuilder::new().has_headers(false).from_writer(HEAD.to_vec());
    let mut text = CsvText { scene: &study.scene, writer };
    for m in &study.methods {
        method(&mut text, m);
    }
    costs(&mut text, study);
    outcomes(&mut text, study);
    String::from_utf8(text.writer.into_inner().unwrap_or_default()).unwrap_or_default()
}

fn method<'a>(text: &mut CsvText<'a>, m: &'a MethodResult) {
    for p in &m.points {
        let curve = CsvLine {
            peer: m.peer,
            seconds: number(p.seconds),
            samples_per_pixel: number(p.samples_per_pixel),
            runs: p.runs.to_string(),
            ..text.about("curve", &m.name, number(p.budget))
        };
        text.add(&curve, &point(p));
    }
    let whole = CsvLine { peer: m.peer, ..text.about("method", &m.name, "") };
    let slopes = [("slope_seconds", "1", m.slope), ("slope_samples", "1", m.slope_samples)];
    text.add(&whole, &slopes);
    text.add(&whole, &[("efficiency", "1/s", m.efficiency)]);
    for price in &m.prices {
        // A missing time is also a result: its value is empty.
        let seconds = price.seconds.unwrap_or(Interval::exact(f64::NAN));
        let setting = number(price.error);
        let about =
            CsvLine { measured: price.measured, peer: m.peer, ..text.about("price", &m.name, setting) };
        text.add(&about, &[("seconds_to_error", "s", Some(seconds))]);
    }
}

fn point(p: &CurvePoint) -> [(&'static str, &'static str, Option<Interval>); 13] {
    let relative = |i: usize| p.relative.map(|r| r[i]);
    [
        ("rel_mse", "1", p.rel_mse),
        ("rel_mse_trimmed", "1", p.rel_mse_trimmed),
        ("noise", "1", p.noise),
        ("bias", "1", p.bias),
        ("relative_median", "1", relative(0)),
        ("relative_p95", "1", relative(1)),
        ("relative_p99", "1", relative(2)),
        ("smape", "1", p.smape),
        ("flip", "1", p.flip),
        ("flip_filtered", "1", p.flip_filtered),
        ("trace_seconds", "s", exact(p.trace_seconds)),
        ("splat_seconds", "s", exact(p.splat_seconds)),
        ("display_seconds", "s", exact(p.display_seconds)),
    ]
}

/// Effects, settings of the display, arithmetic, schemes.
fn costs<'a>(text: &mut CsvText<'a>, study: &'a Study) {
    for e in &study.effects {
        let [variance, loss] = [e.variance, e.loss].map(|x| x.map(Interval::exact));
        let about = text.about("effect", &e.name, if e.on { "on" } else { "off" });
        text.add(&about, &[("time_ratio", "1", e.time), ("variance_share", "1", variance)]);
        text.add(&about, &[("flip_without", "1", loss)]);
    }
    for o in &study.options {
        let about = CsvLine { seconds: number(o.seconds), ..text.about("option", &o.name, &o.method) };
        let flip = o.flip.map(|[with, _]| Interval::exact(with));
        text.add(
            &about,
            &[("paths_ratio", "1", o.paths.map(Interval::exact)), ("error_ratio", "1", o.error)],
        );
        text.add(&about, &[("flip", "1", flip)]);
    }
    if let Some(auto) = &study.auto {
        let about = text.about("auto", &auto.method, "");
        text.add(&about, &[("trial_seconds", "s", exact(auto.seconds))]);
    }
    let about = text.about("effect", "unused", "");
    text.add(&about, &[("speed_ratio", "1", study.unused_effects)]);
    for d in &study.display {
        let about = CsvLine {
            samples_per_pixel: number(d.samples_per_pixel),
            ..text.about("display", &d.knob, &d.setting)
        };
        let time = if d.per_sample { "time_per_million_samples" } else { "time_per_repaint" };
        let [rel_mse, flip] = [d.rel_mse, d.flip].map(|x| x.map(Interval::exact));
        text.add(&about, &[(time, "ms", d.milliseconds), ("rel_mse", "1", rel_mse), ("flip", "1", flip)]);
    }
    for n in &study.numeric {
        let about = text.about("numeric", &n.choice, format!("{} : {}", n.forms[1], n.forms[0]));
        text.add(&about, &[("time_ratio", "1", Some(n.time)), ("error_ratio", "1", Some(n.error))]);
    }
    for s in &study.schemes {
        let about = text.about("scheme", &s.name, if s.used { "used" } else { "" });
        text.add(&about, &[("error_ratio", "1", Some(s.error)), ("stated_over_true", "1", Some(s.stated))]);
    }
}

fn outcomes<'a>(text: &mut CsvText<'a>, study: &'a Study) {
    if let Some(p) = &study.predictions {
        let [known, held, open] = [p.known, p.held, p.open].map(|n| exact(n as f64));
        let about = text.about("prediction", "", "");
        text.add(&about, &[("known", "1", known), ("held", "1", held), ("open", "1", open)]);
        text.add(&about, &[("predicted_over_true", "1", exact(p.ratio))]);
    }
    for s in &study.stated {
        let about = text.about("stated", &s.method, "");
        let [median, p95, p99] = s.held.map(|n| exact(n as f64));
        text.add(
            &about,
            &[("pictures", "1", exact(s.pictures as f64)), ("stated_over_true", "1", Some(s.ratio))],
        );
        text.add(&about, &[("held_median", "1", median), ("held_p95", "1", p95), ("held_p99", "1", p99)]);
    }
    for s in &study.stability {
        let about = text.about("stability", &s.method, "");
        text.add(&about, &[("paths", "1", exact(s.paths as f64)), ("energy_ratio", "1", s.energy)]);
        for (cause, count, _) in &s.rejected {
            let about = CsvLine { setting: cause.clone(), ..about.clone() };
            text.add(&about, &[("rejected", "1", exact(*count as f64))]);
        }
    }
}
