//! Part 6: whether predictions came true, and what it costs to know the error.

use maud::{Markup, html};

use crate::study::Interval;
use crate::study::data::{PredictionScore, Study};
use crate::study::format::{THIN, factor, percent_interval, significant};
use crate::study::pages::parts::{cell, listing, maybe, missing, note};

/// The share of outcomes that an interval should contain.
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
