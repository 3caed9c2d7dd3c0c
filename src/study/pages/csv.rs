//! The numbers of a study as tidy CSV: one number per line, named by its part, its subject and what it is.

use crate::study::Interval;
use crate::study::data::{CurvePoint, MethodResult, Study};

const COLUMNS: [&str; 14] = [
    "scene",
    "part",
    "subject",
    "peer",
    "setting",
    "seconds",
    "samples_per_pixel",
    "runs",
    "figure",
    "unit",
    "value",
    "low",
    "high",
    "measured",
];

/// What the numbers of some lines are about.
#[derive(Clone)]
struct CsvSubject<'a> {
    part: &'a str,
    subject: &'a str,
    peer: bool,
    setting: String,
    seconds: Option<f64>,
    samples: Option<f64>,
    runs: Option<usize>,
    measured: bool,
}

impl<'a> CsvSubject<'a> {
    fn new(part: &'a str, subject: &'a str, setting: impl Into<String>) -> Self {
        let setting = setting.into();
        Self { part, subject, peer: false, setting, seconds: None, samples: None, runs: None, measured: true }
    }
}

struct CsvText<'a> {
    scene: &'a str,
    writer: csv::Writer<Vec<u8>>,
}

impl CsvText<'_> {
    /// A line for each number that is there.
    fn add(&mut self, about: &CsvSubject<'_>, numbers: &[(&str, &str, Option<Interval>)]) {
        for (name, unit, value) in numbers {
            let Some(Interval { value, low, high }) = value else { continue };
            let line = [
                self.scene.to_string(),
                about.part.to_string(),
                about.subject.to_string(),
                about.peer.to_string(),
                about.setting.clone(),
                about.seconds.map_or_else(String::new, number),
                about.samples.map_or_else(String::new, number),
                about.runs.map_or_else(String::new, |n| n.to_string()),
                (*name).to_string(),
                (*unit).to_string(),
                number(*value),
                number(*low),
                number(*high),
                about.measured.to_string(),
            ];
            // Writing to memory cannot fail, and every line has as many cells as the header.
            let _ = self.writer.write_record(&line);
        }
    }
}

/// The shortest text that reads back as the same number; empty where there is none.
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
    let mut text = CsvText { scene: &study.scene, writer: csv::Writer::from_writer(Vec::new()) };
    let _ = text.writer.write_record(COLUMNS);
    for m in &study.methods {
        method(&mut text, m);
    }
    costs(&mut text, study);
    outcomes(&mut text, study);
    String::from_utf8(text.writer.into_inner().unwrap_or_default()).unwrap_or_default()
}

fn method(text: &mut CsvText<'_>, m: &MethodResult) {
    let about =
        |part, setting: String| CsvSubject { peer: m.peer, ..CsvSubject::new(part, &m.name, setting) };
    for p in &m.points {
        let curve = CsvSubject {
            seconds: Some(p.seconds),
            samples: Some(p.samples_per_pixel),
            runs: Some(p.runs),
            ..about("curve", number(p.budget))
        };
        text.add(&curve, &point(p));
    }
    text.add(
        &about("method", String::new()),
        &[
            ("slope_seconds", "1", m.slope),
            ("slope_samples", "1", m.slope_samples),
            ("efficiency", "1/s", m.efficiency),
        ],
    );
    for price in &m.prices {
        // A time that is missing is a finding too: its value is empty.
        let seconds = price.seconds.unwrap_or(Interval::exact(f64::NAN));
        let about = CsvSubject { measured: price.measured, ..about("price", number(price.error)) };
        text.add(&about, &[("seconds_to_error", "s", Some(seconds))]);
    }
}

fn point(p: &CurvePoint) -> [(&'static str, &'static str, Option<Interval>); 12] {
    let relative = |i: usize| p.relative.map(|r| r[i]);
    [
        ("rel_mse", "1", Some(p.rel_mse)),
        ("rel_mse_trimmed", "1", Some(p.rel_mse_trimmed)),
        ("noise", "1", p.noise),
        ("bias", "1", p.bias),
        ("relative_median", "1", relative(0)),
        ("relative_p95", "1", relative(1)),
        ("relative_p99", "1", relative(2)),
        ("smape", "1", Some(p.smape)),
        ("flip", "1", Some(p.flip)),
        ("trace_seconds", "s", exact(p.trace_seconds)),
        ("splat_seconds", "s", exact(p.splat_seconds)),
        ("display_seconds", "s", exact(p.display_seconds)),
    ]
}

/// Effects, settings of the display, arithmetic, schemes.
fn costs(text: &mut CsvText<'_>, study: &Study) {
    for e in &study.effects {
        let [variance, loss] = [e.variance, e.loss].map(|x| x.map(Interval::exact));
        text.add(
            &CsvSubject::new("effect", &e.name, if e.on { "on" } else { "off" }),
            &[("time_ratio", "1", e.time), ("variance_share", "1", variance), ("flip_without", "1", loss)],
        );
    }
    text.add(&CsvSubject::new("effect", "unused", ""), &[("speed_ratio", "1", study.unused_effects)]);
    for d in &study.display {
        let about = CsvSubject {
            samples: Some(d.samples_per_pixel),
            ..CsvSubject::new("display", &d.knob, &d.setting)
        };
        let time = if d.per_sample { "time_per_million_samples" } else { "time_per_repaint" };
        let [rel_mse, flip] = [d.rel_mse, d.flip].map(|x| x.map(Interval::exact));
        text.add(&about, &[(time, "ms", d.milliseconds), ("rel_mse", "1", rel_mse), ("flip", "1", flip)]);
    }
    for n in &study.numeric {
        let about = CsvSubject::new("numeric", &n.choice, format!("{} : {}", n.forms[1], n.forms[0]));
        text.add(&about, &[("time_ratio", "1", Some(n.time)), ("error_ratio", "1", Some(n.error))]);
    }
    for s in &study.schemes {
        let about = CsvSubject::new("scheme", &s.name, if s.used { "used" } else { "" });
        text.add(&about, &[("error_ratio", "1", Some(s.error)), ("stated_over_true", "1", Some(s.stated))]);
    }
}

/// Predictions and stability.
fn outcomes(text: &mut CsvText<'_>, study: &Study) {
    if let Some(p) = &study.predictions {
        let [known, held, open] = [p.known, p.held, p.open].map(|n| exact(n as f64));
        text.add(
            &CsvSubject::new("prediction", "", ""),
            &[
                ("known", "1", known),
                ("held", "1", held),
                ("open", "1", open),
                ("predicted_over_true", "1", exact(p.ratio)),
            ],
        );
    }
    for s in &study.stability {
        let about = CsvSubject::new("stability", &s.method, "");
        text.add(&about, &[("paths", "1", exact(s.paths as f64)), ("energy_ratio", "1", s.energy)]);
        for (cause, count, _) in &s.rejected {
            let about = CsvSubject { setting: cause.clone(), ..about.clone() };
            text.add(&about, &[("rejected", "1", exact(*count as f64))]);
        }
    }
}
