//! Part 2: time to an error.

use maud::{Markup, html};

use crate::study::Interval;
use crate::study::data::{MethodResult, Study};
use crate::study::format::{THIN, goal, seconds, with_unit};
use crate::study::pages::chart::{BarChart, BarMark, BarPanel, BarRow, MethodStyle, styled, tick_label};
use crate::study::pages::parts::{bars, cell, maybe, method, missing, note, table};
use crate::study::pages::verdict;

pub fn conclusion(study: &Study) -> String {
    let Some(a) = verdict::recommend(study) else { return "No time to an error is known.".into() };
    let time = |(m, p): (&MethodResult, Option<(_, Interval)>)| match p {
        Some((_, time)) => format!("{} {}", m.name, seconds(&time).main),
        None => format!("{} not known", m.name),
    };
    let times: Vec<String> = verdict::ranked(&verdict::own(study), a.error).into_iter().map(time).collect();
    let halving = verdict::halving(a.method).map_or_else(String::new, |(error, more)| {
        let (name, error, more) = (&a.method.name, goal(error), seconds(&more).prose());
        format!(" With {name}, halving an error of {error} takes {more} more.")
    });
    format!("Time to {}: {}.{halving}", goal(a.error), times.join(", "))
}

/// Dot chart of times, grouped by error.
pub fn chart(study: &Study) -> BarChart {
    let timed = || styled(study).filter(|(m, _)| m.prices.iter().any(|p| p.seconds.is_some()));
    let mut rows = Vec::new();
    for error in verdict::errors(&study.methods) {
        for (i, (m, style)) in timed().enumerate() {
            let found = verdict::price(m, error);
            let extrapolated = found.is_some_and(|(p, _)| !p.measured);
            rows.push(BarRow {
                group: (i == 0).then(|| format!("to {} at 95{THIN}% of the picture", goal(error))),
                name: m.name.clone(),
                style: MethodStyle { hollow: extrapolated || style.hollow, ..style },
                values: vec![found.map(|(_, s)| s)],
            });
        }
    }
    let tick = |x| format!("{}{THIN}s", tick_label(x));
    let panel = BarPanel::new("", BarMark::Dot, tick, |i| seconds(i).main);
    BarChart { label: "Time to a relative error, by method".into(), panels: vec![panel], rows }
}

pub fn body(study: &Study) -> Markup {
    let chart = chart(study);
    html! {
        @if chart.is_empty() && study.methods.iter().any(|m| !m.prices.is_empty()) {
            p { "The curves were measured, but nothing tells when any of these errors is reached: they end far above, or fall too slowly." }
        } @else if chart.is_empty() { (missing(study, "Times to an error were", "prices")) }
        @else {
            (bars(&chart, "Time to an error, with 90 % intervals. Hollow: predicted, not measured (other programs: grey)."))
            (price_list(study))
            (note(&how(study)))
        }
    }
}

fn how(study: &Study) -> String {
    let trials = study.trial_size.map_or_else(String::new, |[width, height]| {
        format!(
            " Trials of {width}×{height} pixels tell the error at more samples per pixel than pictures of full size get in the time; by how much \
             the errors of both differ at equal samples is measured."
        )
    });
    format!(
        "The time at which the error of 95{THIN}% of the picture, in tiles of 8×8 pixels, comes down to the one stated: the error is fitted as a \
         power law of samples, as it is predicted during a render. Times in italics lie beyond what was measured at full size.{trials} “Not \
         known” means that the error does not fall, or that the interval would span a factor of a thousand. To halve: from the \
         second-lowest error to the lowest, else by the slope from the end of the curve. Efficiency is 1/(relMSE · second)."
    )
}

fn price_list(study: &Study) -> Markup {
    let errors = verdict::errors(&study.methods);
    let mut heads = vec!["Method".to_string()];
    heads.extend(errors.iter().map(|e| format!("to {}", goal(*e))));
    heads.extend(["to halve the error".into(), "efficiency".into()]);
    let halving = |(from, more): (f64, Interval)| {
        let time = seconds(&more);
        html! {
            "+" (THIN) (time.main) " "
            small { @if let Some(range) = &time.range { (range) "; " } "from " (goal(from)) }
        }
    };
    let row = |(m, style): (&MethodResult, MethodStyle)| {
        let mut cells = vec![method(&m.name, style)];
        cells.extend(errors.iter().map(|e| price(m, *e)));
        cells.push(maybe(verdict::halving(m).map(halving)));
        cells.push(maybe(m.efficiency.map(|e| with_unit(&e, 1.0, ""))));
        cells
    };
    table("Time to an error", &heads, &styled(study).map(row).collect::<Vec<_>>())
}

/// A method's time to an error as a cell.
pub fn price(m: &MethodResult, error: f64) -> Markup {
    match verdict::price(m, error) {
        Some((p, time)) if p.measured => cell(seconds(&time)),
        Some((_, time)) => html! { i { (seconds(&time)) } },
        None if m.prices.is_empty() => cell("—"),
        None => html! { span.dim { "not known" } },
    }
}
