//! Wavefront OBJ, through the crate `tobj`, with checks before it. All objects and groups of a file become one mesh; its materials
//! are not used.

use glam::{Vec2, Vec3};
use tobj::{LoadError, LoadOptions};

use super::MeshOptions;
use super::clean::{CleanLines, Faults, Keep};
use super::file::{MeshFile, RawMesh};
use crate::scene::desc::Mesh;
use crate::scene::diagnostic::{FindingKind, SceneError};

/// Reads an OBJ file.
pub(super) fn read<'a>(file: &MeshFile<'a>, options: &MeshOptions) -> Result<RawMesh<'a>, SceneError> {
    let mut keep = Keep { uvs: true, normals: !options.face_normals };
    let mut warnings = Vec::new();
    let (mut raw, mut faults, mut lines) = clean(file, keep)?;
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
        (raw, faults, lines) = clean(file, keep)?;
    }
    if faults.materials.times > 0 {
        let found = file.finding(faults.materials.first_line, "materials named in an OBJ file are not used");
        warnings.push(found.help("give the shape a bsdf in the scene file").advice());
    }
    let line_of = move |triangle: usize| {
        let next = lines.partition_point(|(first, _)| *first as usize <= triangle);
        next.checked_sub(1).map_or(1, |face| lines[face].1 as usize)
    };
    Ok(RawMesh {
        mesh: assemble(&raw, options.flip_tex_coords),
        dropped: vec![
            (faults.malformed, "faces are not made of indices: dropped"),
            (faults.out_of_range, "faces have an index that the file does not have: dropped"),
            (faults.too_small, "faces, lines or points have fewer than three vertices: dropped"),
            (faults.unknown, "lines start with a keyword that is not supported: not used"),
        ],
        warnings,
        line_of: Box::new(line_of),
        advice: "is it an OBJ file? faces are lines like `f 1 2 3`",
    })
}

/// First triangle and line of each face.
type FaceLines = Vec<(u32, u32)>;

/// Lets the library read what passes the first check.
fn clean(file: &MeshFile<'_>, keep: Keep) -> Result<(tobj::Mesh, Faults, FaceLines), SceneError> {
    let options = LoadOptions { single_index: true, triangulate: true, ..LoadOptions::default() };
    // Some editors put a byte order mark first, which would cost the first vertex and shift all others.
    let mut lines = CleanLines::new(file.bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(file.bytes), keep);
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
            Err(file.finding_of(kind, lines.number, message).error())
        }
    }
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
    use glam::Vec3;

    use super::*;
    use crate::scene::limits;
    use crate::scene::mesh::{MeshRead, parse};

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
    fn a_position_with_two_normals_is_two_vertices() {
        let m = read(&format!("{SQUARE}vn 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//2 3//1 4//2\n")).mesh;
        assert_eq!(m.triangles, [[0, 1, 2], [3, 2, 4]]);
        assert_eq!(m.positions[3], m.positions[0]);
        assert_eq!(m.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::Y, Vec3::Y]);
    }

    #[test]
    fn a_position_with_a_hundred_normals_is_a_hundred_vertices() {
        let normals: String = (0..100).map(|i| format!("vn {i} 0 1\n")).collect();
        let faces: String = (1..=100).map(|i| format!("f 1//{i} 2//1 3//1\n")).collect();
        let m = read(&format!("{SQUARE}{normals}{faces}{faces}")).mesh;
        assert_eq!((m.positions.len(), m.triangles.len()), (102, 200));
        assert_eq!(m.triangles[..100], m.triangles[100..]);
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

    /// A file of several parts, read by several threads, with indices across them in both directions.
    #[test]
    fn parts_of_a_large_file_fit_together() {
        let mut text = String::from("f 1 2 3\n");
        for i in 0..80_000 {
            text += &format!("v {i} 0 0\nv {i} 1 0\nv {i} 0 1\nf -3 -2 -1\n");
        }
        text += "f 1 2 240001\nf 3 2 1\n";
        assert!(text.len() > 3 << 20);
        let MeshRead { mesh, warnings, .. } = read(&text);
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (240_000, 80_002));
        assert_eq!(mesh.triangles[0], [0, 1, 2]);
        assert!((0..80_000).all(|i| mesh.triangles[i + 1] == [0, 1, 2].map(|k| 3 * i as u32 + k)));
        assert!((0..80_000).all(|i| mesh.positions[3 * i + 1] == Vec3::new(i as f32, 1.0, 0.0)));
        assert_eq!(warnings.iter().map(|w| w.location().1).collect::<Vec<_>>(), [320_002]);
        let bad = text.replace("v 79999 1 0", "v 79999 1 0\nf 1 1 2");
        assert_eq!(read_lines(&bad), [320_003, 320_000]);
    }

    fn read_lines(text: &str) -> Vec<usize> {
        read(text).warnings.iter().map(|w| w.location().1).collect()
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
