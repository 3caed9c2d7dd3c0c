//! The documentation of plugins as plain text and as Markdown.

use pointillist::scene::UNSUPPORTED;

use super::{ParameterDoc, PluginDoc, PluginKind};

/// If at least this fraction of a kind's plugins have a parameter, the Markdown states it once for the kind.
const COMMON: f64 = 0.6;

/// The plain text: a section for each kind, then the plugins that are not supported, with an empty line between.
pub(super) fn plain(kinds: &[PluginKind]) -> String {
    let row = |(kind, name, why): &(&str, &str, &str)| format!("  {:26} {why}\n", format!("{kind} {name}"));
    let rows: String = UNSUPPORTED.iter().map(row).collect();
    format!("{}not supported\n{rows}", kinds.iter().map(section).collect::<String>())
}

/// The Markdown: a table for each kind, then one of the plugins that are not supported.
pub(super) fn markdown(kinds: &[PluginKind]) -> String {
    let row = |(kind, name, why): &(&str, &str, &str)| format!("| {kind} `{name}` | {why} |\n");
    let rows: String = UNSUPPORTED.iter().map(row).collect();
    let tables: String = kinds.iter().map(table).collect();
    format!("{tables}### Not supported\n\n| plugin of Mitsuba 3.9 | because |\n|---|---|\n{rows}")
}

/// Formats a kind for the terminal: one line per parameter of each plugin.
fn section(kind: &PluginKind) -> String {
    let plugin = |PluginDoc { name, note, parameters, .. }: &PluginDoc| {
        let note = if note.is_empty() { String::new() } else { format!("  — {note}") };
        let (idle, used): (Vec<_>, Vec<_>) = parameters.iter().partition(|p| p.idle);
        let mut lines = format!("  {name}{note}\n");
        used.iter().for_each(|p| lines += &format!("      {:26} {}\n", label(p), about(p)));
        if !idle.is_empty() {
            let names: Vec<&str> = idle.iter().map(|p| p.name).collect();
            lines += &format!("      without effect: {}\n", names.join(", "));
        }
        lines
    };
    let note = if kind.note.is_empty() { String::new() } else { format!("  — {}\n", kind.note) };
    format!("{}\n{note}{}\n", kind.name, kind.plugins.iter().map(plugin).collect::<String>())
}

/// Name of a parameter, or in angle brackets the nested element.
fn label(parameter: &ParameterDoc) -> String {
    if parameter.nested { format!("<{}>", parameter.name) } else { parameter.name.to_owned() }
}

/// Type and default of a parameter.
fn about(ParameterDoc { value, default, required, .. }: &ParameterDoc) -> String {
    let default = default.as_ref().filter(|d| !d.is_empty());
    let default = if *required { Some("required".to_owned()) } else { default.map(|d| format!("= {d}")) };
    [Some(value.clone()).filter(|v| !v.is_empty()), default]
        .into_iter()
        .flatten()
        .collect::<Vec<_>>()
        .join(" ")
}

/// Formats a kind as Markdown: common parameters, then a table in which plugins with the same parameters share a row.
fn table(kind: &PluginKind) -> String {
    let most = kind.plugins.len() as f64 * COMMON;
    let have = |p: &ParameterDoc| kind.plugins.iter().filter(|plugin| plugin.parameters.contains(p)).count();
    let mut common: Vec<&ParameterDoc> = Vec::new();
    for parameter in kind.plugins.iter().flat_map(|plugin| &plugin.parameters) {
        if kind.plugins.len() > 2 && have(parameter) as f64 >= most && !common.contains(&parameter) {
            common.push(parameter);
        }
    }
    let mut text = format!("### {}\n\n", kind.name);
    if !kind.note.is_empty() {
        text += &format!("{}\n\n", kind.note);
    }
    // Parameters lacking in the same plugins are stated together.
    let lack = |p: &ParameterDoc| -> Vec<&str> {
        let without = kind.plugins.iter().filter(|plugin| !plugin.parameters.contains(p));
        without.map(|plugin| plugin.name).collect()
    };
    while let Some(first) = common.first() {
        let without = lack(first);
        let (together, rest): (Vec<_>, Vec<_>) = common.iter().partition(|p| lack(p) == without);
        let all = if without.is_empty() { "All".into() } else { format!("All but {}", code(&without, " ")) };
        text += &format!("{all}: {}.\n\n", cell(&together));
        common = rest;
    }
    text += "| plugin | parameters | remarks |\n|---|---|---|\n";
    let own = |plugin: &PluginDoc| {
        let own = plugin.parameters.iter().filter(|p| kind.plugins.len() < 3 || (have(p) as f64) < most);
        cell(&own.collect::<Vec<_>>())
    };
    let mut rows: Vec<(Vec<&str>, String, &str)> = Vec::new();
    for plugin in &kind.plugins {
        let (parameters, note) = (own(plugin), plugin.note.as_str());
        match rows.iter_mut().find(|(_, p, n)| *p == parameters && *n == note) {
            Some((names, ..)) => names.push(plugin.name),
            None => rows.push((vec![plugin.name], parameters, note)),
        }
    }
    for (names, parameters, note) in rows {
        text += &format!("| {} | {parameters} | {note} |\n", code(&names, " "));
    }
    text + "\n"
}

fn code(names: &[&str], between: &str) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(between)
}

/// Parameters in one line; ignored ones come last.
fn cell(parameters: &[&ParameterDoc]) -> String {
    let (idle, used): (Vec<&ParameterDoc>, Vec<_>) = parameters.iter().partition(|p| p.idle);
    let one = |p: &&ParameterDoc| format!("`{}` {}", label(p), about(p)).trim_end().to_owned();
    let mut parts: Vec<String> = used.iter().map(one).collect();
    if !idle.is_empty() {
        parts.push(format!("without effect {}", code(&idle.iter().map(|p| p.name).collect::<Vec<_>>(), " ")));
    }
    parts.join(", ")
}
