//! Errors and warnings with their place: file, line, column and the source line under a caret.
//!
//! Only the line that a message is about is kept, cut to a readable width, so that a message about a file of one line and 60 MB is
//! still a message.

use std::fmt;

use miette::{
    Diagnostic, LabeledSpan, MietteError, MietteSpanContents, Severity, SourceCode, SourceSpan, SpanContents,
};

/// Characters of a message at most.
const LONGEST: usize = 600;

/// The subject of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FindingKind {
    /// A file could not be read.
    File,
    /// An input is larger or deeper than [`crate::scene::limits`] allows.
    Limit,
    /// The XML is not well-formed, or not text.
    Syntax,
    /// An element or attribute that the format does not have.
    Unknown,
    /// A plugin that this program does not have.
    Plugin,
    /// A parameter that is not used, or of the wrong type.
    Parameter,
    /// A value that cannot be understood or used.
    Value,
    /// Something required is missing.
    Missing,
    /// A name that refers to nothing, twice to the same, or to itself.
    Reference,
    /// A mesh file with faults.
    Mesh,
}

/// An error or a warning before it is decided which.
#[derive(Clone, Debug)]
pub(crate) struct Finding {
    kind: FindingKind,
    severity: Severity,
    message: String,
    label: String,
    help: Option<String>,
    excerpt: Excerpt,
}

impl Finding {
    /// An error about `at`.
    pub(crate) fn new(kind: FindingKind, at: LineAt<'_>, message: impl Into<String>) -> Self {
        Self {
            kind,
            severity: Severity::Error,
            message: tidy(message.into()),
            label: "here".into(),
            help: None,
            excerpt: Excerpt::new(at),
        }
    }

    /// Adds advice on what to do.
    pub(crate) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(tidy(help.into()));
        self
    }

    /// Replaces the label under the caret.
    pub(crate) fn label(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    pub(crate) fn error(self) -> SceneError {
        SceneError(Box::new(self))
    }

    pub(crate) fn warning(mut self) -> SceneWarning {
        self.severity = Severity::Warning;
        SceneWarning(Box::new(self))
    }

    /// Makes it a remark that needs no action.
    pub(crate) fn advice(mut self) -> SceneWarning {
        self.severity = Severity::Advice;
        SceneWarning(Box::new(self))
    }
}

/// The beginning of a name or value of a file, for messages.
pub(crate) fn shorten(text: &str) -> String {
    text.chars().take(64).collect()
}

/// Cuts a text to a readable length and takes control characters out.
fn tidy(text: String) -> String {
    if text.len() <= LONGEST && !text.contains(char::is_control) {
        return text;
    }
    let mut short: String = text.chars().take(LONGEST).map(printable).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}

/// The reason why a scene could not be read. `miette` shows it with the source line and a caret.
#[derive(Clone)]
pub struct SceneError(Box<Finding>);

/// A remark on a scene that does not prevent a picture.
///
/// Its miette severity is `Warning`, or `Advice` for a setting that has no effect here and needs none.
#[derive(Clone)]
pub struct SceneWarning(Box<Finding>);

impl SceneError {
    /// The same as a warning that says what was done `instead`.
    pub(crate) fn tolerated(self, instead: &str) -> SceneWarning {
        let Finding { message, .. } = *self.0.clone();
        Finding { message: tidy(format!("{message}: {instead}")), help: None, ..*self.0 }.warning()
    }
}

macro_rules! finding {
    ($name:ident) => {
        impl $name {
            /// The subject.
            pub fn kind(&self) -> FindingKind {
                self.0.kind
            }

            /// File, line and column (from 1, in characters).
            pub fn location(&self) -> (&str, usize, usize) {
                (&self.0.excerpt.name, self.0.excerpt.line, self.0.excerpt.column)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&self.0.message)
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                let (file, line, column) = self.location();
                write!(f, "{file}:{line}:{column}: {:?}: {}", self.0.kind, self.0.message)
            }
        }

        impl std::error::Error for $name {}

        impl Diagnostic for $name {
            fn severity(&self) -> Option<Severity> {
                Some(self.0.severity)
            }

            fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
                self.0.help.as_ref().map(|h| Box::new(h) as Box<dyn fmt::Display + 'a>)
            }

            fn source_code(&self) -> Option<&dyn SourceCode> {
                Some(&self.0.excerpt)
            }

            fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
                let (start, len) = self.0.excerpt.label;
                Some(Box::new(std::iter::once(LabeledSpan::new(Some(self.0.label.clone()), start, len))))
            }
        }
    };
}

