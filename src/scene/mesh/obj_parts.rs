//! The lines of an OBJ file, in parts that several threads read side by side.
//!
//! A part ends where a line ends. A first pass counts the vertices of each part, so that a second one knows what relative
//! indices mean and which indices the file has. Bad faces are counted and left out; vertices are cut to the numbers that mean
//! something.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::file::Count;
use crate::color::srgb;
use crate::scene::diagnostic::FindingKind;
use crate::scene::leftovers::Leftovers;
use crate::scene::limits;

/// Bytes of a part, at least.
const PART_BYTES: usize = 1 << 18;

/// Numbers of dropped elements.
#[derive(Clone, Debug, Default)]
pub(super) struct Faults {
    /// Faces that are not made of indices.
    pub(super) malformed: Count,
    /// Faces with an index beyond what the file has.
    pub(super) out_of_range: Count,
    /// Faces of fewer than three vertices.
    pub(super) too_small: Count,
}

impl Faults {
    fn merge(&mut self, later: &Faults) {
        self.malformed.merge(later.malformed);
        self.out_of_range.merge(later.out_of_range);
        self.too_small.merge(later.too_small);
    }
}

/// The materials that a file names.
#[derive(Clone, Debug, Default)]
pub(crate) struct NamedMaterials {
    /// Its MTL files.
    pub(crate) libraries: Vec<String>,
    /// The first triangle of each use of a material, in the order of the file.
    pub(crate) uses: Vec<(usize, String)>,
    /// The first line that names one or the other.
    pub(super) first_line: Option<usize>,
}

impl NamedMaterials {
    /// Those of later lines, too, before which there are this many `triangles`.
    fn merge(&mut self, later: Self, triangles: usize) {
        self.libraries.extend(later.libraries);
        self.uses.extend(later.uses.into_iter().map(|(at, name)| (triangles + at, name)));
        self.first_line = self.first_line.or(later.first_line);
    }
}

/// Why a file cannot be read.
#[derive(Clone, Debug)]
pub(super) struct ObjError {
    pub(super) kind: FindingKind,
    /// From 1.
    pub(super) line: usize,
    pub(super) message: String,
}

/// The contents of the lines of a file, or of a part of it.
#[derive(Clone, Debug, Default)]
pub(super) struct ObjLines {
    pub(super) positions: Vec<Vec3>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) normals: Vec<Vec3>,
    /// Of each triangle the positions, texture coordinates and normals of its corners, from 1; 0 where a corner has none. Empty where
    /// the file has none at all.
    pub(super) corners: [Vec<[u32; 3]>; 3],
    /// Linear colours of positions. Empty where none has one; those beyond its end are white.
    pub(super) colors: Vec<Vec3>,
    /// The first line with a colour.
    pub(super) colored_line: Option<usize>,
    pub(super) faults: Faults,
    pub(super) materials: NamedMaterials,
    /// Statements and numbers that are not used.
    pub(super) left: Leftovers,
    /// Smoothing groups, which count where faces have no normals.
    pub(super) smoothing: Leftovers,
    /// The last line that was read.
    line: usize,
}

/// Some lines of a file.
#[derive(Clone, Copy, Debug)]
struct ObjPart<'a> {
    bytes: &'a [u8],
    /// Number of the first line.
    line: usize,
    /// Of `v`, `vt`, `vn` before.
    before: [usize; 3],
    /// The same, within.
    holds: [usize; 3],
}

/// A file in parts.
#[derive(Clone, Debug)]
pub(super) struct ObjParts<'a> {
    parts: Vec<ObjPart<'a>>,
    /// Of `v`, `vt`, `vn` in the whole file.
    pub(super) total: [usize; 3],
}

