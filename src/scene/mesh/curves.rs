//! Files of curves: hair, fur, strands. Mitsuba's format: a line for each control point, `x y z radius`, and an empty line between
//! curves.

use std::path::Path;

use glam::Vec4;

use crate::scene::desc::{CurveBasis, Curves};
use crate::scene::diagnostic::{FindingKind, LineAt, SceneError, SceneWarning};
use crate::scene::limits;

/// Curves, with what was wrong with their file.
#[derive(Clone, Debug)]
pub struct CurvesRead {
    /// The curves; at least one.
    pub curves: Curves,
    /// One warning for each kind of fault, at its first place.
    pub warnings: Vec<SceneWarning>,
}

/// Reads the text of a file of curves; messages call it `path`.
///
/// # Errors
///
/// [`SceneError`] with file and line: a line that is no control point, or no curve with enough of them.
pub fn parse(path: &Path, bytes: &[u8], basis: CurveBasis) -> Result<CurvesRead, SceneError> {
    let name = path.to_string_lossy();
    let finding = |kind, line: usize, message: String| {
        let text = bytes.split(|b| *b == b'\n').nth(line.saturating_sub(1)).unwrap_or_default();
        let text = String::from_utf8_lossy(&text[..text.len().min(200)]).trim_end().to_owned();
        let at = LineAt { file: &name, text: &text, line: line.max(1), column: 1, range: (0, text.len()) };
        crate::scene::diagnostic::Finding::new(kind, at, message)
    };
    let mut curves = Curves { basis, points: Vec::new(), starts: Vec::new() };
    // Of the current curve.
    let mut start = 0;
    let (mut short, mut first_short) = (0, 0);
    let lines = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).split(|b| *b == b'\n');
    // The empty line at the end closes the last curve.
    for (i, line) in lines.chain(std::iter::once(&b""[..])).enumerate() {
        let line = line.trim_ascii();
        if !line.is_empty() {
            let point = control_point(line).ok_or_else(|| {
                let message =
                    "a line of a curve is `x y z radius`: finite numbers, and a radius that is not negative";
                let found = finding(FindingKind::Mesh, i + 1, message.to_owned());
                found.help("an empty line stands between curves").error()
            })?;
            if curves.points.len() >= limits::CURVE_POINTS {
                let message = format!("the curves have more than {} control points", limits::CURVE_POINTS);
                return Err(finding(FindingKind::Limit, i + 1, message).error());
            }
            curves.points.push(point);
            continue;
        }
        let count = curves.points.len() - start;
        if count >= basis.points() {
            curves.starts.extend((start..=curves.points.len() - basis.points()).map(|s| s as u32));
        } else if count > 0 {
            (short, first_short) = (short + 1, if short == 0 { i } else { first_short });
            curves.points.truncate(start);
        }
        start = curves.points.len();
    }
    let needed = format!("{} control points or more", basis.points());
    if curves.starts.is_empty() {
        let found = finding(FindingKind::Mesh, 1, format!("no curve of this file has {needed}"));
        return Err(found.help("a line for each of them: `x y z radius`").error());
    }
    let mut warnings = Vec::new();
    if short > 0 {
        let message = format!("{short} curves do not have {needed}: dropped");
        warnings
            .push(finding(FindingKind::Mesh, first_short, message).label("the first ends here").warning());
    }
    Ok(CurvesRead { curves, warnings })
}

/// Position and radius. What stands after them has no meaning, as in Mitsuba.
fn control_point(line: &[u8]) -> Option<Vec4> {
    let mut words = std::str::from_utf8(line).ok()?.split_ascii_whitespace().map(str::parse::<f32>);
    let mut next = || words.next()?.ok();
    let point = Vec4::new(next()?, next()?, next()?, next()?);
    (point.is_finite() && point.w >= 0.0).then_some(point)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, basis: CurveBasis) -> Result<CurvesRead, SceneError> {
        parse("c.txt".as_ref(), text.as_bytes(), basis)
    }

    #[test]
    fn curves_stand_between_empty_lines() {
        let text = "\n0 0 0 1\r\n 1 0 0 1 9\n\t2 0 0 .5\n\n \n5 0 0 1\n\n7 0 0 1\n8 0 0 1\n9 0 0 1\n10 0 0 1";
        let linear = read(text, CurveBasis::Linear).expect("valid");
        assert_eq!(linear.curves.starts, [0, 1, 3, 4, 5]);
        assert_eq!(linear.curves.points[3], Vec4::new(7.0, 0.0, 0.0, 1.0));
        assert_eq!(linear.warnings.len(), 1);
        let cubic = read(text, CurveBasis::BSpline).expect("valid");
        assert_eq!((cubic.curves.starts, cubic.curves.points.len()), (vec![0], 4));
    }

    #[test]
    fn errors_have_a_line() {
        for (text, line) in [
            ("", 1),
            ("0 0 0 1\n1 0 0\n", 2),
            ("0 0 0 1\n\n1 0 0 -1\n", 3),
            ("0 0 0 nan\n", 1),
            ("# hair\n", 1),
            ("0 0 0 1\n", 1),
        ] {
            assert_eq!(read(text, CurveBasis::Linear).expect_err(text).location().1, line, "{text}");
        }
    }
}
