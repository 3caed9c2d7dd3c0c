//! Mitsuba's `serialized` format, versions 3 and 4: meshes one after the other, each compressed, and a dictionary at the end of the
//! file (Mitsuba 0.6 documentation, §8.2.3 "Serialized mesh loader").
//!
//! ```text
//! each mesh    u16 0x041C, u16 version, then by zlib: u32 flags; version 4: name, ended by a zero; u64 vertices, u64 triangles;
//!              positions, normals, texture coordinates, colours (those of the flags, f32 or f64); u32 corners
//! dictionary   of each mesh the place in the file (u32 in version 3, u64 in version 4), u32 number of meshes
//! ```
//!
//! All numbers have their least significant byte first.

use std::io::{BufRead, BufReader, ErrorKind, Read};

use flate2::read::ZlibDecoder;
use glam::{Vec2, Vec3};

use super::file::{Count, MeshFile, RawMesh};
use super::options::MeshOptions;
use crate::scene::desc::{Mesh, MeshAttribute};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::leftovers::Leftovers;
use crate::scene::limits;

const MAGIC: u16 = 0x041C;

/// Bytes before the compressed part of a mesh.
const MESH_HEADER: usize = 4;

// Flags. Mitsuba takes any number without `DOUBLE` for one of single precision, and ignores `FACETS`.
const NORMALS: u32 = 0x0001;
const UVS: u32 = 0x0002;
const COLOURS: u32 = 0x0008;
const SINGLE: u32 = 0x1000;
const DOUBLE: u32 = 0x2000;

/// The flags that decide what is read.
const USED: u32 = NORMALS | UVS | COLOURS | SINGLE | DOUBLE;

/// Bytes of a name.
const LONGEST_NAME: u64 = 1 << 16;

/// Reads one mesh of a file.
pub(super) fn read<'a>(file: &MeshFile<'a>, options: &MeshOptions) -> Result<RawMesh<'a>, SceneError> {
    let index = options.shape_index;
    let fault = |fault: SerializedFault| {
        let SerializedFault(kind, message) = fault;
        file.finding_of(kind, 1, format!("mesh {index} of this file: {message}"))
    };
    let (version, compressed) = locate(file.bytes, index).map_err(|f| fault(f).error())?;
    let (mut out_of_range, mut left) = (Count::default(), Leftovers::default());
    let mesh = Inflated::new(compressed).mesh(version, options, &mut out_of_range, &mut left);
    let mesh = mesh.map_err(|f| fault(f).help("is the file complete?").error())?;
    Ok(RawMesh {
        mesh,
        dropped: vec![(out_of_range, "triangles have an index that the file does not have: dropped")],
        left,
        warnings: Vec::new(),
        line_of: Box::new(|_| 1),
        advice: "export the mesh with triangles",
    })
}

/// A fault of the file: its kind and the message.
struct SerializedFault(FindingKind, String);

impl SerializedFault {
    fn new(message: impl Into<String>) -> Self {
        Self(FindingKind::Mesh, message.into())
    }
}

/// The version and the compressed part of mesh `index`.
fn locate(bytes: &[u8], index: u32) -> Result<(u16, &[u8]), SerializedFault> {
    // Mitsuba reads the first mesh without the dictionary.
    let offset = if index == 0 { 0 } else { offset(bytes, header(bytes)?, index)? };
    let mesh = usize::try_from(offset).ok().and_then(|offset| bytes.get(offset..));
    let mesh =
        mesh.ok_or_else(|| SerializedFault::new("the dictionary at its end names a place beyond it"))?;
    Ok((header(mesh)?, &mesh[MESH_HEADER..]))
}

/// The version of the mesh that `bytes` begin with.
fn header(bytes: &[u8]) -> Result<u16, SerializedFault> {
    let [a, b, c, d] = *bytes.first_chunk().ok_or_else(|| SerializedFault::new("the file ends before it"))?;
    match (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])) {
        (MAGIC, version @ 3..=4) => Ok(version),
        (MAGIC, version) => {
            Err(SerializedFault::new(format!("it has version {version}; versions 3 and 4 can be read")))
        }
        _ => Err(SerializedFault::new("it does not begin as a serialized mesh of Mitsuba does")),
    }
}

