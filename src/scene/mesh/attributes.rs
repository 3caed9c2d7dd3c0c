//! Attributes of a mesh among the properties of a PLY file, by the names that Mitsuba 3 gives them (its documentation, "PLY mesh loader").
//!
//! `r`, `g` and `b`, or `red`, `green` and `blue`, also with `diffuse_` in front, are the attribute `vertex_color` or `face_color`. Properties that stand together and
//! are called `NAME_x` `NAME_y` `NAME_z`, `NAME_0` …, or `NAME_1` … are `vertex_NAME`; those that are called `NAME_r` `NAME_g` `NAME_b` are
//! `vertex_NAME_color`. Integers are parts of their greatest value on the curve of sRGB, as Mitsuba 3 means them (3.9.1 takes those of 8
//! bits as they stand, from 0 to 255). Opacity is not used.

use super::file::MeshFile;
use super::ply_header::{PlyElement, PlyProperty, Scalar};
use crate::color::srgb;
use crate::scene::desc::MeshAttribute;
use crate::scene::desc::texture::ATTRIBUTE_NUMBERS;
use crate::scene::diagnostic::SceneError;

/// The last letters of properties that stand together.
const ENDINGS: [[&str; 4]; 4] =
    [["r", "g", "b", "a"], ["x", "y", "z", "w"], ["0", "1", "2", "3"], ["1", "2", "3", "4"]];

/// The names of the components of a colour.
const COLOURS: [[&str; 4]; 3] = [
    ["r", "g", "b", "a"],
    ["red", "green", "blue", "alpha"],
    ["diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"],
];

/// The columns of an element that are attributes, and what was read of them.
#[derive(Default)]
pub(super) struct AttributeColumns {
    attributes: Vec<MeshAttribute>,
    /// By property: the place of its number in `row`.
    places: Vec<Option<usize>>,
    /// The numbers of a row, attribute by attribute.
    row: Vec<f32>,
    /// Some numbers are written in 8 bits.
    pub(super) narrow: bool,
}

impl AttributeColumns {
    /// The columns of `element` that are attributes whose names begin with `first` and that are asked for.
    pub(super) fn find(
        file: &MeshFile<'_>,
        element: &PlyElement,
        first: &str,
        asked: &[String],
    ) -> Result<Self, SceneError> {
        let mut found = Self::default();
        for name in asked {
            let Some(columns) = name.strip_prefix(first).and_then(|rest| columns(element, rest)) else {
                continue;
            };
            let fault = |message: String| {
                let found = file.finding(element.line, message);
                found
                    .help("a texture takes an attribute of 1 or 3 numbers, each a property of its own")
                    .error()
            };
            if columns.iter().any(|&i| element.properties[i].count.is_some()) {
                return Err(fault(format!("the attribute `{name}` is a list")));
            }
            // The fourth component of a colour is its opacity.
            let channels = match columns.len() {
                n @ (1 | 3) => n,
                4 if is_colour(element, &columns) => 3,
                n => return Err(fault(format!("the attribute `{name}` has {n} numbers"))),
            };
            found.places.resize(element.properties.len(), None);
            for &column in &columns[..channels] {
                found.places[column] = Some(found.row.len());
                found.narrow |= element.properties[column].scalar.bytes() == 1;
                found.row.push(0.0);
            }
            // Before memory is taken: a polygon of many corners hands its numbers to many triangles.
            if found.row.len() > ATTRIBUTE_NUMBERS {
                let message =
                    format!("a material uses more than {ATTRIBUTE_NUMBERS} numbers of these attributes");
                return Err(fault(message));
            }
            found.attributes.push(MeshAttribute { name: name.clone(), channels, values: Vec::new() });
        }
        Ok(found)
    }

    /// The place in a row of the number of a property, if it is kept.
    pub(super) fn place(&self, property: usize) -> Option<usize> {
        self.places.get(property).copied().flatten()
    }

