//! Thousands of broken USD files, as text, crate and package: each is read, or refused with its name. Memory and time are bounded.

use std::path::Path;

use pointillist::math::random::Random;

use crate::corrupt::{NUMBERS, corrupt};
use crate::guard::{folder, model_outcome, write};
use crate::messages::assert_has_place;

const TEXT: &[u8] = include_bytes!("../scene/usd/stage.usda");
const CRATE: &[u8] = include_bytes!("../scene/usd/stage.usdc");
const PACKAGE: &[u8] = include_bytes!("../scene/usd/stage.usdz");
const PICTURE: &[u8] = include_bytes!("../scene/usd/picture.png");

/// Pieces of text in wrong places.
const PIECES: &[&str] = &[
    "{",
    "}",
    "(",
    ")",
    "[",
    "]",
    "\"",
    "'''",
    "\"\"\"",
    "@",
    "@@@",
    "<",
    ">",
    "</World>",
    "def ",
    "class ",
    "over ",
    "#",
    ";",
    "references = @stage.usda@",
    "inherits = </World>",
    "payload = @/dev/zero@",
    "subLayers = [@stage.usda@]",
    "None",
    "nan",
    "inf",
    ".connect = ",
    ".timeSamples = {",
    "rel ",
    "token ",
    "int[] ",
    "variantSet \"a\" = {",
    "instanceable = true",
    "[1.5e300]",
    "\\",
    "é",
];

/// Loads the file under guard; the message if it is refused.
fn outcome(folder: &Path, name: &str, what: &str) -> Result<(), String> {
    model_outcome(folder, name, what, &[".usda", ".usdc", ".usdz", ".ply", ".txt"])
}

/// One of the bytes, or of the whole numbers of eight bytes, is another one; or the end is missing.
fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    match random.below(4) {
        0 => {
            let at = random.below(bytes.len());
            bytes[at] = random.below(256) as u8;
        }
        1 => {
            let at = random.below(bytes.len());
            bytes[at] ^= 1 << random.below(8);
        }
        2 => {
            let at = random.below(bytes.len() / 8) * 8;
            let values =
                [0, 1, 7, 255, 1 << 16, 1 << 31, u64::from(u32::MAX), 1 << 40, u64::MAX - 1, u64::MAX];
            let value = values[random.below(values.len())].to_le_bytes();
            let end = (at + 8).min(bytes.len());
            bytes[at..end].copy_from_slice(&value[..end - at]);
        }
        _ if random.below(8) == 0 => bytes.truncate(random.below(bytes.len())),
        _ => {
            let (from, to) = (random.below(bytes.len()), random.below(bytes.len()));
            let count = random.below(16).min(bytes.len() - from.max(to));
            bytes.copy_within(from..from + count, to);
        }
    }
}

/// How many of `count` broken files are refused, and how many read.
fn broken(name: &str, sound: &[u8], count: usize, change: impl Fn(&mut Vec<u8>, &mut Random)) -> [usize; 2] {
    let folder = folder(&format!("broken_{name}"));
    write(&folder, "picture.png", PICTURE);
    write(&folder, name, sound);
    assert_eq!(outcome(&folder, name, "the whole file"), Ok(()));
    let mut random = Random(2_026);
    let mut found = [0, 0];
    for i in 0..count {
        let mut bytes = sound.to_vec();
        (0..=random.below(3)).for_each(|_| change(&mut bytes, &mut random));
        write(&folder, name, &bytes);
        match outcome(&folder, name, &format!("{name} {i}")) {
            Ok(()) => found[1] += 1,
            Err(shown) => {
                assert_has_place(
                    &format!("{name} {i}"),
                    &shown,
                    &[".usda", ".usdc", ".usdz", ".ply", ".txt", ".png"],
                );
                found[0] += 1;
            }
        }
    }
    found
}

#[test]
fn two_thousand_broken_texts() {
    let [refused, read] = broken("stage.usda", TEXT, 2000, |bytes, random| {
        let pieces = if random.below(2) == 0 { PIECES } else { NUMBERS };
        corrupt(bytes, random, pieces);
    });
    assert!(refused > 300 && read > 100, "{refused} refused, {read} read");
}

#[test]
fn three_thousand_broken_crates() {
    let [refused, read] = broken("stage.usdc", CRATE, 3000, damage);
    assert!(refused > 300 && read > 100, "{refused} refused, {read} read");
}

#[test]
fn a_thousand_broken_packages() {
    let [refused, read] = broken("stage.usdz", PACKAGE, 1000, damage);
    // Archives have sums of their bytes.
    assert!(refused > 100 && read > 10, "{refused} refused, {read} read");
}

/// References that make a million prims of a few lines, brackets in brackets, and layers in a circle.
#[test]
fn a_small_file_is_not_made_large() {
    let folder = folder("large_stages");
    let mut text = "#usda 1.0\nclass \"c0\" {\n def Sphere \"s\" {\n }\n}\n".to_owned();
    for level in 1..12 {
        let below = level - 1;
        text += &format!("class \"c{level}\" {{\n");
        for i in 0..10 {
            text += &format!(" def \"p{i}\" (references = </c{below}>) {{\n }}\n");
        }
        text += "}\n";
    }
    text += "def \"all\" (references = </c11>) {\n}\n";
    write(&folder, "stage.usda", text.as_bytes());
    let shown = outcome(&folder, "stage.usda", "references").expect_err("refused");
    assert!(shown.contains("too many of a few"), "{shown}");
    let deep = format!("#usda 1.0\n{}", "def \"a\" {\n".repeat(100_000));
    write(&folder, "stage.usda", deep.as_bytes());
    let shown = outcome(&folder, "stage.usda", "deep").expect_err("refused");
    assert!(shown.contains("brackets"), "{shown}");
    let huge = "#usda 1.0\ndef Mesh \"m\" {\n int[] faceVertexCounts = [2000000000, 3]\n int[] faceVertexIndices = [0, 1, 2]\n \
                point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n}\ndef Cube \"c\" {\n}\n";
    write(&folder, "stage.usda", huge.as_bytes());
    assert_eq!(outcome(&folder, "stage.usda", "huge"), Ok(()));
}