/// The place of mesh `index`, from the dictionary at the end of the file.
fn offset(bytes: &[u8], version: u16, index: u32) -> Result<u64, SerializedFault> {
    let cut = || SerializedFault::new("the dictionary at its end is not complete");
    let (rest, count) = bytes.split_last_chunk().ok_or_else(cut)?;
    let count = u32::from_le_bytes(*count);
    let width = if version == 3 { 4 } else { 8 };
    if u64::from(count) * width as u64 > rest.len() as u64 {
        return Err(cut());
    }
    let dictionary = &rest[rest.len() - count as usize * width..];
    let entry = dictionary.chunks_exact(width).nth(index as usize).ok_or_else(|| {
        let range = format!("`shape_index` goes from 0 to {}", i64::from(count) - 1);
        SerializedFault::new(format!("there is none: {range}"))
    })?;
    Ok(entry.iter().rev().fold(0, |offset, byte| offset << 8 | u64::from(*byte)))
}

/// The inflated bytes of a mesh, of which nobody knows how many there are.
struct Inflated<'a> {
    bytes: BufReader<ZlibDecoder<&'a [u8]>>,
    /// Bytes that may still come.
    left: u64,
}

impl<'a> Inflated<'a> {
    fn new(compressed: &'a [u8]) -> Self {
        let left = limits::MESH_INFLATED_FREE + limits::MESH_INFLATION * compressed.len() as u64;
        Self { bytes: BufReader::with_capacity(1 << 16, ZlibDecoder::new(compressed)), left }
    }

    fn exact(&mut self, out: &mut [u8]) -> Result<(), SerializedFault> {
        self.bytes.read_exact(out).map_err(|e| match e.kind() {
            ErrorKind::UnexpectedEof => SerializedFault::new("the file ends within it"),
            _ => SerializedFault::new("its bytes cannot be decompressed"),
        })
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], SerializedFault> {
        let mut bytes = [0; N];
        self.exact(&mut bytes).map(|()| bytes)
    }

    fn skip_name(&mut self) -> Result<(), SerializedFault> {
        let mut name = Vec::new();
        let read = self.bytes.by_ref().take(LONGEST_NAME).read_until(0, &mut name);
        let ended = read.is_ok() && name.last() == Some(&0);
        if ended { Ok(()) } else { Err(SerializedFault::new("its name does not end")) }
    }

    /// Reads `count` rows of `N` numbers of `W` bytes each.
    fn rows<T, const N: usize, const W: usize>(
        &mut self,
        count: usize,
        make: impl Fn([[u8; W]; N]) -> T,
    ) -> Result<Vec<T>, SerializedFault> {
        // Before memory is taken: the number may be a lie.
        self.left = self.left.checked_sub((count * N * W) as u64).ok_or_else(|| {
            let message =
                format!("it says that it is more than {} times as large as its file", limits::MESH_INFLATION);
            SerializedFault(FindingKind::Limit, message)
        })?;
        let mut rows = Vec::with_capacity(count);
        let mut block = vec![0; (N * W * count.min(4096)).max(1)];
        while rows.len() < count {
            let bytes = &mut block[..N * W * (count - rows.len()).min(4096)];
            self.exact(bytes)?;
            rows.extend(bytes.as_chunks::<W>().0.as_chunks::<N>().0.iter().map(|row| make(*row)));
        }
        Ok(rows)
    }

    /// Reads `count` rows of `N` floats, of double precision where `double`.
    fn floats<T, const N: usize>(
        &mut self,
        count: usize,
        double: bool,
        make: impl Fn([f32; N]) -> T,
    ) -> Result<Vec<T>, SerializedFault> {
        if double {
            self.rows(count, |row| make(row.map(|b| f64::from_le_bytes(b) as f32)))
        } else {
            self.rows(count, |row| make(row.map(f32::from_le_bytes)))
        }
    }

