//! The box at the top: which method, how long, what is dearest, what to be wary of.

use crate::study::Interval;
use crate::study::data::Study;
use crate::study::pages::escape::xml;
use crate::study::pages::number::{THIN, count, extra, goal, percent, seconds, times};
use crate::study::pages::parts::list;
use crate::study::pages::verdict::{self, Answer};

/// A reference with a larger error is worth a word.
const ROUGH: f64 = 0.02;

/// The first sentence: `Use path: 1 % at 95 % of the picture in about 42 s (90 %: 36–55).`
pub fn headline(study: &Study) -> String {
    match verdict::answer(study) {
        Some(a) => {
            let how = if a.measured { "in" } else { "in about" };
            let (error, time) = (goal(a.error), seconds(&a.seconds).prose());
            format!("Use {}: {error} at 95{THIN}% of the picture {how} {time}.", a.method.name)
        }
        None if study.methods.is_empty() => "Nothing has been measured yet.".into(),
        None => "The measurements do not reach far enough to name a method.".into(),
    }
}

/// What stands below it, one sentence each.
pub fn reasons(study: &Study) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(a) = verdict::answer(study) {
        if a.error > 0.0101 {
            let (error, one) = (goal(a.error), goal(0.01));
            lines.push(format!(
                "No curve tells when {one} is reached; {error} is the least error that one does."
            ));
        }
        if !a.measured {
            lines.push("This time was not measured: the curve was drawn further.".into());
        }
        lines.extend(second(&a));
        lines.extend(peer(&a));
        lines.extend(sooner(study, &a));
    }
    if let Some((effect, time)) = verdict::dearest(study) {
        let share = extra(&time).prose();
        lines.push(format!("Dearest effect: {}, {share} time per path.", effect.name));
    }
    lines
}

fn second(a: &Answer) -> Option<String> {
    let (method, ratio) = a.second.as_ref()?;
    Some(match ratio {
        Some(r) if r.holds(1.0) => {
            format!(
                "Runner-up: {}, {} of its time: no difference that these measurements show.",
                method.name,
                times(r).prose()
            )
        }
        Some(r) => format!("Runner-up: {}, {} of its time.", method.name, times(r).prose()),
        None => format!(
            "Runner-up: {}, whose curve does not tell when it gets to {}.",
            method.name,
            goal(a.error)
        ),
    })
}

fn peer(a: &Answer) -> Option<String> {
    let (method, ratio) = a.peer.as_ref()?;
    let time = format!("{} of its time", times(ratio).prose());
    let what = if verdict::price(method, a.error).is_some() { "" } else { " for the same relMSE" };
    Some(match ratio {
        r if r.holds(1.0) => format!("{} is about as fast: {time}{what}.", method.name),
        r if r.value < 1.0 => format!("{} is faster: {time}{what}.", method.name),
        _ => format!("{} needs {time}{what}.", method.name),
    })
}

/// Another method that is sooner at the largest error, for a first look.
fn sooner(study: &Study, a: &Answer) -> Option<String> {
    let first = *verdict::errors(&study.methods).first()?;
    let own: Vec<_> = study.methods.iter().filter(|m| !m.peer).collect();
    let (method, found) = verdict::ranked(&own, first).into_iter().next()?;
    let (_, time) = found?;
    let surely = verdict::price(a.method, first)
        .is_none_or(|(_, t)| verdict::ratio(&t, &time).is_some_and(|r| r.low > 1.0));
    (method.name != a.method.name && surely)
        .then(|| format!("For {} already, {} is sooner: {}.", goal(first), method.name, seconds(&time)))
}

/// What to be wary of.
pub fn caveats(study: &Study) -> Vec<String> {
    let mut lines: Vec<String> =
        verdict::flags(study).into_iter().map(|(method, flag)| format!("{method}: {flag}.")).collect();
    let unflagged = |m: &&crate::study::data::Method| verdict::flat(m) && m.flags.is_empty();
    for method in study.methods.iter().filter(unflagged) {
        lines.push(format!("{}: slope flatter than −0.4: heavy tail or bias.", method.name));
    }
    if let Some(own) = study.reference.as_ref().map(|r| r.relative[1]).filter(|own| *own > ROUGH) {
        lines.push(format!(
            "The reference itself is within {} at 95{THIN}% of the picture: no smaller error is measured; --budget makes a longer one, \
             --against takes another.",
            percent(&Interval::exact(own)).main
        ));
    }
    let (bad, paths) = verdict::rejected(study);
    if bad > 0 {
        lines.push(format!(
            "{} of {} paths gave samples that are not finite.",
            count(bad as f64),
            count(paths as f64)
        ));
    }
    for s in &study.stability {
        if s.energy.as_ref().is_some_and(|e| !e.holds(1.0) && (e.value - 1.0).abs() > 0.01) {
            let energy = s.energy.unwrap_or(Interval::exact(1.0));
            lines.push(format!(
                "{}: mean brightness {} of the reference's.",
                s.method,
                times(&energy).prose()
            ));
        }
    }
    if !study.missing.is_empty() {
        lines.push(format!("Not there yet: {}.", list(&study.missing)));
    }
    lines
}

/// The box.
pub fn html(study: &Study) -> String {
    let items =
        |lines: Vec<String>| -> String { lines.iter().map(|l| format!("<li>{}</li>\n", xml(l))).collect() };
    let (reasons, caveats) = (items(reasons(study)), items(caveats(study)));
    let reasons = if reasons.is_empty() { reasons } else { format!("<ul>\n{reasons}</ul>\n") };
    let caveats = if caveats.is_empty() {
        caveats
    } else {
        format!("<div class=\"caveats\"><h2>To be wary of</h2><ul>\n{caveats}</ul></div>\n")
    };
    format!(
        "<div class=\"answer\" id=\"answer\">\n<p class=\"headline\">{}</p>\n{reasons}{caveats}</div>\n",
        xml(&headline(study))
    )
}