impl<'a> ObjParts<'a> {
    /// Splits and counts.
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        let mut parts: Vec<ObjPart<'_>> = split(bytes).into_par_iter().map(ObjPart::count).collect();
        let (mut total, mut line) = ([0; 3], 1);
        for part in &mut parts {
            (part.before, total) = (total, [0, 1, 2].map(|kind| total[kind] + part.holds[kind]));
            (part.line, line) = (line, line + part.line);
        }
        Self { parts, total }
    }

    /// Reads everything.
    pub(super) fn read(&self) -> Result<ObjLines, ObjError> {
        let triangles = AtomicUsize::new(0);
        let read: Vec<Result<ObjLines, ObjError>> = self
            .parts
            .par_iter()
            .map(|part| {
                let enough =
                    |new: usize| triangles.fetch_add(new, Ordering::Relaxed) + new > limits::MESH_TRIANGLES;
                part.read(self.total, enough)
            })
            .collect();
        if triangles.into_inner() > limits::MESH_TRIANGLES {
            let message = format!("the mesh has more than {} triangles", limits::MESH_TRIANGLES);
            let line = self.line_of(limits::MESH_TRIANGLES);
            return Err(ObjError { kind: FindingKind::Limit, line, message });
        }
        let mut all = ObjLines::default();
        all.positions.reserve_exact(self.total[0]);
        all.uvs.reserve_exact(self.total[1]);
        all.normals.reserve_exact(self.total[2]);
        let count = |kind: usize| read.iter().flatten().map(|part| part.corners[kind].len()).sum::<usize>();
        let counts = [0, 1, 2].map(count);
        all.corners.iter_mut().zip(counts).for_each(|(corners, count)| corners.reserve_exact(count));
        for part in read {
            let part = part?;
            let ObjLines { positions, uvs, normals, corners, colors, colored_line, .. } = part;
            let (faults, materials, left, smoothing) =
                (part.faults, part.materials, part.left, part.smoothing);
            let line = part.line;
            all.materials.merge(materials, all.corners[0].len());
            if let Some(first) = colored_line {
                all.colored_line.get_or_insert(first);
                all.colors.resize(all.positions.len(), Vec3::ONE);
                all.colors.extend(colors);
            }
            all.left.merge(&left);
            all.smoothing.merge(&smoothing);
            all.positions.extend(positions);
            all.uvs.extend(uvs);
            all.normals.extend(normals);
            all.corners.iter_mut().zip(corners).for_each(|(all, part)| all.extend(part));
            all.faults.merge(&faults);
            all.line = line;
        }
        Ok(all)
    }

    /// The line of a triangle by its index, found by reading once more: for messages.
    pub(super) fn line_of(&self, triangle: usize) -> usize {
        let mut first = 0;
        for part in &self.parts {
            let mut count = 0;
            let enough = |new: usize| {
                count += new;
                first + count > triangle
            };
            match part.read(self.total, enough) {
                Ok(read) if first + count > triangle => return read.line,
                Ok(_) => first += count,
                Err(e) => return e.line,
            }
        }
        1
    }
}

/// Parts of at least [`PART_BYTES`] but the last, each the start of a line of its own, not of one that carries on.
fn split(mut rest: &[u8]) -> Vec<&[u8]> {
    let mut parts = Vec::new();
    while !rest.is_empty() {
        let mut end = PART_BYTES.min(rest.len());
        loop {
            end = memchr::memchr(b'\n', &rest[end..]).map_or(rest.len(), |at| end + at + 1);
            let start = memchr::memrchr(b'\n', &rest[..end - 1]).map_or(0, |at| at + 1);
            if end == rest.len() || !carries_on(&rest[start..end]) {
                break;
            }
        }
        let (part, after) = rest.split_at(end);
        parts.push(part);
        rest = after;
    }
    parts
}

impl<'a> ObjPart<'a> {
    /// A part with its numbers of vertices; `line` is its number of lines until the parts before it are known.
    fn count(bytes: &'a [u8]) -> Self {
        let (mut rest, mut holds, mut line) = (bytes, [0; 3], 0);
        while !rest.is_empty() {
            let (text, lines) = logical_line(rest);
            rest = &rest[text.len()..];
            line += lines;
            if let Some(kind) = vertex_kind(text.trim_ascii()) {
                holds[kind] += 1;
            }
        }
        Self { bytes, line, before: [0; 3], holds }
    }

    /// Reads the lines until there are `enough` triangles, which is told how many a face adds. `total` are the numbers of vertices of the
    /// file.
    fn read(&self, total: [usize; 3], mut enough: impl FnMut(usize) -> bool) -> Result<ObjLines, ObjError> {
        let mut lines = ObjLines::default();
        lines.positions.reserve_exact(self.holds[0]);
        lines.uvs.reserve_exact(self.holds[1]);
        lines.normals.reserve_exact(self.holds[2]);
        let (mut rest, mut next, mut seen) = (self.bytes, self.line, self.before);
        while !rest.is_empty() {
            let (text, count) = logical_line(rest);
            rest = &rest[text.len()..];
            (lines.line, next) = (next, next + count);
            let line = lines.line;
            let error = |kind, message: String| ObjError { kind, line, message };
            if text.len() > limits::MESH_LINE_BYTES {
                let message = format!("this line has more than {} bytes", limits::MESH_LINE_BYTES);
                return Err(error(FindingKind::Limit, message));
            }
            let joined: Vec<u8>;
            let text = if count == 1 {
                text.trim_ascii()
            } else {
                joined = text.iter().map(|b| if *b == b'\\' { b' ' } else { *b }).collect();
                joined.trim_ascii()
            };
            if let Some(kind) = vertex_kind(text) {
                seen[kind] += 1;
                lines.vertex(kind, text).map_err(|message| error(FindingKind::Mesh, message.into()))?;
            } else if let Some(face) = text.strip_prefix(b"f").filter(|rest| starts_blank(rest)) {
                let before = lines.corners[0].len();
                lines.face(face, seen, total);
                if lines.corners[0].len() > before && enough(lines.corners[0].len() - before) {
                    break;
                }
            } else {
                lines.other(text);
            }
        }
        Ok(lines)
    }
}

