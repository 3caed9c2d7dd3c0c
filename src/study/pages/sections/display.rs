//! Part 4: what the display's settings cost and give.

use crate::study::Interval;
use crate::study::data::{DisplayPrice, Study};
use crate::study::pages::escape::xml;
use crate::study::pages::number::{Figure, THIN, count, figure, percent_of, plain};
use crate::study::pages::parts::{capital, cell, heads, maybe, missing, note, plot, section, table};
use crate::study::pages::plot::axis::label;
use crate::study::pages::plot::{Mark, Panel, Row, Rows};

/// The sentence to take away: what the dearest change of a setting costs, and which gives most.
pub fn takeaway(study: &Study) -> String {
    if study.display.is_empty() {
        return "The display’s settings have no measured prices.".into();
    }
    let changes: Vec<Change<'_>> = study.display.iter().filter_map(|d| change(study, d)).collect();
    let timed = |c: &&Change<'_>| c.milliseconds.is_some_and(|ms| ms > 0.0);
    let dear = changes.iter().filter(timed).max_by(|a, b| a.cost().total_cmp(&b.cost()));
    let good = changes.iter().filter_map(|c| Some((c, c.error?))).min_by(|a, b| a.1.total_cmp(&b.1));
    let mut text = match dear {
        Some(c) => {
            let per = if c.of.per_sample { " per million samples" } else { " per repaint" };
            format!(
                "The dearest setting is {} {}: {}{THIN}ms{per} more than the default.",
                c.of.knob,
                c.of.setting,
                plain(c.cost(), 2)
            )
        }
        None if study.display.iter().all(|d| d.milliseconds.is_none()) => {
            "The settings were not timed: the device has no clock for its passes.".into()
        }
        None => "No setting costs more than the default.".into(),
    };
    match good {
        Some((c, error)) if error < 0.98 => {
            text += &format!(
                " {} {} lowers the error most, to ×{THIN}{} of the default’s at {} samples per pixel.",
                capital(&c.of.knob),
                c.of.setting,
                plain(error, 2),
                count(c.of.samples_per_pixel)
            );
        }
        Some(_) => text += " No setting gives a smaller error than the default.",
        None => {}
    }
    text
}

/// A setting against the default of its knob, at as many samples.
struct Change<'a> {
    of: &'a DisplayPrice,
    /// Milliseconds more.
    milliseconds: Option<f64>,
    /// RMS error over the default's.
    error: Option<f64>,
}

impl Change<'_> {
    fn cost(&self) -> f64 {
        self.milliseconds.unwrap_or(0.0)
    }
}

fn change<'a>(study: &'a Study, d: &'a DisplayPrice) -> Option<Change<'a>> {
    let like = |b: &&DisplayPrice| (&b.knob, b.samples_per_pixel) == (&d.knob, d.samples_per_pixel);
    let base = study.display.iter().filter(like).find(|b| b.default)?;
    let finite = |x: f64| x.is_finite().then_some(x);
    let milliseconds = || finite(d.milliseconds?.value - base.milliseconds?.value);
    let error = || finite((d.rel_mse? / base.rel_mse?).sqrt());
    (!d.default).then(|| Change { of: d, milliseconds: milliseconds(), error: error() })
}

