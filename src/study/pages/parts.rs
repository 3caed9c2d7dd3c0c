//! The parts of every section: headings, numbers, tables, notes.

use maud::{Markup, Render, html};

use crate::study::data::Study;
use crate::study::format::FormattedInterval;
use crate::study::pages::chart::{BarChart, ChartSize, CurveChart, Drawing, MethodStyle, key, shortened};

/// Rows of bars with their caption.
pub fn bars(chart: &BarChart, caption: &str) -> Markup {
    html! { figure { (drawings(&chart.label, caption, |size| chart.draw(size))) } }
}

/// Curves with their caption; nothing if there are none.
pub fn curves(chart: &CurveChart, caption: &str) -> Markup {
    html! {
        @if !chart.is_empty() {
            figure data-curves { (chart.json()) (drawings(chart.label, caption, |size| chart.draw(size))) }
        }
    }
}

/// The drawings of a chart, of which the one that fits the screen is shown, and its caption.
fn drawings(label: &str, caption: &str, draw: impl Fn(ChartSize) -> Drawing) -> Markup {
    html! {
        (draw(ChartSize::Wide).inline(label))
        (draw(ChartSize::Narrow).inline(label))
        figcaption { (caption) }
    }
}

/// A column of a table: its heading, and the cell that it makes of an item.
pub type Column<'a, T> = (&'a str, &'a dyn Fn(&T) -> Markup);

/// A table of one row for each item, by columns.
pub fn listing<T>(label: &str, items: &[T], columns: &[Column<'_, T>]) -> Markup {
    let heads: Vec<&str> = columns.iter().map(|(head, _)| *head).collect();
    let row = |item: &T| columns.iter().map(|(_, cell)| cell(item)).collect();
    table(label, &heads, &items.iter().map(row).collect::<Vec<_>>())
}

/// A table whose first column names the rows; it scrolls within itself where it is too wide.
pub fn table<H: AsRef<str>>(label: &str, heads: &[H], rows: &[Vec<Markup>]) -> Markup {
    html! {
        @if !rows.is_empty() {
            div.scroll tabindex="0" role="region" aria-label=(label) {
                table {
                    thead { tr { @for head in heads { th scope="col" { (head.as_ref()) } } } }
                    tbody {
                        @for row in rows {
                            tr {
                                th scope="row" { (row[0]) }
                                @for cell in &row[1..] { td { (cell) } }
                            }
                        }
                    }
                }
            }
        }
    }
}

impl Render for FormattedInterval {
    fn render(&self) -> Markup {
        html! { (self.main) @if let Some(range) = &self.range { " " small { (range) } } }
    }
}

pub fn cell(content: impl Render) -> Markup {
    content.render()
}

pub fn maybe(content: Option<impl Render>) -> Markup {
    content.map_or_else(|| cell("—"), cell)
}

/// A cell of words, which may wrap.
pub fn words(text: &str) -> Markup {
    html! { span.text { (text) } }
}

/// The name of a method with its marker.
pub fn method(name: &str, style: MethodStyle) -> Markup {
    html! { (key(style)) "\u{a0}" (shortened(name, 60)) }
}

/// Explains how something was measured; it opens on demand.
pub fn note(text: &str) -> Markup {
    details("How this was measured", html! { p { (text) } })
}

pub fn details(summary: &str, body: Markup) -> Markup {
    html! { details { summary { (summary) } (body) } }
}

/// A command to copy: a click selects all of it.
pub fn command(text: &str) -> Markup {
    html! { pre { code { (text) } } }
}

/// A picture that is in the page itself: `data:image/…;base64,…`, and nothing that would be fetched or run.
pub fn embedded(uri: Option<&str>) -> Option<&str> {
    let harmless = |c: char| c.is_ascii_alphanumeric() || "+/=;,-.".contains(c);
    uri.filter(|uri| uri.strip_prefix("data:image/").is_some_and(|data| data.chars().all(harmless)))
}

/// Pictures above one another with a caption.
pub fn pictures(all: &[(&str, String)], caption: &Markup) -> Markup {
    html! { figure { @for (uri, alt) in all { img src=(uri) alt=(alt); } figcaption { (caption) } } }
}

/// Stands in the place of a part that is missing, with the command that measures it.
pub fn missing(study: &Study, what: &str, part: &str) -> Markup {
    let asked: Vec<&str> = study.missing.iter().map(String::as_str).filter(|m| m.contains(part)).collect();
    html! {
        div.absent {
            p {
                @if asked.is_empty() { (what) " not measured." } @else { (what) " requested but not finished (" (asked.join("; ")) ")." }
                " The same command continues where it stopped and adds what is missing:"
            }
            (command(&command_of(study)))
        }
    }
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
