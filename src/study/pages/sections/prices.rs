//! Part 2: seconds to an error.

use crate::study::Interval;
use crate::study::data::{Method, Study};
use crate::study::pages::escape::xml;
use crate::study::pages::number::{THIN, figure, goal, seconds};
use crate::study::pages::parts::{
    cell, heads, maybe, method, missing, note, paragraph, plot, section, table,
};
use crate::study::pages::plot::axis::label;
use crate::study::pages::plot::{Look, Mark, Panel, Row, Rows, looks};
use crate::study::pages::verdict;

/// The sentence to take away.
pub fn takeaway(study: &Study) -> String {
    let own: Vec<&Method> = study.methods.iter().filter(|m| !m.peer).collect();
    let Some(a) = verdict::answer(study) else { return "No time to an error is known.".into() };
    let times: Vec<String> = verdict::ranked(&own, a.error)
        .into_iter()
        .map(|(m, p)| match p {
            Some((_, time)) => format!("{} {}", m.name, seconds(&time).main),
            None => format!("{} beyond what its curve tells", m.name),
        })
        .collect();
    let mut text = format!("Time to {}: {}.", goal(a.error), times.join(", "));
    if let Some((error, more)) = verdict::halving(a.method) {
        text += &format!(
            " With {}, to halve {} takes {} more.",
            a.method.name,
            goal(error),
            seconds(&more).prose()
        );
    }
    text
}

/// Prices as rows of dots, grouped by error.
pub fn rows(study: &Study) -> Rows {
    let mut all = Vec::new();
    let methods: Vec<(&Method, Look)> = study.methods.iter().zip(looks(&study.methods)).collect();
    for error in verdict::errors(&study.methods) {
        let mut group = Some(format!("to {} at 95{THIN}% of the picture", goal(error)));
        for (m, look) in methods.iter().filter(|(m, _)| m.prices.iter().any(|p| p.seconds.is_some())) {
            let found = verdict::price(m, error);
            all.push(Row {
                group: group.take(),
                name: m.name.clone(),
                class: look.class,
                marker: look.marker,
                hollow: found.is_some_and(|(p, _)| !p.measured) || look.hollow,
                figures: vec![found.map(|(_, s)| s)],
            });
        }
    }
    let panel = Panel {
        title: String::new(),
        mark: Mark::Dot,
        tick: |x| format!("{}{THIN}s", label(x)),
        figure: |i| seconds(i).main,
        base: None,
    };
    Rows { label: "Time to a relative error, by method".into(), panels: vec![panel], rows: all }
}

/// The section.
pub fn html(study: &Study) -> String {
    let rows = rows(study);
    let body = if rows.is_empty() && study.methods.iter().any(|m| !m.prices.is_empty()) {
        paragraph(
            "The curves were measured, and none tells when any of these errors is reached: they end far above, fall too slowly, or \
             come down to the error of the reference.",
        )
    } else if rows.is_empty() {
        missing(study, "Times to an error were", "prices")
    } else {
        let plotted = plot(
            &rows.label,
            "Time to an error, with 90 % intervals. Hollow: not measured, the curve was drawn further (peers: grey).",
            |size| rows.draw(size),
        );
        let note = note(
            "A price is the time at which the fitted curve of error against seconds meets the error; “95 % of the picture” are \
             areas of 8×8 pixels. Prices in italics lie beyond the measured part of the curve; “beyond the curve” is said where \
             the line would have to be drawn to more than a thousandfold, or where the method’s bias shows, which falls otherwise than noise. To halve: from the second-lowest price to the lowest, else by the slope from the \
             end of the curve. Efficiency is 1/(relMSE · second).",
        );
        plotted + &list(study) + &note
    };
    section("prices", "2  Price list", &takeaway(study), &body)
}

fn list(study: &Study) -> String {
    let errors = verdict::errors(&study.methods);
    let mut heads = heads(&["Method"]);
    heads.extend(errors.iter().map(|e| format!("to {}", goal(*e))));
    heads.extend(["to halve the error".into(), "efficiency".into()]);
    let row = |(m, look): (&Method, Look)| {
        let mut cells = vec![method(&m.name, look)];
        cells.extend(errors.iter().map(|e| price(m, *e)));
        cells.push(verdict::halving(m).map_or_else(
            || "—".into(),
            |(from, more)| {
                let figure = seconds(&more);
                let range = figure.range.map_or_else(String::new, |r| format!("{r}; "));
                format!("+{THIN}{} <small>{}from {}</small>", xml(&figure.main), xml(&range), goal(from))
            },
        ));
        cells.push(maybe(m.efficiency, |e: &Interval| figure(e, 1.0, "")));
        cells
    };
    let rows: Vec<_> = study.methods.iter().zip(looks(&study.methods)).map(row).collect();
    table("Price list", &heads, &rows)
}

/// A price as a cell.
pub fn price(m: &Method, error: f64) -> String {
    match verdict::price(m, error) {
        Some((p, time)) if p.measured => cell(&seconds(&time)),
        Some((_, time)) => format!("<i>{}</i>", cell(&seconds(&time))),
        None if m.prices.is_empty() => "—".into(),
        None => "<span class=\"dim\">beyond the curve</span>".into(),
    }
}