/// Numbers of samples that settings were judged at.
fn samples(study: &Study) -> Vec<f64> {
    let mut all: Vec<f64> = study.display.iter().map(|d| d.samples_per_pixel).collect();
    all.retain(|n| n.is_finite());
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

/// Settings as rows of bars, grouped by knob: `per_sample` picks those per million samples or those per repaint. One column of
/// time, and one of error for each number of samples.
fn rows(study: &Study, per_sample: bool) -> Rows {
    let samples = samples(study);
    let mut all: Vec<Row> = Vec::new();
    let mut seen: Vec<(&str, &str)> = Vec::new();
    for d in study.display.iter().filter(|d| d.per_sample == per_sample) {
        let name = (d.knob.as_str(), d.setting.as_str());
        if seen.contains(&name) {
            continue;
        }
        let first = seen.iter().all(|(knob, _)| *knob != name.0);
        seen.push(name);
        let same: Vec<&DisplayPrice> = study
            .display
            .iter()
            .filter(|e| (&e.knob, &e.setting, e.per_sample) == (&d.knob, &d.setting, d.per_sample))
            .collect();
        let error = |n: f64| {
            let e = same.iter().find(|e| e.samples_per_pixel == n)?.rel_mse?;
            Some(Interval::exact(100.0 * e.max(0.0).sqrt()))
        };
        let mut figures = vec![same.iter().find_map(|e| e.milliseconds)];
        figures.extend(samples.iter().map(|n| error(*n)));
        all.push(Row {
            group: first.then(|| d.knob.clone()),
            name: if d.default { format!("{} (default)", d.setting) } else { d.setting.clone() },
            class: "m0",
            marker: 0,
            hollow: !d.default,
            figures,
        });
    }
    let time = if per_sample { "ms per M samples" } else { "ms per repaint" };
    let panel = |title: String, tick, figure| Panel { title, mark: Mark::Bar, tick, figure, base: None };
    let mut panels = vec![panel(time.into(), label, |i| figure(i, 1.0, "").main)];
    panels.extend(samples.iter().map(|n| {
        panel(
            format!("RMS error, {} spp", count(*n)),
            |x| format!("{}{THIN}%", label(x)),
            |i| percent_of(i.value / 100.0),
        )
    }));
    Rows { label: format!("Display settings: {time} and error"), panels, rows: all }
}

/// The section.
pub fn html(study: &Study) -> String {
    if study.display.is_empty() {
        let body = missing(study, "Prices of the display’s settings were", "display");
        return section("display", "4  Price of each display setting", &takeaway(study), &body);
    }
    let mut body = String::new();
    for (per_sample, what) in [(false, "a repaint"), (true, "a million samples")] {
        let rows = rows(study, per_sample);
        if !rows.is_empty() {
            let caption = format!(
                "Device time of {what} and error of the displayed linear picture, by samples per pixel (spp). Solid: the default."
            );
            body += &plot(&rows.label, &caption, |size| rows.draw(size));
        }
    }
    body += &list(study);
    let device = if study.machine.device.is_empty() { "the device" } else { &study.machine.device };
    body += &note(&format!(
        "Milliseconds are those of the passes on {device}, by its own clock where it has one. The error is that of the linear \
         picture as displayed (blurred), root of relMSE against the reference; one setting is changed at a time, the default is \
         measured anew with each group, and the film has the study's filter but where filters are compared. One float against two: see also part 5, for they differ after hours, \
         not after a few samples.",
    ));
    section("display", "4  Price of each display setting", &takeaway(study), &body)
}

fn list(study: &Study) -> String {
    let row = |d: &DisplayPrice| {
        vec![
            format!("{}: {}{}", xml(&d.knob), xml(&d.setting), if d.default { " (default)" } else { "" }),
            d.milliseconds.map_or_else(|| "—".into(), |m| cell(&figure(&m, 1.0, &format!("{THIN}ms")))),
            if d.per_sample { "million samples".into() } else { "repaint".into() },
            maybe(change(study, d).and_then(|c| c.milliseconds), |t| Figure {
                main: signed(*t),
                range: None,
            }),
            d.rel_mse.map_or_else(|| "—".into(), |e| percent_of(e.max(0.0).sqrt())),
            d.flip.map_or_else(|| "—".into(), |f| plain(f, 2)),
            count(d.samples_per_pixel),
        ]
    };
    let rows: Vec<_> = study.display.iter().map(row).collect();
    table(
        "Prices of display settings",
        &heads(&["Setting", "time", "per", "over the default", "RMS error", "FLIP", "at samples/pixel"]),
        &rows,
    )
}

fn signed(ms: f64) -> String {
    format!("{}{}{THIN}ms", if ms > 0.0 { "+" } else { "" }, plain(ms, 2))
}
