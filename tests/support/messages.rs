//! Messages as the user sees them.

use miette::{GraphicalReportHandler, GraphicalTheme};

/// The message as the user sees it.
pub fn render(d: &dyn miette::Diagnostic) -> String {
    let mut out = String::new();
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor());
    handler.render_report(&mut out, d).expect("a string never fails");
    out
}

/// The message shows `file:line:column` of one of the files, and is of a readable size.
pub fn assert_has_place(what: &str, shown: &str, names: &[&str]) {
    let numbered = |rest: &str| {
        let mut parts = rest.split(|c: char| !c.is_ascii_digit());
        parts.next().is_some_and(|line| line.parse::<u32>().is_ok_and(|l| l > 0))
    };
    let places = |name: &str| {
        shown.match_indices(name).any(|(i, n)| shown[i + n.len()..].strip_prefix(':').is_some_and(numbered))
    };
    assert!(names.iter().any(|n| places(n)), "{what}: no place in\n{shown}");
    assert!(shown.len() < 20_000, "{what}: {} bytes of message", shown.len());
}
