//! Stanford PLY, text and binary (Turk, *The PLY Polygon File Format*, 1994), with the names of properties that Mitsuba knows.
//!
//! Polygons are cut into triangles around their first corner (Mitsuba itself reads triangles only). Photogrammetry gives texture
//! coordinates to the corners of faces, as the list `texcoord`, and the number of a picture, as `texnumber`. Properties and elements
//! that nothing uses are skipped, and told.

use std::ops::Range;

use glam::{Vec2, Vec3};

use super::attributes::{AttributeColumns, has_color};
use super::file::{Count, MISSING_UV, MeshFile, RawMesh};
use super::obj_parts::NamedMaterials;
use super::options::MeshOptions;
use super::ply_header::{Encoding, PlyElement, PlyHeader, PlyProperty, Scalar};
use super::ply_numbers::{Binary, Numbers, RowFault, Text};
use super::wedges;
use crate::scene::desc::{Mesh, MeshAttribute};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::leftovers::Leftovers;
use crate::scene::limits;

/// The properties of a vertex that are kept: position, normal, texture coordinates, which have several names.
const KEPT: [&str; 8] = ["x", "y", "z", "nx", "ny", "nz", "", ""];
/// The names of texture coordinates; the first pair that a file has counts.
const UV_NAMES: [[&str; 2]; 10] = [
    ["u", "v"],
    ["s", "t"],
    ["texture_u", "texture_v"],
    ["texture_s", "texture_t"],
    ["texcoord_u", "texcoord_v"],
    ["texcoord_s", "texcoord_t"],
    ["texcoord_x", "texcoord_y"],
    ["tex_u", "tex_v"],
    ["u0", "v0"],
    TX_TY,
];
/// Texture coordinates, unless a `tz` makes a tangent of them.
const TX_TY: [&str; 2] = ["tx", "ty"];
const POSITION: Range<usize> = 0..3;
const NORMAL: Range<usize> = 3..6;
const UV: Range<usize> = 6..8;
/// The place in [`KEPT`] of what is not kept.
const UNUSED: usize = KEPT.len();

/// The names of the list of corners of a face.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// The list of the texture coordinates of the corners of a face, two numbers each.
const CORNER_UVS: &str = "texcoord";

/// The number of the picture of a face.
const PICTURE: &str = "texnumber";

/// The attributes of a PLY file that serves as a model, by its header.
pub(crate) struct PlySummary {
    /// The attribute that is its colour.
    pub(crate) color: Option<&'static str>,
    /// Files of its pictures.
    pub(crate) pictures: Vec<String>,
    /// It has texture coordinates.
    pub(crate) has_uvs: bool,
    /// Its faces have numbers of pictures.
    pub(crate) numbered: bool,
}

/// Reads the header of a PLY file; messages call it `name`.
///
/// # Errors
///
/// [`SceneError`] with file and line.
pub(crate) fn summary(name: &str, bytes: &[u8]) -> Result<PlySummary, SceneError> {
    let header = PlyHeader::read(&MeshFile { name, bytes, text: bytes })?;
    let (vertices, faces) = (header.element("vertex"), header.element("face"));
    let of_face = |is: fn(&PlyProperty) -> bool| faces.is_some_and(|e| e.properties.iter().any(is));
    let color = [(vertices, MeshAttribute::VERTEX_COLOR), (faces, MeshAttribute::FACE_COLOR)];
    Ok(PlySummary {
        color: color.into_iter().find(|(e, _)| e.is_some_and(has_color)).map(|(_, name)| name),
        has_uvs: of_face(is_corner_uvs) || vertices.is_some_and(|e| slots(e).contains(&UV.start)),
        numbered: of_face(is_picture),
        pictures: header.pictures.clone(),
    })
}

/// Reads a PLY file.
pub(super) fn read<'a>(file: &MeshFile<'a>, options: &MeshOptions) -> Result<RawMesh<'a>, SceneError> {
    let (mut raw, pictures) = read_named(file, options)?;
    if pictures.uses.len() > 1
        && let Some(line) = pictures.first_line
    {
        raw.left.add(&format!("face.{PICTURE}"), line);
    }
    Ok(raw)
}

