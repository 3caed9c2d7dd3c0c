//! The texts a scene is made of, and places in them.

use std::path::{Path, PathBuf};

use crate::scene::desc::Place;
use crate::scene::diagnostic::{Finding, FindingKind, LineAt};

/// A piece of a file, in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Span {
    /// Index into [`Sources`].
    pub(crate) file: u32,
    pub(crate) start: u32,
    /// One after the last byte.
    pub(crate) end: u32,
}

impl Span {
    /// The bytes `range` of file `file`.
    pub(crate) fn new(file: u32, range: std::ops::Range<usize>) -> Self {
        let clamp = |v: usize| u32::try_from(v).unwrap_or(u32::MAX);
        Self { file, start: clamp(range.start), end: clamp(range.end) }
    }
}

/// Bytes between counts of characters.
const STRIDE: usize = 1024;

/// One file, or a text that stands for one.
#[derive(Debug)]
struct SourceText {
    path: PathBuf,
    text: String,
    /// Byte at which each line starts.
    lines: Vec<u32>,
    /// Characters before each multiple of [`STRIDE`] bytes, so that a column is found without reading a
    /// long line from its start.
    characters: Vec<u32>,
}

/// All texts of a scene.
#[derive(Debug, Default)]
pub(crate) struct Sources(Vec<SourceText>);

impl Sources {
    /// Adds a text of less than 4 GiB and returns its index.
    pub(crate) fn add(&mut self, path: PathBuf, text: &str) -> u32 {
        let starts = text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(i, _)| i as u32 + 1);
        let lines = std::iter::once(0).chain(starts).collect();
        let mut count = 0;
        let mut characters = Vec::with_capacity(text.len() / STRIDE + 1);
        for chunk in text.as_bytes().chunks(STRIDE) {
            characters.push(count);
            count += starts_of_characters(chunk);
        }
        self.0.push(SourceText { path, text: text.into(), lines, characters });
        self.0.len() as u32 - 1
    }

    pub(crate) fn path(&self, file: u32) -> &Path {
        &self.0[file as usize].path
    }

    /// All paths, in the order they were added.
    pub(crate) fn paths(&self) -> Vec<PathBuf> {
        self.0.iter().map(|s| s.path.clone()).collect()
    }

    /// The byte at which character `column` of line `line` stands (both from 1), as nearly as there is one.
    pub(crate) fn offset(&self, file: u32, line: usize, column: usize) -> usize {
        let source = &self.0[file as usize];
        let Some(&start) = source.lines.get(line.saturating_sub(1)) else { return source.text.len() };
        let rest = &source.text[start as usize..];
        rest.char_indices()
            .nth(column.saturating_sub(1))
            .map_or(source.text.len(), |(i, _)| start as usize + i)
    }

    /// Line and column of the start of a span.
    pub(crate) fn place(&self, span: Span) -> Place {
        let (line, start, end) = self.line(span);
        let source = &self.0[span.file as usize];
        let column =
            1 + source.characters_before((span.start as usize).min(end)) - source.characters_before(start);
        Place { file: span.file, line: line as u32, column }
    }

    pub(crate) fn finding(&self, kind: FindingKind, span: Span, message: impl Into<String>) -> Finding {
        let source = &self.0[span.file as usize];
        let (line, start, end) = self.line(span);
        let range = ((span.start as usize).saturating_sub(start), (span.end as usize).saturating_sub(start));
        let file = source.path.to_string_lossy();
        let column = self.place(span).column as usize;
        let at = LineAt { file: &file, text: &source.text[start..end], line, column, range };
        Finding::new(kind, at, message)
    }

    /// The line (from 1) a span starts in, and the bytes it takes without its end.
    fn line(&self, span: Span) -> (usize, usize, usize) {
        let source = &self.0[span.file as usize];
        let at = (span.start as usize).min(source.text.len()) as u32;
        let line = source.lines.partition_point(|&s| s <= at);
        let start = source.lines[line - 1] as usize;
        let end = source.lines.get(line).map_or(source.text.len(), |&s| s as usize);
        let text = &source.text[start..end];
        let text = text.strip_suffix('\n').unwrap_or(text);
        (line, start, start + text.strip_suffix('\r').unwrap_or(text).len())
    }
}

impl SourceText {
    /// Characters that start before a byte.
    fn characters_before(&self, byte: usize) -> u32 {
        let Some(&count) = self.characters.get(byte / STRIDE) else {
            return self.characters.len().checked_sub(1).map_or(0, |last| {
                self.characters[last] + starts_of_characters(&self.text.as_bytes()[last * STRIDE..])
            });
        };
        count + starts_of_characters(&self.text.as_bytes()[byte / STRIDE * STRIDE..byte])
    }
}

/// Bytes that are the first of a character.
fn starts_of_characters(bytes: &[u8]) -> u32 {
    bytes.iter().filter(|b| **b & 0xc0 != 0x80).count() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_count_characters_from_one() {
        let mut s = Sources::default();
        let f = s.add("x".into(), "ab\r\näöü c\n");
        let at = |start| s.place(Span { file: f, start, end: start });
        assert_eq!((at(0).line, at(0).column), (1, 1));
        assert_eq!((at(4).line, at(4).column), (2, 1));
        assert_eq!((at(11).line, at(11).column), (2, 5));
        assert_eq!((at(13).line, at(13).column), (3, 1));
        assert_eq!((at(900).line, at(900).column), (3, 1));
        let long = "ä".repeat(3 * STRIDE);
        let f = s.add("y".into(), &long);
        for column in [1, 2, 700, STRIDE, 3 * STRIDE] {
            let start = 2 * (column as u32 - 1);
            assert_eq!(s.place(Span { file: f, start, end: start }).column, column as u32);
        }
        assert_eq!(
            s.place(Span { file: f, start: 6 * STRIDE as u32, end: 0 }).column as usize,
            3 * STRIDE + 1
        );
        let f = 0;
        assert_eq!(s.offset(f, 2, 5), 11);
        assert_eq!(s.offset(f, 99, 5), 13);
    }
}
