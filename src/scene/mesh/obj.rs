//! Wavefront OBJ, through the crate `tobj`, with checks before and after it.

use std::path::Path;

use glam::{DMat3, Vec2, Vec3};
use tobj::{LoadError, LoadOptions};

use super::check::{self, Repairs};
use super::clean::{CleanLines, Count, Faults, Keep};
use super::{MeshError, MeshOptions, MeshRead, normals};
use crate::scene::desc::Mesh;
use crate::scene::diagnostic::{Finding, FindingKind, LineAt, SceneError, SceneWarning};
use crate::scene::files::read_bytes;
use crate::scene::limits;

/// Reads the OBJ file at `path`. All its objects and groups become one mesh; its materials are not used.
///
/// # Errors
///
/// [`MeshError::Unreadable`] when the file cannot be opened or is too large, [`MeshError::At`] with the
/// line when it is no OBJ file or nothing of it can be traced.
pub fn load(path: &Path, options: &MeshOptions) -> Result<MeshRead, MeshError> {
    let bytes =
        read_bytes(path, limits::MESH_BYTES).map_err(|e| MeshError::Unreadable(e.kind(), e.to_string()))?;
    Ok(parse(&path.to_string_lossy(), &bytes, options)?)
}

/// Reads OBJ text; messages call it `name`.
///
/// # Errors
///
/// [`SceneError`] with file and line.
pub fn parse(name: &str, bytes: &[u8], options: &MeshOptions) -> Result<MeshRead, SceneError> {
    // Some editors put a byte order mark first, which would cost the first vertex and shift all others.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let file = ObjFile { name, bytes };
    let mut keep = Keep { uvs: true, normals: !options.face_normals };
    let mut warnings = Vec::new();
    let (mut raw, mut faults, mut lines) = file.read(keep)?;
    // Where some corners have normals or coordinates and others have not, they belong to nobody.
    let partial = |have: usize, per: usize| have != 0 && have / per != raw.positions.len() / 3;
    let whole = Keep { uvs: !partial(raw.texcoords.len(), 2), normals: !partial(raw.normals.len(), 3) };
    for (kept, what) in [(whole.uvs, "texture coordinates"), (whole.normals, "normals")] {
        if !kept {
            let message = format!("some corners have {what} and others have not: none are used");
            warnings.push(file.finding(1, message).warning());
        }
    }
    if !whole.uvs || !whole.normals {
        keep = Keep { uvs: whole.uvs, normals: keep.normals && whole.normals };
        (raw, faults, lines) = file.read(keep)?;
    }
    let mut mesh = assemble(&raw, options.flip_tex_coords);
    let line_of = |i: usize| {
        let next = lines.partition_point(|(first, _)| *first as usize <= i);
        next.checked_sub(1).map_or(1, |f| lines[f].1 as usize)
    };
    let repairs = check::repair(&mut mesh, line_of);
    file.report(&faults, &repairs, &mut warnings);
    if mesh.triangles.is_empty() {
        let line =
            [repairs.flat, repairs.not_finite, faults.out_of_range, faults.too_small, faults.malformed];
        let line = line.iter().map(|c| c.first_line).max().unwrap_or(1).max(1);
        let found = file.finding(line, "this mesh has no triangle that can be traced");
        return Err(found.help("is it an OBJ file? faces are lines like `f 1 2 3`").error());
    }
    let world = options.world.map_or(DMat3::IDENTITY, |m| DMat3::from_cols_array(&m.map(f64::from_bits)));
    if mesh.normals.is_empty() && !options.face_normals {
        mesh.normals = normals::from_faces(&mesh, &world);
    } else {
        let bad = normals::mend(&mut mesh, &world);
        if bad > 0 {
            warnings.push(
                file.finding(1, format!("{bad} normals have no direction: made from the faces")).warning(),
            );
        }
    }
    Ok(MeshRead { bytes: bytes.len(), mesh, warnings })
}

/// The mesh as this program keeps it.
fn assemble(raw: &tobj::Mesh, flip: bool) -> Mesh {
    let triples = |v: &[f32]| v.chunks_exact(3).map(Vec3::from_slice).collect();
    let uv = |c: &[f32]| Vec2::new(c[0], if flip { 1.0 - c[1] } else { c[1] });
    Mesh {
        positions: triples(&raw.positions),
        normals: triples(&raw.normals),
        uvs: raw.texcoords.chunks_exact(2).map(uv).collect(),
        triangles: raw.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    }
}

/// First triangle and line of each face.
type FaceLines = Vec<(u32, u32)>;

/// A file for messages.
struct ObjFile<'a> {
    name: &'a str,
    bytes: &'a [u8],
}

