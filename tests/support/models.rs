//! A small glTF model made in code: a textured cube, shown twice.

use serde_json::{Value, json};

/// A binary glTF file of this text and this binary part.
pub fn glb(text: &Value, binary: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], with: u8| {
        let mut out = bytes.to_vec();
        out.resize(bytes.len().next_multiple_of(4), with);
        out
    };
    let (text, binary) = (padded(text.to_string().as_bytes(), b' '), padded(binary, 0));
    let mut out = b"glTF".to_vec();
    let number = |n: usize, out: &mut Vec<u8>| out.extend((n as u32).to_le_bytes());
    number(2, &mut out);
    number(28 + text.len() + binary.len(), &mut out);
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &binary)] {
        number(chunk.len(), &mut out);
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

/// A PNG of 2 × 2 texels: red, green, blue, white; the red one is half transparent.
pub fn png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().unwrap();
    let texels = [255, 0, 0, 128, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 255];
    writer.write_image_data(&texels).unwrap();
    writer.finish().unwrap();
    bytes
}

/// The cube [−1, 1]³ with normals and texture coordinates, in two nodes; a material with a texture. Text and binary part.
pub fn cube() -> (Value, Vec<u8>) {
    let (mut positions, mut normals, mut uvs, mut indices) = (vec![], vec![], vec![], vec![]);
    for face in 0..6_usize {
        let (axis, sign) = (face % 3, if face < 3 { 1.0 } else { -1.0 });
        for corner in 0..4_usize {
            let (s, t) = ((corner % 2) as f32, (corner / 2) as f32);
            let mut p = [0.0_f32; 3];
            p[axis] = sign;
            p[(axis + 1) % 3] = (2.0 * s - 1.0) * sign;
            p[(axis + 2) % 3] = 2.0 * t - 1.0;
            positions.extend(p);
            normals.extend(std::array::from_fn::<f32, 3, _>(|i| if i == axis { sign } else { 0.0 }));
            uvs.extend([s, t]);
        }
        let first = 4 * face as u16;
        indices.extend([0, 1, 3, 0, 3, 2].map(|i| first + i));
    }
    let floats = |v: &[f32]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let indices: Vec<u8> = indices.iter().flat_map(|v: &u16| v.to_le_bytes()).collect();
    let (mut binary, mut views) = (Vec::new(), Vec::new());
    for bytes in [floats(&positions), floats(&normals), floats(&uvs), indices, png()] {
        views.push(json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len() }));
        binary.extend(bytes);
    }
    let accessor = |view: usize, count: usize, kind: &str, component: u32| json!({ "bufferView": view, "count": count, "type": kind, "componentType": component });
    let mut accessors =
        vec![accessor(0, 24, "VEC3", 5126), accessor(1, 24, "VEC3", 5126), accessor(2, 24, "VEC2", 5126)];
    accessors.push(accessor(3, 36, "SCALAR", 5123));
    accessors[0]["min"] = json!([-1, -1, -1]);
    accessors[0]["max"] = json!([1, 1, 1]);
    let text = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [
            { "name": "both", "children": [1, 2], "translation": [0, 1, 0] },
            { "mesh": 0, "translation": [2, 0, 0] },
            { "mesh": 0, "translation": [-2, 0, 0], "scale": [1, 2, 1] },
        ],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": 0,
        }] }],
        "materials": [{
            "name": "painted",
            "pbrMetallicRoughness": {
                "baseColorTexture": { "index": 0 }, "metallicFactor": 0.25, "roughnessFactor": 0.5,
            },
        }],
        "textures": [{ "source": 0 }],
        "images": [{ "bufferView": 4, "mimeType": "image/png" }],
        "bufferViews": views,
        "accessors": accessors,
        "buffers": [{ "byteLength": binary.len() }],
    });
    (text, binary)
}
