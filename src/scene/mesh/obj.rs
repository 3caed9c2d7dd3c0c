//! Wavefront OBJ. All objects and groups of a file become one mesh; its materials
//! are not used, except where the file is a model by itself (`scene/model/obj.rs`).

use std::collections::HashMap;

use glam::Vec3;
use rayon::prelude::*;

use super::file::{MISSING_UV, MeshFile, RawMesh};
use super::normals;
use super::obj_parts::{NamedMaterials, ObjLines, ObjParts};
use super::options::MeshOptions;
use crate::scene::desc::{Mesh, MeshAttribute};
use crate::scene::diagnostic::SceneError;

/// Reads an OBJ file.
pub(super) fn read<'a>(file: &MeshFile<'a>, options: &MeshOptions) -> Result<RawMesh<'a>, SceneError> {
    let (mut raw, materials) = read_named(file, options)?;
    if let Some(line) = materials.first_line {
        let found = file.finding(line, "materials named in an OBJ file are not used");
        raw.warnings.push(found.help("give the shape a bsdf in the scene file").advice());
    }
    Ok(raw)
}

/// Reads an OBJ file and the names of its materials.
pub(super) fn read_named<'a>(
    file: &MeshFile<'a>,
    options: &MeshOptions,
) -> Result<(RawMesh<'a>, NamedMaterials), SceneError> {
    // Some editors put a byte order mark first, which would cost the first vertex and shift all others.
    let parts = ObjParts::new(file.bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(file.bytes));
    let mut lines = parts.read().map_err(|e| file.finding_of(e.kind, e.line, e.message).error())?;
    if options.face_normals {
        lines.corners[2] = Vec::new();
    }
    if parts.total == [0; 3] && lines.corners[0].is_empty() {
        let found = file.finding(1, "this file has neither vertices nor faces");
        return Err(found.help("is it an OBJ file? faces are lines like `f 1 2 3`").error());
    }
    let (faults, materials) = (std::mem::take(&mut lines.faults), std::mem::take(&mut lines.materials));
    let mut left = std::mem::take(&mut lines.left);
    let smoothing = std::mem::take(&mut lines.smoothing);
    let facets = smoothing.has("s off") || smoothing.has("s 0") || smoothing.kinds() > 1;
    // Normals that are made from faces are smooth, whatever their group.
    let of_normals = lines.corners[2].as_flattened();
    if facets && !options.face_normals && (of_normals.is_empty() || of_normals.contains(&0)) {
        left.merge(&smoothing);
    }
    if let Some(line) = lines.colored_line
        && !options.attributes.iter().any(|name| name == MeshAttribute::VERTEX_COLOR)
    {
        lines.colors = Vec::new();
        left.add("colours of vertices", line);
    }
    let raw = RawMesh {
        mesh: assemble(lines, options.flip_tex_coords),
        left,
        dropped: vec![
            (faults.malformed, "faces are not made of indices: dropped"),
            (faults.out_of_range, "faces have an index that the file does not have: dropped"),
            (faults.too_small, "faces have fewer than three vertices: dropped"),
        ],
        warnings: Vec::new(),
        line_of: Box::new(move |triangle| parts.line_of(triangle)),
        advice: "is it an OBJ file? faces are lines like `f 1 2 3`",
    };
    Ok((raw, materials))
}

