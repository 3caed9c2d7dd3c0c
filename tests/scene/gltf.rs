//! Geometry, cameras and lights of glTF models: extensions that are required, morph targets, skins, instances, integers.

use std::f64::consts::FRAC_1_SQRT_2;

use glam::{DVec3, Vec2, Vec3};
use pointillist::scene::desc::ShapeKind;
use pointillist::scene::{Loaded, SceneDesc, load};
use serde_json::{Value, json};

use super::models::{changed_with, read};

/// Adds an accessor of these bytes to a model; returns its index.
pub fn accessor(text: &mut Value, binary: &mut Vec<u8>, kind: &str, component: u32, bytes: &[u8]) -> usize {
    binary.resize(binary.len().next_multiple_of(4), 0);
    let width = match component {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        _ => 4,
    };
    let numbers = match kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        _ => 16,
    };
    let views = text["bufferViews"].as_array_mut().unwrap();
    views.push(json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len() }));
    let view = views.len() - 1;
    binary.extend(bytes);
    text["buffers"][0]["byteLength"] = json!(binary.len());
    let accessors = text["accessors"].as_array_mut().unwrap();
    let count = bytes.len() / (width * numbers);
    accessors.push(json!({ "bufferView": view, "count": count, "type": kind, "componentType": component,
        "min": vec![-1; numbers], "max": vec![1; numbers] }));
    accessors.len() - 1
}

/// An accessor of floats.
pub fn floats(text: &mut Value, binary: &mut Vec<u8>, kind: &str, values: &[f32]) -> usize {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    accessor(text, binary, kind, 5126, &bytes)
}

/// The vertices of the shapes in the world.
fn points(desc: &SceneDesc) -> Vec<Vec<DVec3>> {
    let shape = |shape: &pointillist::scene::desc::ShapeDesc| {
        let part = desc.parts(shape).first().unwrap();
        let ShapeKind::Mesh(id) = part.kind else { panic!("{:?}", part.kind) };
        let outer = shape.to_world;
        let positions = &desc.meshes[id.0 as usize].positions;
        positions.iter().map(|p| outer.transform_point3(p.as_dvec3())).collect()
    };
    desc.shapes.iter().map(shape).collect()
}

#[test]
fn what_a_model_requires_is_there_or_named() {
    for (name, remedy) in [
        ("EXT_texture_avif", "PNG"),
        ("MSFT_texture_dds", "KTX2"),
        ("KHR_materials_iris", "extensionsRequired"),
        ("VENDOR_anything", "extensionsRequired"),
    ] {
        // The other faults of the file come after what it requires.
        let path = changed_with("required", |text, _| {
            text["extensionsUsed"] = json!([name]);
            text["extensionsRequired"] = json!(["KHR_mesh_quantization", name]);
            text["accessors"][0].as_object_mut().unwrap().remove("count");
            text["textures"] = json!([{ "extensions": { name: { "source": 99 } } }]);
        });
        let error = load(&path, &[]).expect_err(name);
        let shown = format!("{:?}", miette::Report::new(error));
        assert!(shown.contains(name) && shown.contains(remedy), "{shown}");
    }
}

/// The node's weights are used instead of the mesh's, and normals move, too.
#[test]
fn morph_targets_are_shown_at_their_weights() {
    let path = changed_with("morphed", |text, binary| {
        let moved = floats(text, binary, "VEC3", &[0.5, 0.0, 0.0].repeat(24));
        let turned = floats(text, binary, "VEC3", &[0.0, 0.0, 100.0].repeat(24));
        let primitive = &mut text["meshes"][0]["primitives"][0];
        primitive["targets"] = json!([{ "POSITION": moved }, { "NORMAL": turned }]);
        text["meshes"][0]["weights"] = json!([1.0, 0.0]);
        text["nodes"][2]["weights"] = json!([-2.0, 1.0]);
    });
    let Loaded { desc, warnings } = read(&path);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!((desc.groups.len(), desc.shapes.len()), (0, 2), "two poses are two meshes");
    let first: Vec<DVec3> = points(&desc).iter().map(|shape| shape[3]).collect();
    assert_eq!(first, [DVec3::new(3.5, 2.0, 1.0), DVec3::new(-2.0, 3.0, 1.0)]);
    assert_eq!(desc.meshes[0].normals[0], Vec3::X);
    assert!(desc.meshes[1].normals[0].distance(Vec3::Z) < 0.02, "{}", desc.meshes[1].normals[0]);
}

