//! Prints warnings about a scene on standard error: one line for similar ones or, with `--verbose`, each with its source line.

use std::collections::HashMap;
use std::path::Path;

use miette::{Diagnostic, Severity};

use crate::render::options::SceneOptions;
use crate::render::process::tell;
use crate::scene::SceneWarning;

/// Most lines of warnings.
const MOST: usize = 10;

/// One line for a warning, or for several similar ones.
#[derive(Clone)]
struct WarningLine {
    message: String,
    /// `file:line:column` of the first warning.
    place: Option<String>,
    help: Option<String>,
    count: usize,
}

/// Prints the reader's warnings about the scene of `source`.
pub fn tell_warnings(warnings: &[SceneWarning], source: &SceneOptions) {
    if source.verbose {
        warnings.iter().for_each(|warning| tell(&format!("{:?}", miette::Report::new(warning.clone()))));
    } else {
        folded(warnings, source.scene.parent()).iter().for_each(|line| tell(line));
    }
}

/// Prints notices from preparing the scene of `source`.
pub fn tell_notices(notices: &[String], source: &SceneOptions) {
    if source.verbose {
        return notices.iter().for_each(|notice| tell(&format!("warning: {notice}")));
    }
    let line = |notice: &String| WarningLine { message: notice.clone(), place: None, help: None, count: 1 };
    let (lines, all_shown) = shown(&alike(notices.iter().map(line).collect()));
    lines.iter().for_each(|line| tell(line));
    if !all_shown {
        tell(&format!("note: --verbose shows all {} of these", notices.len()));
    }
}

/// One line per kind of warning, a single one for all remarks, and how to see the rest. Paths are relative to `folder`.
fn folded(warnings: &[SceneWarning], folder: Option<&Path>) -> Vec<String> {
    let line = |warning: &SceneWarning| {
        let (file, line, column) = warning.location();
        let file = Path::new(file);
        let file = folder.and_then(|folder| file.strip_prefix(folder).ok()).unwrap_or(file).display();
        WarningLine {
            message: warning.to_string(),
            place: Some(format!("{file}:{line}:{column}")),
            help: warning.help().map(|help| help.to_string()),
            count: 1,
        }
    };
    let is_remark = |warning: &&SceneWarning| warning.severity() == Some(Severity::Advice);
    let (remarks, warnings): (Vec<_>, Vec<_>) = warnings.iter().partition(is_remark);
    let [remarks, warnings] = [remarks, warnings].map(|list| list.into_iter().map(line).collect::<Vec<_>>());
    let (mut lines, all_shown) = shown(&alike(warnings.clone()));
    let all = format!("all {} warnings", warnings.len());
    match (alike(remarks.clone()).as_slice(), all_shown) {
        ([], true) => {}
        ([], false) => lines.push(format!("note: --verbose shows {all}")),
        ([one], true) => lines.push(format!("note: {one}")),
        (_, all_shown) => {
            let and = if all_shown { String::new() } else { format!(", and {all}") };
            lines.push(format!(
                "note: {} remarks on what has no effect here or is read in another way: --verbose shows them{and}",
                remarks.len()
            ));
        }
    }
    lines
}

/// The lines to show, and whether each warning has a line of its own.
fn shown(groups: &[WarningLine]) -> (Vec<String>, bool) {
    let mut lines: Vec<_> = groups.iter().take(MOST).map(|group| format!("warning: {group}")).collect();
    let rest: usize = groups.iter().skip(MOST).map(|group| group.count).sum();
    if rest > 0 {
        lines.push(format!("warning: {rest} more of other kinds"));
    }
    (lines, rest == 0 && groups.iter().all(|group| group.count == 1))
}

/// Merges warnings that differ only in numbers; if there are more than are shown, also those that differ in names. Sorted by the first of
/// each kind.
fn alike(warnings: Vec<WarningLine>) -> Vec<WarningLine> {
    let joined = |with_names| {
        let (mut groups, mut places) = (Vec::<WarningLine>::new(), HashMap::new());
        for warning in &warnings {
            let place = *places.entry(pattern(&warning.message, with_names)).or_insert(groups.len());
            match groups.get_mut(place) {
                Some(group) => group.count += 1,
                None => groups.push(warning.clone()),
            }
        }
        groups
    };
    let groups = joined(true);
    if groups.len() > MOST { joined(false) } else { groups }
}