/// Reads a PLY file and the numbers of the pictures of its triangles, as names of materials.
pub(super) fn read_named<'a>(
    file: &MeshFile<'a>,
    options: &MeshOptions,
) -> Result<(RawMesh<'a>, NamedMaterials), SceneError> {
    let header = PlyHeader::read(file)?;
    let last = header.next_line - 1;
    let element = |name: &str, needed: &str| {
        let missing = || {
            file.finding(last, format!("this PLY file has no element `{name}`"))
                .help(needed.to_owned())
                .error()
        };
        header.element(name).ok_or_else(missing)
    };
    let vertices = element("vertex", "its header says `element vertex COUNT`")?;
    let faces = element("face", "only polygons are read: export the mesh with faces")?;
    let slots = slots(vertices);
    let has = |mut range: Range<usize>| range.all(|s| slots.contains(&s));
    if !has(POSITION) {
        return Err(file.finding(vertices.line, "a vertex has the properties `x`, `y` and `z`").error());
    }
    if !faces.properties.iter().any(is_corners) {
        let found = file.finding(faces.line, "a face has a list of integers `vertex_indices`");
        return Err(found.help("write `property list uchar int vertex_indices`").error());
    }
    let mut read = PlyRead {
        file: *file,
        vertices: vertices.rows,
        flip: options.flip_tex_coords,
        has_normals: has(NORMAL) && !options.face_normals,
        has_uvs: has(UV),
        slots,
        of_vertices: AttributeColumns::find(file, vertices, MeshAttribute::VERTEX, &options.attributes)?,
        of_faces: AttributeColumns::find(file, faces, MeshAttribute::FACE, &options.attributes)?,
        mesh: Mesh::default(),
        corner_uvs: faces.properties.iter().any(is_corner_uvs).then(Vec::new),
        row_uvs: Vec::new(),
        pictures: NamedMaterials {
            first_line: faces.properties.iter().find(|p| is_picture(p)).map(|p| p.line),
            ..NamedMaterials::default()
        },
        lines: Vec::new(),
        bad_uvs: Count::default(),
        out_of_range: Count::default(),
        too_small: Count::default(),
    };
    let rest = &file.bytes[header.bytes..];
    let (unread, line) = match header.encoding {
        Encoding::Ascii => {
            let text = read.elements(&header, Text { rest, line: header.next_line })?;
            (text.rest.trim_ascii().len(), text.line)
        }
        Encoding::LittleEndian => (read.elements(&header, Binary::<false> { rest })?.rest.len(), last),
        Encoding::BigEndian => (read.elements(&header, Binary::<true> { rest })?.rest.len(), last),
    };
    let mut warnings = Vec::new();
    if unread > 0 {
        let message = format!("{unread} bytes after the last row that the header announces: not used");
        warnings.push(file.finding(line, message).warning());
    }
    if read.of_vertices.narrow || read.of_faces.narrow {
        let message = "attributes in 8 bits are parts of 255 on the curve of sRGB; Mitsuba 3.9.1 takes them as they stand";
        warnings.push(file.finding(vertices.line, message).advice());
    }
    let left = read.left_over(&header);
    let (lines, announced) = (read.lines, faces.line);
    let mut attributes = read.of_vertices.into_attributes();
    attributes.extend(read.of_faces.into_attributes());
    let mut mesh = Mesh { attributes, ..read.mesh };
    if let Some(uvs) = read.corner_uvs {
        wedges::split(&mut mesh, &uvs);
    }
    let raw = RawMesh {
        mesh,
        left,
        dropped: vec![
            (read.out_of_range, "faces have an index that the file does not have: dropped"),
            (read.too_small, "faces have fewer than three vertices: dropped"),
            (read.bad_uvs, "faces have not two texture coordinates for each corner: theirs are not used"),
        ],
        warnings,
        line_of: Box::new(move |triangle| lines.get(triangle).map_or(announced, |line| *line as usize)),
        advice: "export the mesh with polygons",
    };
    Ok((raw, read.pictures))
}

