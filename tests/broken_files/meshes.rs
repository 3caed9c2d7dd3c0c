//! A thousand broken PLY files of each encoding, a thousand broken `serialized` files, and a thousand broken files of curves of each kind: each is read, or refused with a place.

use std::io::Write;

use flate2::{Compression, write::ZlibEncoder};

use crate::corrupt::corrupt;
use crate::guard::{folder, outcome, write};
use crate::messages::assert_has_place;
use pointillist::math::random::Random;

/// Pieces of PLY in wrong places.
const LINES: &[&str] = &[
    "element vertex 4294967295\n",
    "element face 2147483647\n",
    "element face 18446744073709551615\n",
    "element none 4000000000\n",
    "element vertex -3\n",
    "property list uint uint vertex_indices\n",
    "property list char char vertex_index\n",
    "property list float int vertex_indices\n",
    "property list uchar double vertex_indices\n",
    "property double x\n",
    "property uchar red\n",
    "property list uchar float r\n",
    "property float r\n",
    "property uchar weight_1\n",
    "property list int float more\n",
    "format ascii 1.0\n",
    "format binary_big_endian 1.0\n",
    "format binary_little_endian 1.0\n",
    "end_header\n",
    "comment \u{0}\n",
    "ply\n",
    "-1 ",
    "nan ",
    "255 ",
    "4294967295 ",
    "\u{ff}\u{ff}\u{ff}\u{ff}",
];

/// A bent grid of 6 × 6 vertices.
fn grid() -> (Vec<[f32; 11]>, Vec<[u32; 4]>) {
    let vertex = |i: u32| {
        let (x, y) = (i as f32 % 6.0, (i / 6) as f32);
        [x, x * y, y, 0.0, 1.0, 0.0, x / 5.0, y / 5.0, x / 5.0, y / 5.0, 0.5]
    };
    let quads = (0..30_u32).filter(|i| i % 6 != 5).map(|i| [i, i + 1, i + 7, i + 6]).collect();
    ((0..36).map(vertex).collect(), quads)
}

/// The grid as PLY, with bytes that `float` and `int` make of numbers.
fn ply(
    format: &str,
    float: fn(f32) -> Vec<u8>,
    int: fn(u32) -> Vec<u8>,
    length: fn(u8) -> Vec<u8>,
    end: &str,
) -> Vec<u8> {
    let names: String = ["x", "y", "z", "nx", "ny", "nz", "u", "v", "r", "g", "b"]
        .map(|n| format!("property float {n}\n"))
        .concat();
    let (vertices, quads) = grid();
    let mut file = format!(
        "ply\nformat {format} 1.0\ncomment a grid\nelement vertex {}\n{names}element face {}\n\
         property list uchar int vertex_indices\nproperty float weight_0\nend_header\n",
        vertices.len(),
        quads.len()
    )
    .into_bytes();
    for vertex in vertices {
        vertex.iter().for_each(|n| file.extend(float(*n)));
        file.extend(end.bytes());
    }
    for quad in quads {
        file.extend(length(4));
        quad.iter().for_each(|i| file.extend(int(*i)));
        file.extend(float(1.0));
        file.extend(end.bytes());
    }
    file
}

fn compress(raw: &[u8]) -> Vec<u8> {
    let mut out = vec![0x1c, 0x04, 4, 0];
    let mut zlib = ZlibEncoder::new(&mut out, Compression::default());
    zlib.write_all(raw).expect("memory");
    zlib.finish().expect("memory");
    out
}

/// The grid as a mesh of `serialized`, not yet compressed.
fn raw() -> Vec<u8> {
    let (vertices, quads) = grid();
    let mut raw = 0x100b_u32.to_le_bytes().to_vec();
    raw.extend(b"grid\0");
    [vertices.len() as u64, 2 * quads.len() as u64].iter().for_each(|n| raw.extend(n.to_le_bytes()));
    for range in [0..3, 3..6, 6..8, 8..11] {
        vertices.iter().flat_map(|v| &v[range.clone()]).for_each(|n| raw.extend(n.to_le_bytes()));
    }
    for [a, b, c, d] in quads {
        [a, b, c, a, c, d].iter().for_each(|i| raw.extend(i.to_le_bytes()));
    }
    raw
}

/// Reads a thousand files that `broken` makes; both outcomes occur often enough.
fn thousand(name: &str, kind: &str, mut broken: impl FnMut(&mut Random) -> Vec<u8>) {
    let folder = folder(name);
    let (file, parameter) = (format!("mesh.{kind}"), "<integer name=\"shape_index\" value=\"0\"/>");
    let weight = "<texture name=\"roughness\" type=\"mesh_attribute\"><string name=\"name\" value=\"face_weight\"/></texture>";
    let (parameter, weight) = if kind == "serialized" { (parameter, "") } else { ("", weight) };
    let color = "<texture name=\"base_color\" type=\"mesh_attribute\"><string name=\"name\" value=\"vertex_color\"/></texture>";
    let bsdf = match kind {
        "linearcurve" | "bsplinecurve" => String::new(),
        _ => format!("<bsdf type=\"principled\">{color}{weight}</bsdf>"),
    };
    let scene = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/>\
         <shape type=\"{kind}\"><string name=\"filename\" value=\"{file}\"/>{parameter}{bsdf}</shape></scene>"
    );
    write(&folder, "scene.xml", scene.as_bytes());
    let mut random = Random(31_337);
    let (mut refused, mut read) = (0, 0);
    for i in 0..1000 {
        let bytes = broken(&mut random);
        write(&folder, &file, &bytes);
        let what = format!("{name} {i}: {}", String::from_utf8_lossy(&bytes[..bytes.len().min(2000)]));
        match outcome(&folder, &what) {
            Ok(()) => read += 1,
            Err(shown) => {
                assert_has_place(&what, &shown, &[&file, "scene.xml"]);
                refused += 1;
            }
        }
    }
    assert!(refused > 100 && read > 50, "{name}: {refused} refused, {read} read");
}