/// Removes numbers from a text and, unless `with_names`, quoted names.
fn pattern(text: &str, with_names: bool) -> String {
    let (mut kept, mut quote) = (String::new(), None);
    for c in text.chars() {
        match quote {
            Some(end) if end == c => quote = None,
            Some(_) => {}
            None if !with_names && matches!(c, '`' | '"') => quote = Some(c),
            None if !c.is_ascii_digit() => kept.push(c),
            None => {}
        }
    }
    kept
}

impl std::fmt::Display for WarningLine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let more = (self.count > 1).then(|| format!("{} more like it", self.count - 1));
        let behind: Vec<_> = self.place.iter().chain(&more).map(String::as_str).collect();
        f.write_str(&self.message)?;
        if !behind.is_empty() {
            write!(f, " ({})", behind.join("; "))?;
        }
        self.help.as_ref().map_or(Ok(()), |help| write!(f, "\n  help: {help}"))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

    use super::*;

    /// Lines about a scene with these elements besides a sensor and a light.
    fn lines(elements: &str) -> Vec<String> {
        let text = format!(
            "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/>\n{elements}</scene>"
        );
        folded(&crate::scene::load_str("t.xml", &text, &[]).unwrap().warnings, None)
    }

    fn cube(parameters: &str) -> String {
        format!("<shape type=\"cube\">{parameters}</shape>\n")
    }

    #[test]
    fn what_is_alike_is_one_line_with_the_first_place_and_the_count() {
        let cubes = cube("<float name=\"odd\" value=\"1\"/>").repeat(3);
        let said = lines(&(cubes + &cube("<float name=\"strange\" value=\"1\"/>")));
        assert_eq!(said.len(), 3, "{said:#?}");
        assert!(said[0].contains("`odd`") && said[0].contains("(t.xml:2:20; 2 more like it)"), "{}", said[0]);
        assert!(said[1].contains("`strange`") && said[1].contains("(t.xml:5:20)"), "{}", said[1]);
        assert_eq!(said[2], "note: --verbose shows all 4 warnings");
        assert!(lines(&cube("")).is_empty());
    }

    /// However many kinds of warnings there are, few lines are printed, and all warnings are counted.
    #[test]
    fn many_kinds_are_joined_and_counted() {
        let names = |count: usize| (0..count).map(|i| "x".repeat(i + 1));
        let odd: String =
            names(40).map(|name| cube(&format!("<float name=\"{name}\" value=\"1\"/>"))).collect();
        let said = lines(&odd);
        assert!(said.len() == 2 && said[0].contains("39 more like it"), "{said:#?}");
        let bare = |name: String| WarningLine { message: name, place: None, help: None, count: 1 };
        let (said, all_shown) = shown(&alike(names(40).map(bare).collect()));
        assert!(!all_shown && said.len() == MOST + 1);
        assert_eq!(said[MOST], "warning: 30 more of other kinds");
    }

    #[test]
    fn remarks_are_one_line() {
        let film = |names: &[&str]| {
            let name = |name: &&str| format!("<float name=\"{name}\" value=\"1\"/>");
            format!("<film type=\"hdrfilm\">{}</film>", names.iter().map(name).collect::<String>())
        };
        let of_film = |names: &[&str]| {
            let text = format!(
                "<scene version=\"3.0.0\"><emitter type=\"constant\"/>\n<sensor type=\"perspective\">{}</sensor></scene>",
                film(names)
            );
            folded(&crate::scene::load_str("t.xml", &text, &[]).unwrap().warnings, None)
        };
        let one = of_film(&["odd"]);
        assert!(one.len() == 1 && one[0].starts_with("note: ") && one[0].contains("t.xml:2:"), "{one:?}");
        let two = of_film(&["odd", "strange"]);
        let words =
            "note: 2 remarks on what has no effect here or is read in another way: --verbose shows them";
        assert_eq!(two, [words]);
    }
}
