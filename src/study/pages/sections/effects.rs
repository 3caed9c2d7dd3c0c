//! Part 3: cost of each effect, and its contribution.

use maud::{Markup, html};

use crate::study::Interval;
use crate::study::data::{EffectPrice, OptionPrice, Study};
use crate::study::format::{factor, increase, percent_of, seconds_of, significant};
use crate::study::pages::chart::{
    BarChart, BarMark, BarPanel, BarRow, MethodStyle, PLAIN, percent_label, tick_label,
};
use crate::study::pages::parts::{bars, cell, embedded, listing, maybe, missing, note, pictures, words};
use crate::study::pages::verdict;

pub fn conclusion(study: &Study) -> String {
    let mut text = match verdict::most_expensive_effect(study) {
        Some((effect, time)) => {
            let time = increase(&time).prose();
            format!("The most expensive effect is {}: {time} time per path.", effect.name)
        }
        None => "The cost of this scene's effects has not been measured.".into(),
    };
    let lost =
        study.effects.iter().filter(|e| e.on).filter_map(|e| Some((e, e.loss.filter(|l| l.is_finite())?)));
    if let Some((effect, loss)) = lost.max_by(|a, b| a.1.total_cmp(&b.1)) {
        text += &format!(" The picture loses most without {} (FLIP {}).", effect.name, significant(loss, 2));
    }
    if let Some(ratio) = study.unused_effects.and_then(|r| r.cleaned()) {
        let cost = if ratio.value < 1.0 && !ratio.holds(1.0) { "are not free" } else { "cost nothing" };
        text += &format!(
            " Effects that the scene does not use {cost}: the specialised code traces paths {} as fast as the general code.",
            factor(&ratio).prose()
        );
    }
    text
}

/// Costs of the effects that are on, most expensive first, then of those that are off.
pub fn chart(study: &Study) -> BarChart {
    let time = |e: &EffectPrice| e.time.and_then(|t| t.cleaned()).map_or(f64::NEG_INFINITY, |t| t.value);
    let priced = |e: &&EffectPrice| e.time.is_some() || e.variance.is_some() || e.loss.is_some();
    let mut sorted: Vec<&EffectPrice> = study.effects.iter().filter(priced).collect();
    sorted.sort_by(|a, b| b.on.cmp(&a.on).then(time(b).total_cmp(&time(a))));
    let first_off = sorted.iter().position(|e| !e.on).filter(|i| *i > 0);
    let heading = |i: usize| match first_off {
        Some(_) if i == 0 => Some("effects that the scene uses".to_string()),
        Some(first) if i == first => Some("not used: what they would cost".to_string()),
        _ => None,
    };
    let row = |(i, e): (usize, &&EffectPrice)| BarRow {
        group: heading(i),
        name: e.name.clone(),
        style: if e.on { PLAIN } else { MethodStyle { class: "n0", hollow: true, ..PLAIN } },
        values: vec![
            e.time.map(|t| t.map(|x| 100.0 * (x - 1.0))),
            e.variance.map(|v| Interval::exact(100.0 * v)),
            e.loss.map(Interval::exact),
        ],
    };
    let time = |i: &Interval| increase(&i.map(|x| 1.0 + x / 100.0)).main;
    BarChart {
        label: "Time, share of variance and loss of picture, by effect".into(),
        panels: vec![
            BarPanel::new("time per path", BarMark::Bar, percent_label, time),
            BarPanel::new("of the variance", BarMark::Bar, percent_label, |i| percent_of(i.value / 100.0)),
            BarPanel::new("loss (FLIP)", BarMark::Bar, tick_label, |i| significant(i.value, 2)),
        ],
        rows: sorted.iter().enumerate().map(row).collect(),
    }
}

pub fn body(study: &Study) -> Markup {
    let chart = chart(study);
    html! {
        @if chart.is_empty() { (missing(study, "Costs of effects were", "effects")) }
        @else {
            (bars(&chart, "Extra time per path with the effect; the share of the variance that it causes (negative: less noise with \
                it); how visibly the picture changes without it."))
        }
        (effect_table(study))
        (without_effects(study))
        (options(study))
        @if !study.effects.is_empty() {
            (note("An effect is removed from the scene before the scene is prepared, together with its code. Time per path is measured with \
                and without it in turn, and the ratio is taken pair by pair. Variance and loss are compared at equal numbers of paths; loss \
                is the increase of the mean FLIP against the reference without the effect, and noise hides small losses. The cost of \
                effects that the scene does not use is the speed of the code for all effects against that of the specialised code."))
        }
    }
}

fn effect_table(study: &Study) -> Markup {
    listing(
        "Costs of effects",
        &study.effects,
        &[
            ("Effect", &|e| cell(&e.name)),
            ("plan", &|e| html! { @if e.on { "on" } @else { span.dim { "off" } } }),
            ("time per path", &|e| maybe(e.time.as_ref().map(increase))),
            ("of the variance", &|e| maybe(e.variance.map(percent_of))),
            ("loss (FLIP)", &|e| maybe(e.loss.map(|l| significant(l, 2)))),
            ("reason", &|e| words(&e.reason)),
        ],
    )
}

/// Options of `render` against a render without them.
fn options(study: &Study) -> Markup {
    let first = study.options.first();
    let flip = |o: &OptionPrice, i: usize| maybe(o.flip.map(|flip| significant(flip[i], 2)));
    html! {
        @if let Some(first) = first {
            h3 {
                "Options of a render: " (first.method) " at " (first.size[0]) "×" (first.size[1]) " for " (seconds_of(first.seconds))
            }
            (listing(
                "Options of a render",
                &study.options,
                &[
                    ("Option", &|o| cell(&o.name)),
                    ("paths in the same time", &|o| maybe(o.paths.map(|p| factor(&Interval::exact(p))))),
                    ("error, 95 % of the picture", &|o| maybe(o.error.as_ref().map(factor))),
                    ("FLIP with it", &|o| flip(o, 0)),
                    ("FLIP without", &|o| flip(o, 1)),
                ],
            ))
            (note("A render with each option against one without, by the same method in the same time. The error of --adaptive is that of its \
                replicates; the error of a denoised or reweighted picture contains its bias and is measured against the reference. \
                --light-groups makes one picture for each emitter beside the picture of all, whose noise per path stays the same."))
        }
    }
}

fn without_effects(study: &Study) -> Markup {
    let one = |e: &EffectPrice| {
        let loss = e.loss.map_or_else(String::new, |l| format!(", FLIP {}", significant(l, 2)));
        let caption = format!("without {}{loss}", e.name);
        Some(pictures(&[(embedded(e.picture.as_deref())?, caption.clone())], &cell(caption)))
    };
    let all: Vec<Markup> = study.effects.iter().filter_map(one).collect();
    html! { @if !all.is_empty() { h3 { "The picture without it" } div.pictures { @for picture in all { (picture) } } } }
}
