//! Part 7: rejected samples, and brightness of the picture.

use maud::{Markup, html};

use crate::study::data::{Stability, Study};
use crate::study::format::{THIN, count, factor};
use crate::study::pages::chart::style_of;
use crate::study::pages::parts::{cell, command, list, listing, maybe, method, missing, note, words};
use crate::study::pages::verdict;

pub fn conclusion(study: &Study) -> String {
    if study.stability.is_empty() {
        return "Stability has not been measured.".into();
    }
    let (bad, paths) = verdict::rejected(study);
    let mut text = match bad {
        0 => format!("All samples of {} paths were finite.", count(paths as f64)),
        n => format!("{} of {} paths gave samples that were rejected.", count(n as f64), count(paths as f64)),
    };
    let known = study.stability.iter().any(|s| s.energy.is_some());
    let off: Vec<String> = study.stability.iter().filter(|s| s.alarm).map(|s| s.method.clone()).collect();
    if !off.is_empty() {
        text += &format!(" The mean brightness of {} differs by more than chance.", list(&off));
    } else if known {
        text += " The mean brightness of all unbiased methods agrees.";
    }
    text
}

/// Short form of the conclusion.
pub fn summary(study: &Study) -> String {
    let (bad, paths) = verdict::rejected(study);
    let energies = study.stability.iter().filter(|s| !s.biased).filter_map(|s| s.energy?.cleaned());
    let most = energies.max_by(|a, b| (a.value - 1.0).abs().total_cmp(&(b.value - 1.0).abs()));
    let agrees = if study.stability.iter().any(|s| s.alarm) { "differs" } else { "agrees" };
    let energy =
        most.map_or_else(String::new, |e| format!("; brightness {agrees}, at most {}", factor(&e).prose()));
    format!("{} of {} paths rejected{energy}", count(bad as f64), count(paths as f64))
}

pub fn body(study: &Study) -> Markup {
    let causes = |s: &Stability| {
        let causes = s.rejected.iter().map(|(cause, n, _)| format!("{cause}: {}", count(*n as f64)));
        if s.rejected.is_empty() { "—".into() } else { causes.collect::<Vec<_>>().join(", ") }
    };
    let samples = listing(
        "Stability",
        &study.stability,
        &[
            ("Method", &|s| method(&s.method, style_of(study, &s.method))),
            ("paths", &|s| cell(count(s.paths as f64))),
            ("rejected", &|s| cell(count(verdict::rejected_samples(s) as f64))),
            ("by cause", &|s| words(&causes(s))),
            ("brightness over that of others", &|s| maybe(s.energy.as_ref().map(factor))),
            ("", &|s| {
                words(match (s.alarm, s.biased) {
                    (true, _) => "differs by more than chance",
                    (_, true) => "biased by design",
                    _ => "",
                })
            }),
        ],
    );
    let replays = study.stability.iter().flat_map(|s| s.rejected.iter().map(move |r| (s, r)));
    let replays: Vec<_> = replays.filter(|(_, (_, count, _))| *count > 0).collect();
    html! {
        @if study.stability.is_empty() { (missing(study, "Rejected samples and brightness were", "stability")) }
        @else {
            (samples)
            @if !replays.is_empty() { h3 { "Commands that repeat the first of each" } }
            @for (s, (cause, _, replay)) in &replays {
                p { (s.method) ", " (cause) ":" }
                @if !replay.is_empty() { (command(replay)) }
            }
            (note(&format!("Every sample is checked before it is added. One that is not finite is counted by its cause and left out. \
                Brightness is the mean luminance of all samples over that of the most precise other unbiased method, or of a given \
                reference, with its 90{THIN}% interval; a method that loses or creates light differs from 1. The marked ones differ by \
                more than chance would let one study in 100{THIN}000.")))
        }
    }
}
