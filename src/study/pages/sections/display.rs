//! Part 4: cost and benefit of the display settings.

use maud::{Markup, html};

use crate::study::Interval;
use crate::study::data::{DisplayPrice, Study};
use crate::study::format::{THIN, count, percent_of, significant, with_unit};
use crate::study::pages::chart::{
    BarChart, BarMark, BarPanel, BarRow, MethodStyle, PLAIN, percent_label, tick_label,
};
use crate::study::pages::parts::{bars, cell, listing, maybe, missing, note};

/// Conclusion: cost of the most expensive change of a setting, and which change lowers the error most.
pub fn conclusion(study: &Study) -> String {
    if study.display.is_empty() {
        return "The cost of the display's settings has not been measured.".into();
    }
    let changes: Vec<SettingChange<'_>> = study.display.iter().filter_map(|d| change(study, d)).collect();
    let slower = changes.iter().filter_map(|c| Some((c, c.milliseconds.filter(|ms| *ms > 0.0)?)));
    let mut text = match slower.max_by(|a, b| a.1.total_cmp(&b.1)) {
        Some((c, ms)) => {
            let per = if c.of.per_sample { "per million samples" } else { "per repaint" };
            let (knob, setting, ms) = (&c.of.knob, &c.of.setting, significant(ms, 2));
            format!(
                "The most expensive setting is {knob}: {setting}, with {ms}{THIN}ms {per} more than the default."
            )
        }
        None if study.display.iter().all(|d| d.milliseconds.is_none()) => {
            "The settings were not timed, because the device has no clock for its passes.".into()
        }
        None => "No setting costs more than the default.".into(),
    };
    match changes.iter().filter_map(|c| Some((c, c.error?))).min_by(|a, b| a.1.total_cmp(&b.1)) {
        Some((c, error)) if error < 0.98 => {
            let (ratio, samples) = (significant(error, 2), count(c.of.samples_per_pixel));
            text += &format!(
                " {}: {} lowers the error most, to ×{THIN}{ratio} of the default's at {samples} samples per pixel.",
                c.of.knob, c.of.setting
            );
        }
        Some(_) => text += " No setting gives a smaller error than the default.",
        None => {}
    }
    text
}

/// A setting compared with the default of its group, at equal samples.
struct SettingChange<'a> {
    of: &'a DisplayPrice,
    /// Additional milliseconds.
    milliseconds: Option<f64>,
    /// RMS error over the default's.
    error: Option<f64>,
}

fn change<'a>(study: &'a Study, d: &'a DisplayPrice) -> Option<SettingChange<'a>> {
    let like = |b: &&DisplayPrice| (&b.knob, b.samples_per_pixel) == (&d.knob, d.samples_per_pixel);
    let base = study.display.iter().filter(like).find(|b| b.default)?;
    let finite = |x: f64| x.is_finite().then_some(x);
    let milliseconds = || finite(d.milliseconds?.value - base.milliseconds?.value);
    let error = || finite((d.rel_mse? / base.rel_mse?).sqrt());
    (!d.default).then(|| SettingChange { of: d, milliseconds: milliseconds(), error: error() })
}

/// Bar chart of settings grouped by knob: those that cost time per million samples, or those per repaint. One panel for time, and one for
/// the error at each number of samples.
fn chart(study: &Study, per_sample: bool) -> BarChart {
    let mut samples: Vec<f64> =
        study.display.iter().map(|d| d.samples_per_pixel).filter(|n| n.is_finite()).collect();
    samples.sort_by(f64::total_cmp);
    samples.dedup();
    let settings: Vec<&DisplayPrice> = study.display.iter().filter(|d| d.per_sample == per_sample).collect();
    let mut rows: Vec<BarRow> = Vec::new();
    for (i, d) in settings.iter().enumerate() {
        let same = |e: &&&DisplayPrice| (&e.knob, &e.setting) == (&d.knob, &d.setting);
        if settings[..i].iter().any(|e| same(&e)) {
            continue;
        }
        let error = |n: f64| {
            let rel_mse = settings.iter().filter(same).find(|e| e.samples_per_pixel == n)?.rel_mse?;
            Some(Interval::exact(100.0 * rel_mse.max(0.0).sqrt()))
        };
        let time = settings.iter().filter(same).find_map(|e| e.milliseconds);
        rows.push(BarRow {
            group: settings[..i].iter().all(|e| e.knob != d.knob).then(|| d.knob.clone()),
            name: if d.default { format!("{} (default)", d.setting) } else { d.setting.clone() },
            style: MethodStyle { hollow: !d.default, ..PLAIN },
            values: std::iter::once(time).chain(samples.iter().map(|n| error(*n))).collect(),
        });
    }
    let time = if per_sample { "ms per M samples" } else { "ms per repaint" };
    let mut panels = vec![BarPanel::new(time, BarMark::Bar, tick_label, |i| with_unit(i, 1.0, "").main)];
    panels.extend(samples.iter().map(|n| {
        let title = format!("RMS error, {} spp", count(*n));
        BarPanel::new(title, BarMark::Bar, percent_label, |i| percent_of(i.value / 100.0))
    }));
    BarChart { label: format!("Display settings: {time} and error"), panels, rows }
}

pub fn body(study: &Study) -> Markup {
    let device = if study.machine.device.is_empty() { "the device" } else { &study.machine.device };
    html! {
        @if study.display.is_empty() { (missing(study, "Costs of the display's settings were", "display")) }
        @else {
            @for (per_sample, what) in [(false, "a repaint"), (true, "a million samples")] {
                @let chart = chart(study, per_sample);
                @if !chart.is_empty() {
                    (bars(&chart, &format!("Device time of {what} and error of the displayed linear picture, by samples per pixel (spp). \
                        Solid: the default.")))
                }
            }
            (setting_table(study))
            (note(&format!("Milliseconds are those of the passes on {device}, by its own clock where it has one. The error is that of the \
                linear picture as displayed (blurred): the root of relMSE against the reference. One setting is changed at a time, the \
                default is measured anew with each group, and the film has the study's filter except where filters are compared. Sums in \
                one float and in two differ after hours, not after a few samples: see part 5.")))
        }
    }
}

fn setting_table(study: &Study) -> Markup {
    let signed = |ms: f64| format!("{}{}{THIN}ms", if ms > 0.0 { "+" } else { "" }, significant(ms, 2));
    listing(
        "Costs of display settings",
        &study.display,
        &[
            ("Setting", &|d| html! { (d.knob) ": " (d.setting) @if d.default { " (default)" } }),
            ("time", &|d| maybe(d.milliseconds.map(|ms| with_unit(&ms, 1.0, &format!("{THIN}ms"))))),
            ("per", &|d| cell(if d.per_sample { "million samples" } else { "repaint" })),
            ("over the default", &|d| maybe(change(study, d).and_then(|c| c.milliseconds).map(signed))),
            ("RMS error", &|d| maybe(d.rel_mse.map(|e| percent_of(e.max(0.0).sqrt())))),
            ("FLIP", &|d| maybe(d.flip.map(|f| significant(f, 2)))),
            ("at samples/pixel", &|d| cell(count(d.samples_per_pixel))),
        ],
    )
}
