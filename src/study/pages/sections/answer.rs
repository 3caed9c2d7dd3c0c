//! The box at the top: the method to use, how long it takes, what is expensive, what to watch out for.

use maud::{Markup, html};

use crate::study::Interval;
use crate::study::data::Study;
use crate::study::format::{THIN, count, factor, goal, increase, percent_of, seconds};
use crate::study::pages::parts::list;
use crate::study::pages::verdict::{self, Recommendation};

/// The error of a reference above which the reader is warned.
const ROUGH_REFERENCE: f64 = 0.02;

/// The first sentence: `Use path: 95 % of the picture is within 1 % after about 42 s (90 %: 36–55).`
pub fn headline(study: &Study) -> String {
    match verdict::recommend(study) {
        Some(a) => format!(
            "Use {}: 95{THIN}% of the picture is within {} after {}{}.",
            a.method.name,
            goal(a.error),
            if a.measured { "" } else { "about " },
            seconds(&a.seconds).prose()
        ),
        None if study.methods.is_empty() => "Nothing has been measured yet.".into(),
        None => "The measurements do not reach far enough to recommend a method.".into(),
    }
}

/// The reasons below it, one sentence each.
pub fn reasons(study: &Study) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(a) = verdict::recommend(study) {
        if a.error > 0.0101 {
            let (wanted, reached) = (goal(0.01), goal(a.error));
            lines.push(format!(
                "No curve reaches {wanted}; the smallest error that one reaches is {reached}."
            ));
        }
        if !a.measured {
            lines.push("This time is extrapolated from the curve, not measured.".into());
        }
        lines.extend(runner_up(&a));
        lines.extend(other_program(&a));
        lines.extend(faster_preview(study, &a));
    }
    if let Some((effect, time)) = verdict::most_expensive_effect(study) {
        let time = increase(&time).prose();
        lines.push(format!("Most expensive effect: {}, {time} time per path.", effect.name));
    }
    lines
}

fn runner_up(a: &Recommendation) -> Option<String> {
    let (method, ratio) = a.second.as_ref()?;
    let name = &method.name;
    Some(match ratio {
        Some(ratio) => format!("Runner-up: {name} takes {} as long{}.", factor(ratio).prose(), judged(ratio)),
        None => format!("Runner-up: {name}, whose curve does not reach {}.", goal(a.error)),
    })
}

fn other_program(a: &Recommendation) -> Option<String> {
    let (method, ratio) = a.peer.as_ref()?;
    let what = if verdict::price(method, a.error).is_some() { "" } else { " for the same relMSE" };
    Some(format!("{} takes {} as long{what}{}.", method.name, factor(ratio).prose(), judged(ratio)))
}

/// What a ratio of times that may be 1 means.
fn judged(ratio: &Interval) -> &'static str {
    if ratio.holds(1.0) { ", which is no measurable difference" } else { "" }
}

/// Another method that is faster at the largest error, for a preview.
fn faster_preview(study: &Study, a: &Recommendation) -> Option<String> {
    let error = *verdict::errors(&study.methods).first()?;
    let (method, found) = verdict::ranked(&verdict::own(study), error).into_iter().next()?;
    let (_, time) = found?;
    let surely =
        verdict::price(a.method, error).is_none_or(|(_, t)| t.ratio(&time).is_some_and(|r| r.low > 1.0));
    (method.name != a.method.name && surely)
        .then(|| format!("For a preview at {}, {} is faster: {}.", goal(error), method.name, seconds(&time)))
}

pub fn warnings(study: &Study) -> Vec<String> {
    let mut lines = Vec::new();
    for m in &study.methods {
        lines.extend(verdict::flags(m).iter().map(|flag| format!("{}: {flag}.", m.name)));
    }
    if let Some(own) = study.reference.as_ref().map(|r| r.relative[1]).filter(|own| *own > ROUGH_REFERENCE) {
        lines.push(format!(
            "The reference is itself only within {} at 95{THIN}% of the picture, so smaller errors cannot be measured. A larger --budget \
             makes a better one; --against takes one from a file.",
            percent_of(own)
        ));
    }
    let (bad, paths) = verdict::rejected(study);
    if bad > 0 {
        let [bad, paths] = [bad, paths].map(|n| count(n as f64));
        lines.push(format!("{bad} of {paths} paths gave samples that are not finite."));
    }
    for s in &study.stability {
        let off = |e: &Interval| !e.holds(1.0) && (e.value - 1.0).abs() > 0.01;
        if let Some(energy) = s.energy.filter(off) {
            let ratio = factor(&energy).prose();
            lines.push(format!("{}: the picture's mean brightness is {ratio} the reference's.", s.method));
        }
    }
    if !study.missing.is_empty() {
        lines.push(format!("Not measured yet: {}.", list(&study.missing)));
    }
    lines
}

pub fn html(study: &Study) -> Markup {
    let warnings = warnings(study);
    html! {
        div.answer #answer {
            p.headline { (headline(study)) }
            ul { @for reason in reasons(study) { li { (reason) } } }
            @if !warnings.is_empty() {
                div.caveats { h2 { "Watch out" } ul { @for warning in warnings { li { (warning) } } } }
            }
        }
    }
}