/// The places of the properties of vertices in [`KEPT`].
fn slots(vertices: &PlyElement) -> Vec<usize> {
    let index = |name: &str| vertices.properties.iter().position(|p| p.count.is_none() && p.name == name);
    let mut slots = vec![UNUSED; vertices.properties.len()];
    let uv_names = UV_NAMES.iter().filter(|names| **names != TX_TY || index("tz").is_none());
    let uvs = uv_names.map(|names| names.map(index)).find(|pair| pair.iter().all(Option::is_some));
    for range in [POSITION, NORMAL] {
        // Part of a normal is none.
        let found: Vec<Option<usize>> = KEPT[range.clone()].iter().map(|name| index(name)).collect();
        if found.iter().all(Option::is_some) {
            range.zip(found).for_each(|(slot, at)| at.into_iter().for_each(|at| slots[at] = slot));
        }
    }
    UV.zip(uvs.into_iter().flatten()).for_each(|(slot, at)| at.into_iter().for_each(|at| slots[at] = slot));
    slots
}

fn is_corner_uvs(property: &PlyProperty) -> bool {
    property.count.is_some() && property.name == CORNER_UVS
}

fn is_picture(property: &PlyProperty) -> bool {
    property.count.is_none() && property.name == PICTURE
}

fn is_corners(property: &PlyProperty) -> bool {
    property.count.is_some() && property.scalar.is_integer() && CORNERS.contains(&property.name.as_str())
}

/// The mesh so far.
struct PlyRead<'a> {
    file: MeshFile<'a>,
    /// The number of vertices that the header announces.
    vertices: usize,
    flip: bool,
    has_normals: bool,
    has_uvs: bool,
    /// Places in [`KEPT`] of the properties of a vertex.
    slots: Vec<usize>,
    of_vertices: AttributeColumns,
    of_faces: AttributeColumns,
    mesh: Mesh,
    /// Texture coordinates of the corners of each triangle, if faces have any.
    corner_uvs: Option<Vec<[Vec2; 3]>>,
    /// Those of the face that is being read.
    row_uvs: Vec<f32>,
    /// Numbers of the pictures of faces, as names of materials.
    pictures: NamedMaterials,
    /// The line of each triangle of a text.
    lines: Vec<u32>,
    bad_uvs: Count,
    out_of_range: Count,
    too_small: Count,
}

