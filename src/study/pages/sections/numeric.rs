//! Part 5: what exactness of arithmetic costs and gives.

use crate::study::data::{NumericPrice, Study};
use crate::study::pages::escape::xml;
use crate::study::pages::number::{THIN, clean, plain, times};
use crate::study::pages::parts::{cell, heads, missing, note, plot, section, table};
use crate::study::pages::plot::axis::label;
use crate::study::pages::plot::{Mark, Panel, Row, Rows};

/// The sentence to take away.
pub fn takeaway(study: &Study) -> String {
    let worth = |n: &&NumericPrice| clean(&n.error).is_some_and(|e| e.low > 1.0 && e.value > 1.05);
    let (pays, not): (Vec<_>, Vec<_>) = study.numeric.iter().partition(worth);
    if study.numeric.is_empty() {
        return "No choice of arithmetic has a measured price.".into();
    }
    let one = |n: &&NumericPrice| {
        let (time, error) = (times(&n.time).main, times(&n.error).main);
        format!("{} ({time} of the time, the cheap form has {error} of the error)", n.choice)
    };
    let mut text = match pays.as_slice() {
        [] => "The cheap forms are exact enough here: none has measurably more error.".to_string(),
        some => {
            format!(
                "The more exact form matters for {}.",
                some.iter().map(one).collect::<Vec<_>>().join("; ")
            )
        }
    };
    if !pays.is_empty() && !not.is_empty() {
        let n = not.len();
        text += &format!(
            " {n} other choice{} no measurable difference to the error.",
            if n == 1 { " makes" } else { "s make" }
        );
    }
    text
}

/// The choice whose exact form saves most error, in a few words.
pub fn shortly(study: &Study) -> String {
    let errors = study.numeric.iter().filter_map(|n| Some((n, clean(&n.error)?)));
    match errors.max_by(|a, b| a.1.value.total_cmp(&b.1.value)) {
        Some((n, error)) => {
            format!(
                "{}, cheap form: error {}, time of the exact one {}",
                n.choice,
                times(&error).main,
                times(&n.time).main
            )
        }
        None => "not measured".into(),
    }
}

fn rows(study: &Study) -> Rows {
    let row = |n: &NumericPrice| Row {
        group: None,
        name: n.choice.clone(),
        class: "m0",
        marker: 0,
        hollow: false,
        figures: vec![clean(&n.time), clean(&n.error)],
    };
    let panel = |title: &str| Panel {
        title: title.into(),
        mark: Mark::Dot,
        tick: |x| format!("×{THIN}{}", label(x)),
        figure: |i| times(i).main,
        base: Some(1.0),
    };
    Rows {
        label: "Time and error by choice of arithmetic".into(),
        panels: vec![panel("time, exact : cheap"), panel("error, cheap : exact")],
        rows: study.numeric.iter().map(row).collect(),
    }
}

/// The section.
pub fn html(study: &Study) -> String {
    let title = "5  Price of each numeric choice";
    if study.numeric.is_empty() {
        let body = missing(study, "Prices of numeric choices were", "numeric");
        return section("numeric", title, &takeaway(study), &body);
    }
    let rows = rows(study);
    let drawn = plot(
        &rows.label,
        "Left: what the more exact form costs. Right: what it saves. At 1 there is no difference.",
        |size| rows.draw(size),
    );
    let line = |n: &NumericPrice| {
        vec![
            xml(&n.choice),
            format!("<span class=\"text\">{}</span>", xml(&n.forms[0])),
            format!("<span class=\"text\">{}</span>", xml(&n.forms[1])),
            cell(&times(&n.time)),
            cell(&times(&n.error)),
            format!("<span class=\"text\">{}</span>", xml(&n.what)),
        ]
    };
    let lines: Vec<_> = study.numeric.iter().map(line).collect();
    let table = table(
        "Numeric choices",
        &heads(&[
            "Choice",
            "cheap form",
            "exact form",
            "time, exact : cheap",
            "error, cheap : exact",
            "what is the error",
        ]),
        &lines,
    );
    let worst = study.numeric.iter().filter_map(|n| clean(&n.error)).map(|e| e.value).fold(0.0, f64::max);
    let how = note(&format!(
        "Both forms run in turn on the same samples; ratios are taken pair by pair. The largest ratio of errors is ×{THIN}{}.",
        plain(worst, 3)
    ));
    section("numeric", title, &takeaway(study), &(drawn + &table + &how))
}