    fn mesh(
        mut self,
        version: u16,
        options: &MeshOptions,
        out_of_range: &mut Count,
        left: &mut Leftovers,
    ) -> Result<Mesh, SerializedFault> {
        let flags = u32::from_le_bytes(self.array()?);
        for flag in (0..u32::BITS).map(|bit| 1 << bit).filter(|flag| flags & !USED & flag != 0) {
            left.add(&format!("flag {flag:#06x}"), 1);
        }
        if version == 4 {
            self.skip_name()?;
        }
        let [vertices, triangles] = [u64::from_le_bytes(self.array()?), u64::from_le_bytes(self.array()?)];
        let most = [limits::MESH_VERTICES, limits::MESH_TRIANGLES];
        if vertices > most[0] as u64 || triangles > most[1] as u64 {
            let message = format!(
                "it says that it has {vertices} vertices and {triangles} triangles; at most {} and {} can be read",
                most[0], most[1]
            );
            return Err(SerializedFault(FindingKind::Limit, message));
        }
        let (vertices, triangles) = (vertices as usize, triangles as usize);
        let of = |flag: u32| if flags & flag != 0 { vertices } else { 0 };
        let double = flags & DOUBLE != 0;
        let flip = |[u, v]: [f32; 2]| Vec2::new(u, if options.flip_tex_coords { 1.0 - v } else { v });
        let positions = self.floats(vertices, double, Vec3::from_array)?;
        let normals = self.floats(of(NORMALS), double, Vec3::from_array)?;
        let uvs = self.floats(of(UVS), double, flip)?;
        let colours = self.floats(of(COLOURS), double, |rgb: [f32; 3]| rgb)?;
        let mut triangles = self.rows(triangles, |row| row.map(u32::from_le_bytes))?;
        triangles.retain(|triangle| {
            let in_range = triangle.iter().all(|&v| (v as usize) < vertices);
            if !in_range {
                out_of_range.add(|| 1);
            }
            in_range
        });
        let kept =
            !colours.is_empty() && options.attributes.iter().any(|name| name == MeshAttribute::VERTEX_COLOR);
        if !colours.is_empty() && !kept {
            left.add("colours of vertices", 1);
        }
        if matches!(self.bytes.fill_buf(), Ok(rest) if !rest.is_empty()) {
            left.add("bytes after the triangles", 1);
        }
        let values = colours.into_flattened();
        let attributes =
            kept.then(|| MeshAttribute { name: MeshAttribute::VERTEX_COLOR.to_owned(), channels: 3, values });
        let attributes = attributes.into_iter().collect();
        Ok(Mesh { positions, normals, uvs, triangles, attributes, ..Mesh::default() })
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::{Compression, write::ZlibEncoder};

    use super::*;
    use crate::scene::mesh::{MeshFormat, MeshRead, parse};

    fn options(shape_index: u32) -> MeshOptions {
        MeshOptions { format: MeshFormat::Serialized, shape_index, ..MeshOptions::default() }
    }

    /// A mesh of the file: a square with everything that there can be.
    fn mesh(version: u16, flags: u32, counts: [u64; 2], size: f64) -> Vec<u8> {
        let mut raw = flags.to_le_bytes().to_vec();
        if version == 4 {
            raw.extend(b"a square\0");
        }
        counts.iter().for_each(|n| raw.extend(n.to_le_bytes()));
        let mut row = |row: &[f64]| {
            for n in row {
                if flags & DOUBLE != 0 {
                    raw.extend(n.to_le_bytes())
                } else {
                    raw.extend((*n as f32).to_le_bytes())
                }
            }
        };
        (0..4).for_each(|i| row(&[size * f64::from(i & 1), size * f64::from(i >> 1), 0.5]));
        for (flag, values) in
            [(NORMALS, [0.0, 3.0, 4.0].as_slice()), (UVS, &[0.25, 0.75]), (COLOURS, &[1.0; 3])]
        {
            (0..4).filter(|_| flags & flag != 0).for_each(|_| row(values));
        }
        [0_u32, 1, 2, 1, 3, 2].iter().for_each(|v| raw.extend(v.to_le_bytes()));
        let mut out = [MAGIC.to_le_bytes(), version.to_le_bytes()].concat();
        let mut zlib = ZlibEncoder::new(&mut out, Compression::default());
        zlib.write_all(&raw).expect("memory");
        zlib.finish().expect("memory");
        out
    }

    /// A file of `meshes` with its dictionary.
    fn file(version: u16, meshes: &[Vec<u8>]) -> Vec<u8> {
        let mut out = meshes.concat();
        let mut place = 0_u64;
        for mesh in meshes {
            out.extend(&place.to_le_bytes()[..if version == 3 { 4 } else { 8 }]);
            place += mesh.len() as u64;
        }
        out.extend((meshes.len() as u32).to_le_bytes());
        out
    }

    #[test]
    fn both_versions_and_precisions_and_every_flag() {
        for version in [3, 4] {
            for flags in
                [0, 0x1000, DOUBLE, UVS, NORMALS | UVS | COLOURS | DOUBLE, NORMALS | COLOURS | 0x1010]
            {
                let meshes = [1.0, 2.0].map(|size| mesh(version, flags, [4, 2], size));
                for (index, size) in [(0, 1.0), (1, 2.0)] {
                    let MeshRead { mesh, warnings, .. } =
                        parse("a", &file(version, &meshes), &options(index)).expect("valid");
                    assert_eq!(mesh.positions[3], Vec3::new(size, size, 0.5));
                    assert_eq!(mesh.triangles, [[0, 1, 2], [1, 3, 2]]);
                    let normal = if flags & NORMALS != 0 { Vec3::new(0.0, 0.6, 0.8) } else { Vec3::Z };
                    assert_eq!(mesh.normals, [normal; 4]);
                    let uvs = if flags & UVS != 0 { vec![Vec2::new(0.25, 0.75); 4] } else { Vec::new() };
                    let told: Vec<String> = warnings.iter().map(ToString::to_string).collect();
                    let left = match flags & (COLOURS | 0x10) {
                        0 => Vec::new(),
                        COLOURS => vec!["not used: `colours of vertices`"],
                        _ => vec!["not used: `flag 0x0010`, `colours of vertices`"],
                    };
                    assert_eq!(
                        (mesh.uvs.clone(), told),
                        (uvs, left.into_iter().map(str::to_owned).collect())
                    );
                }
            }
        }
    }

    #[test]
    fn lies_are_refused() {
        let good = || file(4, &[mesh(4, 0, [4, 2], 1.0)]);
        let error = |bytes: &[u8], index: u32| {
            let e = parse("a", bytes, &options(index)).expect_err("broken");
            (e.kind(), e.to_string())
        };
        let expect = |bytes: &[u8], index: u32, kind: FindingKind, words: &str| {
            let (found, message) = error(bytes, index);
            assert!(found == kind && message.contains(words), "{found:?} {message}");
        };
        let of = FindingKind::Mesh;
        expect(&good(), 1, of, "from 0 to 0");
        let one = mesh(4, 0, [4, 2], 1.0);
        expect(&one[..one.len() - 10], 0, of, "ends within");
        expect(&good()[..3], 0, of, "ends before");
        expect(b"ply\nformat", 0, of, "does not begin");
        expect(&mesh(5, 0, [4, 2], 1.0), 0, of, "version 5");
        expect(&[&good()[..], &u32::MAX.to_le_bytes()].concat(), 1, of, "not complete");
        expect(&[&good()[..], &[255; 16], &2_u32.to_le_bytes()].concat(), 1, of, "beyond it");
        expect(&mesh(4, 0, [4, 3], 1.0), 0, of, "ends within");
        expect(&mesh(4, 0, [u64::MAX, 2], 1.0), 0, FindingKind::Limit, "at most");
        expect(&mesh(4, 0, [1 << 25, 2], 1.0), 0, FindingKind::Limit, "100 times");
        expect(&mesh(4, 0, [4, 1 << 24], 1.0), 0, FindingKind::Limit, "100 times");
        let shifted =
            parse("a", &mesh(4, 0, [3, 2], 1.0), &options(0)).expect("the second triangle is sound");
        assert_eq!((shifted.mesh.triangles.len(), shifted.warnings.len()), (1, 2), "and bytes are left");
    }
}
