//! Nothing in a glTF file is ignored without a word: something unknown in each place is told with the place.

use pointillist::scene::load;
use serde_json::{Value, json};

use super::gltf::{accessor, floats};
use super::models::changed_with;

/// A model that has an object of each kind.
fn everything(text: &mut Value, binary: &mut Vec<u8>) {
    let moved = floats(text, binary, "VEC3", &[0.25, 0.0, 0.0].repeat(24));
    let bound = floats(text, binary, "MAT4", &glam::Mat4::IDENTITY.to_cols_array());
    let joints = accessor(text, binary, "VEC4", 5121, &[0; 96]);
    let weights = accessor(text, binary, "VEC4", 5121, &[255, 0, 0, 0].repeat(24));
    let places = floats(text, binary, "VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, 9.0]);
    text["accessors"][moved]["sparse"] = json!({ "count": 1,
        "indices": { "bufferView": 3, "componentType": 5123 }, "values": { "bufferView": 0 } });
    let transform = json!({ "KHR_texture_transform": { "offset": [0.5, 0.5] } });
    let texture = || json!({ "index": 0, "extensions": transform });
    text["materials"] = json!([{
        "pbrMetallicRoughness": { "baseColorTexture": texture(), "metallicRoughnessTexture": texture(), "metallicFactor": 0.5 },
        "normalTexture": texture(), "emissiveTexture": texture(), "emissiveFactor": [1, 1, 1],
        "extensions": {
            "KHR_materials_anisotropy": { "anisotropyStrength": 0.5 },
            "KHR_materials_clearcoat": { "clearcoatFactor": 1, "clearcoatTexture": texture(), "clearcoatRoughnessTexture": texture() },
            "KHR_materials_emissive_strength": { "emissiveStrength": 2 },
            "KHR_materials_ior": { "ior": 1.4 },
            "KHR_materials_iridescence": { "iridescenceFactor": 1, "iridescenceTexture": texture(),
                "iridescenceThicknessTexture": texture() },
            "KHR_materials_sheen": { "sheenColorFactor": [0.5, 0.5, 0.5], "sheenColorTexture": texture() },
            "KHR_materials_specular": { "specularFactor": 0.5 },
        } },
        { "extensions": {
            "KHR_materials_diffuse_transmission": { "diffuseTransmissionFactor": 0.5, "diffuseTransmissionTexture": texture(),
                "diffuseTransmissionColorTexture": texture() },
            "KHR_materials_transmission": { "transmissionFactor": 1, "transmissionTexture": texture() },
            "KHR_materials_volume": { "thicknessFactor": 1 },
            "KHR_materials_volume_scatter": { "multiscatterColorFactor": [1, 1, 1] },
            "KHR_materials_dispersion": { "dispersion": 1 },
        } },
        { "extensions": { "KHR_materials_unlit": {} } },
        { "extensions": { "KHR_materials_pbrSpecularGlossiness": { "diffuseTexture": texture(), "specularGlossinessTexture": texture() } } },
    ]);
    text["samplers"] = json!([{ "magFilter": 9728, "minFilter": 9728, "wrapS": 33071, "wrapT": 33071 }]);
    text["textures"] =
        json!([{ "source": 0, "sampler": 0, "extensions": { "EXT_texture_webp": { "source": 0 } } }]);
    text["cameras"] = json!([
        { "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } },
        { "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9 } },
    ]);
    text["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "spot", "intensity": 5.0, "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.5 } },
    ] } });
    let primitive = &mut text["meshes"][0]["primitives"][0];
    primitive["targets"] = json!([{ "POSITION": moved }]);
    let mut skinned = text["meshes"][0].clone();
    skinned["primitives"][0]["attributes"]["JOINTS_0"] = json!(joints);
    skinned["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(weights);
    text["meshes"].as_array_mut().unwrap().push(skinned);
    text["skins"] = json!([{ "joints": [0], "inverseBindMatrices": bound }]);
    text["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
    text["nodes"][0]["camera"] = json!(0);
    text["nodes"][1]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": places } } });
    text["nodes"][2] = json!({ "mesh": 1, "skin": 0 });
}

/// The places of all objects below `value`: as pointers of JSON and as messages have them.
fn objects(value: &Value, pointer: &str, place: &str, out: &mut Vec<(String, String)>) {
    match value {
        Value::Object(members) => {
            if !pointer.ends_with("/extensions") {
                out.push((pointer.to_owned(), place.to_owned()));
            }
            let dot = if place.is_empty() { "" } else { "." };
            for (key, value) in members {
                objects(value, &format!("{pointer}/{key}"), &format!("{place}{dot}{key}"), out);
            }
        }
        Value::Array(list) => {
            for (i, value) in list.iter().enumerate() {
                objects(value, &format!("{pointer}/{i}"), &format!("{place}[{i}]"), out);
            }
        }
        _ => {}
    }
}

/// What a load tells after `change`. `test` names the file.
fn told(test: &str, change: &dyn Fn(&mut Value)) -> Vec<String> {
    let path = changed_with(test, |text, binary| {
        everything(text, binary);
        change(text);
    });
    let loaded = load(&path, &[]).unwrap_or_else(|e| panic!("{e:?}"));
    loaded.warnings.iter().map(ToString::to_string).collect()
}

#[test]
fn something_unknown_in_any_place_is_told() {
    let mut places = Vec::new();
    changed_with("words-all", |text, binary| {
        everything(text, binary);
        objects(text, "", "", &mut places);
    });
    let known = told("words", &|_| ());
    let mut missing = Vec::new();
    let mut count = 0;
    for (pointer, place) in &places {
        let is_map = pointer.ends_with("/attributes") || pointer.contains("/targets/");
        let mut cases: Vec<(&str, Value)> = vec![("unheardOf", json!(1))];
        if !is_map {
            cases.push(("extensions", json!({ "VENDOR_unheardOf": { "a": 1 } })));
            // Names and extras need no word.
            let silent = told("words", &|text| {
                let object = text.pointer_mut(pointer).unwrap();
                object["extras"] = json!({ "unheardOf": 1 });
            });
            assert_eq!(silent, known, "{pointer}");
        }
        for (key, value) in cases {
            count += 1;
            let warnings = told("words", &|text| {
                let object = text.pointer_mut(pointer).unwrap();
                match (key, object.get_mut("extensions")) {
                    ("extensions", Some(extensions)) => {
                        extensions["VENDOR_unheardOf"] = value["VENDOR_unheardOf"].clone()
                    }
                    _ => object[key] = value.clone(),
                }
            });
            let place = if place.is_empty() { "the top of the file" } else { place };
            let is_it = |w: &&String| w.contains("unheardOf") && w.contains(&format!("({place})"));
            if warnings.iter().filter(is_it).count() != 1 {
                missing.push(format!("{key} at {place}: {warnings:#?}"));
            }
        }
    }
    println!("{count} positions in {} objects", places.len());
    assert!(count > 120, "{count}");
    assert!(missing.is_empty(), "{} are not told:\n{}", missing.len(), missing.join("\n"));
}

/// A property that is not used in many places is one message, and ten thousand kinds do not fill the screen.
#[test]
fn what_is_told_is_grouped() {
    let warnings = told("grouped", &|text| {
        for i in 0..50 {
            text["materials"][0]["extensions"]["VENDOR_layers"] = json!({});
            let material = text["materials"][0].clone();
            text["materials"].as_array_mut().unwrap().push(material);
            let _ = i;
        }
    });
    let grouped: Vec<&String> = warnings.iter().filter(|w| w.contains("VENDOR_layers")).collect();
    assert!(grouped.len() == 1 && grouped[0].contains("materials[0] and 50 more"), "{grouped:?}");
    let warnings =
        told("grouped", &|text| (0..10_000).for_each(|i| text["asset"][format!("new{i}")] = json!(i)));
    assert!(warnings.len() < 200, "{}", warnings.len());
    assert!(warnings.iter().any(|w| w.contains("more remarks")), "{:?}", warnings.last());
}

/// Properties that are known and not used are told, too, with the reason.
#[test]
fn what_is_known_and_not_used_is_told() {
    type Change = dyn Fn(&mut Value);
    let cases: [(&str, &Change); 16] = [
        ("animations", &|t| t["animations"] = json!([{ "channels": "anything" }])),
        ("occlusionTexture", &|t| t["materials"][0]["occlusionTexture"] = json!({ "index": 0 })),
        ("TANGENT", &|t| t["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = json!(1)),
        ("_BATCHID", &|t| t["meshes"][0]["primitives"][0]["attributes"]["_BATCHID"] = json!(1)),
        ("COLOR_1", &|t| t["meshes"][0]["primitives"][0]["attributes"]["COLOR_1"] = json!(1)),
        ("TEXCOORD_1", &|t| t["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(2)),
        ("first camera", &|t| t["nodes"][2]["camera"] = json!(1)),
        ("scenes[0]", &|t| t["scenes"] = json!([t["scenes"][0], {}])),
        ("wrapT", &|t| t["samplers"][0]["wrapT"] = json!(10_497)),
        ("points and lines", &|t| t["meshes"][1]["primitives"][0]["mode"] = json!(1)),
        ("`iridescenceIor` is from 1 to 10", &|t| {
            t["materials"][0]["extensions"]["KHR_materials_iridescence"] =
                json!({ "iridescenceFactor": 1, "iridescenceIor": 0.5 });
        }),
        ("where its surface lets no light in", &|t| {
            t["meshes"][0]["primitives"][0]["material"] = json!(1);
            t["materials"][1]["extensions"] = json!({ "KHR_materials_volume":
                { "thicknessFactor": 1, "attenuationColor": [1, 0, 0], "attenuationDistance": 2 } });
        }),
        ("`KHR_materials_volume_scatter` scatters nothing", &|t| {
            t["meshes"][0]["primitives"][0]["material"] = json!(1);
        }),
        ("a volume has one colour", &|t| {
            t["materials"][1]["extensions"]["KHR_materials_volume_scatter"]["multiscatterColorTexture"] =
                json!({ "index": 0 });
        }),
        ("several sets", &|t| t["materials"][0]["normalTexture"]["texCoord"] = json!(1)),
        ("VENDOR_used", &|t| t["extensionsUsed"] = json!(["VENDOR_used", "KHR_materials_sheen"])),
    ];
    let known = told("known", &|_| ());
    for (wanted, change) in cases {
        let warnings = told("known", change);
        let new: Vec<&String> = warnings.iter().filter(|w| !known.contains(w)).collect();
        assert!(new.iter().any(|w| w.contains(wanted)), "{wanted}: {new:?}");
    }
}

/// Values of a wrong type, where the crate does not look, are errors with their place.
#[test]
fn wrong_types_have_a_place() {
    type Change = dyn Fn(&mut Value);
    let cases: [(&str, &Change); 7] = [
        ("materials[0].extensions.KHR_materials_clearcoat.clearcoatFactor", &|t| {
            t["materials"][0]["extensions"]["KHR_materials_clearcoat"]["clearcoatFactor"] = json!("1");
        }),
        ("materials[1].extensions.KHR_materials_volume_scatter.multiscatterColor", &|t| {
            t["materials"][1]["extensions"]["KHR_materials_volume_scatter"]["multiscatterColor"] =
                json!([1, 1]);
        }),
        ("materials[0].emissiveFactor", &|t| t["materials"][0]["emissiveFactor"] = json!([1, 1])),
        ("textures[0].source", &|t| t["textures"][0]["source"] = json!(7)),
        ("samplers[0].wrapS", &|t| t["samplers"][0]["wrapS"] = json!(1)),
        ("materials[0].normalTexture", &|t| t["materials"][0]["normalTexture"] = json!({})),
        ("meshes[0].primitives[0].material", &|t| t["meshes"][0]["primitives"][0]["material"] = json!(-1)),
    ];
    for (place, change) in cases {
        let path = changed_with("types", |text, binary| {
            everything(text, binary);
            change(text);
        });
        let error = load(&path, &[]).expect_err(place).to_string();
        assert!(error.contains(place), "{place}: {error}");
    }
}
