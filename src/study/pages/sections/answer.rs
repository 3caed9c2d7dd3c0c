//! The summary box at the top: recommended method, its time, expensive effects, and warnings.

use maud::{Markup, html};

use crate::study::Interval;
use crate::study::data::Study;
use crate::study::format::{THIN, count, factor, goal, seconds, seconds_of};
use crate::study::pages::parts::list;
use crate::study::pages::verdict::{self, Recommendation};

/// Numbers of machines whose times are listed.
const MACHINES: [u32; 2] = [4, 16];

/// The first sentence: `Use path: 95 % of the picture is within 5 % after about 42 s (90 %: 36–55) and within 1 % after about 12 min
/// (90 %: 9–16).`
pub fn headline(study: &Study) -> String {
    let Some(a) = verdict::recommend(study) else {
        return match study.methods.is_empty() {
            true => "Nothing has been measured yet.".into(),
            false => "Nothing tells how long any method takes.".into(),
        };
    };
    let within = |error: f64, seconds: &Interval, measured: bool| {
        let about = if measured { "" } else { "about " };
        format!("within {} after {about}{}", goal(error), self::seconds(seconds).prose())
    };
    let first = verdict::price(a.method, PREVIEW).filter(|_| a.error < PREVIEW);
    let first =
        first.map(|(price, time)| within(PREVIEW, &time, price.measured) + " and ").unwrap_or_default();
    let last = within(a.error, &a.seconds, a.measured);
    format!("Use {}: 95{THIN}% of the picture is {first}{last}.", a.method.name)
}

/// Error target of a preview.
const PREVIEW: f64 = 0.05;

/// Reasons below the headline, one sentence each.
pub fn reasons(study: &Study) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(a) = verdict::recommend(study) {
        lines.extend(on_machines(study, &a));
        lines.extend(dearest_effect(study, &a));
        lines.extend(runner_up(&a));
        if a.error > 0.0101 {
            let (wanted, reached) = (goal(0.01), goal(a.error));
            lines.push(format!(
                "Nothing tells when {wanted} is reached; the smallest error with a time is {reached}."
            ));
        }
        lines.extend(other_program(&a));
        lines.extend(faster_preview(study, &a));
        lines.extend(auto(study, &a));
    }
    lines
}

/// The time on several machines.
fn on_machines(study: &Study, a: &Recommendation) -> Option<String> {
    let time = |n: u32| format!("{} on {n}", seconds(&study.farm.on(n, a.seconds)).main);
    let worth = study.farm.on(MACHINES[0], a.seconds).value < a.seconds.value;
    let times: Vec<String> = MACHINES.into_iter().map(time).collect();
    let whole = "with scene and merging";
    worth.then(|| format!("On machines such as this one, {} takes {}, {whole}.", goal(a.error), list(&times)))
}

/// The effect that costs most: `Without wavelengths, paths would take 37 % less time.`
pub fn dearest_effect(study: &Study, a: &Recommendation) -> Option<String> {
    let (effect, time) = verdict::most_expensive_effect(study)?;
    let saved = 1.0 - 1.0 / time.value;
    let what =
        if a.method.name == "path" { "paths".to_string() } else { format!("paths by {}", a.method.name) };
    (saved > 0.005)
        .then(|| format!("Without {}, {what} would take {:.0}{THIN}% less time.", effect.name, 100.0 * saved))
}

/// The method that `auto` would choose.
fn auto(study: &Study, a: &Recommendation) -> Option<String> {
    let auto = study.auto.as_ref()?;
    let trial = seconds_of(auto.seconds);
    let method = &auto.method;
    if *method == a.method.name {
        return Some(format!("--integrator auto takes it, too, after a trial of {trial}."));
    }
    let theirs = verdict::own(study).into_iter().find(|m| m.name == *method);
    let ratio = theirs.and_then(|m| verdict::price(m, a.error)).and_then(|(_, time)| time.ratio(&a.seconds));
    let ratio = ratio.map_or_else(String::new, |r| format!(", which takes {} as long", factor(&r).prose()));
    Some(format!("--integrator auto takes {method} after a trial of {trial}{ratio}."))
}

fn runner_up(a: &Recommendation) -> Option<String> {
    let (method, ratio) = a.second.as_ref()?;
    let name = &method.name;
    Some(match ratio {
        Some(ratio) => format!("Runner-up: {name} takes {} as long{}.", factor(ratio).prose(), judged(ratio)),
        None => format!("Runner-up: {name}; nothing tells when it reaches {}.", goal(a.error)),
    })
}

fn other_program(a: &Recommendation) -> Option<String> {
    let (method, ratio) = a.peer.as_ref()?;
    let what = if verdict::price(method, a.error).is_some() { "" } else { " for the same relMSE" };
    Some(format!("{} takes {} as long{what}{}.", method.name, factor(ratio).prose(), judged(ratio)))
}

/// Interprets a ratio of times that may be 1.
fn judged(ratio: &Interval) -> &'static str {
    if ratio.holds(1.0) { ", which is no measurable difference" } else { "" }
}

/// A method that is faster at the largest error, for a preview.
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
    let (bad, paths) = verdict::rejected(study);
    if bad > 0 {
        let [bad, paths] = [bad, paths].map(|n| count(n as f64));
        lines.push(format!("{bad} of {paths} paths gave samples that are not finite."));
    }
    for s in study.stability.iter().filter(|s| s.alarm) {
        let ratio = s.energy.as_ref().map_or_else(String::new, |energy| factor(energy).prose());
        lines.push(format!(
            "{}: the picture's mean brightness is {ratio} that of the other unbiased methods; one of them is wrong.",
            s.method
        ));
    }
    for dropped in &study.dropped {
        lines.push(format!("{} {}; not measured further.", dropped.method, dropped.reason));
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
