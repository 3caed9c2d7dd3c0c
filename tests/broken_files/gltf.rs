//! A thousand broken glTF models: each is read, or refused with a place. Memory is bounded.

use std::path::Path;

use pointillist::math::random::Random;
use serde_json::{Value, json};

use crate::corrupt::{NUMBERS, corrupt};
use crate::guard::{folder, model_outcome, write};
use crate::messages::assert_has_place;
use crate::models::{cube, glb};

/// Pieces of JSON in wrong places.
const PIECES: &[&str] = &[
    "\"uri\":\"/dev/zero\",",
    "\"uri\":\".\",",
    "\"uri\":\"data:;base64,AAAA\",",
    "\"children\":[0],",
    "\"byteStride\":0,",
    "\"byteStride\":4294967295,",
    "\"count\":4294967295,",
    "\"count\":18446744073709551615,",
    "\"sparse\":{\"count\":3,\"indices\":{\"bufferView\":3,\"componentType\":5123},\"values\":{\"bufferView\":0}},",
    "\"bufferView\":99,",
    "\"mode\":5,",
    "\"mode\":0,",
    "null",
    "[[[[[[",
    "{",
    "}",
    "\\u0000",
    "é",
];

/// Loads the model under guard; the message if it is refused.
fn outcome(folder: &Path, name: &str, what: &str) -> Result<(), String> {
    model_outcome(folder, name, what, &[".glb", ".gltf", ".ply"])
}

/// The cube with a light, a camera and most of what a material can have that needs no other plugin.
fn model() -> (Value, Vec<u8>) {
    let (mut text, binary) = cube();
    text["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }]);
    text["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "spot", "intensity": 5.0, "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.5 } },
    ] } });
    text["materials"][0]["emissiveFactor"] = json!([1, 0.5, 0]);
    text["nodes"][1]["camera"] = json!(0);
    text["nodes"][2]["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
    (text, binary)
}

/// One of the numbers, words or lists of a JSON text is replaced by another one.
fn mistake(value: &mut Value, random: &mut Random) {
    let stops = random.below(12) == 0;
    match value {
        Value::Object(map) if !map.is_empty() => {
            let key = map.keys().nth(random.below(map.len())).unwrap().clone();
            match stops {
                true => drop(map.remove(&key)),
                false => mistake(map.get_mut(&key).unwrap(), random),
            }
        }
        Value::Array(list) if !list.is_empty() => {
            let i = random.below(list.len());
            match stops {
                true => list.push(list[i].clone()),
                false => mistake(&mut list[i], random),
            }
        }
        leaf => {
            let others = [
                json!(-1),
                json!(0),
                json!(1),
                json!(3),
                json!(99),
                json!(u32::MAX),
                json!(u64::MAX),
                json!(1e38),
                json!(0.5),
                json!("x"),
                json!([0, 1]),
                json!({}),
                Value::Null,
            ];
            *leaf = others[random.below(others.len())].clone();
        }
    }
}

#[test]
fn a_thousand_broken_models() {
    let folder = folder("broken_models");
    let (text, binary) = model();
    write(&folder, "model.glb", &glb(&text, &binary));
    assert_eq!(outcome(&folder, "model.glb", "the whole file"), Ok(()));
    let mut random = Random(2_026);
    let (mut refused, mut read) = (0, 0);
    for i in 0..1000 {
        let (mut text, mut data) = (text.clone(), binary.clone());
        let bytes = match i % 3 {
            // Wrong values in a sound container.
            0 => {
                (0..=random.below(2)).for_each(|_| mistake(&mut text, &mut random));
                glb(&text, &data)
            }
            // A sound text of a broken binary part, or one that is cut short.
            1 => {
                data.truncate(random.below(data.len()));
                glb(&text, &data)
            }
            // A broken file.
            _ => {
                let mut bytes = glb(&text, &data);
                let pieces = if random.below(2) == 0 { PIECES } else { NUMBERS };
                (0..=random.below(3)).for_each(|_| corrupt(&mut bytes, &mut random, pieces));
                bytes
            }
        };
        write(&folder, "model.glb", &bytes);
        let what = format!("model {i}: {}", String::from_utf8_lossy(&bytes));
        match outcome(&folder, "model.glb", &what) {
            Ok(()) => read += 1,
            Err(shown) => {
                assert_has_place(&what, &shown, &["model.glb", ".ply", ".png"]);
                refused += 1;
            }
        }
    }
    assert!(refused > 300 && read > 50, "{refused} refused, {read} read");
}

/// Faults that have names.
#[test]
fn each_lie_has_its_message() {
    let folder = folder("lying_models");
    let told = |change: &dyn Fn(&mut Value)| {
        let (mut text, binary) = model();
        change(&mut text);
        write(&folder, "model.glb", &glb(&text, &binary));
        outcome(&folder, "model.glb", &text.to_string()).expect_err(&text.to_string())
    };
    type Change = dyn Fn(&mut Value);
    let cases: [(&str, &Change); 9] = [
        ("form a tree", &|t| t["nodes"][1]["children"] = json!([0])),
        ("form a tree", &|t| t["nodes"][2]["children"] = json!([1])),
        ("beyond its bufferView", &|t| t["accessors"][0]["count"] = json!(25)),
        ("more elements", &|t| t["accessors"][0]["count"] = json!(u64::MAX)),
        ("beyond its buffer", &|t| t["bufferViews"][0]["byteLength"] = json!(1_000_000)),
        ("not valid", &|t| t["meshes"][0]["primitives"][0]["material"] = json!(7)),
        ("not a regular file", &|t| t["buffers"][0]["uri"] = json!("/dev/zero")),
        ("base64", &|t| t["buffers"][0]["uri"] = json!("data:text/plain,hello")),
        ("shows no mesh", &|t| t["scenes"][0]["nodes"] = json!([])),
    ];
    for (wanted, change) in cases {
        let shown = told(change);
        assert!(shown.contains(wanted), "{wanted}: {shown}");
    }
}

/// Ten thousand primitives that share one accessor of zeros with hardly a byte behind it.
#[test]
fn a_small_file_does_not_fill_the_memory() {
    let folder = folder("inflated_models");
    let (mut text, binary) = model();
    let zeros = json!({ "count": 1_000_000, "type": "VEC3", "componentType": 5126,
        "min": [0, 0, 0], "max": [0, 0, 0], "sparse": { "count": 1,
        "indices": { "bufferView": 3, "componentType": 5123 }, "values": { "bufferView": 0 } } });
    text["accessors"].as_array_mut().unwrap().push(zeros);
    let primitive = json!({ "attributes": { "POSITION": 4 }, "mode": 4 });
    text["meshes"][0]["primitives"] = (0..10_000).map(|_| primitive.clone()).collect();
    write(&folder, "model.glb", &glb(&text, &binary));
    let shown = outcome(&folder, "model.glb", "inflated").expect_err("refused");
    assert!(shown.contains("too often"), "{shown}");
}