    /// Takes one number of a row.
    pub(super) fn set(&mut self, place: usize, value: f64, scalar: Scalar) {
        self.row[place] = match scalar.greatest() {
            Some(greatest) => srgb::decode((value / greatest).clamp(0.0, 1.0) as f32),
            None => value as f32,
        };
    }

    /// Ends a row, which belongs to so many vertices or triangles.
    pub(super) fn end_row(&mut self, times: usize) {
        for _ in 0..times {
            let mut rest = self.row.as_slice();
            for MeshAttribute { channels, values, .. } in &mut self.attributes {
                let (own, others) = rest.split_at(*channels);
                values.extend_from_slice(own);
                rest = others;
            }
        }
    }

    /// The attributes that were read.
    pub(super) fn into_attributes(self) -> Vec<MeshAttribute> {
        self.attributes
    }
}

/// True where an element has the properties of a colour.
pub(super) fn has_color(element: &PlyElement) -> bool {
    columns(element, "color").is_some_and(|columns| columns.len() >= 3)
}

/// The properties that are the attribute of this name, without `vertex_` or `face_`.
fn columns(element: &PlyElement, name: &str) -> Option<Vec<usize>> {
    let index = |name: &str| element.properties.iter().position(|p| p.name == name);
    let colours = COLOURS.iter().filter(|_| name == "color");
    let colour = colours.map(|names| names.iter().map_while(|name| index(name)).collect::<Vec<_>>());
    if let Some(colour) = colour.into_iter().find(|columns| columns.len() >= 3) {
        return Some(colour);
    }
    ENDINGS.iter().enumerate().find_map(|(i, endings)| {
        let prefix = if i == 0 { name.strip_suffix("_color")? } else { name };
        let first = index(&format!("{prefix}_{}", endings[0]))?;
        let is = |(p, ending): (&PlyProperty, &&str)| p.name == format!("{prefix}_{ending}");
        let count = element.properties[first..].iter().zip(endings).take_while(|pair| is(*pair)).count();
        Some((first..first + count).collect())
    })
}

/// True where the first property is the red of a colour.
fn is_colour(element: &PlyElement, columns: &[usize]) -> bool {
    let name = element.properties[columns[0]].name.as_str();
    COLOURS.iter().any(|names| names[0] == name) || name.ends_with("_r")
}

#[cfg(test)]
mod tests {
    use crate::scene::desc::MeshAttribute;
    use crate::scene::diagnostic::SceneError;
    use crate::scene::mesh::{MeshFormat, MeshOptions, parse};

