//! The page of a scene, assembled from its sections, and the index of all scenes.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::study::Interval;
use crate::study::data::{ReferenceImage, Study};
use crate::study::format::{count, goal, seconds_of, with_unit};
use crate::study::pages::chart::{self, ChartSize, key, shortened, styled};
use crate::study::pages::parts::{command, command_of, list, maybe, table};
use crate::study::pages::sections::{
    answer, convergence, display, effects, numeric, predictions, prices, stability,
};
use crate::study::pages::verdict;

const STYLE: &str = include_str!("style.css");

/// A part of the page: anchor, title in the contents, heading, conclusion in one or two sentences, and body.
struct Part(&'static str, &'static str, &'static str, fn(&Study) -> String, fn(&Study) -> Markup);

const PARTS: [Part; 7] = [
    Part("convergence", "1 Error", "1  How the error falls", convergence::conclusion, convergence::body),
    Part("prices", "2 Time to an error", "2  Time to an error", prices::conclusion, prices::body),
    Part("effects", "3 Effects", "3  Cost of each effect", effects::conclusion, effects::body),
    Part("display", "4 Display", "4  Cost of each display setting", display::conclusion, display::body),
    Part("numeric", "5 Arithmetic", "5  Cost of exact arithmetic", numeric::conclusion, numeric::body),
    Part("predictions", "6 Predictions", "6  Predictions", predictions::conclusion, predictions::body),
    Part("stability", "7 Stability", "7  Stability", stability::conclusion, stability::body),
];

/// Page of a study: a single file without scripts and external resources.
pub fn html(study: &Study) -> String {
    let name = verdict::name(study);
    let body = html! {
        main {
            header { h1 { (name) } p.dim { (subtitle(study)) } }
            (answer::html(study))
            nav { @for Part(id, entry, ..) in &PARTS { a href={ "#" (id) } { (entry) } " " } a href="#origin" { "Machine" } " " }
            @for Part(id, _, title, conclusion, body) in &PARTS {
                section id=(id) { h2 { (title) } p.takeaway { (conclusion(study)) } (body(study)) }
            }
            (origin(study))
        }
    };
    document(&format!("{}: what accuracy costs in time", shortened(&name, 80)), "", body)
}

/// Index page of all scenes: one row each with the answers and a small curve. Each study has the link to its page.
pub fn index(studies: &[(String, &Study)]) -> String {
    let body = html! {
        main.broad {
            header {
                h1 { "What accuracy costs in time" }
                p { (index_summary(studies)) }
                p.dim {
                    "A scene's name links to its page beside this one. If that page is missing, because the repository keeps only this "
                    "one, " code { "tools/study scenes/NAME.xml" } " makes it."
                }
            }
            (times_to_one_percent(studies))
            (legend(studies))
            @for (link, study) in studies { (scene(link, study)) }
        }
    };
    document("What accuracy costs in time", "", body)
}

/// A page with the style of all pages, and `style`, which is its own.
pub fn document(title: &str, style: &str, body: Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en-GB" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(chart::STYLE)) (PreEscaped(style)) }
            }
            body { (body) }
        }
    };
    page.into_string() + "\n"
}

/// Subtitle of the page.
fn subtitle(study: &Study) -> String {
    let m = &study.machine;
    let mut parts = vec!["What accuracy costs in time".to_string()];
    if study.size != [0, 0] {
        parts.push(format!("{} × {} pixels", study.size[0], study.size[1]));
    }
    if !m.cpu.is_empty() {
        let threads = if m.threads == 0 { String::new() } else { format!("{} threads of ", m.threads) };
        parts.push(format!("{threads}{}", m.cpu));
    }
    parts.extend([&m.device, &m.program, &m.date].into_iter().filter(|s| !s.is_empty()).cloned());
    if let Some(seconds) = verdict::shared_seconds(study) {
        parts.push(format!("up to {} per method", seconds_of(seconds)));
    }
    parts.join(" · ")
}

