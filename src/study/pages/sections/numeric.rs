//! Part 5: cost and benefit of more precise arithmetic.

use maud::{Markup, html};

use crate::study::data::{NumericPrice, Study};
use crate::study::format::{THIN, factor, significant};
use crate::study::pages::parts::{cell, listing, missing, note, words};

pub fn conclusion(study: &Study) -> String {
    let matters = |n: &&NumericPrice| n.error.cleaned().is_some_and(|e| e.low > 1.0 && e.value > 1.05);
    let (exact, cheap): (Vec<_>, Vec<_>) = study.numeric.iter().partition(matters);
    if study.numeric.is_empty() {
        return "The cost of more exact arithmetic has not been measured.".into();
    }
    if exact.is_empty() {
        return "The cheap forms are exact enough here: none has measurably more error.".into();
    }
    let one = |n: &&NumericPrice| {
        let (time, error) = (factor(&n.time).main, factor(&n.error).main);
        format!("{} ({time} of the time; the cheap form has {error} of the error)", n.choice)
    };
    let text =
        format!("Exact arithmetic matters for {}.", exact.iter().map(one).collect::<Vec<_>>().join("; "));
    let other = match cheap.len() {
        0 => String::new(),
        1 => " The other choice makes no measurable difference to the error.".into(),
        n => format!(" {n} other choices make no measurable difference to the error."),
    };
    text + &other
}

/// Short name of the choice whose precise form reduces the error most.
pub fn summary(study: &Study) -> String {
    let errors = study.numeric.iter().filter_map(|n| Some((n, n.error.cleaned()?)));
    let Some((n, error)) = errors.max_by(|a, b| a.1.value.total_cmp(&b.1.value)) else {
        return "not measured".into();
    };
    let [error, time] = [&error, &n.time].map(|i| factor(i).main);
    format!("{}, cheap form: error {error}; exact form: time {time}", n.choice)
}

pub fn body(study: &Study) -> Markup {
    let choices = listing(
        "Choices of arithmetic",
        &study.numeric,
        &[
            ("Choice", &|n| cell(&n.choice)),
            ("cheap form", &|n| words(&n.forms[0])),
            ("exact form", &|n| words(&n.forms[1])),
            ("time, exact : cheap", &|n| cell(factor(&n.time))),
            ("error, cheap : exact", &|n| cell(factor(&n.error))),
            ("error of what", &|n| words(&n.what)),
        ],
    );
    let worst = study.numeric.iter().filter_map(|n| n.error.cleaned()).map(|e| e.value).fold(0.0, f64::max);
    html! {
        @if study.numeric.is_empty() { (missing(study, "Costs of arithmetic were", "numeric")) }
        @else {
            (choices)
            (note(&format!("Both forms run in turn on the same samples; ratios are taken pair by pair. The time is the cost of the exact form, \
                the error what it avoids; at 1 there is no difference. The largest ratio of errors is ×{THIN}{}.", significant(worst, 3))))
        }
    }
}
