//! `pointillist plugins`: the supported subset of Mitsuba's format. `tools/plugins` writes the text from what the readers of plugins ask for.

use miette::{Result, miette};

use crate::cmd::args::PluginsArgs;

/// A section for each kind, then what is not supported, with an empty line between. The first line of a section is its name; after it
/// stand plugins, indented by two spaces, and below each its parameters, indented further.
const TEXT: &str = include_str!("plugins.txt");

/// Runs the subcommand.
pub fn list(args: &PluginsArgs) -> Result<()> {
    let Some(which) = &args.which else {
        print!("{TEXT}");
        return Ok(());
    };
    let kinds: Vec<(&str, &str)> =
        TEXT.split("\n\n").filter_map(|section| section.split_once('\n')).collect();
    // The last section, which is no kind, lists what is not supported.
    let kinds = &kinds[..kinds.len().saturating_sub(1)];
    let matching: Vec<String> = match kinds.iter().find(|(kind, _)| kind == which) {
        Some((kind, plugins)) => vec![format!("{kind}\n{plugins}")],
        None => kinds
            .iter()
            .filter_map(|(kind, plugins)| Some(format!("{kind}\n{}", plugin(plugins, which)?)))
            .collect(),
    };
    if matching.is_empty() {
        let names = kinds.iter().map(|(kind, _)| *kind).collect::<Vec<_>>().join(", ");
        return Err(miette!(help = format!("the kinds are {names}"), "there is no kind or plugin `{which}`"));
    }
    matching.iter().for_each(|section| println!("{section}\n"));
    Ok(())
}

/// The lines about the plugin of this name in the section of a kind.
fn plugin(section: &str, name: &str) -> Option<String> {
    let is_heading = |line: &str| line.starts_with("  ") && !line.starts_with("   ");
    let mut lines = section
        .lines()
        .skip_while(|line| !(is_heading(line) && line.split_whitespace().next() == Some(name)));
    let heading = lines.next()?;
    let parameters = lines.take_while(|line| !is_heading(line));
    Some(std::iter::once(heading).chain(parameters).collect::<Vec<_>>().join("\n"))
}
