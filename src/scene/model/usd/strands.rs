//! Curves and points: `BasisCurves` as files of curves, `Points` as small balls.

use std::fmt::Write as _;

use glam::Vec3;

use super::mesh::Polygons;
use super::prim::PrimReader;
use super::primvars::{Interpolation, Primvar};
use super::values::{self, Tuples};
use crate::scene::limits;

/// Pieces of a line for each segment of a curve that is no B-spline.
const PIECES: usize = 8;

/// A file of curves and the plugin that reads it.
pub(super) struct CurveFile {
    pub(super) plugin: &'static str,
    pub(super) text: String,
}

/// How the control points of a cubic curve act.
#[derive(Clone, Copy, PartialEq, Eq)]
enum StrandBasis {
    Linear,
    BSpline,
    Bezier,
    CatmullRom,
}

/// Reads a `BasisCurves`; nothing where it has no curve that can be shown.
pub(super) fn curves(prim: &PrimReader) -> Option<CurveFile> {
    let points = prim.tuples("points").filter(|points| points.width == 3)?.all::<3>();
    let counts = prim.integers("curveVertexCounts").unwrap_or_default();
    let basis_word = prim.word("basis");
    let basis = match (prim.word("type").as_deref(), basis_word.as_deref()) {
        (Some("linear"), _) => StrandBasis::Linear,
        (_, Some("bspline")) => StrandBasis::BSpline,
        (_, None | Some("bezier")) => StrandBasis::Bezier,
        (_, Some("catmullRom")) => StrandBasis::CatmullRom,
        _ => {
            prim.fault("curves of an unknown basis are left out");
            return None;
        }
    };
    let wrap = prim.word("wrap").unwrap_or_default();
    if prim.has("normals") {
        prim.tuples("normals");
        prim.fault("curves are round: the normals that make them ribbons are not used");
    }
    let widths = widths(prim, points.len(), counts.len());
    if points.len() > limits::CURVE_POINTS {
        prim.fault(format!("curves with more than {} points are left out", limits::CURVE_POINTS));
        return None;
    }
    let (mut at, mut text, mut written) = (0_usize, String::new(), 0_usize);
    for (curve, count) in counts.iter().enumerate() {
        let count = usize::try_from(*count).unwrap_or(usize::MAX);
        let Some(end) = at.checked_add(count).filter(|end| *end <= points.len()) else {
            prim.fault("curves have more points than are listed: the others are left out");
            break;
        };
        let mut controls: Vec<[f32; 4]> = (at..end)
            .map(|i| {
                let [x, y, z] = points[i];
                [x, y, z, 0.5 * widths(curve, i).max(0.0)]
            })
            .collect();
        at = end;
        if controls.iter().flatten().any(|v| !v.is_finite()) {
            prim.fault("curves with points that are no numbers are left out");
            continue;
        }
        wrapped(&mut controls, basis, &wrap);
        let line = if basis == StrandBasis::BSpline { controls } else { polyline(&controls, basis) };
        written += line.len();
        if written > limits::CURVE_POINTS {
            prim.fault(format!("curves beyond {} points are left out", limits::CURVE_POINTS));
            break;
        }
        for [x, y, z, radius] in line {
            let _ = writeln!(text, "{x} {y} {z} {radius}");
        }
        text.push('\n');
    }
    let least = if basis == StrandBasis::BSpline { 4 } else { 2 };
    if written < least {
        prim.fault("curves without points are left out");
        return None;
    }
    let plugin = if basis == StrandBasis::BSpline { "bsplinecurve" } else { "linearcurve" };
    Some(CurveFile { plugin, text })
}

/// The diameter at a point of a curve.
fn widths(prim: &PrimReader, points: usize, curves: usize) -> impl Fn(usize, usize) -> f32 {
    let name = if prim.has("primvars:widths") { "primvars:widths" } else { "widths" };
    let widths = prim.tuples(name).filter(|widths| widths.width == 1 && widths.len() > 0);
    let word = prim.metadata(name, "interpolation").and_then(|value| values::word(&value));
    let widths = widths.map_or_else(Vec::new, |widths| widths.values);
    if widths.is_empty() {
        prim.fault("curves or points without widths have a width of 1");
    }
    let by_curve = widths.len() == curves && word.as_deref() == Some("uniform");
    if ![1, points].contains(&widths.len()) && !by_curve && !widths.is_empty() {
        prim.fault(
            "the widths of curves fit neither their points nor their number: the first is used for all",
        );
    }
    move |curve, point| match widths.len() {
        0 => 1.0,
        n if n == points => widths[point],
        _ if by_curve => widths.get(curve).copied().unwrap_or(1.0),
        _ => widths[0],
    }
}