    /// Attributes of a square of two triangles and a third without area between them; `vertex` and `face` are properties, rows are
    /// made of `numbers`.
    fn read(vertex: &str, face: &str, asked: &[&str]) -> Result<Vec<MeshAttribute>, SceneError> {
        let list =
            |text: &str| text.split_terminator(',').map(|p| format!("property {p}\n")).collect::<String>();
        let count = |text: &str| text.split_terminator(',').count();
        let numbers = |row: usize, n: usize| (0..n).map(|i| format!(" {}", 10 * row + i)).collect::<String>();
        let corners = ["0 0 0", "1 0 0", "5 5 5", "1 1 0", "0 1 0"];
        let vertices: String =
            corners.iter().enumerate().map(|(i, p)| format!("{p}{}\n", numbers(i, count(vertex)))).collect();
        let faces: String = ["4 0 1 3 4", "3 0 0 1", "3 0 1 3"]
            .iter()
            .enumerate()
            .map(|(i, f)| format!("{f}{}\n", numbers(i, count(face))))
            .collect();
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n{}element face 3\n\
             property list uchar int vertex_indices\n{}end_header\n{vertices}{faces}",
            list(vertex),
            list(face)
        );
        let attributes = asked.iter().map(|name| (*name).to_owned()).collect();
        let options = MeshOptions { format: MeshFormat::Ply, attributes, ..MeshOptions::default() };
        parse("a.ply", text.as_bytes(), &options).map(|read| read.mesh.attributes.clone())
    }

    fn one(vertex: &str, asked: &str) -> MeshAttribute {
        read(vertex, "", &[asked]).expect("valid").pop().expect("there is one")
    }

    #[test]
    fn columns_are_named_as_by_mitsuba() {
        for (vertex, asked, expected) in [
            ("float r,float g,float b", "vertex_color", [0.0, 1.0, 2.0]),
            ("float blue,float green,float red", "vertex_color", [2.0, 1.0, 0.0]),
            ("float a,float r,float g,float b,float q", "vertex_color", [1.0, 2.0, 3.0]),
            ("float red,float green,float blue,float alpha", "vertex_color", [0.0, 1.0, 2.0]),
            ("float w,double foo_x,float foo_y,float foo_z", "vertex_foo", [1.0, 2.0, 3.0]),
            ("float foo_r,float foo_g,float foo_b,float foo_a", "vertex_foo_color", [0.0, 1.0, 2.0]),
            ("float a_b_0,float a_b_1,float a_b_2", "vertex_a_b", [0.0, 1.0, 2.0]),
            ("float foo_1,float foo_2,float foo_3", "vertex_foo", [0.0, 1.0, 2.0]),
        ] {
            let found = one(vertex, asked);
            assert_eq!(
                (found.name.as_str(), found.channels, found.values.len()),
                (asked, 3, 4 * 3),
                "{vertex}"
            );
            // The vertex that nothing uses goes, in all columns.
            let rows = [0.0, 10.0, 30.0, 40.0].map(|row| expected.map(|v| row + v));
            assert_eq!(found.values, rows.as_flattened(), "{vertex}");
        }
        let found = one("float foo_x,float bar_x", "vertex_bar");
        assert_eq!((found.channels, found.values), (1, vec![1.0, 11.0, 31.0, 41.0]));
        let none =
            read("float r,float g,float foo", "", &["vertex_color", "vertex_foo", "face_color", "vertex_"]);
        assert!(none.expect("valid").is_empty());
    }

    /// Polygons hand theirs to all of their triangles, and triangles without area take theirs away.
    #[test]
    fn faces_have_attributes() {
        let found = read("", "float q,float w_x", &["face_w", "vertex_w"]).expect("valid");
        assert_eq!((found.len(), found[0].values.as_slice()), (1, [1.0, 1.0, 21.0].as_slice()));
    }

    #[test]
    fn integers_are_on_the_curve_of_srgb() {
        let found = one("uchar red,ushort green,uchar blue", "vertex_color").values;
        let above = ((12.0 / 255.0 + 0.055) / 1.055f32).powf(2.4);
        let expected = [10.0 / 255.0 / 12.92, 11.0 / 65_535.0 / 12.92, above];
        assert!(found[3..6].iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?}");
    }

    #[test]
    fn what_is_no_attribute_is_refused_with_its_line() {
        for (vertex, asked, words) in [
            ("float foo_x,float foo_y", "vertex_foo", "has 2 numbers"),
            ("float foo_x,float foo_y,float foo_z,float foo_w", "vertex_foo", "has 4 numbers"),
            ("list uchar float r,float g,float b", "vertex_color", "is a list"),
            ("list uchar float foo_x", "vertex_foo", "is a list"),
        ] {
            let e = read(vertex, "", &[asked]).expect_err(vertex);
            assert!(e.location().1 == 3 && e.to_string().contains(words), "{e}");
            // Nobody asks.
            assert!(vertex.contains("list") || read(vertex, "", &[]).expect("valid").is_empty());
        }
        assert!(read("colour r", "", &["vertex_color"]).is_err());
        let six = "float a_x,float a_y,float a_z,float b_x,float b_y,float b_z";
        let e = read(six, "", &["vertex_a", "vertex_b"]).expect_err("too many");
        assert!(e.location().1 == 3 && e.to_string().contains("more than 4"), "{e}");
        assert_eq!(read(six, "", &["vertex_b"]).expect("valid").len(), 1);
    }
}
