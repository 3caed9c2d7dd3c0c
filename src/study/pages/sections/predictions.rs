//! Part 6: whether predictions came true, and what it costs to know the error.

use crate::study::data::{SchemePrice, Study};
use crate::study::pages::escape::xml;
use crate::study::pages::number::{THIN, percent, plain, times};
use crate::study::pages::parts::{cell, heading, heads, missing, note, plot, section, table};
use crate::study::pages::plot::axis::label;
use crate::study::pages::plot::{Mark, Panel, Row, Rows};
use crate::study::pages::verdict;

/// What the intervals are stated to hold.
const STATED: f64 = 0.9;

/// The sentence to take away.
pub fn takeaway(study: &Study) -> String {
    let Some(p) = &study.predictions else { return "No prediction has been recorded.".into() };
    let Some(share) = verdict::share(p.held, p.known) else {
        return format!("Of {} predictions none has come due.", p.open);
    };
    let (held, known) = (p.held, p.known);
    let judgement = match share {
        s if s.holds(STATED) => "as often as stated",
        s if s.value < STATED => "less often than stated: the intervals are too narrow",
        _ => "more often than stated: the intervals are wider than they need be",
    };
    format!(
        "The stated 90{THIN}% intervals held in {held} of {known} predictions, {}: {judgement}.",
        percent(&share).prose()
    )
}

/// The section.
pub fn html(study: &Study) -> String {
    let mut body = String::new();
    match &study.predictions {
        None => body += &missing(study, "Predictions were", "predictions"),
        Some(p) => {
            let ratio = if p.ratio > 0.0 && p.ratio.is_finite() {
                format!("×{THIN}{}", plain(p.ratio, 3))
            } else {
                "—".into()
            };
            let hit = verdict::share(p.held, p.known).map_or_else(|| "—".into(), |s| cell(&percent(&s)));
            let row = vec![
                p.known.to_string(),
                p.held.to_string(),
                hit,
                format!("90{THIN}%"),
                ratio,
                p.open.to_string(),
            ];
            let heads = heads(&[
                "outcome known",
                "interval held",
                "hit rate",
                "stated",
                "predicted over true time",
                "still open",
            ]);
            body += &table("Predictions", &heads, &[row]);
        }
    }
    if !study.schemes.is_empty() {
        body += &heading("What it costs to know the error");
        body += &schemes(study);
    }
    if study.predictions.is_some() {
        body += &note(
            "While a picture is rendered, its error and the time to a smaller one are predicted from what is known then, with a 90 % \
         interval; each prediction is logged and compared with the time at which the error was reached. The hit rate's own \
         interval is Wilson's. Predictions whose time had not come when the run ended are counted apart and judged nowhere.",
        );
    }
    section("predictions", "6  Predictions", &takeaway(study), &body)
}

fn schemes(study: &Study) -> String {
    let row = |s: &SchemePrice| Row {
        group: None,
        name: if s.used { format!("{} (in use)", s.name) } else { s.name.clone() },
        class: "m0",
        marker: 0,
        hollow: !s.used,
        figures: vec![Some(s.error), Some(s.stated)],
    };
    let panel = |title: &str| Panel {
        title: title.into(),
        mark: Mark::Dot,
        tick: |x| format!("×{THIN}{}", label(x)),
        figure: |i| times(i).main,
        base: Some(1.0),
    };
    let rows = Rows {
        label: "Schemes to know the error".into(),
        panels: vec![panel("error, over undivided"), panel("stated : true error")],
        rows: study.schemes.iter().map(row).collect(),
    };
    let line = |s: &SchemePrice| {
        let used = if s.used { "in use" } else { "" };
        vec![xml(&s.name), used.into(), cell(&times(&s.error)), cell(&times(&s.stated))]
    };
    let lines: Vec<_> = study.schemes.iter().map(line).collect();
    let caption = "A run that is divided, so that its error is known, gives up some evenness of its samples. Left: error over that of an \
                   undivided run of as many samples. Right: stated over true error; 1 is honest.";
    let heads = heads(&["Scheme", "", "error over an undivided run", "stated over true error"]);
    plot(&rows.label, caption, |size| rows.draw(size)) + &table("Schemes", &heads, &lines)
}