fn broken_ply(name: &str, whole: &[u8]) {
    // Half of the changes into the header, where they do most.
    let header = whole.windows(10).position(|w| w == b"end_header").expect("a header");
    thousand(name, "ply", |random| {
        let mut bytes = whole.to_vec();
        for _ in 0..=random.below(3) {
            if random.below(2) == 0 {
                let mut front: Vec<u8> = bytes.drain(..header.min(bytes.len())).collect();
                front.push(b'\n');
                corrupt(&mut front, random, LINES);
                bytes.splice(0..0, front);
            } else {
                corrupt(&mut bytes, random, LINES);
            }
        }
        bytes
    });
}

#[test]
fn a_thousand_broken_ply_texts() {
    let text = |n: f32| format!("{n} ").into_bytes();
    let int = |n: u32| format!("{n} ").into_bytes();
    broken_ply("broken_ply_text", &ply("ascii", text, int, |n| format!("{n} ").into_bytes(), "\n"));
}

#[test]
fn a_thousand_broken_little_endian_ply_files() {
    let file = ply(
        "binary_little_endian",
        |n| n.to_le_bytes().to_vec(),
        |n| n.to_le_bytes().to_vec(),
        |n| vec![n],
        "",
    );
    broken_ply("broken_ply_little", &file);
}

#[test]
fn a_thousand_broken_big_endian_ply_files() {
    let file =
        ply("binary_big_endian", |n| n.to_be_bytes().to_vec(), |n| n.to_be_bytes().to_vec(), |n| vec![n], "");
    broken_ply("broken_ply_big", &file);
}

/// In half of the files what is inside is broken and then compressed as it should be.
#[test]
fn a_thousand_broken_serialized_files() {
    let raw = raw();
    let dictionary = [0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0];
    thousand("broken_serialized", "serialized", |random| {
        if random.below(2) == 0 {
            let mut inner = raw.clone();
            let end = if random.below(2) == 0 { 40 } else { inner.len() };
            let mut front: Vec<u8> = inner.drain(..end).collect();
            corrupt(&mut front, random, LINES);
            return [compress(&[front, inner].concat()), dictionary.to_vec()].concat();
        }
        let mut bytes = [compress(&raw), dictionary.to_vec()].concat();
        corrupt(&mut bytes, random, LINES);
        bytes
    });
}

/// The counts of vertices and triangles are anything but what the file holds.
#[test]
fn a_thousand_serialized_files_with_lying_counts() {
    let raw = raw();
    let counts = raw.windows(5).position(|w| w == b"grid\0").expect("a name") + 5;
    thousand("lying_serialized", "serialized", |random| {
        let mut raw = raw.clone();
        for at in [counts, counts + 8] {
            let lie = match random.below(4) {
                0 => continue,
                1 => random.below(100) as u64,
                2 => 1 << random.below(64),
                _ => u64::MAX >> random.below(64),
            };
            raw[at..at + 8].copy_from_slice(&lie.to_le_bytes());
        }
        [compress(&raw), vec![0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]].concat()
    });
}

fn broken_curves(kind: &str) {
    let point = |i: u32| format!("{} {} {} {}\n", i, i * i % 7, 0.5 * f64::from(i), 1.0 / f64::from(i + 1));
    let curves: String = (0..40).map(|i| point(i) + if i % 9 == 8 { "\n" } else { "" }).collect();
    thousand(&format!("broken_{kind}"), kind, |random| {
        let mut bytes = curves.clone().into_bytes();
        if random.below(4) == 0 {
            bytes.truncate(1 + random.below(60));
        }
        corrupt(
            &mut bytes,
            random,
            &["nan ", "-1 ", "1e39 ", "\n", "\n\n", "\u{0}", "0 0 0 0\n", "# hair\n"],
        );
        bytes
    });
}

#[test]
fn a_thousand_broken_linear_curves() {
    broken_curves("linearcurve");
}

#[test]
fn a_thousand_broken_b_splines() {
    broken_curves("bsplinecurve");
}

/// A few kilobytes that say that they are gigabytes.
#[test]
fn bombs_are_refused_before_they_fill_the_memory() {
    let folder = folder("bombs");
    let scene = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/>\
                 <shape type=\"serialized\"><string name=\"filename\" value=\"mesh.serialized\"/></shape></scene>";
    write(&folder, "scene.xml", scene.as_bytes());
    for counts in [[1_u64 << 25, 1], [3, 1 << 24], [u64::MAX, u64::MAX], [1 << 32, 1 << 33]] {
        let mut raw = 0x1000_u32.to_le_bytes().to_vec();
        raw.push(0);
        counts.iter().for_each(|n| raw.extend(n.to_le_bytes()));
        raw.resize(1 << 26, 0);
        write(&folder, "mesh.serialized", &compress(&raw));
        let shown = outcome(&folder, "a bomb").expect_err("a bomb");
        assert_has_place("a bomb", &shown, &["mesh.serialized"]);
    }
}
