//! Compressed glTF models against what they were made from: Draco, meshoptimizer's codecs, KTX2.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3, Vec2};
use pointillist::image::bitmap::Bitmap;
use pointillist::scene::desc::texture::SpectrumTexture;
use pointillist::scene::desc::{BsdfDesc, Mesh, ShapeDesc, ShapeKind};
use pointillist::scene::{Loaded, SceneDesc, load};
use serde_json::{Value, json};

use super::models::{changed_with, inner, read};
use crate::support::models::glb;

/// Where the files are.
fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scene/compressed").join(name)
}

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(file(name)).unwrap()
}

/// A corner of a triangle in the world.
#[derive(Clone, Debug)]
struct Corner {
    position: DVec3,
    normal: DVec3,
    uv: Option<Vec2>,
    color: Option<[f32; 3]>,
}

/// How much corners may differ: positions in units of the world, the others by their largest component.
struct Tolerance {
    position: f64,
    normal: f64,
    /// None where the file has no texture coordinates.
    uv: Option<f32>,
    color: f32,
}

/// All triangles in the world, with the materials of their shapes.
fn triangles(desc: &SceneDesc) -> Vec<(String, [Corner; 3])> {
    let mut all = Vec::new();
    for shape in &desc.shapes {
        let is_instance = matches!(shape.kind, ShapeKind::Instance(_));
        for part in desc.parts(shape) {
            let ShapeDesc { kind: ShapeKind::Mesh(id), .. } = part else { panic!("{:?}", part.kind) };
            let mesh = &desc.meshes[id.0 as usize];
            let to_world = if is_instance { shape.to_world * part.to_world } else { part.to_world };
            let turn: DMat3 = to_world.matrix3.inverse().transpose();
            let corner = |i: &u32| corner(mesh, *i as usize, |p| to_world.transform_point3(p), turn);
            let name = desc.names.bsdfs[part.bsdf.0 as usize].id.clone().unwrap_or_default();
            all.extend(mesh.triangles.iter().map(|t| (name.clone(), t.each_ref().map(corner))));
        }
    }
    all
}

fn corner(mesh: &Mesh, i: usize, to_world: impl Fn(DVec3) -> DVec3, turn: DMat3) -> Corner {
    let colors = mesh.attributes.iter().find(|attribute| attribute.name == "vertex_color");
    Corner {
        position: to_world(mesh.positions[i].as_dvec3()),
        normal: mesh.normals.get(i).map_or(DVec3::ZERO, |n| (turn * n.as_dvec3()).normalize()),
        uv: mesh.uvs.get(i).copied(),
        color: colors.map(|colors| std::array::from_fn(|c| colors.values[3 * i + c])),
    }
}

/// What differs between two triangles beyond `tolerance`, if corners may be counted from any of them.
fn difference(a: &[Corner; 3], b: &[Corner; 3], tolerance: &Tolerance) -> Option<String> {
    let turn = (0..3).min_by(|s, t| {
        let sum =
            |turn: usize| (0..3).map(|i| a[i].position.distance(b[(i + turn) % 3].position)).sum::<f64>();
        sum(*s).total_cmp(&sum(*t))
    });
    (0..3).find_map(|i| {
        let (a, b) = (&a[i], &b[(i + turn.unwrap()) % 3]);
        let far = |what: &str| Some(format!("{what}: {a:?} is {b:?}"));
        if a.position.distance(b.position) > tolerance.position {
            return far("position");
        }
        if (a.normal - b.normal).abs().max_element() > tolerance.normal {
            return far("normal");
        }
        if let Some(most) = tolerance.uv
            && !a.uv.zip(b.uv).is_some_and(|(a, b)| (a - b).abs().max_element() <= most)
            && a.uv != b.uv
        {
            return far("texture coordinates");
        }
        let colors =
            |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance.color);
        match (a.color, b.color) {
            (None, None) => None,
            (Some(a), Some(b)) if colors(a, b) => None,
            _ => far("color"),
        }
    })
}

