//! What every section is made of: headings, figures, tables, notes. All of it is XML as well as HTML.

use crate::study::data::Study;
use crate::study::pages::escape::{short, xml};
use crate::study::pages::number::Figure;
use crate::study::pages::plot::{Look, Size, Svg};

/// A section: heading, the one sentence to take away, and the rest, which is HTML already.
pub fn section(id: &str, title: &str, takeaway: &str, body: &str) -> String {
    format!(
        "<section id=\"{id}\">\n<h2>{}</h2>\n<p class=\"takeaway\">{}</p>\n{body}</section>\n",
        xml(title),
        xml(takeaway)
    )
}

/// A heading within a section.
pub fn heading(text: &str) -> String {
    format!("<h3>{}</h3>\n", xml(text))
}

/// A paragraph.
pub fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", xml(text))
}

/// A plot with its caption, in the width that fits the screen.
pub fn plot(label: &str, caption: &str, draw: impl Fn(Size) -> Svg) -> String {
    format!(
        "<figure><div class=\"wide\">{}</div><div class=\"narrow\">{}</div>\n<figcaption>{}</figcaption></figure>\n",
        draw(Size::Wide).inline(label),
        draw(Size::Narrow).inline(label),
        xml(caption)
    )
}

/// A table; heads are text, cells are HTML, the first of a row names it. It scrolls within itself where it is too wide.
pub fn table(label: &str, heads: &[String], rows: &[Vec<String>]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let head: String = heads.iter().map(|h| format!("<th scope=\"col\">{}</th>", xml(h))).collect();
    let row = |cells: &Vec<String>| {
        let tag = |(i, c): (usize, &String)| match i {
            0 => format!("<th scope=\"row\">{c}</th>"),
            _ => format!("<td>{c}</td>"),
        };
        format!("<tr>{}</tr>\n", cells.iter().enumerate().map(tag).collect::<String>())
    };
    let body: String = rows.iter().map(row).collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{}\"><table><thead><tr>{head}</tr></thead>\n\
         <tbody>\n{body}</tbody></table></div>\n",
        xml(label)
    )
}

/// Heads of a table.
pub fn heads(names: &[&str]) -> Vec<String> {
    names.iter().map(|n| (*n).to_string()).collect()
}

/// A figure as a cell: the interval small below.
pub fn cell(figure: &Figure) -> String {
    match &figure.range {
        Some(range) => format!("{} <small>{}</small>", xml(&figure.main), xml(range)),
        None => xml(&figure.main),
    }
}

/// The cell of a figure that may not be there.
pub fn maybe<T>(figure: Option<T>, show: impl Fn(&T) -> Figure) -> String {
    figure.as_ref().map_or_else(|| "—".into(), |f| cell(&show(f)))
}

/// A method's name with its marker.
pub fn method(name: &str, look: Look) -> String {
    format!("{}\u{a0}{}", key(look), xml(&short(name, 60)))
}

/// The marker alone.
pub fn key(look: Look) -> String {
    let mut svg = Svg::new(Size::Thumb, 14.0);
    svg.open(look.class, "");
    svg.marker(look.marker, [7.0, 7.0], 5.0, look.hollow);
    svg.close();
    svg.inline("")
        .replace("viewBox=\"0 0 240 14\"", "viewBox=\"0 0 14 14\"")
        .replace("plot small", "plot key")
}

/// A note that opens: how something was measured.
pub fn note(text: &str) -> String {
    format!("<details><summary>How this was measured</summary><p>{}</p></details>\n", xml(text))
}

/// More of it, that opens.
pub fn more(summary: &str, html: &str) -> String {
    if html.is_empty() {
        return String::new();
    }
    format!("<details><summary>{}</summary>{html}</details>\n", xml(summary))
}

/// A command to copy: a click selects all of it.
pub fn command(text: &str) -> String {
    format!("<pre><code>{}</code></pre>\n", xml(text))
}

/// What stands in the place of a part that is not there, and what to run to get it.
pub fn missing(study: &Study, what: &str, part: &str) -> String {
    let asked: Vec<&str> = study.missing.iter().map(String::as_str).filter(|m| m.contains(part)).collect();
    let why = match asked.as_slice() {
        [] => format!("{what} not measured in this run."),
        names => format!("{what} asked for and not finished ({}).", names.join("; ")),
    };
    format!(
        "<div class=\"absent\"><p>{} The same command goes on where it stopped and adds what is missing:</p>\n{}</div>\n",
        xml(&why),
        command(&command_of(study))
    )
}

/// The command that repeats the study.
pub fn command_of(study: &Study) -> String {
    match (study.command.trim(), study.scene.trim()) {
        ("", "") => "pointillist study SCENE.xml".into(),
        ("", scene) => format!("pointillist study {scene}"),
        (command, _) => command.into(),
    }
}

/// `a`, `a and b`, `a, b and c`.
pub fn list(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// With a capital at its beginning.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |c| c.to_uppercase().chain(letters).collect())
}
