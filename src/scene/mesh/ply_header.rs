//! The header of a PLY file: the elements, their numbers, and the types of their properties.

use super::file::MeshFile;
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::limits;

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A type of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    /// The type of a name, in the two ways in which files spell them.
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of a number in a binary file.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(super) fn is_integer(self) -> bool {
        self.greatest().is_some()
    }

    /// The greatest integer.
    pub(super) fn greatest(self) -> Option<f64> {
        Some(match self {
            Self::I8 => i8::MAX.into(),
            Self::U8 => u8::MAX.into(),
            Self::I16 => i16::MAX.into(),
            Self::U16 => u16::MAX.into(),
            Self::I32 => i32::MAX.into(),
            Self::U32 => u32::MAX.into(),
            Self::F32 | Self::F64 => return None,
        })
    }
}

/// A property of an element.
pub(super) struct PlyProperty {
    pub(super) name: String,
    pub(super) scalar: Scalar,
    /// The type of the number of values, of a list.
    pub(super) count: Option<Scalar>,
    /// The line that announces it.
    pub(super) line: usize,
}

/// A table of the file: so many rows with these properties.
pub(super) struct PlyElement {
    pub(super) name: String,
    pub(super) rows: usize,
    pub(super) properties: Vec<PlyProperty>,
    /// The line that announces it.
    pub(super) line: usize,
}

impl PlyElement {
    /// The fewest bytes that a row can have.
    fn least_bytes(&self, encoding: Encoding) -> usize {
        let bytes = |p: &PlyProperty| match encoding {
            Encoding::Ascii => 2, // a digit and a blank
            _ => p.count.unwrap_or(p.scalar).bytes(),
        };
        self.properties.iter().map(bytes).sum()
    }
}

/// A header.
pub(super) struct PlyHeader {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<PlyElement>,
    /// Files of pictures, named by the comments `TextureFile` that photogrammetry writes.
    pub(super) pictures: Vec<String>,
    /// Bytes before the numbers.
    pub(super) bytes: usize,
    /// Number of the first line after the header.
    pub(super) next_line: usize,
}

impl PlyHeader {
    /// Reads the header of `file` and checks that what it announces fits into the rest.
    pub(super) fn read(file: &MeshFile<'_>) -> Result<Self, SceneError> {
        let error = |line, message: String| file.finding(line, message).error();
        let mut encoding = None;
        let mut elements: Vec<PlyElement> = Vec::new();
        let mut pictures = Vec::new();
        let (mut at, mut line) = (0, 0);
        loop {
            line += 1;
            let rest = &file.bytes[at..];
            let end = rest.iter().take(limits::MESH_LINE_BYTES).position(|b| *b == b'\n');
            let Some(end) = end.filter(|_| at < limits::MESH_LINE_BYTES) else {
                let found = file.finding(line, "the header of this PLY file does not end");
                return Err(found.help("it ends with the line `end_header`").error());
            };
            at += end + 1;
            let text = String::from_utf8_lossy(&rest[..end]);
            let text = text.trim();
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            if line == 1 && words != ["ply"] {
                let found = file.finding(line, "this is not a PLY file");
                return Err(found.help("the first line of a PLY file is `ply`").error());
            }
            match words.as_slice() {
                ["comment", "TextureFile", _, ..] => {
                    let name = text.split_once("TextureFile").map_or("", |(_, name)| name.trim());
                    pictures.push(name.to_owned());
                }
                ["ply"] | [] | ["comment" | "obj_info", ..] => {}
                ["format", name, "1.0"] if encoding.is_none() => {
                    encoding = Some(match *name {
                        "ascii" => Encoding::Ascii,
                        "binary_little_endian" => Encoding::LittleEndian,
                        "binary_big_endian" => Encoding::BigEndian,
                        _ => return Err(error(line, "this is not a format of PLY 1.0".to_owned())),
                    });
                }
                ["element", name, count] => {
                    let rows = count
                        .parse()
                        .map_err(|_| error(line, "an element has a number of rows".to_owned()))?;
                    if elements.iter().any(|e| e.name == *name) {
                        return Err(error(line, "a second element of this name".to_owned()));
                    }
                    elements.push(PlyElement {
                        name: (*name).to_owned(),
                        rows,
                        properties: Vec::new(),
                        line,
                    });
                }
                ["property", words @ ..] => {
                    let Some((element, property)) = elements.last_mut().zip(property(words, line)) else {
                        let found = file.finding(line, "this is not a property of an element");
                        return Err(found
                            .help("write `property float x`, or `property list uchar int vertex_indices`")
                            .error());
                    };
                    element.properties.push(property);
                }
                ["end_header"] => {
                    let encoding =
                        encoding.ok_or_else(|| error(line, "the header names no format".to_owned()))?;
                    let header = Self { encoding, elements, pictures, bytes: at, next_line: line + 1 };
                    return header.check(file);
                }
                _ => {
                    return Err(error(
                        line,
                        "this line has no meaning in the header of a PLY file".to_owned(),
                    ));
                }
            }
        }
    }

    /// Refuses numbers of rows for which the file is too short.
    fn check(self, file: &MeshFile<'_>) -> Result<Self, SceneError> {
        let left = file.bytes.len() - self.bytes;
        for element in &self.elements {
            let PlyElement { name, rows, line, .. } = element;
            // The last number of a text needs no blank after it.
            let least = rows.saturating_mul(element.least_bytes(self.encoding));
            if least > left + usize::from(self.encoding == Encoding::Ascii) {
                let message =
                    format!("{rows} rows of `{name}` do not fit into the {left} bytes after the header");
                return Err(file.finding(*line, message).help("is the file complete?").error());
            }
            if *rows > limits::MESH_VERTICES {
                let message = format!("the mesh has more than {} vertices or faces", limits::MESH_VERTICES);
                return Err(file.finding_of(FindingKind::Limit, *line, message).error());
            }
        }
        Ok(self)
    }

    /// The element of this name.
    pub(super) fn element(&self, name: &str) -> Option<&PlyElement> {
        self.elements.iter().find(|e| e.name == name)
    }
}

/// A property, from the words after `property`.
fn property(words: &[&str], line: usize) -> Option<PlyProperty> {
    let (count, scalar, name) = match words {
        ["list", count, scalar, name] => (Some(Scalar::of(count).filter(|c| c.is_integer())?), scalar, name),
        [scalar, name] => (None, scalar, name),
        _ => return None,
    };
    Some(PlyProperty { name: (*name).to_owned(), scalar: Scalar::of(scalar)?, count, line })
}