/// Every triangle of one model is one of the other.
fn assert_alike(whole: &SceneDesc, other: &SceneDesc, tolerance: &Tolerance, what: &str) {
    let (whole, mut other) = (triangles(whole), triangles(other));
    assert!(!whole.is_empty() && whole.len() == other.len(), "{what}: {} of {}", other.len(), whole.len());
    for (material, triangle) in &whole {
        let middle = |t: &[Corner; 3]| (t[0].position + t[1].position + t[2].position) / 3.0;
        let near = |(_, t): &(String, [Corner; 3])| middle(t).distance(middle(triangle));
        let found = (0..other.len()).min_by(|a, b| near(&other[*a]).total_cmp(&near(&other[*b]))).unwrap();
        let (name, found) = other.swap_remove(found);
        assert_eq!(*material, name, "{what}");
        assert_eq!(difference(triangle, &found, tolerance), None, "{what}");
    }
}

/// Half a quantum along each of three axes, for the largest side of a mesh in the world and so many bits.
fn half_quantum(side: f64, bits: u32) -> f64 {
    side / f64::from((1_u32 << bits) - 1) * 0.5 * 3_f64.sqrt() + 1e-6
}

#[test]
fn draco_is_decoded() {
    let whole = read(&file("whole.glb"));
    for (name, bits) in [("draco-edgebreaker.glb", 12), ("draco-sequential.glb", 14)] {
        let Loaded { desc, warnings } = read(&file(name));
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].to_string().contains("`_HEAT` of `attributes` is not used"), "{warnings:?}");
        // Both meshes and the band have sides of 2; that of the plate is 1, and twice as large in the world.
        let tolerance =
            Tolerance { position: half_quantum(2.0, bits), normal: 5e-3, uv: Some(1.3e-4), color: 1e-6 };
        assert_alike(&whole.desc, &desc, &tolerance, name);
    }
}

/// Floats that are not quantised are as they were, and a stream has triangles also where its primitive says that it is a strip.
#[test]
fn draco_without_quantisation_loses_nothing() {
    let whole = read(&file("whole.glb"));
    let exact = Tolerance { position: 1e-9, normal: 1e-9, uv: Some(0.0), color: 0.0 };
    assert_alike(&whole.desc, &read(&file("draco-exact.glb")).desc, &exact, "draco-exact.glb");
    let (mut text, binary) = parts(&bytes("draco-exact.glb"));
    text["meshes"][0]["primitives"][1]["mode"] = json!(5);
    let path = changed_with("draco-strip", |t, b| (*t, *b) = (text, binary));
    assert_alike(&whole.desc, &read(&path).desc, &exact, "a strip");
}

/// The stream counts where both are there, and where it is damaged what stands in for it does, told once.
#[test]
fn draco_may_stand_beside_other_data() {
    let whole = read(&file("whole.glb"));
    let original = bytes("draco-used.glb");
    let (text, binary) = parts(&original);
    let exact = Tolerance { position: 1e-9, normal: 1e-9, uv: Some(0.0), color: 0.0 };
    let write = |name: &str, text: &Value, binary: &[u8]| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("compressed");
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join(name), glb(text, binary)).unwrap();
        folder.join(name)
    };
    let streams: Vec<(usize, usize)> = primitives(&text)
        .iter()
        .map(|p| {
            let view = p["extensions"]["KHR_draco_mesh_compression"]["bufferView"].as_u64().unwrap();
            let view = &text["bufferViews"][view as usize];
            (view["byteOffset"].as_u64().unwrap() as usize, view["byteLength"].as_u64().unwrap() as usize)
        })
        .collect();
    assert_eq!(streams.len(), 4);
    // Other data are zeros: the streams are used.
    let mut zeros = binary.clone();
    for primitive in primitives(&text) {
        let attributes = primitive["attributes"].as_object().unwrap().values();
        for index in attributes.chain([&primitive["indices"]]) {
            let accessor = &text["accessors"][index.as_u64().unwrap() as usize];
            let view = &text["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
            let [at, length] = ["byteOffset", "byteLength"].map(|name| view[name].as_u64().unwrap() as usize);
            zeros[at..at + length].fill(0);
        }
    }
    assert_ne!(zeros, binary);
    let Loaded { desc, .. } = read(&write("zeros.glb", &text, &zeros));
    let tolerance =
        Tolerance { position: half_quantum(2.0, 14), normal: 5e-3, uv: Some(1.3e-4), color: 1e-6 };
    assert_alike(&whole.desc, &desc, &tolerance, "streams beside zeros");
    // Streams are damaged.
    let mut damaged = binary.clone();
    streams.iter().for_each(|(at, _)| damaged[*at + 12..*at + 20].fill(255));
    let Loaded { desc, warnings } = read(&write("damaged.glb", &text, &damaged));
    assert_alike(&whole.desc, &desc, &exact, "data that stand in");
    let told: Vec<_> = warnings.iter().map(ToString::to_string).filter(|w| w.contains("stand in")).collect();
    assert!(!told.is_empty() && told.len() <= 4, "{told:?}");
    assert!(told[0].contains("KHR_draco_mesh_compression") && told[0].contains("primitives["), "{told:?}");
}

