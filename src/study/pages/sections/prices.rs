//! Part 2: the time to an error.

use maud::{Markup, html};

use crate::study::Interval;
use crate::study::data::{MethodResult, Study};
use crate::study::format::{THIN, goal, seconds, with_unit};
use crate::study::pages::chart::{BarChart, BarMark, BarPanel, BarRow, MethodStyle, styles, tick_label};
use crate::study::pages::parts::{cell, figure, maybe, method, missing, note, section, table};
use crate::study::pages::verdict;

/// The conclusion.
pub fn conclusion(study: &Study) -> String {
    let Some(a) = verdict::recommend(study) else { return "No time to an error is known.".into() };
    let own: Vec<&MethodResult> = study.methods.iter().filter(|m| !m.peer).collect();
    let time = |(m, p): (&MethodResult, Option<(_, Interval)>)| match p {
        Some((_, time)) => format!("{} {}", m.name, seconds(&time).main),
        None => format!("{} beyond its curve", m.name),
    };
    let times: Vec<String> = verdict::ranked(&own, a.error).into_iter().map(time).collect();
    let halving = verdict::halving(a.method).map_or_else(String::new, |(error, more)| {
        let (name, error, more) = (&a.method.name, goal(error), seconds(&more).prose());
        format!(" With {name}, halving an error of {error} takes {more} more.")
    });
    format!("Time to {}: {}.{halving}", goal(a.error), times.join(", "))
}

/// Times as rows of dots, grouped by error.
pub fn chart(study: &Study) -> BarChart {
    let methods: Vec<(&MethodResult, MethodStyle)> =
        study.methods.iter().zip(styles(&study.methods)).collect();
    let timed = || methods.iter().filter(|(m, _)| m.prices.iter().any(|p| p.seconds.is_some()));
    let mut rows = Vec::new();
    for error in verdict::errors(&study.methods) {
        let heading = format!("to {} at 95{THIN}% of the picture", goal(error));
        for (i, (m, style)) in timed().enumerate() {
            let found = verdict::price(m, error);
            let extrapolated = found.is_some_and(|(p, _)| !p.measured);
            rows.push(BarRow {
                group: (i == 0).then(|| heading.clone()),
                name: m.name.clone(),
                style: MethodStyle { hollow: extrapolated || style.hollow, ..*style },
                values: vec![found.map(|(_, s)| s)],
            });
        }
    }
    let panel = BarPanel {
        title: String::new(),
        mark: BarMark::Dot,
        tick: |x| format!("{}{THIN}s", tick_label(x)),
        number: |i| seconds(i).main,
        base: None,
    };
    BarChart { label: "Time to a relative error, by method".into(), panels: vec![panel], rows }
}

/// The section.
pub fn html(study: &Study) -> Markup {
    let chart = chart(study);
    let body = html! {
        @if chart.is_empty() && study.methods.iter().any(|m| !m.prices.is_empty()) {
            p { "The curves were measured, but none reaches any of these errors: they end far above, fall too slowly, or come down to the \
                 error of the reference." }
        } @else if chart.is_empty() { (missing(study, "Times to an error were", "prices")) }
        @else {
            (figure(&chart.label, "Time to an error, with 90 % intervals. Hollow: extrapolated from the curve, not measured (other \
                programs: grey).", |size| chart.draw(size)))
            (price_list(study))
            (note("A time is the one at which the fitted curve of error against seconds meets the error; “95 % of the picture” counts \
                tiles of 8×8 pixels. Times in italics lie beyond the measured part of the curve. “Beyond the curve” means that the line \
                would have to be extended more than a thousandfold, or that the method has visible bias, which falls differently from \
                noise. To halve: from the second-lowest error to the lowest, else by the slope from the end of the curve. Efficiency is \
                1/(relMSE · second)."))
        }
    };
    section("prices", "2  Time to an error", &conclusion(study), body)
}

fn price_list(study: &Study) -> Markup {
    let errors = verdict::errors(&study.methods);
    let mut heads = vec!["Method".to_string()];
    heads.extend(errors.iter().map(|e| format!("to {}", goal(*e))));
    heads.extend(["to halve the error".into(), "efficiency".into()]);
    let row = |(m, style): (&MethodResult, MethodStyle)| {
        let mut cells = vec![method(&m.name, style)];
        cells.extend(errors.iter().map(|e| price(m, *e)));
        cells.push(maybe(verdict::halving(m).map(|(from, more)| {
            let time = seconds(&more);
            html! {
                "+" (THIN) (time.main) " "
                small { @if let Some(range) = &time.range { (range) "; " } "from " (goal(from)) }
            }
        })));
        cells.push(maybe(m.efficiency.map(|e| with_unit(&e, 1.0, ""))));
        cells
    };
    let rows: Vec<_> = study.methods.iter().zip(styles(&study.methods)).map(row).collect();
    table("Time to an error", &heads, &rows)
}

/// A method's time to an error as a cell.
pub fn price(m: &MethodResult, error: f64) -> Markup {
    match verdict::price(m, error) {
        Some((p, time)) if p.measured => cell(seconds(&time)),
        Some((_, time)) => html! { i { (seconds(&time)) } },
        None if m.prices.is_empty() => cell("—"),
        None => html! { span.dim { "beyond the curve" } },
    }
}