finding!(SceneError);
finding!(SceneWarning);

/// Characters of the source line shown on each side of the caret.
const CONTEXT: usize = 100;

/// Characters underlined at most.
const UNDERLINED: usize = 60;

/// A line of a file, as a finding needs it.
pub(crate) struct LineAt<'a> {
    pub(crate) file: &'a str,
    /// The whole line without its end.
    pub(crate) text: &'a str,
    /// Line number, from 1.
    pub(crate) line: usize,
    /// Column of the start of `range`, in characters, from 1.
    pub(crate) column: usize,
    /// The part meant, in bytes of `text`; cut to the line and to character boundaries.
    pub(crate) range: (usize, usize),
}

/// One line of a source, as much of it as is worth showing.
#[derive(Clone, Debug)]
struct Excerpt {
    /// Name of the file.
    name: String,
    /// The shown part of the line.
    text: String,
    /// The underlined part, in bytes of `text`.
    label: (usize, usize),
    /// Line, from 1.
    line: usize,
    /// Column in characters, from 1.
    column: usize,
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        _span: &SourceSpan,
        _before: usize,
        _after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        Ok(Box::new(MietteSpanContents::new_named(
            self.name.clone(),
            self.text.as_bytes(),
            (0, self.text.len()).into(),
            self.line - 1,
            self.column - 1,
            1,
        )))
    }
}

impl Excerpt {
    /// The line of `at`, cut.
    fn new(at: LineAt<'_>) -> Self {
        let text = at.text;
        let start = floor_boundary(text, at.range.0);
        let end = floor_boundary(text, at.range.1).max(start);
        let before: Vec<char> = text[..start].chars().rev().take(CONTEXT).collect();
        let mut shown: String = before.into_iter().rev().map(printable).collect();
        let label_start = shown.len();
        let meant: String = text[start..end].chars().take(UNDERLINED).map(printable).collect();
        shown.push_str(&meant);
        let label_len = meant.len();
        shown.extend(text[end..].chars().take(CONTEXT).map(printable));
        if label_len == 0 {
            shown.push(' ');
        }
        Excerpt {
            name: at.file.to_owned(),
            text: shown,
            label: (label_start, label_len.max(1)),
            line: at.line,
            column: at.column,
        }
    }
}

/// A character that cannot disturb a terminal.
fn printable(c: char) -> char {
    if c == '\t' {
        ' '
    } else if c.is_control() || matches!(c, '\u{feff}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}') {
        '\u{fffd}'
    } else {
        c
    }
}

/// The last character boundary at or before `i`.
fn floor_boundary(text: &str, i: usize) -> usize {
    let mut i = i.min(text.len());
    while !text.is_char_boundary(i) {
        i -= 1;
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;
    use miette::{GraphicalReportHandler, GraphicalTheme};

    fn render(d: &dyn Diagnostic) -> String {
        let mut out = String::new();
        GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor())
            .render_report(&mut out, d)
            .expect("a string never fails");
        out
    }

    #[test]
    fn shows_place_line_and_caret() {
        let at =
            LineAt { file: "a.xml", text: "  <shape type=\"blob\"/>", line: 7, column: 10, range: (9, 20) };
        let e = Finding::new(FindingKind::Plugin, at, "unknown shape").help("write sphere").error();
        let text = render(&e);
        assert!(text.contains("a.xml:7:10"), "{text}");
        assert!(text.contains("7 │   <shape type=\"blob\"/>"), "{text}");
        assert!(text.contains("write sphere"), "{text}");
    }

    #[test]
    fn a_huge_line_is_cut_and_odd_ranges_do_not_panic() {
        let long = "é".repeat(1_000_000);
        for range in [(0, 2_000_000), (999_999, 5), (3, usize::MAX), (2_000_000, 2_000_001)] {
            let at = LineAt { file: "a.xml", text: &long, line: 1, column: 1, range };
            let text = render(&Finding::new(FindingKind::Value, at, "m").error());
            assert!(text.len() < 3000 && text.contains("a.xml:1:"), "{}", text.len());
        }
        let at = LineAt { file: "empty.xml", text: "", line: 1, column: 1, range: (0, 0) };
        let text = render(&Finding::new(FindingKind::Value, at, "m").error());
        assert!(text.contains("empty.xml:1:1"), "{text}");
    }
}
