//! Part 7: samples that were not finite, and the energy of the picture.

use crate::study::data::{Stability, Study};
use crate::study::pages::escape::xml;
use crate::study::pages::number::{THIN, clean, count, times};
use crate::study::pages::parts::{
    command, heading, heads, list, maybe, method, missing, note, section, table,
};
use crate::study::pages::plot::{Look, looks};
use crate::study::pages::verdict;

/// The sentence to take away.
pub fn takeaway(study: &Study) -> String {
    if study.stability.is_empty() {
        return "Stability has not been looked at.".into();
    }
    let (bad, paths) = verdict::rejected(study);
    let mut text = match bad {
        0 => format!("All samples of {} paths were finite.", count(paths as f64)),
        n => format!("{} of {} paths gave samples that were rejected.", count(n as f64), count(paths as f64)),
    };
    let audited: Vec<&Stability> = study.stability.iter().filter(|s| energy(s).is_some()).collect();
    let off: Vec<String> = audited
        .iter()
        .filter_map(|s| Some((s, energy(s)?)))
        .filter(|(_, e)| !e.holds(1.0))
        .map(|(s, e)| format!("{} {}", s.method, times(&e).prose()))
        .collect();
    if off.is_empty() && !audited.is_empty() {
        text += " The mean brightness of every method agrees with the reference.";
    } else if !off.is_empty() {
        text += &format!(" Mean brightness over the reference's differs from 1 with {}.", list(&off));
    }
    text
}

/// The same in a few words.
pub fn shortly(study: &Study) -> String {
    let (bad, paths) = verdict::rejected(study);
    let off = study
        .stability
        .iter()
        .filter_map(energy)
        .max_by(|a, b| (a.value - 1.0).abs().total_cmp(&(b.value - 1.0).abs()));
    let energy = off.map_or_else(String::new, |e| format!("; brightness off most: {}", times(&e)));
    format!("{} of {} paths rejected{energy}", count(bad as f64), count(paths as f64))
}

fn energy(s: &Stability) -> Option<crate::study::Interval> {
    clean(s.energy.as_ref()?)
}

/// The section.
pub fn html(study: &Study) -> String {
    if study.stability.is_empty() {
        let body = missing(study, "Rejected samples and energy were", "stability");
        return section("stability", "7  Stability", &takeaway(study), &body);
    }
    let row = |s: &Stability| {
        let bad: u64 = s.rejected.iter().fold(0, |n, (_, k, _)| n.saturating_add(*k));
        let causes: Vec<String> =
            s.rejected.iter().map(|(cause, n, _)| format!("{cause}: {}", count(*n as f64))).collect();
        let causes = if causes.is_empty() { "—".into() } else { xml(&causes.join(", ")) };
        vec![
            method(&s.method, look(study, &s.method)),
            count(s.paths as f64),
            count(bad as f64),
            format!("<span class=\"text\">{causes}</span>"),
            maybe(s.energy, times),
        ]
    };
    let rows: Vec<_> = study.stability.iter().map(row).collect();
    let heads = heads(&["Method", "paths", "rejected", "by cause", "brightness over the reference's"]);
    let body = table("Stability", &heads, &rows)
        + &replays(study)
        + &note(&format!(
            "Every sample is checked before it is added; one that is not finite is counted by its cause and left out. Brightness is the \
             mean luminance of the picture over that of the reference, with its 90{THIN}% interval; a method that loses or makes light \
             is off from 1."
        ));
    section("stability", "7  Stability", &takeaway(study), &body)
}

fn replays(study: &Study) -> String {
    let all = study.stability.iter().flat_map(|s| s.rejected.iter().map(move |r| (s, r)));
    let one = |(s, (cause, _, replay)): (&Stability, &(String, u64, String))| {
        let shown = if replay.is_empty() { String::new() } else { command(replay) };
        format!("<p>{}, {}:</p>\n{shown}", xml(&s.method), xml(cause))
    };
    let shown: String = all.filter(|(_, r)| r.1 > 0).map(one).collect();
    if shown.is_empty() {
        shown
    } else {
        format!("{}{shown}", heading("Commands that repeat the first of each"))
    }
}

fn look(study: &Study, name: &str) -> Look {
    let all = study.methods.iter().zip(looks(&study.methods));
    let found = all.into_iter().find(|(m, _)| m.name == name).map(|(_, look)| look);
    found.unwrap_or(Look { class: "n0", marker: 0, hollow: true })
}