/// Adds the points that `wrap` asks for.
fn wrapped(controls: &mut Vec<[f32; 4]>, basis: StrandBasis, wrap: &str) {
    let (Some(first), Some(last)) = (controls.first().copied(), controls.last().copied()) else { return };
    let n = controls.len();
    match (wrap, basis) {
        ("periodic", StrandBasis::Linear | StrandBasis::Bezier) => controls.push(first),
        ("periodic", _) => controls.extend((0..3).map(|i| controls[i % n]).collect::<Vec<_>>()),
        ("pinned", StrandBasis::BSpline) => {
            // Three points at the same place: the curve begins there.
            controls.splice(0..0, [first; 2]);
            controls.extend([last; 2]);
        }
        ("pinned", StrandBasis::CatmullRom) => {
            let beyond = |end: [f32; 4], next: [f32; 4]| std::array::from_fn(|i| 2.0 * end[i] - next[i]);
            let (before, after) =
                (beyond(first, controls[1.min(n - 1)]), beyond(last, controls[n.saturating_sub(2)]));
            controls.insert(0, before);
            controls.push(after);
        }
        _ => {}
    }
    controls.iter_mut().for_each(|point| point[3] = point[3].max(0.0));
}

/// A curve as a line.
fn polyline(controls: &[[f32; 4]], basis: StrandBasis) -> Vec<[f32; 4]> {
    let step = match basis {
        StrandBasis::Linear => return controls.to_vec(),
        StrandBasis::Bezier => 3,
        _ => 1,
    };
    let mut line = Vec::new();
    let segments = controls.len().saturating_sub(1) / step;
    for segment in 0..segments {
        let Some(p) = controls.get(segment * step..segment * step + 4) else { break };
        let pieces = if line.is_empty() { 0..=PIECES } else { 1..=PIECES };
        for piece in pieces {
            let t = piece as f32 / PIECES as f32;
            let s = 1.0 - t;
            let weights = match basis {
                StrandBasis::Bezier => [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t],
                _ => [
                    0.5 * (-t + 2.0 * t * t - t * t * t),
                    0.5 * (2.0 - 5.0 * t * t + 3.0 * t * t * t),
                    0.5 * (t + 4.0 * t * t - 3.0 * t * t * t),
                    0.5 * (-t * t + t * t * t),
                ],
            };
            let mut point: [f32; 4] = std::array::from_fn(|i| (0..4).map(|k| weights[k] * p[k][i]).sum());
            point[3] = point[3].max(0.0);
            line.push(point);
        }
    }
    line
}

/// Reads a `Points` as balls of 80 triangles (20 where there are many); nothing where there is none.
pub(super) fn points(prim: &PrimReader) -> Option<(Polygons, usize)> {
    let points = prim.tuples("points").filter(|points| points.width == 3)?.all::<3>();
    let widths = widths(prim, points.len(), usize::MAX);
    prim.used("ids");
    let (directions, faces) = ball(points.len() <= 10_000);
    let mut mesh = Polygons::default();
    let mut normals = Vec::new();
    for (i, point) in points.iter().enumerate() {
        let radius = 0.5 * widths(0, i);
        let center = Vec3::from(*point);
        if !(center.is_finite() && radius > 0.0 && radius.is_finite()) {
            continue;
        }
        let first = mesh.points.len() as u32;
        mesh.points.extend(directions.iter().map(|d| center + radius * *d));
        normals.extend(directions.iter().flat_map(|d| d.to_array()));
        mesh.corners.extend(faces.iter().flatten().map(|i| first + i));
        mesh.counts.extend(faces.iter().map(|_| 3));
    }
    mesh.normals = Some(Primvar::of(Tuples::new(3, normals), Interpolation::Vertex));
    (!mesh.points.is_empty()).then_some((mesh, faces.len()))
}

/// The corners of an icosahedron, or of one whose faces are cut into four, and its faces.
fn ball(fine: bool) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let golden = f32::midpoint(1.0, 5.0_f32.sqrt());
    let mut points = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        points.extend([Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)]);
    }
    let points: Vec<Vec3> = points.iter().map(|p| p.normalize()).collect();
    let mut faces = Vec::new();
    let near = |a: usize, b: usize| points[a].distance(points[b]) < 1.2;
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let outwards = (points[b] - points[a]).cross(points[c] - points[a]).dot(points[a]) > 0.0;
                    faces.push(
                        [a, if outwards { b } else { c }, if outwards { c } else { b }].map(|i| i as u32),
                    );
                }
            }
        }
    }
    if !fine {
        return (points, faces);
    }
    let mut all = points;
    let mut halves = std::collections::BTreeMap::new();
    let mut cut = Vec::new();
    for [a, b, c] in faces {
        let mut half = |i: u32, j: u32| {
            *halves.entry((i.min(j), i.max(j))).or_insert_with(|| {
                all.push((all[i as usize] + all[j as usize]).normalize());
                all.len() as u32 - 1
            })
        };
        let (ab, bc, ca) = (half(a, b), half(b, c), half(c, a));
        cut.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    (all, cut)
}
