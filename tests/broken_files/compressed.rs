//! Thousands of broken compressed models and pictures (Draco, meshoptimizer's codecs, KTX2): each is read, or refused with a place.

use std::path::{Path, PathBuf};

use pointillist::math::random::Random;
use pointillist::scene::load;
use serde_json::Value;

use crate::corrupt::corrupt;
use crate::guard::{folder, guarded, outcome, write};
use crate::messages::{assert_has_place, render};
use crate::models::glb;

/// Bytes that mean something in streams.
const PIECES: &[&str] = &["DRACO", "\u{0}\u{0}\u{0}\u{0}", "\u{7f}\u{7f}\u{7f}\u{7f}", "\u{1}", "é"];

fn compressed() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scene/compressed")
}

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(compressed().join(name)).expect("a file of the tests")
}

/// Changes some bytes, bits or lengths from `from` on.
fn damage(bytes: &mut Vec<u8>, from: usize, random: &mut Random) {
    for _ in 0..=random.below(3) {
        let at = from + random.below((bytes.len() - from).max(1));
        match random.below(5) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.below(256) as u8,
            2 => bytes[at] = [0, 1, 127, 128, 255][random.below(5)],
            3 => {
                let end = (at + 1 + random.below(8)).min(bytes.len());
                bytes[at..end].fill([0, 255][random.below(2)]);
            }
            _ => {
                let mut end = bytes.split_off(at);
                corrupt(&mut end, random, PIECES);
                bytes.extend(end);
            }
        }
        if bytes.len() <= from {
            bytes.resize(from + 1, 0);
        }
    }
}

/// Changes a number or a word of one of the extensions of compression.
fn mistake(value: &mut Value, random: &mut Random) {
    let others = [0_u64, 1, 2, 3, 4, 5, 8, 12, 255, 256, 65_535, 1 << 20, 1 << 31, u64::MAX];
    match value {
        Value::Object(map) if !map.is_empty() => {
            let key = map.keys().nth(random.below(map.len())).expect("not empty").clone();
            mistake(map.get_mut(&key).expect("its key"), random);
        }
        Value::Number(_) => *value = others[random.below(others.len())].into(),
        Value::String(_) => {
            let words = ["NONE", "COLOR", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "TRIANGLES", "INDICES"];
            *value = words[random.below(words.len())].into();
        }
        _ => {}
    }
}

/// All extensions of compression in a text.
fn extensions(value: &mut Value) -> Vec<&mut Value> {
    match value {
        Value::Object(map) => {
            let each = map.iter_mut().flat_map(|(key, value)| {
                let is_one = key.ends_with("_compression") && value.is_object();
                if is_one { vec![value] } else { extensions(value) }
            });
            each.collect()
        }
        Value::Array(list) => list.iter_mut().flat_map(extensions).collect(),
        _ => Vec::new(),
    }
}

#[test]
fn thousands_of_broken_compressed_models() {
    let folder = folder("broken_compressed");
    let path = folder.join("model.glb");
    for name in [
        "draco-edgebreaker.glb",
        "draco-sequential.glb",
        "draco-used.glb",
        "meshopt-ext.glb",
        "meshopt-filter.glb",
        "meshopt-strip.glb",
        "pack-ext-float.glb",
        "pack-khr.glb",
        "pack-instanced.glb",
    ] {
        let valid = bytes(name);
        let length = u32::from_le_bytes(valid[12..16].try_into().expect("four bytes")) as usize;
        let text: Value = serde_json::from_slice(&valid[20..20 + length]).expect("JSON");
        let mut random = Random(1_404);
        let (mut refused, mut read) = (0, 0);
        for i in 0..COUNT {
            let (mut text, mut binary) = (text.clone(), valid[28 + length..].to_vec());
            match i % 4 {
                0 => {
                    let mut all = extensions(&mut text);
                    let one = random.below(all.len());
                    mistake(all[one], &mut random);
                }
                // As it is, with views that reach beyond it.
                1 => binary.truncate(random.below(binary.len())),
                _ => damage(&mut binary, 0, &mut random),
            }
            write(&folder, "model.glb", &glb(&text, &binary));
            let what = format!("{name} {i}");
            let path = path.clone();
            let outcome = guarded(&what, move || load(&path, &[]).map_err(|e| render(&e)).map(|_| ()));
            match outcome {
                Ok(()) => read += 1,
                Err(shown) => {
                    assert_has_place(&what, &shown, &["model.glb", ".ply"]);
                    refused += 1;
                }
            }
        }
        println!("{name}: {refused} refused, {read} read");
        assert!(refused > COUNT / 10 && read > 0, "{name}: {refused} refused, {read} read");
    }
}

#[test]
fn thousands_of_broken_ktx2_pictures() {
    let folder = folder("broken_ktx2");
    let scene = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/><bsdf type=\"diffuse\">\
                 <texture type=\"bitmap\" name=\"reflectance\"><string name=\"filename\" value=\"a.ktx2\"/></texture></bsdf></scene>";
    write(&folder, "scene.xml", scene.as_bytes());
    for name in [
        "uastc.ktx2",
        "uastc-zstd.ktx2",
        "etc1s.ktx2",
        "etc1s-opaque.ktx2",
        "rgba8.ktx2",
        "bgra8-zstd.ktx2",
        "r8.ktx2",
        "rg16-swizzled.ktx2",
        "half-upwards.ktx2",
        "float.ktx2",
    ] {
        let valid = bytes(name);
        let mut random = Random(2_004);
        let (mut refused, mut read) = (0, 0);
        for i in 0..COUNT {
            let mut bytes = valid.clone();
            match i % 4 {
                // A number of the header.
                0 => {
                    let at = 12 + 4 * random.below(23);
                    let number = [0, 1, 2, 3, 6, 7, 44, 60, 255, 4096, 1 << 20, i32::MAX as u32, u32::MAX];
                    let number = number[random.below(number.len())];
                    bytes[at..at + 4].copy_from_slice(&number.to_le_bytes());
                }
                1 => damage(&mut bytes, 12, &mut random),
                // Behind the header and the data format descriptor, so that decoders see it.
                _ => damage(&mut bytes, 250.min(valid.len() - 40), &mut random),
            }
            write(&folder, "a.ktx2", &bytes);
            let what = format!("{name} {i}");
            match outcome(&folder, &what) {
                Ok(()) => read += 1,
                Err(shown) => {
                    assert_has_place(&what, &shown, &["scene.xml"]);
                    assert!(shown.contains("a.ktx2"), "{what}: {shown}");
                    refused += 1;
                }
            }
        }
        println!("{name}: {refused} refused, {read} read");
        assert!(refused > COUNT / 10 && read > 0, "{name}: {refused} refused, {read} read");
    }
}

/// Broken files of each kind.
const COUNT: usize = 300;