/// The mesh as this program keeps it: each combination of position, texture coordinates and normal is a vertex.
fn assemble(lines: ObjLines, flip: bool) -> Mesh {
    let ObjLines { positions, mut uvs, normals, mut colors, corners, .. } = lines;
    if !colors.is_empty() {
        colors.resize(positions.len(), Vec3::ONE);
    }
    let attributes = |colors: Vec<Vec3>| {
        let values: Vec<f32> = colors.iter().flat_map(|color| color.to_array()).collect();
        let attribute = MeshAttribute { name: MeshAttribute::VERTEX_COLOR.to_owned(), channels: 3, values };
        if colors.is_empty() { Vec::new() } else { vec![attribute] }
    };
    let [mut triangles, of_uvs, of_normals] = corners;
    // Those that no corner has are of no use.
    let given = |of: Vec<[u32; 3]>| when(of.as_flattened().iter().any(|index| *index > 0), of);
    let (of_uvs, of_normals) = (given(of_uvs), given(of_normals));
    if flip {
        uvs.par_iter_mut().for_each(|uv| uv.y = 1.0 - uv.y);
    }
    let same = |of: &[[u32; 3]], count: usize| {
        of.is_empty() || (count == positions.len() && of.par_iter().eq(triangles.par_iter()))
    };
    if same(&of_uvs, uvs.len()) && same(&of_normals, normals.len()) {
        triangles.par_iter_mut().for_each(|t| *t = t.map(|i| i - 1));
        let (uvs, normals) = (when(!of_uvs.is_empty(), uvs), when(!of_normals.is_empty(), normals));
        return Mesh {
            positions,
            normals,
            uvs,
            triangles,
            attributes: attributes(colors),
            ..Mesh::default()
        };
    }
    let (mut mesh, mut split_colors) = (Mesh::default(), Vec::new());
    let (has_uvs, has_normals) = (!of_uvs.is_empty(), !of_normals.is_empty());
    // The first vertex at each position, with its other indices; those that differ from it are looked up.
    let mut first = vec![(u32::MAX, [0; 2]); positions.len()];
    let mut others: HashMap<[u32; 3], u32> = HashMap::new();
    let index = |of: &[[u32; 3]], i: usize, k: usize| of.get(i).map_or(0, |t| t[k]);
    for (i, triangle) in triangles.iter_mut().enumerate() {
        for (k, corner) in triangle.iter_mut().enumerate() {
            let (at, uv, normal) = (*corner, index(&of_uvs, i, k), index(&of_normals, i, k));
            let (known, of_known) = &mut first[at as usize - 1];
            let new = mesh.positions.len() as u32;
            *corner = if *known == u32::MAX {
                (*known, *of_known) = (new, [uv, normal]);
                new
            } else if *of_known == [uv, normal] {
                *known
            } else {
                *others.entry([at, uv, normal]).or_insert(new)
            };
            if *corner == new {
                mesh.positions.push(positions[at as usize - 1]);
                if has_uvs {
                    mesh.uvs.push(if uv > 0 { uvs[uv as usize - 1] } else { MISSING_UV });
                }
                if has_normals {
                    mesh.normals.push(if normal > 0 {
                        normals[normal as usize - 1]
                    } else {
                        normals::MISSING
                    });
                }
                split_colors.extend(colors.get(at as usize - 1));
            }
        }
    }
    Mesh { triangles, attributes: attributes(split_colors), ..mesh }
}