/// True at the end of a word.
fn starts_blank(rest: &[u8]) -> bool {
    rest.first().is_none_or(u8::is_ascii_whitespace)
}

impl ObjLines {
    /// Reads three numbers of a position or normal, and one or two of a texture coordinate.
    fn vertex(&mut self, kind: usize, line: &[u8]) -> Result<(), &'static str> {
        let mut words = words(line).skip(1);
        let mut number = || words.next().map(|word| number(word).ok_or(()));
        let what = [
            "a position has three numbers",
            "a texture coordinate has two numbers",
            "a normal has three numbers",
        ][kind];
        let mut required = || number().unwrap_or(Err(())).map_err(|()| what);
        if kind == 1 {
            let u = required()?;
            let v = number().unwrap_or(Ok(0.0)).map_err(|()| what)?;
            self.uvs.push(Vec2::new(u, v));
        } else {
            let vector = Vec3::new(required()?, required()?, required()?);
            if kind == 0 { &mut self.positions } else { &mut self.normals }.push(vector);
        }
        if let Some(first) = words.next() {
            self.more_numbers(kind, [first].into_iter().chain(words));
        }
        Ok(())
    }

    /// The words after the numbers that a vertex needs: a colour after a position, or nothing that is used.
    #[cold]
    fn more_numbers<'w>(&mut self, kind: usize, words: impl Iterator<Item = &'w [u8]>) {
        let numbers: Vec<Option<f32>> =
            words.take_while(|word| !word.starts_with(b"#")).take(5).map(number).collect();
        let left = match (kind, numbers.as_slice()) {
            (_, []) => return,
            (0, [Some(r), Some(g), Some(b), more @ ..]) => {
                let color =
                    [*r, *g, *b].map(|v| srgb::decode(if v.is_nan() { 0.0 } else { v.clamp(0.0, 1.0) }));
                self.colored_line.get_or_insert(self.line);
                self.colors.resize(self.positions.len() - 1, Vec3::ONE);
                self.colors.push(color.into());
                if !more.is_empty() {
                    "numbers after a colour"
                } else if [*r, *g, *b].iter().any(|v| !(0.0..=1.0).contains(v)) {
                    "parts of colours beyond 1"
                } else {
                    return;
                }
            }
            // The weight of a point of a curve.
            (0, [Some(1.0)]) => return,
            // The depth of a solid texture, which pictures have not.
            (1, [Some(0.0)]) => return,
            (0, _) => "numbers after a position",
            (1, _) => "numbers after texture coordinates",
            _ => "numbers after a normal",
        };
        self.left.add(left, self.line);
    }

    /// Reads a polygon and cuts it into triangles around its first corner.
    fn face(&mut self, text: &[u8], seen: [usize; 3], total: [usize; 3]) {
        let first = self.corners[0].len();
        let (mut start, mut previous, mut count) = ([0; 3], [0; 3], 0);
        for word in words(text).take_while(|word| !word.starts_with(b"#")) {
            let corner = match corner(word, seen, total) {
                Ok(corner) => corner,
                Err(fault) => {
                    self.corners.iter_mut().for_each(|corners| corners.truncate(first));
                    fault(&mut self.faults).add(|| self.line);
                    return;
                }
            };
            match count {
                0 => start = corner,
                1 => {}
                _ => {
                    for kind in (0..3).filter(|kind| total[*kind] > 0) {
                        self.corners[kind].push([start[kind], previous[kind], corner[kind]]);
                    }
                }
            }
            (previous, count) = (corner, count + 1);
        }
        if count < 3 {
            self.faults.too_small.add(|| self.line);
        }
    }

    /// A line that is neither vertex nor face.
    fn other(&mut self, line: &[u8]) {
        let line_number = self.line;
        match words(line).next().unwrap_or_default() {
            keyword @ (b"usemtl" | b"mtllib") => {
                self.materials.first_line.get_or_insert(line_number);
                let name = String::from_utf8_lossy(line[keyword.len()..].trim_ascii()).into_owned();
                match keyword {
                    b"usemtl" => self.materials.uses.push((self.corners[0].len(), name)),
                    _ => self.materials.libraries.push(name),
                }
            }
            b"" | b"o" | b"g" => {}
            b"s" => {
                let group = String::from_utf8_lossy(words(line).nth(1).unwrap_or_default()).into_owned();
                self.smoothing.add(&format!("s {group}"), line_number);
            }
            keyword if keyword.starts_with(b"#") => {}
            keyword => {
                self.left.add(&String::from_utf8_lossy(&keyword[..keyword.len().min(80)]), line_number)
            }
        }
    }
}

