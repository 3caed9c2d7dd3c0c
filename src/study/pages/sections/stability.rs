//! Part 7: samples that were not finite, and the brightness of the picture.

use maud::{Markup, html};

use crate::study::Interval;
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
    let energies: Vec<(&Stability, Interval)> =
        study.stability.iter().filter_map(|s| Some((s, s.energy?.cleaned()?))).collect();
    let off = energies.iter().filter(|(_, e)| !e.holds(1.0));
    let off: Vec<String> = off.map(|(s, e)| format!("{} {}", s.method, factor(e).prose())).collect();
    if !off.is_empty() {
        text += &format!(" The mean brightness differs from the reference's with {}.", list(&off));
    } else if !energies.is_empty() {
        text += " The mean brightness of every method agrees with the reference.";
    }
    text
}

/// The same in a few words.
pub fn summary(study: &Study) -> String {
    let (bad, paths) = verdict::rejected(study);
    let energies = study.stability.iter().filter_map(|s| s.energy?.cleaned());
    let most = energies.max_by(|a, b| (a.value - 1.0).abs().total_cmp(&(b.value - 1.0).abs()));
    let energy = most.map_or_else(String::new, |e| format!("; brightness off most: {}", factor(&e)));
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
            ("brightness over the reference's", &|s| maybe(s.energy.as_ref().map(factor))),
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
                Brightness is the mean luminance of the picture over that of the reference, with its 90{THIN}% interval; a method that \
                loses or creates light differs from 1.")))
        }
    }
}