/// `values`, or none.
fn when<T>(keep: bool, values: Vec<T>) -> Vec<T> {
    if keep { values } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::math::random::Random;
    use crate::scene::diagnostic::FindingKind;
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
    fn corners_keep_what_others_have_not() {
        let read = read(&format!("{SQUARE}vn 0 1 1\nvt 0.5 0.25\nf 1/1/1 2/1/1 3/1/1\nf 1 3 4\n"));
        let MeshRead { mesh, warnings, .. } = read;
        assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
        assert_eq!((mesh.normals[0], mesh.normals[3]), (Vec3::new(0.0, 1.0, 1.0).normalize(), Vec3::Z));
        assert_eq!((mesh.uvs[0], mesh.uvs[3]), (Vec2::new(0.5, 0.75), Vec2::ZERO));
        let note = "of 6 vertices 3 have no texture coordinates: 0 0 is used; 3 have no normals: made from the faces";
        assert_eq!(warnings.iter().map(ToString::to_string).collect::<Vec<_>>(), [note]);
    }

    #[test]
    fn colours_of_vertices_are_an_attribute() {
        let text = format!("v 0 0 0 1 0 0.5\n{SQUARE}f 1 2 3 4\nf 3 4 5\n");
        let options = |asked: bool| MeshOptions {
            attributes: if asked { vec![MeshAttribute::VERTEX_COLOR.to_owned()] } else { Vec::new() },
            ..MeshOptions::default()
        };
        let asked = parse("a.obj", text.as_bytes(), &options(true)).expect("valid");
        assert_eq!(
            asked.warnings.len(),
            1,
            "the first quad has a triangle without area: {:?}",
            asked.warnings
        );
        let colors = &asked.mesh.attributes[0].values;
        assert_eq!((colors.len(), colors[0], colors[1]), (3 * asked.mesh.positions.len(), 1.0, 0.0));
        assert!((colors[2] - 0.214).abs() < 1e-3 && colors[3..].iter().all(|v| *v == 1.0), "{colors:?}");
        let unasked = parse("a.obj", text.as_bytes(), &options(false)).expect("valid");
        assert!(unasked.warnings[1].to_string().contains("`colours of vertices`"), "{:?}", unasked.warnings);
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
            let read = parse("a.obj", text.as_bytes(), &options);
            let e = read.map(|read| read.nothing.expect(text)).unwrap_or_else(|e| e);
            assert_eq!(e.location().1, line, "{text}: {e:?}");
        }
        let long = format!("v 0 0 0\nf{}\n", " 1".repeat(limits::MESH_LINE_BYTES));
        let e = parse("a.obj", long.as_bytes(), &options).expect_err("too long");
        assert_eq!((e.kind(), e.location().1), (FindingKind::Limit, 2));
    }

    /// Random files, against the crate `tobj`: the same triangles, bit for bit.
    #[test]
    fn triangles_are_those_of_another_reader() {
        let mut random = Random(7);
        for round in 0..60 {
            let mut text = String::new();
            let counts = [20, 15, 10];
            for (word, count) in ["v", "vt", "vn"].into_iter().zip(counts) {
                for _ in 0..count {
                    let [a, b, c] = [0; 3].map(|_| random.f64() * 10_f64.powi(random.below(9) as i32 - 4));
                    text += &match random.below(3) {
                        0 => format!("{word} {a} {b} {c:e}\n"),
                        1 => format!("{word}  {a:.3}\t{b:.9} {c}  \r\n"),
                        _ => format!(" {word} {a:.6} {b:.1} -{c:.7}\n"),
                    };
                }
            }
            for _ in 0..40 {
                text += "f";
                for _ in 0..3 + random.below(3) {
                    let [v, t, n] = counts.map(|n| 1 + random.below(n) as i64);
                    let v = if random.below(2) == 0 { v - 1 - counts[0] as i64 } else { v };
                    text += &match round % 4 {
                        0 => format!(" {v}"),
                        1 => format!(" {v}/{t}"),
                        2 => format!(" {v}//{n}"),
                        _ => format!(" {v}/{t}/{n}"),
                    };
                }
                text += "\n";
            }
            let options =
                tobj::LoadOptions { single_index: true, triangulate: true, ..tobj::LoadOptions::default() };
            let no_materials = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
            let (models, _) =
                tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials).expect("valid");
            let wanted = &models[0].mesh;
            let lines = ObjParts::new(text.as_bytes()).read().expect("valid");
            let mesh = assemble(lines, false);
            assert_eq!(mesh.triangles.len() * 3, wanted.indices.len());
            for (&i, &w) in mesh.triangles.as_flattened().iter().zip(&wanted.indices) {
                let (i, w) = (i as usize, w as usize);
                let same = |mine: &[f32], theirs: &[f32]| {
                    let at = w * mine.len();
                    assert_eq!(mine, &theirs[at..at + mine.len()], "{text}");
                };
                same(&mesh.positions[i].to_array(), &wanted.positions);
                mesh.uvs.get(i).inspect(|uv| same(&uv.to_array(), &wanted.texcoords));
                mesh.normals.get(i).inspect(|n| same(&n.to_array(), &wanted.normals));
            }
            assert_eq!(mesh.uvs.is_empty(), wanted.texcoords.is_empty());
            assert_eq!(mesh.normals.is_empty(), wanted.normals.is_empty());
        }
    }
}
