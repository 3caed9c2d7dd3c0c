//! Part 6: accuracy of predictions and of stated errors, and the cost of the error estimate.

use maud::{Markup, html};

use crate::study::Interval;
use crate::study::data::{PredictionScore, StatedErrors, Study};
use crate::study::format::{THIN, factor, percent_interval, significant};
use crate::study::pages::chart::style_of;
use crate::study::pages::parts::{cell, listing, maybe, method, missing, note};

/// Nominal coverage of the intervals.
const STATED: f64 = 0.9;

pub fn conclusion(study: &Study) -> String {
    let Some(p) = &study.predictions else { return "No prediction has been recorded.".into() };
    let Some(share) = Interval::of_share(p.held, p.known) else {
        return format!("None of {} predictions has come due.", p.open);
    };
    let judgement = match share {
        s if s.holds(STATED) => "as often as stated",
        s if s.value < STATED => "less often than stated: the intervals are too narrow",
        _ => "more often than stated: the intervals are wider than they need be",
    };
    let (held, known, share) = (p.held, p.known, percent_interval(&share).prose());
    format!("The 90{THIN}% intervals held in {held} of {known} predictions, {share}: {judgement}.")
}

pub fn body(study: &Study) -> Markup {
    html! {
        @match &study.predictions {
            None => (missing(study, "Predictions were", "predictions")),
            Some(p) => (score(p)),
        }
        @if !study.stated.is_empty() {
            h3 { "How often stated errors held" }
            (stated(study))
        }
        @if !study.schemes.is_empty() {
            h3 { "What it costs to know the error" }
            (schemes(study))
        }
        @if study.predictions.is_some() {
            (note("While a picture is rendered, its error and the time to a smaller one are predicted with a 90 % interval. Each prediction \
                is logged and compared with the time at which the error was reached. The interval of the hit rate is Wilson's. Predictions \
                whose time had not come when the run ended are counted apart and not judged."))
        }
    }
}

fn score(p: &PredictionScore) -> Markup {
    let ratio = (p.ratio > 0.0 && p.ratio.is_finite()).then(|| format!("×{THIN}{}", significant(p.ratio, 3)));
    listing(
        "How predictions held",
        std::slice::from_ref(p),
        &[
            ("Predictions with an outcome", &|p| cell(p.known)),
            ("held", &|p| cell(p.held)),
            ("hit rate", &|p| maybe(Interval::of_share(p.held, p.known).as_ref().map(percent_interval))),
            ("stated", &|_| cell(format!("90{THIN}%"))),
            ("predicted : true time", &|_| maybe(ratio.as_ref())),
            ("not due yet", &|p| cell(p.open)),
        ],
    )
}

fn stated(study: &Study) -> Markup {
    let held = |s: &StatedErrors, i: usize| {
        let share = Interval::of_share(s.held[i], s.pictures);
        maybe(share.as_ref().map(percent_interval))
    };
    let table = listing(
        "How often stated errors held",
        &study.stated,
        &[
            ("Method", &|s| method(&s.method, style_of(study, &s.method))),
            ("pictures", &|s| cell(s.pictures)),
            ("held in half of the picture", &|s| held(s, 0)),
            ("95\u{202f}% of it", &|s| held(s, 1)),
            ("99\u{202f}% of it", &|s| held(s, 2)),
            ("stated over true error", &|s| cell(factor(&s.ratio))),
        ],
    );
    html! {
        (table)
        p.dim {
            "Every render states its error without a reference, each with a 90" (THIN) "% interval. Here it is compared with the error "
            "against the reference, of pictures whose error is at least twice the reference's own; others are not counted. The last column is of 95" (THIN) "% of "
            "the picture, a geometric mean: below 1 too little is stated. Pictures by one method share no samples with each other, but light that "
            "no method of this study has found is missing from the reference too."
        }
    }
}

fn schemes(study: &Study) -> Markup {
    let schemes = listing(
        "Ways to know the error",
        &study.schemes,
        &[
            ("Division", &|s| cell(&s.name)),
            ("", &|s| cell(if s.used { "in use" } else { "" })),
            ("error over an undivided run", &|s| cell(factor(&s.error))),
            ("stated over true error", &|s| cell(factor(&s.stated))),
        ],
    );
    html! {
        (schemes)
        p.dim {
            "A run that is divided so that its error is known gives up some evenness of its samples. The first ratio compares its error "
            "with that of an undivided run of as many samples, the second the stated with the true error: 1 is honest."
        }
    }
}