impl PlyRead<'_> {
    /// The properties and elements that nothing uses.
    fn left_over(&self, header: &PlyHeader) -> Leftovers {
        let mut left = Leftovers::default();
        for element in header.elements.iter().filter(|element| element.rows > 0) {
            let used = |(i, property): (usize, &PlyProperty)| match element.name.as_str() {
                "vertex" => self.slots[i] != UNUSED || self.of_vertices.place(i).is_some(),
                _ => {
                    let known = is_corners(property) || is_corner_uvs(property) || is_picture(property);
                    known || self.of_faces.place(i).is_some()
                }
            };
            if !matches!(element.name.as_str(), "vertex" | "face") {
                left.add(&format!("element {}", element.name), element.line);
                continue;
            }
            for (_, property) in element.properties.iter().enumerate().filter(|pair| !used(*pair)) {
                left.add(&format!("{}.{}", element.name, property.name), property.line);
            }
        }
        left
    }

    /// Reads all rows of all elements and returns what comes after them.
    fn elements<N: Numbers>(&mut self, header: &PlyHeader, mut numbers: N) -> Result<N, SceneError> {
        for element in &header.elements {
            let read_row: fn(&mut Self, &PlyElement, &mut N) -> Result<(), RowFault> =
                match element.name.as_str() {
                    "vertex" => Self::vertex,
                    "face" => Self::face,
                    _ => Self::other,
                };
            if element.name == "vertex" {
                self.reserve(element.rows);
            }
            for row in 1..=element.rows {
                read_row(self, element, &mut numbers)
                    .map_err(|fault| self.error(fault, element, row, numbers.line()))?;
            }
        }
        Ok(numbers)
    }

    /// Room for the vertices; the header was checked against the size of the file.
    fn reserve(&mut self, rows: usize) {
        self.mesh.positions.reserve_exact(rows);
        self.mesh.normals.reserve_exact(if self.has_normals { rows } else { 0 });
        self.mesh.uvs.reserve_exact(if self.has_uvs { rows } else { 0 });
    }

    fn vertex<N: Numbers>(&mut self, element: &PlyElement, numbers: &mut N) -> Result<(), RowFault> {
        let mut values = [0.0; UNUSED];
        for (i, (property, &slot)) in element.properties.iter().zip(&self.slots).enumerate() {
            match values.get_mut(slot) {
                Some(value) => *value = numbers.next(property.scalar)? as f32,
                None => attribute(&mut self.of_vertices, i, property, numbers)?,
            }
        }
        self.of_vertices.end_row(1);
        let [x, y, z, nx, ny, nz, u, v] = values;
        self.mesh.positions.push(Vec3::new(x, y, z));
        if self.has_normals {
            self.mesh.normals.push(Vec3::new(nx, ny, nz));
        }
        if self.has_uvs {
            self.mesh.uvs.push(Vec2::new(u, if self.flip { 1.0 - v } else { v }));
        }
        Ok(())
    }

    fn face<N: Numbers>(&mut self, element: &PlyElement, numbers: &mut N) -> Result<(), RowFault> {
        let (mut line, first) = (element.line, self.mesh.triangles.len());
        for (i, property) in element.properties.iter().enumerate() {
            match property.count {
                Some(count) if is_corners(property) => {
                    let corners = length(count, numbers)?;
                    line = numbers.line().unwrap_or(line);
                    self.polygon(corners, property.scalar, numbers, line)?;
                }
                Some(count) if is_corner_uvs(property) => {
                    let length = length(count, numbers)?;
                    self.row_uvs.clear();
                    for _ in 0..length {
                        self.row_uvs.push(numbers.next(property.scalar)? as f32);
                    }
                }
                None if is_picture(property) => {
                    let name = numbers.next(property.scalar)?.to_string();
                    if self.pictures.uses.last().is_none_or(|(_, last)| *last != name) {
                        self.pictures.uses.push((first, name));
                    }
                }
                _ => attribute(&mut self.of_faces, i, property, numbers)?,
            }
        }
        self.of_faces.end_row(self.mesh.triangles.len() - first);
        self.end_corner_uvs(line);
        if numbers.line().is_some() {
            self.lines.resize(self.mesh.triangles.len(), line as u32);
        }
        Ok(())
    }

    /// Hands the texture coordinates of a face to its triangles, which are cut around the first corner.
    fn end_corner_uvs(&mut self, line: usize) {
        let Some(uvs) = &mut self.corner_uvs else { return };
        let made = self.mesh.triangles.len() - uvs.len();
        let row: &[[f32; 2]] = self.row_uvs.as_chunks().0;
        let fits = self.row_uvs.len() == 2 * (made + 2);
        if made > 0 && !fits && !row.is_empty() {
            self.bad_uvs.add(|| line);
        }
        let flip = self.flip;
        let uv = |[u, v]: [f32; 2]| Vec2::new(u, if flip { 1.0 - v } else { v });
        uvs.extend(
            (0..made).map(|i| if fits { [row[0], row[i + 1], row[i + 2]].map(uv) } else { [MISSING_UV; 3] }),
        );
        self.row_uvs.clear();
    }

    /// Reads the corners of a polygon and adds its triangles.
    fn polygon<N: Numbers>(
        &mut self,
        corners: usize,
        scalar: Scalar,
        numbers: &mut N,
        line: usize,
    ) -> Result<(), RowFault> {
        let triangles = &mut self.mesh.triangles;
        let first_triangle = triangles.len();
        let (mut first, mut previous, mut in_range) = (0, 0, true);
        for corner in 0..corners {
            let index = numbers.next(scalar)?;
            in_range &= index >= 0.0 && index < self.vertices as f64 && index.fract() == 0.0;
            let index = index as u32;
            match corner {
                0 => first = index,
                1 => {}
                _ if in_range => triangles.push([first, previous, index]),
                _ => {}
            }
            previous = index;
        }
        if !in_range {
            triangles.truncate(first_triangle);
            self.out_of_range.add(|| line);
        } else if corners < 3 {
            self.too_small.add(|| line);
        }
        if triangles.len() > limits::MESH_TRIANGLES { Err(RowFault::TooMany) } else { Ok(()) }
    }

    fn other<N: Numbers>(&mut self, element: &PlyElement, numbers: &mut N) -> Result<(), RowFault> {
        element.properties.iter().try_for_each(|property| skip(property, numbers))
    }

    fn error(&self, fault: RowFault, element: &PlyElement, row: usize, line: Option<usize>) -> SceneError {
        let (line, PlyElement { name, rows, .. }) = (line.unwrap_or(element.line), element);
        let at = format!("in row {row} of the {rows} of `{name}`");
        let (kind, message) = match fault {
            RowFault::End => (FindingKind::Mesh, format!("the file ends {at}")),
            RowFault::NotANumber => (FindingKind::Mesh, format!("this is not a number, {at}")),
            RowFault::Negative => (FindingKind::Mesh, format!("a list with less than no items, {at}")),
            RowFault::TooMany => {
                (FindingKind::Limit, format!("the mesh has more than {} triangles", limits::MESH_TRIANGLES))
            }
        };
        self.file.finding_of(kind, line, message).error()
    }
}