/// The words of a line.
fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

fn number(word: &[u8]) -> Option<f32> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// The list of faults that a corner belongs to.
type FaultOf = fn(&mut Faults) -> &mut Count;

/// The absolute indices (from 1; 0 where not given) of one corner, all in range.
fn corner(word: &[u8], seen: [usize; 3], total: [usize; 3]) -> Result<[u32; 3], FaultOf> {
    let malformed: FaultOf = |f| &mut f.malformed;
    let mut indices = [0; 3];
    for (slot, part) in word.split(|b| *b == b'/').enumerate() {
        if slot > 2 || (slot == 0 && part.is_empty()) {
            return Err(malformed);
        }
        if part.is_empty() {
            continue;
        }
        let index = index(part).ok_or(malformed)?;
        let absolute =
            if index < 0 { index.saturating_add(seen[slot] as i64).saturating_add(1) } else { index };
        let in_range = u32::try_from(absolute).ok().filter(|i| (1..=total[slot]).contains(&(*i as usize)));
        indices[slot] = in_range.ok_or::<FaultOf>(|f| &mut f.out_of_range)?;
    }
    Ok(indices)
}

/// A whole number.
fn index(word: &[u8]) -> Option<i64> {
    if word.len() < 10 && word.iter().all(u8::is_ascii_digit) {
        return Some(word.iter().fold(0, |n, digit| 10 * n + i64::from(digit - b'0')));
    }
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// True for a line that the next one continues: a backslash is its last character.
fn carries_on(line: &[u8]) -> bool {
    line.trim_ascii_end().ends_with(b"\\")
}

/// The first line of `rest` with its end, and of how many lines in the file it is made: a backslash at the end of one
/// carries on in the next, except after a comment.
fn logical_line(rest: &[u8]) -> (&[u8], usize) {
    let end = |from: usize| memchr::memchr(b'\n', &rest[from..]).map_or(rest.len(), |e| from + e + 1);
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

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> ObjLines {
        ObjParts::new(text.as_bytes()).read().expect("valid")
    }

    #[test]
    fn a_backslash_carries_on_in_the_next_line() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 \\\r\n1 0\n# note \\\nv 0 1 0\nf 1 2 \\\n3 \\\n4\nf 1 2 9\nf 1 2 \\\n\nf 1 2 3";
        let read = lines(text);
        assert_eq!(read.positions, [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
        assert_eq!(read.corners[0], [[1, 2, 3], [1, 3, 4], [1, 2, 3]]);
        let faults = read.faults;
        assert_eq!((faults.out_of_range.times, faults.out_of_range.first_line), (1, 10));
        assert_eq!((faults.too_small.times, faults.too_small.first_line), (1, 11));
    }

    #[test]
    fn bad_faces_are_left_out_and_counted() {
        let text = "v 0 0 0 1 0 0\r\nv 1 0 0\nf 1 2 3\nv 0 1 0\nf -3 -2 -1\nf 1 2 4\nf 1 2\nf 0 1 2\nf 1 x 2\nl 1 2\n\
                    f -9223372036854775808 1 2\nf 1/1 2 3\nwhat 1\n# f 1 2 3\nusemtl a\nf 1 2 3 # end\nf +1 2 3\nf 1 2 4294967297";
        let read = lines(text);
        assert_eq!(read.corners[0], [[1, 2, 3]; 4]);
        assert_eq!(read.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
        let faults = read.faults;
        assert_eq!(faults.out_of_range, Count { times: 5, first_line: 6 });
        assert_eq!(faults.too_small, Count { times: 1, first_line: 7 });
        assert_eq!(faults.malformed, Count { times: 1, first_line: 9 });
        assert_eq!(read.left.note(), Some(("not used: `l`, `what`".to_owned(), 10)));
        assert_eq!((read.colored_line, read.colors), (Some(1), vec![Vec3::X]));
        assert_eq!(read.materials.uses, [(2, "a".to_owned())]);
        assert_eq!(read.materials.first_line, Some(15));
    }

    /// Parts begin with lines of their own, wherever the file is cut.
    #[test]
    fn lines_that_carry_on_are_not_cut() {
        let line = format!("v 1 \\\n{}\\\n2 3\n", " ".repeat(60));
        let text = line.repeat(3 * PART_BYTES / line.len());
        let parts = ObjParts::new(text.as_bytes());
        assert!(parts.parts.len() > 1 && parts.parts.iter().all(|part| part.bytes.starts_with(b"v 1")));
        let read = parts.read().expect("valid");
        assert!(
            read.positions.len() == parts.total[0]
                && read.positions.iter().all(|p| *p == Vec3::new(1.0, 2.0, 3.0))
        );
    }
}
