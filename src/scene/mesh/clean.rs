//! OBJ lines as a reader of OBJ can digest them.
//!
//! The library that reads OBJ refuses a whole file for one face out of range, blows points and lines
//! up to triangles, overflows on some relative indices and mixes up vertices when some have normals
//! and some have not. Here each line is checked before the library sees it: bad faces are counted
//! and left out, and vertices are cut to the numbers that mean something.

use super::file::Count;
use std::fmt::Write as _;
use std::io::{self, BufRead, Read};

use crate::scene::limits;

/// What was left out.
#[derive(Clone, Debug, Default)]
pub(super) struct Faults {
    /// Faces that are not made of indices.
    pub(super) malformed: Count,
    /// Faces with an index beyond what the file has.
    pub(super) out_of_range: Count,
    /// Faces, lines and points of fewer than three vertices.
    pub(super) too_small: Count,
    /// Lines with a keyword that OBJ does not have, or that is not supported.
    pub(super) unknown: Count,
    /// Materials named by the file.
    pub(super) materials: Count,
}

/// Which of a face's indices are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Keep {
    pub(super) uvs: bool,
    pub(super) normals: bool,
}

/// The lines of an OBJ file, checked one at a time.
pub(super) struct CleanLines<'a> {
    rest: &'a [u8],
    keep: Keep,
    /// Of `v`, `vt`, `vn` in the whole file.
    total: [usize; 3],
    /// The same, so far.
    seen: [usize; 3],
    /// The current line, clean, and how much of it is consumed.
    line: String,
    consumed: usize,
    /// Number of the current line, from 1.
    pub(super) number: usize,
    /// Number of the one after it.
    next: usize,
    pub(super) triangles: usize,
    /// First triangle and line of each face.
    pub(super) faces: Vec<(u32, u32)>,
    pub(super) faults: Faults,
    /// Set when the reading stopped because something is too large.
    pub(super) excess: Option<String>,
}

impl<'a> CleanLines<'a> {
    pub(super) fn new(bytes: &'a [u8], keep: Keep) -> Self {
        let mut total = [0; 3];
        for line in bytes.split(|b| *b == b'\n') {
            if let Some(kind) = vertex_kind(line.trim_ascii()) {
                total[kind] += 1;
            }
        }
        Self {
            rest: bytes,
            keep,
            total,
            seen: [0; 3],
            line: String::new(),
            consumed: 0,
            number: 0,
            next: 1,
            triangles: 0,
            faces: Vec::new(),
            faults: Faults::default(),
            excess: None,
        }
    }

    /// Makes the next line that matters the current one; false at the end.
    fn advance(&mut self) -> io::Result<bool> {
        self.line.clear();
        self.consumed = 0;
        while self.line.is_empty() && !self.rest.is_empty() {
            let (line, lines) = logical_line(self.rest);
            self.rest = &self.rest[line.len()..];
            self.number = self.next;
            self.next += lines;
            if line.len() > limits::MESH_LINE_BYTES {
                let message = format!("this line has more than {} bytes", limits::MESH_LINE_BYTES);
                return self.refuse(message).map(|()| false);
            }
            if lines == 1 {
                self.clean(line.trim_ascii())?;
            } else {
                let joined: Vec<u8> = line.iter().map(|b| if *b == b'\\' { b' ' } else { *b }).collect();
                self.clean(joined.trim_ascii())?;
            }
        }
        Ok(!self.line.is_empty())
    }

    /// Stops the reading and keeps the reason, which would not survive the library's error.
    fn refuse(&mut self, message: String) -> io::Result<()> {
        self.excess = Some(message);
        Err(io::Error::other("too much"))
    }

    fn clean(&mut self, line: &[u8]) -> io::Result<()> {
        if let Some(kind) = vertex_kind(line) {
            self.seen[kind] += 1;
            self.vertex(kind, &String::from_utf8_lossy(line));
            return Ok(());
        }
        let number = self.number;
        let keyword_end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        match &line[..keyword_end] {
            b"f" => {
                let text = String::from_utf8_lossy(&line[1..]);
                self.face(&text)?;
            }
            b"l" | b"p" => self.faults.too_small.add(|| number),
            b"usemtl" | b"mtllib" => self.faults.materials.add(|| number),
            b"" | b"o" | b"g" | b"s" => {}
            keyword if keyword.starts_with(b"#") => {}
            _ => self.faults.unknown.add(|| number),
        }
        Ok(())
    }

    /// Keeps three numbers of a position or normal and two of a texture coordinate.
    fn vertex(&mut self, kind: usize, line: &str) {
        let wanted = if kind == 1 { 2 } else { 3 };
        let mut tokens = line.split_ascii_whitespace().take(1 + wanted);
        self.line.push_str(tokens.next().unwrap_or_default());
        let mut given = 0;
        for token in tokens {
            self.line.push(' ');
            self.line.push_str(token);
            given += 1;
        }
        if kind == 1 && given == 1 {
            self.line.push_str(" 0");
        }
        self.line.push('\n');
    }

    fn face(&mut self, text: &str) -> io::Result<()> {
        self.line.push('f');
        let number = self.number;
        let mut corners = 0;
        for token in text.split_ascii_whitespace() {
            if token.starts_with('#') {
                break;
            }
            match self.corner(token) {
                Ok(indices) => push_corner(&mut self.line, indices, self.keep),
                Err(fault) => {
                    self.line.clear();
                    fault(&mut self.faults).add(|| number);
                    return Ok(());
                }
            }
            corners += 1;
        }
        if corners < 3 {
            self.line.clear();
            self.faults.too_small.add(|| number);
            return Ok(());
        }
        self.line.push('\n');
        self.faces.push((self.triangles as u32, self.number as u32));
        self.triangles += corners - 2;
        if self.triangles > limits::MESH_TRIANGLES {
            return self.refuse(format!("the mesh has more than {} triangles", limits::MESH_TRIANGLES));
        }
        Ok(())
    }