/// The length of a list.
fn length<N: Numbers>(count: Scalar, numbers: &mut N) -> Result<usize, RowFault> {
    let length = numbers.next(count)?;
    if length < 0.0 { Err(RowFault::Negative) } else { Ok(length as usize) }
}

/// Reads the number of a property if it belongs to an attribute, or else skips it.
fn attribute<N: Numbers>(
    columns: &mut AttributeColumns,
    index: usize,
    property: &PlyProperty,
    numbers: &mut N,
) -> Result<(), RowFault> {
    match columns.place(index) {
        Some(place) => columns.set(place, numbers.next(property.scalar)?, property.scalar),
        None => skip(property, numbers)?,
    }
    Ok(())
}

fn skip<N: Numbers>(property: &PlyProperty, numbers: &mut N) -> Result<(), RowFault> {
    let length = property.count.map_or(Ok(1), |count| length(count, numbers))?;
    numbers.skip(property.scalar, length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::mesh::{MeshFormat, MeshRead, parse};

    const OPTIONS: MeshOptions = MeshOptions {
        format: MeshFormat::Ply,
        shape_index: 0,
        face_normals: false,
        flip_tex_coords: false,
        attributes: Vec::new(),
        world: None,
    };

    const HEADER: &str = "ply\nformat ascii 1.0\ncomment of four corners\nelement vertex 4\nproperty float x\n\
                          property double y\nproperty float32 z\nproperty uchar red\nproperty float s\nproperty float t\n\
                          property list uchar float extra\nelement face 3\nproperty list uint8 int32 vertex_index\n\
                          property float weight\nend_header\n";
    const ROWS: &str = "0 0 0 9 .25 .75 0\n1 0 0 9 .25 .75 2 7 7\n1 1 0 9 .25 .75 0\n0 1 0 9 .25 .75 1 nan\n";

    fn read(text: &str) -> Result<MeshRead, SceneError> {
        parse("a.ply", text.as_bytes(), &OPTIONS)
    }

    #[test]
    fn text_with_polygons_and_properties_of_no_use() {
        let MeshRead { mesh, warnings, .. } =
            read(&format!("{HEADER}{ROWS}3 0 1 2 .5\n4 0 1 2 3 .5\r\n3 0 2 3 1")).expect("valid");
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 1, 2], [0, 2, 3], [0, 2, 3]]);
        assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
        assert_eq!((mesh.uvs.clone(), warnings.len()), (vec![Vec2::new(0.25, 0.75); 4], 1));
        assert_eq!(warnings[0].to_string(), "not used: `vertex.red`, `vertex.extra`, `face.weight`");
        assert_eq!(mesh.normals, [Vec3::Z; 4]);
    }

    #[test]
    fn faults_have_a_line() {
        let read = read(&format!("{HEADER}{ROWS}3 0 1 2 0\n3 0 1 4 0\n2 0 1 0\n what")).expect("one face");
        let lines: Vec<usize> = read.warnings.iter().map(|w| w.location().1).collect();
        assert_eq!((read.mesh.triangles.len(), lines), (1, vec![22, 21, 22, 8]), "{:?}", read.warnings);
    }

    #[test]
    fn errors_have_a_line() {
        let at = |from: &str, to: &str| {
            let text = format!("{HEADER}{ROWS}3 0 1 2 0\n3 0 1 2 0\n3 0 1 2 0\n");
            assert!(text.contains(from));
            let e = read(&text.replacen(from, to, 1)).expect_err(to);
            e.location().1
        };
        for (from, to, line) in [
            ("ply", "plx", 1),
            ("ascii 1.0", "ascii 2.0", 2),
            ("comment", "remark", 3),
            ("element vertex 4", "element vertex 4294967295", 4),
            ("element vertex 4", "element vertex -1", 4),
            ("element face", "element vertex", 12),
            ("element face", "element faces", 15),
            ("property float x", "property list float int x", 5),
            ("property float x", "property float w", 4),
            ("uint8 int32 vertex_index", "uint8 float vertex_index", 12),
            ("end_header\n", "", 15),
            ("0 0 0 9", "0 0 zero 9", 16),
            ("3 0 1 2 0\n3 0 1 2 0\n3 0 1 2 0\n", "-3 0 1 2 0\n\n", 20),
            ("3 0 1 2 0\n3 0 1 2 0\n3 0 1 2 0\n", "3 0 1 2 0\n3 0 1 2 0\n3 0 1", 22),
        ] {
            assert_eq!(at(from, to), line, "{to}");
        }
    }

    /// All types in both orders of bytes.
    #[test]
    fn binary_of_every_type() {
        for (order, big) in [("little", false), ("big", true)] {
            for (index, bytes) in
                [("char", 1), ("uchar", 1), ("short", 2), ("ushort", 2), ("int", 4), ("uint", 4)]
            {
                let mut file = format!(
                    "ply\nformat binary_{order}_endian 1.0\nelement face 1\nproperty list {index} {index} vertex_indices\n\
                     element vertex 3\nproperty double x\nproperty float y\nproperty {index} z\nproperty float nx\n\
                     property float ny\nproperty float nz\nend_header\n"
                )
                .into_bytes();
                let mut push = |little: &[u8]| {
                    let mut bytes = little.to_vec();
                    if big {
                        bytes.reverse();
                    }
                    file.extend(bytes);
                };
                for value in [3_u32, 0, 1, 2] {
                    push(&value.to_le_bytes()[..bytes]);
                }
                for (x, y) in [(0.0_f64, 0.0_f32), (1.5, 0.0), (0.0, 2.5)] {
                    push(&x.to_le_bytes());
                    push(&y.to_le_bytes());
                    push(&7_u32.to_le_bytes()[..bytes]);
                    [0.0_f32, 3.0, 4.0].iter().for_each(|n| push(&n.to_le_bytes()));
                }
                let mesh = parse("a.ply", &file, &OPTIONS).expect("valid").mesh;
                assert_eq!(mesh.positions[1..], [Vec3::new(1.5, 0.0, 7.0), Vec3::new(0.0, 2.5, 7.0)]);
                assert_eq!(
                    (mesh.normals.clone(), mesh.triangles.clone()),
                    (vec![Vec3::new(0.0, 0.6, 0.8); 3], vec![[0, 1, 2]])
                );
                let cut = &file[..file.len() - 1];
                assert_eq!(parse("a.ply", cut, &OPTIONS).expect_err("cut").location().1, 5);
            }
        }
    }
}