impl ObjFile<'_> {
    /// Lets the library read what passes the first check.
    fn read(&self, keep: Keep) -> Result<(tobj::Mesh, Faults, FaceLines), SceneError> {
        let options = LoadOptions { single_index: true, triangulate: true, ..LoadOptions::default() };
        let mut lines = CleanLines::new(self.bytes, keep);
        let loaded = tobj::load_obj_buf(&mut lines, &options, |_| Err(LoadError::OpenFileFailed));
        match loaded {
            Ok((models, _)) => {
                let mesh = models.into_iter().next().map(|m| m.mesh).unwrap_or_default();
                Ok((mesh, lines.faults, lines.faces))
            }
            Err(e) => {
                let (kind, message) = match lines.excess {
                    Some(message) => (FindingKind::Limit, message),
                    None => (FindingKind::Mesh, describe(e)),
                };
                Err(self.finding_of(kind, lines.number, message).error())
            }
        }
    }

    fn finding(&self, line: usize, message: impl Into<String>) -> Finding {
        self.finding_of(FindingKind::Mesh, line, message.into())
    }

    fn finding_of(&self, kind: FindingKind, line: usize, message: String) -> Finding {
        let text = self.bytes.split(|b| *b == b'\n').nth(line.saturating_sub(1)).unwrap_or_default();
        let text = String::from_utf8_lossy(&text[..text.len().min(1000)]);
        let text = text.trim_end();
        Finding::new(
            kind,
            LineAt { file: self.name, text, line: line.max(1), column: 1, range: (0, text.len()) },
            message,
        )
    }

    /// One warning for each kind of fault.
    fn report(&self, faults: &Faults, repairs: &Repairs, warnings: &mut Vec<SceneWarning>) {
        let dropped: [(Count, &str); 6] = [
            (faults.malformed, "faces are not made of indices: dropped"),
            (faults.out_of_range, "faces have an index that the file does not have: dropped"),
            (faults.too_small, "faces, lines or points have fewer than three vertices: dropped"),
            (repairs.not_finite, "triangles have a vertex that is not a finite number: dropped"),
            (repairs.flat, "triangles have no area: dropped"),
            (faults.unknown, "lines start with a keyword that is not supported: not used"),
        ];
        for (count, what) in dropped.into_iter().filter(|(c, _)| c.times > 0) {
            let found = self.finding(count.first_line, format!("{} {what}", count.times));
            warnings.push(found.label("the first").warning());
        }
        if repairs.bad_uvs > 0 {
            let message = format!("{} texture coordinates are not finite: set to 0", repairs.bad_uvs);
            warnings.push(self.finding(1, message).warning());
        }
        if faults.materials.times > 0 {
            let found =
                self.finding(faults.materials.first_line, "materials named in an OBJ file are not used");
            warnings.push(found.help("give the shape a bsdf in the scene file").advice());
        }
    }
}

/// The library's errors in words.
fn describe(error: LoadError) -> String {
    match error {
        LoadError::PositionParseError => "a position has three numbers".into(),
        LoadError::NormalParseError => "a normal has three numbers".into(),
        LoadError::TexcoordParseError => "a texture coordinate has two numbers".into(),
        other => format!("this cannot be read: {other}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    fn read(text: &str) -> MeshRead {
        parse("a.obj", text.as_bytes(), &MeshOptions { flip_tex_coords: true, ..MeshOptions::default() })
            .expect("valid")
    }

    #[test]
    fn a_byte_order_mark_costs_no_vertex() {
        let m = read(&format!("\u{feff}{SQUARE}f 1 2 3 4\n"));
        assert_eq!((m.mesh.positions.len(), m.mesh.triangles.len(), m.warnings.len()), (4, 2, 0));
    }

    #[test]
    fn a_quad_becomes_two_triangles_with_normals() {
        let m = read(&format!("{SQUARE}vt 0 0.25\nf 1/1 2/1 3/1 4/1\n")).mesh;
        assert_eq!(m.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(m.normals, [Vec3::Z; 4]);
        assert_eq!(m.uvs, [Vec2::new(0.0, 0.75); 4]);
    }

    #[test]
    fn faults_are_dropped_and_named_with_their_line() {
        let read = read(&format!("{SQUARE}v nan 0 0\nf 1 2 3\nf 1 2 9\nf 1 2 5\nf 1 1 2\nf 1 2\n"));
        assert_eq!(read.mesh.triangles.len(), 1);
        let lines: Vec<usize> = read.warnings.iter().map(|w| w.location().1).collect();
        assert_eq!(lines, [7, 10, 8, 9], "{:?}", read.warnings);
    }

    #[test]
    fn mixed_corners_lose_their_normals_but_not_their_place() {
        let read = read(&format!("{SQUARE}vn 0 0 1\nf 1//1 2//1 3//1\nf 1 3 4\n"));
        assert_eq!(read.mesh.triangles.len(), 2);
        assert_eq!(read.mesh.normals.len(), read.mesh.positions.len());
        assert_eq!(read.warnings.len(), 1);
    }

    #[test]
    fn errors_have_a_line() {
        let options = MeshOptions::default();
        for (text, line) in
            [("v 0 0 0\nv 1 x 0\nf 1 2 2\n", 2), ("", 1), ("hello", 1), ("v 1 1\n", 1), ("vn 0 0\n", 1)]
        {
            let e = parse("a.obj", text.as_bytes(), &options).expect_err(text);
            assert_eq!(e.location().1, line, "{text}: {e:?}");
        }
        let long = format!("v 0 0 0\nf{}\n", " 1".repeat(limits::MESH_LINE_BYTES));
        let e = parse("a.obj", long.as_bytes(), &options).expect_err("too long");
        assert_eq!((e.kind(), e.location().1), (FindingKind::Limit, 2));
    }
}