/// Footer: machine, versions, reference, and the command that reproduces the study.
fn origin(study: &Study) -> Markup {
    let m = &study.machine;
    let mut rows = vec![
        ("Scene", study.scene.clone()),
        ("Picture", format!("{} × {} pixels", study.size[0], study.size[1])),
        ("Processor", m.cpu.clone()),
        ("Tracing threads", if m.threads == 0 { String::new() } else { m.threads.to_string() }),
        ("Vulkan device", m.device.clone()),
        ("Driver", m.driver.clone()),
        ("Program", m.program.clone()),
        ("Date", m.date.clone()),
        ("Loading, not in any time", seconds_of(study.load_seconds)),
    ];
    if let Some(r) = &study.reference {
        let own = r.rel_mse.map_or_else(String::new, |e| with_unit(&Interval::exact(e), 1.0, "").main);
        rows.extend([
            ("Reference", r.file.clone()),
            ("… made by", reference_origin(r)),
            ("… its own relMSE", own),
        ]);
    }
    let peers: Vec<&str> = study.methods.iter().filter(|m| m.peer).map(|m| m.name.as_str()).collect();
    rows.extend((!peers.is_empty()).then(|| ("Compared with", peers.join(", "))));
    html! {
        section #origin {
            h2 { "Machine and command" }
            dl { @for (name, value) in &rows { div { dt { (name) } dd { @if value.is_empty() { "unknown" } @else { (value) } } } } }
            @if !study.missing.is_empty() { p { "Requested but not measured yet: " (study.missing.join("; ")) "." } }
            p { "To repeat it, or to continue where it stopped:" }
            (command(&command_of(study)))
        }
    }
}

pub fn reference_origin(r: &ReferenceImage) -> String {
    let samples =
        (r.samples_per_pixel > 0.0).then(|| format!("{} samples per pixel", count(r.samples_per_pixel)));
    let time = (r.seconds > 0.0).then(|| seconds_of(r.seconds));
    [Some(r.made_by.clone()), samples, time].into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// Number of scenes, and on how many each method is recommended.
fn index_summary(studies: &[(String, &Study)]) -> String {
    let scenes = match studies.len() {
        0 => return "No scene has been studied yet.".into(),
        1 => "1 scene".to_string(),
        n => format!("{n} scenes"),
    };
    let mut wins: Vec<(&str, usize)> = Vec::new();
    for recommended in studies.iter().filter_map(|(_, s)| verdict::recommend(s)) {
        match wins.iter_mut().find(|(name, _)| *name == recommended.method.name) {
            Some((_, n)) => *n += 1,
            None => wins.push((&recommended.method.name, 1)),
        }
    }
    wins.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(b.0)));
    let wins: Vec<String> = wins.into_iter().map(|(name, n)| format!("{name} on {n}")).collect();
    let best = if wins.is_empty() { "" } else { &format!(" The method to use is {}.", list(&wins)) };
    format!("{scenes}.{best}")
}

fn times_to_one_percent(studies: &[(String, &Study)]) -> Markup {
    let mut names: Vec<&str> = Vec::new();
    for method in studies.iter().flat_map(|(_, study)| verdict::own(study)) {
        if !names.contains(&method.name.as_str()) {
            names.push(&method.name);
        }
    }
    let first = format!("Time to {}", goal(0.01));
    let heads: Vec<&str> = std::iter::once(&*first).chain(names.iter().copied()).collect();
    let row = |(link, study): &(String, &Study)| {
        let best = verdict::recommend(study).filter(|a| a.error == 0.01).map(|a| a.method.name.as_str());
        let cell = |name: &&str| {
            let method = verdict::own(study).into_iter().find(|m| m.name == *name);
            let price = maybe(method.map(|m| prices::price(m, 0.01)));
            html! { @if best == Some(*name) { b { (price) } } @else { (price) } }
        };
        let name = html! { a href=(link) { (verdict::name(study)) } };
        std::iter::once(name).chain(names.iter().map(cell)).collect()
    };
    let rows: Vec<Vec<Markup>> = studies.iter().map(row).collect();
    table("Time to an error of 1 %, by scene and method", &heads, &rows)
}

fn legend(studies: &[(String, &Study)]) -> Markup {
    let mut seen: Vec<(&str, chart::MethodStyle)> = Vec::new();
    for (method, style) in studies.iter().flat_map(|(_, study)| styled(study)) {
        if !seen.contains(&(&method.name, style)) {
            seen.push((&method.name, style));
        }
    }
    html! {
        @if !seen.is_empty() {
            p.keys.dim { "Relative RMS error against seconds: " @for (name, style) in seen { span { (key(style)) " " (name) } " " } }
        }
    }
}

fn scene(link: &str, study: &Study) -> Markup {
    let curves = convergence::overall(study);
    html! {
        div.scene {
            div { (curves.draw(ChartSize::Thumbnail).inline(curves.label)) }
            div {
                h2 { a href=(link) { (verdict::name(study)) } }
                p.first { (answer::headline(study)) }
                ul {
                    @for reason in answer::reasons(study) { li { (reason) } }
                    @for warning in answer::warnings(study) { li.warn { (warning) } }
                }
            }
        }
    }
}
