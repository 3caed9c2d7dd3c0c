//! The part of a source that a message shows.
//!
//! Only the line it is about is kept, cut to a readable width, so that a message about a file of one
//! line and 60 MB is still a message.

use miette::{MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};

/// Characters of the source line shown on each side of the caret.
const CONTEXT: usize = 100;

/// Characters underlined at most.
const UNDERLINED: usize = 60;

/// A line of a file, as a finding needs it.
pub(crate) struct LineAt<'a> {
    /// Name of the file.
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
pub(super) struct Excerpt {
    /// Name of the file.
    pub(super) name: String,
    /// The shown part of the line.
    pub(super) text: String,
    /// The underlined part, in bytes of `text`.
    pub(super) label: (usize, usize),
    /// Line, from 1.
    pub(super) line: usize,
    /// Column in characters, from 1.
    pub(super) column: usize,
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
    pub(super) fn new(at: LineAt<'_>) -> Self {
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
pub(super) fn printable(c: char) -> char {
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