/// Half of the vertices follow a joint that is turned and moved, the others one that stays; the node of the mesh does not count.
#[test]
fn a_skin_is_shown_at_its_joints() {
    let path = changed_with("skinned", |text, binary| {
        let bound: Vec<f32> = [glam::Mat4::IDENTITY, glam::Mat4::from_translation(Vec3::NEG_X)]
            .iter()
            .flat_map(glam::Mat4::to_cols_array)
            .collect();
        let bound = floats(text, binary, "MAT4", &bound);
        let joints: Vec<u8> = (0..24).flat_map(|i| [u8::from(i >= 12), 0, 0, 0]).collect();
        let joints = accessor(text, binary, "VEC4", 5121, &joints);
        let weights = accessor(text, binary, "VEC4", 5121, &[255, 0, 0, 0].repeat(24));
        let attributes = &mut text["meshes"][0]["primitives"][0]["attributes"];
        attributes["JOINTS_0"] = json!(joints);
        attributes["WEIGHTS_0"] = json!(weights);
        text["skins"] = json!([{ "joints": [3, 4], "inverseBindMatrices": bound }]);
        // A quarter turn around z takes x to y.
        let turn = json!([0, 0, FRAC_1_SQRT_2, FRAC_1_SQRT_2]);
        text["nodes"][0]["children"] = json!([1]);
        text["nodes"][1]["skin"] = json!(0);
        let nodes = text["nodes"].as_array_mut().unwrap();
        nodes.push(json!({}));
        nodes.push(json!({ "translation": [0, 0, 5], "rotation": turn }));
        text["scenes"][0]["nodes"] = json!([0, 3, 4]);
    });
    let Loaded { desc, warnings } = read(&path);
    assert!(warnings.is_empty(), "{warnings:?}");
    let mesh = &desc.meshes[0];
    assert_eq!(desc.shapes.len(), 1);
    let world = &points(&desc)[0];
    assert_eq!(world[3], DVec3::ONE, "the first face stays");
    // (−1, 1, 1) relative to the joint is (−2, 1, 1), turned (−1, −2, 1), moved by 5.
    let corner = mesh.positions.iter().position(|p| p.distance(Vec3::new(-1.0, -2.0, 6.0)) < 1e-5);
    let corner = corner.unwrap_or_else(|| panic!("{:?}", mesh.positions));
    assert!(corner >= 12, "{corner}");
    // The face to −x looks to −y now.
    assert!(mesh.normals[12].distance(Vec3::NEG_Y) < 1e-5, "{:?}", mesh.normals[12]);
}

/// Nodes that no scene shows have transforms, too.
#[test]
fn joints_may_be_outside_of_the_scene() {
    let path = changed_with("joints-outside", |text, binary| {
        let joints = accessor(text, binary, "VEC4", 5121, &[0, 1, 0, 0].repeat(24));
        let weights = accessor(text, binary, "VEC4", 5121, &[51, 204, 0, 0].repeat(24));
        let attributes = &mut text["meshes"][0]["primitives"][0]["attributes"];
        attributes["JOINTS_0"] = json!(joints);
        attributes["WEIGHTS_0"] = json!(weights);
        text["skins"] = json!([{ "joints": [3, 5] }]);
        text["nodes"][0]["children"] = json!([1]);
        text["nodes"][1]["skin"] = json!(0);
        let nodes = text["nodes"].as_array_mut().unwrap();
        nodes.push(json!({ "translation": [0, 0, 5] }));
        nodes.push(json!({ "translation": [0, 10, 0], "scale": [2, 2, 2], "children": [5] }));
        nodes.push(json!({ "translation": [0, 0, 1] }));
        text["scenes"][0]["nodes"] = json!([0]);
    });
    let Loaded { desc, warnings } = read(&path);
    assert!(warnings.is_empty(), "{warnings:?}");
    // A fifth of (1, 1, 1) + (0, 0, 5) and four of 2 (1, 1, 1) + (0, 10, 2).
    let corner = points(&desc)[0][3];
    assert!(corner.distance(DVec3::new(1.8, 9.8, 4.4)) < 1e-5, "{corner}");
}