/// The text and the binary part of a `.glb`.
fn parts(bytes: &[u8]) -> (Value, Vec<u8>) {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    (serde_json::from_slice(&bytes[20..20 + length]).unwrap(), bytes[28 + length..].to_vec())
}

/// All primitives of all meshes.
fn primitives(text: &Value) -> Vec<&Value> {
    let meshes = text["meshes"].as_array().unwrap().iter();
    meshes.flat_map(|mesh| mesh["primitives"].as_array().unwrap()).collect()
}

/// One error that names the primitive and what to do.
#[test]
fn damaged_streams_without_other_data_are_refused() {
    let (text, mut binary) = parts(&bytes("draco-edgebreaker.glb"));
    let view =
        primitives(&text)[1]["extensions"]["KHR_draco_mesh_compression"]["bufferView"].as_u64().unwrap();
    let at = text["bufferViews"][view as usize]["byteOffset"].as_u64().unwrap() as usize;
    binary[at] = b'x';
    let path = changed_with("draco-damaged", |t, b| (*t, *b) = (text, binary));
    let error = load(&path, &[]).expect_err("damaged").to_string();
    for word in ["meshes[0].primitives[1]", "KHR_draco_mesh_compression", "export"] {
        assert!(error.contains(word), "{error}");
    }
    let (mut text, binary) = parts(&bytes("pack-khr.glb"));
    text["bufferViews"][0]["extensions"]["KHR_meshopt_compression"]["byteLength"] = json!(9);
    let path = changed_with("meshopt-damaged", |t, b| (*t, *b) = (text, binary));
    let error = load(&path, &[]).expect_err("damaged").to_string();
    for word in ["bufferViews[0]", "KHR_meshopt_compression", "export"] {
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn views_of_meshoptimizer_are_decompressed() {
    let whole = read(&file("whole.glb"));
    // The codecs lose nothing; the encoder has reordered nothing either.
    let exact = Tolerance { position: 1e-9, normal: 1e-9, uv: Some(0.0), color: 0.0 };
    assert_alike(&whole.desc, &read(&file("meshopt-ext.glb")).desc, &exact, "meshopt-ext.glb");
    // Both primitives of the first mesh are 4.3 wide together. Bytes of normals lie within a hundredth.
    let filtered = Tolerance { position: half_quantum(4.4, 14), normal: 0.02, uv: Some(2e-4), color: 1e-6 };
    assert_alike(&whole.desc, &read(&file("meshopt-filter.glb")).desc, &filtered, "meshopt-filter.glb");
    // All meshes are quantised alike, 3.94 wide, and the plate is stretched twofold.
    let packed = Tolerance { position: 2.0 * half_quantum(4.0, 14), normal: 6e-3, uv: None, color: 0.01 };
    for name in ["pack-ext-float.glb", "pack-khr.glb", "pack-khr-fallback.gltf"] {
        let Loaded { desc, warnings } = read(&file(name));
        let coarse = Tolerance { normal: 0.02, ..packed };
        let tolerance = if name == "pack-khr-fallback.gltf" { &coarse } else { &packed };
        assert_alike(&whole.desc, &desc, tolerance, name);
        assert!(warnings.is_empty(), "{name}: {warnings:?}");
    }
    let strip = [read(&file("strip.glb")), read(&file("meshopt-strip.glb"))];
    assert_alike(&strip[0].desc, &strip[1].desc, &exact, "meshopt-strip.glb");
}

/// Turns, places and sizes of instances are compressed, too.
#[test]
fn instances_are_decompressed() {
    let whole = read(&file("instanced.glb"));
    let Loaded { desc, warnings } = read(&file("pack-instanced.glb"));
    assert!(warnings.is_empty(), "{warnings:?}");
    // Turns in 12 bits of vertices within 1 of the middle, places in 16.
    let tolerance = Tolerance { position: 1.5e-3, normal: 0.02, uv: None, color: 0.0 };
    assert_alike(&whole.desc, &desc, &tolerance, "pack-instanced.glb");
}

/// A damaged view gives way to the buffer that stands in for it; a view of such a buffer that is not compressed is refused.
#[test]
fn a_buffer_may_stand_in_for_a_compressed_one() {
    let whole = read(&file("whole.glb"));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fallback");
    std::fs::create_dir_all(&folder).unwrap();
    for name in ["pack-khr-fallback.gltf", "pack-khr-fallback.bin", "pack-khr-fallback.fallback.bin"] {
        std::fs::copy(file(name), folder.join(name)).unwrap();
    }
    let mut data = bytes("pack-khr-fallback.bin");
    data[0] = 0;
    std::fs::write(folder.join("pack-khr-fallback.bin"), data).unwrap();
    let Loaded { desc, warnings } = read(&folder.join("pack-khr-fallback.gltf"));
    let tolerance = Tolerance { position: 2.0 * half_quantum(4.0, 14), normal: 0.02, uv: None, color: 0.01 };
    assert_alike(&whole.desc, &desc, &tolerance, "fallback");
    let told = warnings[0].to_string();
    assert!(
        warnings.len() == 1 && told.contains("bufferViews[0]") && told.contains("stand in"),
        "{warnings:?}"
    );

    let (mut text, binary) = parts(&bytes("pack-khr.glb"));
    text["bufferViews"][0].as_object_mut().unwrap().remove("extensions");
    let path = changed_with("fallback-used", |t, b| (*t, *b) = (text, binary));
    let error = load(&path, &[]).expect_err("no data").to_string();
    assert!(error.contains("buffers[1] has no data"), "{error}");
}

/// The cube with `picture` as `KHR_texture_basisu`, after `change`.
fn textured(test: &str, picture: &[u8], change: impl FnOnce(&mut Value)) -> PathBuf {
    changed_with(test, |text, binary| {
        let views = text["bufferViews"].as_array_mut().unwrap();
        views.push(json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": picture.len() }));
        let view = views.len() - 1;
        binary.extend(picture);
        text["buffers"][0]["byteLength"] = json!(binary.len());
        text["images"].as_array_mut().unwrap().push(json!({ "bufferView": view, "mimeType": "image/ktx2" }));
        text["textures"] = json!([{ "extensions": { "KHR_texture_basisu": { "source": 1 } } }]);
        text["extensionsRequired"] = json!(["KHR_texture_basisu"]);
        change(text);
    })
}

/// The picture of the base colour.
fn base_color(desc: &SceneDesc) -> &Bitmap {
    let bsdf = match &desc.bsdfs[desc.parts(&desc.shapes[0])[0].bsdf.0 as usize] {
        BsdfDesc::Mask(mask) => inner(desc, mask.bsdf),
        _ => inner(desc, desc.parts(&desc.shapes[0])[0].bsdf),
    };
    let BsdfDesc::Principled(material) = bsdf else { panic!("{bsdf:?}") };
    let SpectrumTexture::Bitmap(texture) = &material.base_color else { panic!("{:?}", material.base_color) };
    &texture.bitmap
}

/// The mean difference of two pictures of the same size.
fn mean_difference(a: &Bitmap, b: &Bitmap, factor: f32) -> f32 {
    assert_eq!((a.width(), a.height()), (b.width(), b.height()));
    let texels = (0..a.height()).flat_map(|y| (0..a.width()).map(move |x| (x, y)));
    let texel = |(x, y)| (0..3).map(|c| (a.texel(x, y)[c] - factor * b.texel(x, y)[c]).abs()).sum::<f32>();
    texels.map(texel).sum::<f32>() / (3 * a.width() * a.height()) as f32
}

/// glTF has colours in sRGB, whatever the file of the picture says: the base colour is that of the PNG.
#[test]
fn textures_may_be_ktx2() {
    for (name, png) in [
        ("uastc", "uastc.png"),
        ("uastc-zstd", "uastc.png"),
        ("uastc-linear", "uastc.png"),
        ("etc1s", "etc1s.png"),
        ("rgba8", "whole.png"),
        ("bgra8-zstd", "whole.png"),
    ] {
        let png = Bitmap::decode(Path::new(png), &bytes(png), false, 1 << 20).unwrap();
        let picture = bytes(&format!("{name}.ktx2"));
        let Loaded { desc, warnings } = read(&textured(&format!("ktx2-{name}"), &picture, |_| ()));
        assert!(warnings.is_empty(), "{warnings:?}");
        let plain = mean_difference(base_color(&desc), &png, 1.0);
        let half = read(&textured(&format!("ktx2-{name}-half"), &picture, |text| {
            text["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.5, 0.5, 0.5, 1]);
        }));
        let half = mean_difference(base_color(&half.desc), &png, 0.5);
        // Half of a colour is rounded to 8 bits.
        assert!(plain == 0.0 && half < 2e-3, "{name}: {plain} and {half}");
    }
}

/// Alpha of KTX2 is that of the picture.
#[test]
fn opacity_may_be_in_ktx2() {
    for name in ["uastc", "etc1s"] {
        let path = textured(&format!("ktx2-alpha-{name}"), &bytes(&format!("{name}.ktx2")), |text| {
            text["materials"][0]["alphaMode"] = json!("BLEND");
        });
        let desc = read(&path).desc;
        let BsdfDesc::Mask(mask) = &desc.bsdfs[desc.parts(&desc.shapes[0])[0].bsdf.0 as usize] else {
            panic!()
        };
        let SpectrumTexture::Bitmap(texture) = &mask.opacity else { panic!("{:?}", mask.opacity) };
        for (y, alpha) in [(0, 1.0), (10, 150.0 / 255.0), (19, 55.0 / 255.0)] {
            let found = texture.bitmap.texel(7, y)[0];
            assert!((found - alpha).abs() < 0.04, "{name}: {found} instead of {alpha}");
        }
    }
}

#[test]
fn a_picture_stands_in_for_damaged_ktx2() {
    let mut picture = bytes("uastc-zstd.ktx2");
    picture[600..].fill(0);
    let Loaded { desc, warnings } = read(&textured("ktx2-fallback", &picture, |text| {
        text["textures"][0]["source"] = json!(0);
    }));
    assert_eq!(base_color(&desc).width(), 2, "the PNG of the cube");
    let told = warnings[0].to_string();
    assert!(
        warnings.len() == 1 && told.contains("stands in") && told.contains("textures[0]"),
        "{warnings:?}"
    );
    let error = load(&textured("ktx2-damaged", &picture, |_| ()), &[]).expect_err("damaged").to_string();
    assert!(error.contains("image-1.ktx2") && error.contains("damaged"), "{error}");
}
