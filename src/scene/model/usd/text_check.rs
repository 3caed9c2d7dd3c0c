//! Layers as text before the crate reads them: its parser goes down a level for each bracket, so that a file of brackets would use
//! up the stack; and it does not know numbers that begin with their point, as `.5`.

use super::prim::leads_up;

/// Brackets within brackets.
const NESTING: usize = 512;

/// A layer with a 0 before each number that begins with its point.
///
/// # Errors
///
/// The line and what is wrong there.
pub(super) fn checked(bytes: Vec<u8>) -> Result<Vec<u8>, String> {
    let points = points(&bytes)?;
    if points.is_empty() {
        return Ok(bytes);
    }
    let mut out = Vec::with_capacity(bytes.len() + points.len());
    let mut from = 0;
    for point in points {
        out.extend_from_slice(&bytes[from..point]);
        out.push(b'0');
        from = point;
    }
    out.extend_from_slice(&bytes[from..]);
    Ok(out)
}

/// The places of points that numbers begin with.
fn points(bytes: &[u8]) -> Result<Vec<usize>, String> {
    let mut points = Vec::new();
    let (mut depth, mut line, mut i) = (0_usize, 1, 0);
    while let Some(byte) = bytes.get(i) {
        match byte {
            b'\n' => line += 1,
            b'#' => i += bytes[i..].iter().position(|b| *b == b'\n').unwrap_or(bytes.len() - i) - 1,
            b'"' | b'\'' => {
                let (end, lines) = after_string(bytes, i);
                (i, line) = (end, line + lines);
                continue;
            }
            b'@' if bytes[i..].starts_with(b"@@@") => {
                let rest = &bytes[i + 3..];
                i += rest.windows(3).position(|w| w == b"@@@").map_or(rest.len(), |end| end + 3) + 2;
            }
            b'@' => {
                // Asset paths have no line breaks and may hold any bracket.
                let rest = &bytes[i + 1..];
                i += rest.iter().position(|b| *b == b'@' || *b == b'\n').unwrap_or(rest.len());
                if bytes.get(i + 1) == Some(&b'@') {
                    i += 1;
                }
            }
            b'<' => {
                let end = bytes[i..].iter().position(|b| *b == b'>').unwrap_or(bytes.len() - i);
                if !is_path(&bytes[i + 1..(i + end).max(i + 1)]) {
                    return Err(format!("line {line}: what stands in `<` and `>` is no path"));
                }
                i += end;
            }
            b'(' | b'[' | b'{' => {
                depth += 1;
                if depth > NESTING {
                    return Err(format!("line {line}: more than {NESTING} brackets are open"));
                }
            }
            b'.' if bytes.get(i + 1).is_some_and(u8::is_ascii_digit) => {
                let before = i.checked_sub(1).map_or(b' ', |before| bytes[before]);
                if before.is_ascii_whitespace() || b"(,[-+=:".contains(&before) {
                    points.push(i);
                }
            }
            b')' | b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        i += 1;
    }
    Ok(points)
}

/// Whether a path has a point only in its last part, or in parts of points alone: the crate looks for the prim above any other
/// without end.
fn is_path(path: &[u8]) -> bool {
    let path = String::from_utf8_lossy(path);
    let plain = path.split('[').next().unwrap_or_default();
    let mut parts = plain.rsplit('/');
    parts.next();
    !path.contains(|c: char| c.is_whitespace() || c == '"' || c == '<')
        && parts.all(|part| !part.contains('.') || part.chars().all(|c| c == '.'))
        && openusd::sdf::Path::new(&path).map_or(true, |path| leads_up(&path))
}

/// The place after a string that begins at `start`, and the line breaks in it.
fn after_string(bytes: &[u8], start: usize) -> (usize, usize) {
    let quote = bytes[start];
    let long = bytes[start..].starts_with(&[quote; 3]);
    let (mut i, mut lines) = (start + if long { 3 } else { 1 }, 0);
    while let Some(byte) = bytes.get(i) {
        match *byte {
            b'\\' => i += 1,
            b'\n' if !long => return (i, lines),
            b'\n' => lines += 1,
            byte if byte == quote && (!long || bytes[i..].starts_with(&[quote; 3])) => {
                return (i + if long { 3 } else { 1 }, lines);
            }
            _ => {}
        }
        i += 1;
    }
    (i, lines)
}
