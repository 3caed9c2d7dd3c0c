//! The container and the JSON of a glTF file: what the crate's parser gets to see of it.
//!
//! The crate refuses what the specification leaves free (attributes of one's own, textures that only an extension has a picture for,
//! animations of unknown properties) and knows few extensions. So the JSON is read as plain values first, [`grammar`] checks it, and
//! the crate gets the nodes, meshes, accessors, skins, cameras and lights alone. Materials are read from the plain values.

use std::borrow::Cow;

use gltf::binary::Glb;
use serde_json::{Value, json};

use super::grammar;
use crate::scene::diagnostic::{FindingKind, SceneError, shorten};
use crate::scene::limits;
use crate::scene::model::finding;
use crate::scene::model::text::SceneText;

/// A file as plain values and as the crate has it.
pub(super) struct ModelDocument {
    pub(super) root: Value,
    pub(super) document: gltf::Document,
    /// The binary part.
    pub(super) blob: Option<Vec<u8>>,
}

/// Parses a file and tells what of it is not used.
pub(super) fn parse(bytes: &[u8], text: &mut SceneText<'_>) -> Result<ModelDocument, SceneError> {
    let path = text.path;
    let wrong = |message: String| finding(path, FindingKind::Mesh, [1, 1], message).error();
    let (json, blob) = container(bytes).map_err(|e| wrong(describe(&e)))?;
    check_size(&json).map_err(|message| finding(path, FindingKind::Limit, [1, 1], message).error())?;
    let syntax = |e: &serde_json::Error| {
        finding(path, FindingKind::Syntax, [e.line().max(1), e.column().max(1)], e.to_string()).error()
    };
    let root: Value = serde_json::from_slice(&json).map_err(|e| syntax(&e))?;
    check_version(&root).map_err(wrong)?;
    if let Some((message, help)) = missing_extensions(&root) {
        return Err(finding(path, FindingKind::Plugin, [1, 1], message).help(help).error());
    }
    grammar::check(&root, text).map_err(wrong)?;
    let parsed = serde_json::from_value(for_the_crate(&root)).map_err(|e| {
        // Values have no place in the text; the text itself has, unless the crate refuses more of it.
        let placed = serde_json::from_slice::<gltf::json::Root>(&json).err();
        syntax(&placed.unwrap_or(e))
    });
    let parsed: gltf::json::Root = parsed?;
    // The validation of the crate looks at accessors of primitives before it knows that they are there.
    let mut primitives = parsed.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let validated = match primitives
        .any(|p| p.attributes.values().any(|index| index.value() >= parsed.accessors.len()))
    {
        true => Err(gltf::Error::Validation(vec![(
            gltf::json::Path::new().field("meshes"),
            gltf::json::validation::Error::IndexOutOfBounds,
        )])),
        false => gltf::Document::from_json(parsed),
    };
    let document = validated.map_err(|e| wrong(describe(&e)))?;
    Ok(ModelDocument { root, document, blob })
}

/// The text and the binary part.
type FileParts<'a> = (Cow<'a, [u8]>, Option<Vec<u8>>);

/// Takes a file apart. The header is checked first: the crate subtracts its size from what it says.
fn container(bytes: &[u8]) -> Result<FileParts<'_>, gltf::Error> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes.into(), None));
    }
    let said = bytes.get(8..12).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    if said.is_none_or(|length| length < 20 || length as usize > bytes.len()) {
        let length = said.unwrap_or_default();
        return Err(gltf::Error::Binary(gltf::binary::Error::Length { length, length_read: bytes.len() }));
    }
    let glb = Glb::from_slice(bytes)?;
    Ok((glb.json, glb.bin.map(Cow::into_owned)))
}

/// Refuses a text whose values would take far more memory than its bytes.
fn check_size(json: &[u8]) -> Result<(), String> {
    let (objects, values) = json.iter().fold((0, 0), |(objects, values), byte| match byte {
        b'{' => (objects + 1, values),
        b'[' | b',' => (objects, values + 1),
        _ => (objects, values),
    });
    if objects > limits::JSON_OBJECTS || values > 8 * limits::JSON_OBJECTS {
        return Err(format!("this model has more than {} objects or values", limits::JSON_OBJECTS));
    }
    Ok(())
}

