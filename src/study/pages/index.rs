//! The page of all scenes: one row each with the answers and a small curve.

use crate::study::data::Study;
use crate::study::pages::escape::xml;
use crate::study::pages::html::page;
use crate::study::pages::number::goal;
use crate::study::pages::parts::{key, list, table};
use crate::study::pages::plot::{Size, looks};
use crate::study::pages::sections::{answer, curves, prices};
use crate::study::pages::verdict;

/// The page of all scenes. A study comes with the link to its own page, relative to this one.
pub fn index(studies: &[(String, &Study)]) -> String {
    let rows: String = studies.iter().map(|(link, study)| scene(link, study)).collect();
    let body = format!(
        "<header>\n<h1>What accuracy costs in time</h1>\n<p>{}</p>\n</header>\n{}<p class=\"keys dim\">{}</p>\n{rows}",
        xml(&summary(studies)),
        times(studies),
        legend(studies)
    );
    page("What accuracy costs in time", &body).replacen("<main>", "<main class=\"broad\">", 1)
}

/// How many scenes, and how many each method is the one to use on.
fn summary(studies: &[(String, &Study)]) -> String {
    let mut wins: Vec<(&str, usize)> = Vec::new();
    for answer in studies.iter().filter_map(|(_, s)| verdict::answer(s)) {
        match wins.iter_mut().find(|(name, _)| *name == answer.method.name) {
            Some((_, n)) => *n += 1,
            None => wins.push((&answer.method.name, 1)),
        }
    }
    wins.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(b.0)));
    let wins: Vec<String> = wins.into_iter().map(|(name, n)| format!("{name} on {n}")).collect();
    let scenes = match studies.len() {
        0 => return "No scene has been studied yet.".into(),
        1 => "1 scene".to_string(),
        n => format!("{n} scenes"),
    };
    if wins.is_empty() {
        format!("{scenes}.")
    } else {
        format!("{scenes}. The method to use is {}.", list(&wins))
    }
}

/// Names of the program's own methods, in the order in which they come up.
fn methods<'a>(studies: &[(String, &'a Study)]) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for method in studies.iter().flat_map(|(_, s)| &s.methods).filter(|m| !m.peer) {
        if !names.contains(&method.name.as_str()) {
            names.push(&method.name);
        }
    }
    names
}

/// Time to 1 % by scene and method.
fn times(studies: &[(String, &Study)]) -> String {
    let names = methods(studies);
    let mut heads = vec![format!("Time to {}", goal(0.01))];
    heads.extend(names.iter().map(|n| (*n).to_string()));
    let row = |(link, study): &(String, &Study)| {
        let best = verdict::answer(study).filter(|a| a.error == 0.01).map(|a| a.method.name.clone());
        let mut cells = vec![format!("<a href=\"{}\">{}</a>", xml(link), xml(&verdict::name(study)))];
        cells.extend(names.iter().map(|name| {
            let method = study.methods.iter().find(|m| !m.peer && m.name == *name);
            let cell = method.map_or_else(|| "—".into(), |m| prices::price(m, 0.01));
            if best.as_deref() == Some(*name) { format!("<b>{cell}</b>") } else { cell }
        }));
        cells
    };
    let rows: Vec<_> = studies.iter().map(row).collect();
    table("Time to an error of 1 %, by scene and method", &heads, &rows)
}

fn legend(studies: &[(String, &Study)]) -> String {
    let mut seen: Vec<String> = Vec::new();
    for (_, study) in studies {
        for (method, look) in study.methods.iter().zip(looks(&study.methods)) {
            let entry = format!("<span>{} {}</span>", key(look), xml(&method.name));
            if !seen.contains(&entry) {
                seen.push(entry);
            }
        }
    }
    if seen.is_empty() {
        String::new()
    } else {
        format!("Relative RMS error against seconds: {}", seen.join(" "))
    }
}

fn scene(link: &str, study: &Study) -> String {
    let lines = curves::overall(study);
    let svg = lines
        .draw(Size::Thumb)
        .inline(&lines.label)
        .replace("class=\"plot small\"", "class=\"plot small thumb\"");
    let item = |class: &str, text: &str| format!("<li{class}>{}</li>\n", xml(text));
    let mut items: String = answer::reasons(study).iter().map(|r| item("", r)).collect();
    items += &answer::caveats(study).iter().map(|c| item(" class=\"warn\"", c)).collect::<String>();
    let items = if items.is_empty() { items } else { format!("<ul>\n{items}</ul>\n") };
    format!(
        "<div class=\"scene\"><div>{svg}</div>\n<div><h2><a href=\"{}\">{}</a></h2>\n<p class=\"first\">{}</p>\n{items}</div></div>\n",
        xml(link),
        xml(&verdict::name(study)),
        xml(&answer::headline(study))
    )
}
