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
    let changes: Vec<(&DisplayPrice, f64, Option<f64>)> =
        study.display.iter().filter_map(|d| change(study, d)).collect();
    let dear = changes.iter().filter(|(_, time, _)| *time > 0.0).max_by(|a, b| a.1.total_cmp(&b.1));
    let good =
        changes.iter().filter_map(|(d, _, error)| Some((d, (*error)?))).min_by(|a, b| a.1.total_cmp(&b.1));
    let mut text = match dear {
        Some((d, time, _)) => {
            let per = if d.per_sample { " per million samples" } else { " per repaint" };
            format!(
                "The dearest setting is {} {}: {}{THIN}ms{per} more than the default.",
                d.knob,
                d.setting,
                plain(*time, 2)
            )
        }
        None if study.display.is_empty() => "The display’s settings have no measured prices.".into(),
        None => "No setting costs more than the default.".into(),
    };
    match good {
        Some((d, error)) if error < 0.98 => {
            text += &format!(
                " {} {} lowers the error most, to ×{THIN}{} of the default’s.",
                capital(&d.knob),
                d.setting,
                plain(error, 2)
            );
        }
        Some(_) => text += " No setting gives a smaller error than the default.",
        None => {}
    }
    text
}

/// A setting against the default of its knob: milliseconds more, and RMS error over the default’s.
fn change<'a>(study: &'a Study, d: &'a DisplayPrice) -> Option<(&'a DisplayPrice, f64, Option<f64>)> {
    let base =
        study.display.iter().find(|b| b.default && b.knob == d.knob && b.per_sample == d.per_sample)?;
    let time = d.milliseconds?.value - base.milliseconds?.value;
    let error = || {
        let ratio = (d.rel_mse? / base.rel_mse?).sqrt();
        ratio.is_finite().then_some(ratio)
    };
    (!d.default && time.is_finite()).then(|| (d, time, error()))
}

/// Settings as rows of bars, grouped by knob: `per_sample` picks those per million samples or those per repaint.
fn rows(study: &Study, per_sample: bool) -> Rows {
    let mut last: Option<&str> = None;
    let row = |d: &DisplayPrice, knob: Option<String>| Row {
        group: knob,
        name: if d.default { format!("{} (default)", d.setting) } else { d.setting.clone() },
        class: "m0",
        marker: 0,
        hollow: !d.default,
        figures: vec![d.milliseconds, d.rel_mse.map(|e| Interval::exact(100.0 * e.max(0.0).sqrt()))],
    };
    let mut all = Vec::new();
    for d in study.display.iter().filter(|d| d.per_sample == per_sample) {
        let knob = (last != Some(d.knob.as_str())).then(|| d.knob.clone());
        last = Some(&d.knob);
        all.push(row(d, knob));
    }
    let time = if per_sample { "ms per million samples" } else { "ms per repaint" };
    let panel =
        |title: &str, tick, figure| Panel { title: title.into(), mark: Mark::Bar, tick, figure, base: None };
    let panels = vec![
        panel(time, label, |i| figure(i, 1.0, "").main),
        panel("RMS error", |x| format!("{}{THIN}%", label(x)), |i| percent_of(i.value / 100.0)),
    ];
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
                "Device time of {what} and error of the displayed linear picture. Solid: the default."
            );
            body += &plot(&rows.label, &caption, |size| rows.draw(size));
        }
    }
    body += &list(study);
    let spp = study.display.iter().map(|d| d.samples_per_pixel).filter(|s| *s > 0.0).fold(0.0, f64::max);
    let device = if study.machine.device.is_empty() { "the device" } else { &study.machine.device };
    body += &note(&format!(
        "Milliseconds are those of the passes on {device}, by its own clock where it has one. The error is that of the linear \
         picture as displayed (blurred), at {} samples per pixel, root of relMSE against the reference; one setting is changed at \
         a time and the others are left at their defaults.",
        count(spp)
    ));
    section("display", "4  Price of each display setting", &takeaway(study), &body)
}

fn list(study: &Study) -> String {
    let row = |d: &DisplayPrice| {
        vec![
            format!("{}: {}{}", xml(&d.knob), xml(&d.setting), if d.default { " (default)" } else { "" }),
            d.milliseconds.map_or_else(|| "—".into(), |m| cell(&figure(&m, 1.0, &format!("{THIN}ms")))),
            if d.per_sample { "million samples".into() } else { "repaint".into() },
            maybe(change(study, d), |(_, t, _)| Figure { main: signed(*t), range: None }),
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