#[test]
fn instances_of_a_node_are_placed_below_it() {
    let path = changed_with("instancing", |text, binary| {
        let moved = floats(text, binary, "VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, 3.0]);
        let sizes = floats(text, binary, "VEC3", &[1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
        let half = 32_767_i16;
        let turns: Vec<u8> =
            [0, 0, 0, half, 0, 0, half, 0].iter().flat_map(|v: &i16| v.to_le_bytes()).collect();
        let turns = accessor(text, binary, "VEC4", 5122, &turns);
        text["accessors"][turns]["normalized"] = json!(true);
        text["nodes"][0]["children"] = json!([1]);
        text["nodes"][1]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": {
            "TRANSLATION": moved, "SCALE": sizes, "ROTATION": turns } } });
        text["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    });
    let Loaded { desc, warnings } = read(&path);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!((desc.groups.len(), desc.shapes.len()), (1, 2));
    let corners: Vec<DVec3> = points(&desc).iter().map(|shape| shape[3]).collect();
    assert_eq!(corners[0], DVec3::new(3.0, 2.0, 1.0));
    // Half a turn around z, twice as large.
    assert!(corners[1].distance(DVec3::new(0.0, -1.0, 5.0)) < 1e-6, "{:?}", corners[1]);
}

/// `KHR_mesh_quantization`: integers as they are, or as shares of their largest where the accessor says so.
#[test]
fn integers_are_normalized_only_where_the_file_says_so() {
    for (normalized, expected) in
        [(false, Vec3::new(127.0, 127.0, -64.0)), (true, Vec3::new(1.0, 1.0, -64.0 / 127.0))]
    {
        let path = changed_with("quantized", |text, binary| {
            // The cube, flatter: its positions are the first of the binary part.
            let sizes = [127.0, 127.0, 64.0];
            let cube = binary[..24 * 12].as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b));
            let bytes: Vec<u8> =
                cube.zip(sizes.iter().cycle()).map(|(v, size)| (v * size) as i8 as u8).collect();
            let positions = accessor(text, binary, "VEC3", 5120, &bytes);
            let uvs: Vec<u8> = [2_u16, 65_535].repeat(24).iter().flat_map(|v| v.to_le_bytes()).collect();
            let uvs = accessor(text, binary, "VEC2", 5123, &uvs);
            text["accessors"][positions]["normalized"] = json!(normalized);
            let attributes = &mut text["meshes"][0]["primitives"][0]["attributes"];
            attributes["POSITION"] = json!(positions);
            attributes["TEXCOORD_0"] = json!(uvs);
            text["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        });
        let Loaded { desc, warnings } = read(&path);
        assert!(warnings.is_empty(), "{warnings:?}");
        let (positions, uvs) = (&desc.meshes[0].positions, &desc.meshes[0].uvs);
        assert!(positions.iter().any(|p| p.distance(expected) < 1e-6), "{positions:?}");
        assert!(uvs.iter().all(|uv| *uv == Vec2::new(2.0, 65_535.0)), "{uvs:?}");
    }
}

#[test]
fn a_camera_of_parallel_rays_shows_what_it_says() {
    let path = changed_with("orthographic", |text, _| {
        text["cameras"] = json!([
            { "type": "orthographic", "orthographic": { "xmag": 3.0, "ymag": 1.5, "znear": 0.0, "zfar": 100.0 } },
            { "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } },
        ]);
        let nodes = text["nodes"].as_array_mut().unwrap();
        nodes.push(json!({ "camera": 0, "translation": [0, 0, 4] }));
        nodes.push(json!({ "camera": 1 }));
        text["scenes"][0]["nodes"] = json!([0, 3, 4]);
    });
    let Loaded { desc, warnings } = read(&path);
    let camera = &desc.camera;
    assert!(camera.is_orthographic());
    assert_eq!((desc.film.width, desc.film.height), (1440, 720));
    let half = camera.to_world.matrix3;
    assert!((half.x_axis.length() - 3.0).abs() < 1e-9 && half.z_axis.distance(DVec3::NEG_Z) < 1e-9, "{half}");
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].to_string().contains("first camera"), "{warnings:?}");
}

#[test]
fn a_double_sided_light_shines_on_both_sides() {
    let shapes = |double: bool| {
        let path = changed_with("both-sides", |text, _| {
            text["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
            text["materials"][0]["doubleSided"] = json!(double);
            text["nodes"][0]["children"] = json!([1]);
        });
        let desc = read(&path).desc;
        assert!(desc.shapes.iter().all(|shape| shape.emission.is_some()));
        desc.shapes.iter().map(|shape| shape.flip_normals).collect::<Vec<_>>()
    };
    assert_eq!(shapes(false), [false]);
    assert_eq!(shapes(true), [false, true]);
}