    /// The absolute indices (from 1; 0 where not given) of one corner, all in range.
    fn corner(&self, token: &str) -> Result<[usize; 3], fn(&mut Faults) -> &mut Count> {
        let mut indices = [0; 3];
        for (slot, part) in token.split('/').enumerate() {
            let malformed: fn(&mut Faults) -> &mut Count = |f| &mut f.malformed;
            if slot > 2 || (slot == 0 && part.is_empty()) {
                return Err(malformed);
            }
            if part.is_empty() {
                continue;
            }
            let index: i64 = part.parse().map_err(|_| malformed)?;
            let absolute = if index < 0 {
                index.saturating_add(self.seen[slot] as i64).saturating_add(1)
            } else {
                index
            };
            let in_range = usize::try_from(absolute).ok().filter(|i| (1..=self.total[slot]).contains(i));
            indices[slot] = in_range.ok_or::<fn(&mut Faults) -> &mut Count>(|f| &mut f.out_of_range)?;
        }
        Ok(indices)
    }
}

/// Writes ` v/vt/vn`.
fn push_corner(line: &mut String, [v, vt, vn]: [usize; 3], keep: Keep) {
    let uv = if keep.uvs && vt > 0 { vt.to_string() } else { String::new() };
    // A String takes every write.
    let _ = if keep.normals && vn > 0 {
        write!(line, " {v}/{uv}/{vn}")
    } else if uv.is_empty() {
        write!(line, " {v}")
    } else {
        write!(line, " {v}/{uv}")
    };
}

/// The first line of `rest` with its end, and of how many lines in the file it is made: a backslash at the end of one
/// carries on in the next, except after a comment.
fn logical_line(rest: &[u8]) -> (&[u8], usize) {
    let end =
        |from: usize| rest[from..].iter().position(|b| *b == b'\n').map_or(rest.len(), |e| from + e + 1);
    let carries_on = |line: &[u8]| line.trim_ascii_end().ends_with(b"\\");
    let (mut from, mut to, mut lines) = (0, end(0), 1);
    let comment = rest[..to].trim_ascii_start().starts_with(b"#");
    while !comment && to < rest.len() && to <= limits::MESH_LINE_BYTES && carries_on(&rest[from..to]) {
        (from, to, lines) = (to, end(to), lines + 1);
    }
    (&rest[..to], lines)
}

/// 0, 1, 2 for a line of `v`, `vt`, `vn`.
fn vertex_kind(line: &[u8]) -> Option<usize> {
    let blank = |i: usize| line.get(i).is_some_and(u8::is_ascii_whitespace);
    match line {
        [b'v', b't', ..] if blank(2) => Some(1),
        [b'v', b'n', ..] if blank(2) => Some(2),
        [b'v', ..] if blank(1) => Some(0),
        _ => None,
    }
}

impl Read for CleanLines<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let n = self.fill_buf()?.read(out)?;
        self.consume(n);
        Ok(n)
    }
}

impl BufRead for CleanLines<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.consumed >= self.line.len() {
            self.advance()?;
        }
        Ok(&self.line.as_bytes()[self.consumed..])
    }

    fn consume(&mut self, n: usize) {
        self.consumed += n;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: Keep = Keep { uvs: true, normals: true };

    fn cleaned(text: &str, keep: Keep) -> (String, Faults) {
        let mut lines = CleanLines::new(text.as_bytes(), keep);
        let mut out = String::new();
        lines.read_to_string(&mut out).expect("small");
        (out, lines.faults)
    }

    #[test]
    fn a_backslash_carries_on_in_the_next_line() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 \\\r\n1 0\n# note \\\nv 0 1 0\nf 1 2 \\\n3 \\\n4\nf 1 2 9\nf 1 2 \\\n\nf 1 2 3";
        let (out, faults) = cleaned(text, ALL);
        assert_eq!(out, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf 1 2 3\n");
        assert_eq!((faults.out_of_range.times, faults.out_of_range.first_line), (1, 10));
        assert_eq!((faults.too_small.times, faults.too_small.first_line), (1, 11));
    }

    #[test]
    fn bad_faces_are_left_out_and_counted() {
        let text = "v 0 0 0 1 0 0\r\nv 1 0 0\nf 1 2 3\nv 0 1 0\nf -3 -2 -1\nf 1 2 4\nf 1 2\nf 0 1 2\nf 1 x 2\nl 1 2\n\
                    f -9223372036854775808 1 2\nf 1/1 2 3\nwhat 1\n# f 1 2 3\nusemtl a\nf 1 2 3 # end";
        let (out, faults) = cleaned(text, ALL);
        assert_eq!(out, "v 0 0 0\nv 1 0 0\nf 1 2 3\nv 0 1 0\nf 1 2 3\nf 1 2 3\n");
        assert_eq!(faults.out_of_range, Count { times: 4, first_line: 6 });
        assert_eq!(faults.too_small, Count { times: 2, first_line: 7 });
        assert_eq!(faults.malformed, Count { times: 1, first_line: 9 });
        assert_eq!(faults.unknown, Count { times: 1, first_line: 13 });
        assert_eq!(faults.materials.times, 1);
    }

    #[test]
    fn corners_keep_what_is_asked() {
        let text = "v 0 0 0\nvt 0\nvn 0 0 1\nf 1/1/1 1//1 1/1\n";
        assert_eq!(cleaned(text, ALL).0, "v 0 0 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 1//1 1/1\n");
        let (out, _) = cleaned(text, Keep { uvs: false, normals: true });
        assert!(out.ends_with("f 1//1 1//1 1\n"), "{out}");
    }
}