fn check_version(root: &Value) -> Result<(), String> {
    let version = |name: &str| root["asset"][name].as_str();
    let (version, least) = (version("version"), version("minVersion").unwrap_or("2.0"));
    match version {
        Some(v) if v.split('.').next() != Some("2") => {
            Err(format!("this is glTF {}: versions 2.x are read", shorten(v)))
        }
        _ if least != "2.0" => {
            Err(format!("this needs a reader of glTF {}: version 2.0 is read", shorten(least)))
        }
        _ => Ok(()),
    }
}

/// The extensions that the file cannot be shown without and that are not supported: a message and what to do.
fn missing_extensions(root: &Value) -> Option<(String, String)> {
    let required = root["extensionsRequired"].as_array()?.iter().filter_map(Value::as_str);
    let missing: Vec<String> = required.filter(|name| !grammar::is_supported(name)).map(shorten).collect();
    let first = missing.first()?;
    let named = missing.iter().take(8).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let plural = if missing.len() > 1 { "extensions" } else { "extension" };
    let remedy = match first.as_str() {
        "EXT_texture_avif" | "MSFT_texture_dds" => {
            "export the model with pictures in PNG, JPEG, WebP or KTX2"
        }
        _ => {
            "export the model without it, or take it out of `extensionsRequired` to see what remains of the model"
        }
    };
    Some((format!("this model requires the {plural} {named}, not supported here"), remedy.to_owned()))
}

/// The parts of the document that the crate `gltf` reads, without those that it would refuse although they are valid.
fn for_the_crate(root: &Value) -> Value {
    const READ: [&str; 11] = [
        "accessors",
        "asset",
        "bufferViews",
        "buffers",
        "cameras",
        "extensions",
        "meshes",
        "nodes",
        "scene",
        "scenes",
        "skins",
    ];
    let Some(members) = root.as_object() else { return root.clone() };
    let read = members.iter().filter(|(name, _)| READ.contains(&name.as_str()));
    let mut root = Value::Object(read.map(|(name, value)| (name.clone(), value.clone())).collect());
    let scenes = root.get_mut("scenes").and_then(Value::as_array_mut).into_iter().flatten();
    for scene in scenes.filter_map(Value::as_object_mut) {
        scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
    }
    // Of data in an extension, or of zeros: the crate asks for one or the other.
    let accessors = root.get_mut("accessors").and_then(Value::as_array_mut).into_iter().flatten();
    for accessor in accessors.filter_map(Value::as_object_mut) {
        if !accessor.contains_key("bufferView") {
            let nothing = json!({ "count": 0, "indices": { "bufferView": 0, "componentType": 5125 }, "values": { "bufferView": 0 } });
            accessor.entry("sparse").or_insert(nothing);
        }
    }
    let meshes = root.get_mut("meshes").and_then(Value::as_array_mut).into_iter().flatten();
    let primitives = meshes.filter_map(|mesh| mesh.get_mut("primitives").and_then(Value::as_array_mut));
    for primitive in primitives.flatten().filter_map(Value::as_object_mut) {
        primitive.remove("material");
        if let Some(attributes) = primitive.get_mut("attributes").and_then(Value::as_object_mut) {
            attributes.retain(|name, _| grammar::is_attribute(name));
        }
    }
    root
}

/// An error of the format in words: the first of many.
fn describe(error: &gltf::Error) -> String {
    match error {
        gltf::Error::Validation(faults) => match faults.as_slice() {
            [(place, fault), rest @ ..] => {
                let more =
                    if rest.is_empty() { String::new() } else { format!(", and {} more faults", rest.len()) };
                format!("this is not valid glTF: {place} is {}{more}", fault.to_string().to_lowercase())
            }
            [] => "this is not valid glTF".to_owned(),
        },
        error => format!("this is not valid glTF: {error}"),
    }
}
