//! Building blocks of sections: headings, numbers, tables, notes.

use maud::{Markup, Render, html};

use crate::study::data::Study;
use crate::study::format::FormattedInterval;
use crate::study::pages::chart::{BarChart, ChartSize, CurveChart, Drawing, MethodStyle, key, shortened};

/// A bar chart with its caption.
pub fn bars(chart: &BarChart, caption: &str) -> Markup {
    html! { figure { (drawings(&chart.label, caption, |size| chart.draw(size))) } }
}

/// A curve chart with its caption; empty if there are no curves.
pub fn curves(chart: &CurveChart, caption: &str) -> Markup {
    html! {
        @if !chart.is_empty() {
            figure { (drawings(chart.label, caption, |size| chart.draw(size))) }
        }
    }
}

/// The wide and narrow drawing of a chart, of which the fitting one is shown, with its caption.
fn drawings(label: &str, caption: &str, draw: impl Fn(ChartSize) -> Drawing) -> Markup {
    html! {
        (draw(ChartSize::Wide).inline(label))
        (draw(ChartSize::Narrow).inline(label))
        figcaption { (caption) }
    }
}

/// A table column: heading, and function that makes the cell of an item.
pub type Column<'a, T> = (&'a str, &'a dyn Fn(&T) -> Markup);

/// A table with one row per item.
pub fn listing<T>(label: &str, items: &[T], columns: &[Column<'_, T>]) -> Markup {
    let heads: Vec<&str> = columns.iter().map(|(head, _)| *head).collect();
    let row = |item: &T| columns.iter().map(|(_, cell)| cell(item)).collect();
    table(label, &heads, &items.iter().map(row).collect::<Vec<_>>())
}

/// A table whose first column names the rows; scrolls horizontally if too wide.
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

/// A text cell, which may wrap.
pub fn words(text: &str) -> Markup {
    html! { span.text { (text) } }
}

/// The name of a method with its marker.
pub fn method(name: &str, style: MethodStyle) -> Markup {
    html! { (key(style)) "\u{a0}" (shortened(name, 60)) }
}

/// A collapsible note on how something was measured.
pub fn note(text: &str) -> Markup {
    details("How this was measured", html! { p { (text) } })
}

pub fn details(summary: &str, body: Markup) -> Markup {
    html! { details { summary { (summary) } (body) } }
}

/// A command to copy: one click selects all of it.
pub fn command(text: &str) -> Markup {
    html! { pre { code { (text) } } }
}

/// An embedded picture: `data:image/…;base64,…`, and nothing that would be fetched or executed.
pub fn embedded(uri: Option<&str>) -> Option<&str> {
    let harmless = |c: char| c.is_ascii_alphanumeric() || "+/=;,-.".contains(c);
    uri.filter(|uri| uri.strip_prefix("data:image/").is_some_and(|data| data.chars().all(harmless)))
}

/// Pictures stacked vertically with a caption.
pub fn pictures(all: &[(&str, String)], caption: &Markup) -> Markup {
    html! { figure { @for (uri, alt) in all { img src=(uri) alt=(alt); } figcaption { (caption) } } }
}

/// Placeholder for a missing part, with the command that measures it.
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

/// Command that reproduces the study.
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
