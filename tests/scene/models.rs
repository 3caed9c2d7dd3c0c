//! Models without a scene file: OBJ with MTL, PLY, glTF.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec2, Vec3};
use pointillist::scene::desc::texture::{SpectrumTexture, TexturePoint};
use pointillist::scene::desc::{BsdfDesc, BsdfId, FovAxis, LightDesc, ShapeKind};
use pointillist::scene::edit::{Edits, NewValue, Target};
use pointillist::scene::{LoadOptions, LoadProgress, Loaded, SceneDesc, load, load_telling};
use pointillist::spectrum::SampledWavelengths;
use serde_json::{Value, json};

use crate::support::models::{cube, glb, png};

/// Writes files into a folder of this test alone; returns the path of the first.
fn write(test: &str, files: &[(&str, &[u8])]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("models").join(test);
    std::fs::create_dir_all(&folder).unwrap();
    files.iter().for_each(|(name, bytes)| std::fs::write(folder.join(name), bytes).unwrap());
    folder.join(files[0].0)
}

pub fn read(path: &Path) -> Loaded {
    load(path, &[]).unwrap_or_else(|e| panic!("{e:?}"))
}

/// A glTF text as a file, after `change`.
fn changed(test: &str, change: impl FnOnce(&mut Value)) -> PathBuf {
    changed_with(test, |text, _| change(text))
}

/// The same with its binary part.
pub fn changed_with(test: &str, change: impl FnOnce(&mut Value, &mut Vec<u8>)) -> PathBuf {
    let (mut text, mut binary) = cube();
    change(&mut text, &mut binary);
    write(test, &[("model.glb", &glb(&text, &binary))])
}

/// The material within two sides.
pub fn inner(desc: &SceneDesc, id: BsdfId) -> &BsdfDesc {
    match &desc.bsdfs[id.0 as usize] {
        BsdfDesc::TwoSided(both) => inner(desc, both.front),
        other => other,
    }
}

#[test]
fn a_glb_has_its_nodes_materials_and_pictures() {
    let Loaded { desc, warnings } = read(&changed("cube", |_| ()));
    assert!(warnings.is_empty(), "{warnings:?}");
    // A mesh that is seen twice is read once.
    assert_eq!((desc.meshes.len(), desc.groups.len(), desc.shapes.len()), (1, 1, 2));
    assert!(desc.shapes.iter().all(|s| matches!(s.kind, ShapeKind::Instance(_))));
    let places: Vec<DVec3> = desc.shapes.iter().map(|s| s.to_world.transform_point3(DVec3::ONE)).collect();
    assert_eq!(places, [DVec3::new(3.0, 2.0, 1.0), DVec3::new(-1.0, 3.0, 1.0)]);
    let mesh = &desc.meshes[0];
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (24, 12));
    assert_eq!((mesh.positions[3], mesh.normals[3], mesh.uvs[3]), (Vec3::ONE, Vec3::X, Vec2::ONE));
    let part = &desc.groups[0].shapes[0];
    assert_eq!(desc.names.bsdfs[part.bsdf.0 as usize].id.as_deref(), Some("painted"));
    let BsdfDesc::Principled(material) = inner(&desc, part.bsdf) else { panic!("{:?}", desc.bsdfs) };
    let SpectrumTexture::Bitmap(texture) = &material.base_color else { panic!("{:?}", material.base_color) };
    // v = 0 is the upper edge in both.
    assert_eq!(texture.bitmap.texel(0, 0), [1.0, 0.0, 0.0]);
    assert_eq!(texture.bitmap.texel(0, 1), [0.0, 0.0, 1.0]);
    assert!(matches!(desc.lights[0], LightDesc::Map { .. }), "a sky");
}

/// Every vertex lies within the picture, and the model fills at least half of its height or width.
#[test]
fn the_camera_sees_all_of_the_model() {
    for scale in [1e-3, 1.0, 1e4] {
        let path = changed(&format!("framed-{scale}"), |text| {
            text["nodes"][0]["scale"] = json!([scale, scale, scale])
        });
        let desc = read(&path).desc;
        let to_camera = desc.camera.to_world.inverse();
        let half = (0.5 * desc.camera.perspective().unwrap().fov).to_radians().tan();
        let aspect = f64::from(desc.film.width) / f64::from(desc.film.height);
        assert!(aspect > 1.0 && desc.camera.perspective().unwrap().fov_axis == FovAxis::Smaller);
        let mut farthest = DVec3::ZERO;
        for shape in &desc.shapes {
            for p in &desc.meshes[0].positions {
                let p = to_camera.transform_point3(shape.to_world.transform_point3(p.as_dvec3()));
                assert!(p.z > desc.camera.near_clip && p.z < desc.camera.far_clip, "{p}");
                farthest = farthest.max((p / (p.z * half * DVec3::new(aspect, 1.0, 1.0))).abs());
            }
        }
        assert!(farthest.x < 1.0 && farthest.y < 1.0, "{farthest}");
        assert!(farthest.x.max(farthest.y) > 0.5, "{farthest}");
    }
}

#[test]
fn lights_and_cameras_of_a_gltf_count() {
    let path = changed("lights", |text| {
        text["extensionsUsed"] = json!(["KHR_lights_punctual"]);
        text["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
            { "type": "point", "intensity": 3.0, "color": [1, 0.5, 0] },
            { "type": "directional", "intensity": 2.0 },
            { "type": "spot", "intensity": 5.0, "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.5 } },
        ] } });
        text["cameras"] = json!([{ "type": "perspective",
            "perspective": { "yfov": 0.5, "znear": 0.1, "zfar": 50.0, "aspectRatio": 2.0 } }]);
        let light = |i: usize| json!({ "KHR_lights_punctual": { "light": i } });
        // A quarter turn around x takes −z to +y.
        let turn = json!([FRAC_1_SQRT_2, 0, 0, FRAC_1_SQRT_2]);
        let nodes = text["nodes"].as_array_mut().unwrap();
        nodes.push(json!({ "extensions": light(0), "translation": [1, 2, 3] }));
        nodes.push(json!({ "extensions": light(1), "rotation": turn }));
        nodes.push(json!({ "extensions": light(2), "translation": [0, 5, 0], "rotation": turn }));
        nodes.push(json!({ "camera": 0, "translation": [0, 1, 9], "scale": [2, 2, 2] }));
        text["scenes"][0]["nodes"] = json!([0, 3, 4, 5, 6]);
    });
    let Loaded { desc, warnings } = read(&path);
    assert!(warnings.is_empty(), "{warnings:?}");
    let [
        LightDesc::Point { position, intensity, .. },
        LightDesc::Directional { direction, irradiance, .. },
        LightDesc::Spot(spot),
    ] = desc.lights.as_slice()
    else {
        panic!("{:?}", desc.lights)
    };
    assert_eq!(*position, DVec3::new(1.0, 2.0, 3.0));
    assert!((intensity.emitted_rgb()[0] - 3.0).abs() < 0.02, "{:?}", intensity.emitted_rgb());
    assert!(direction.distance(DVec3::Y) < 1e-6 && spot.axis.distance(DVec3::Y) < 1e-6);
    assert!((irradiance.luminance() - 2.0).abs() < 0.02, "{}", irradiance.luminance());
    assert!((spot.beam_width - 0.1_f64.to_degrees()).abs() < 1e-4);
    assert!((spot.cutoff_angle - 0.5_f64.to_degrees()).abs() < 1e-4);
    let camera = &desc.camera;
    assert!(
        (camera.perspective().unwrap().fov - 0.5_f64.to_degrees()).abs() < 1e-4
            && camera.perspective().unwrap().fov_axis == FovAxis::Y
    );
    assert_eq!(camera.to_world.translation, DVec3::new(0.0, 1.0, 9.0));
    assert!(camera.to_world.matrix3.z_axis.distance(DVec3::NEG_Z) < 1e-6, "looks along −z");
    assert!(camera.to_world.matrix3.x_axis.distance(DVec3::NEG_X) < 1e-6, "+x is at the left");
    assert_eq!((desc.film.width, desc.film.height), (1440, 720));
}

#[test]
fn materials_have_factors_alpha_light_and_glass() {
    let path = changed("materials", |text| {
        text["materials"] = json!([
            { "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.25, 1.0, 0.5] }, "alphaMode": "BLEND" },
            { "emissiveFactor": [1, 1, 1], "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 4 } } },
            { "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1 },
                              "KHR_materials_volume": { "thicknessFactor": 1 }, "KHR_materials_ior": { "ior": 1.4 } } },
            { "pbrMetallicRoughness": { "metallicFactor": 0 }, "extensions": { "KHR_materials_transmission": { "transmissionFactor": 0.5 } } },
            { "pbrMetallicRoughness": { "baseColorFactor": [0.5, 1, 1, 1], "baseColorTexture": { "index": 0,
                "extensions": { "KHR_texture_transform": { "offset": [0.5, 0], "rotation": FRAC_PI_2, "scale": [2, 3] } } } } },
        ]);
        let mesh = text["meshes"][0].clone();
        let meshes = (0..5).map(|i| {
            let mut mesh = mesh.clone();
            mesh["primitives"][0]["material"] = json!(i);
            mesh
        });
        text["meshes"] = meshes.collect();
        text["nodes"] = (0..5).map(|i| json!({ "mesh": i })).collect();
        text["scenes"][0]["nodes"] = json!([0, 1, 2, 3, 4]);
    });
    let Loaded { desc, warnings } = read(&path);
    assert!(warnings.is_empty(), "{warnings:?}");
    let bsdf = |i: usize| &desc.bsdfs[desc.shapes[i].bsdf.0 as usize];
    let BsdfDesc::Mask(mask) = bsdf(0) else { panic!("{:?}", bsdf(0)) };
    let BsdfDesc::Principled(paint) = inner(&desc, mask.bsdf) else { panic!("{:?}", desc.bsdfs) };
    let rgb = paint.base_color.uniform().unwrap().reflected_rgb();
    assert!(rgb.iter().zip([0.5, 0.25, 1.0]).all(|(a, b)| (a - b).abs() < 0.01), "{rgb:?}");
    let light = desc.shapes[1].emission.as_ref().unwrap();
    assert!((light.luminance() - 4.0).abs() < 0.05, "{}", light.luminance());
    let BsdfDesc::Principled(glass) = bsdf(2) else { panic!("{:?}", bsdf(2)) };
    assert!((glass.lobes.eta - 1.4).abs() < 1e-6 && !glass.spec_trans.is_black());
    assert!(matches!(bsdf(3), BsdfDesc::PrincipledThin(_)), "{:?}", bsdf(3));
    let BsdfDesc::Principled(cloth) = inner(&desc, desc.shapes[4].bsdf) else { panic!("{:?}", bsdf(4)) };
    let SpectrumTexture::Bitmap(texture) = &cloth.base_color else { panic!("{:?}", cloth.base_color) };
    // Half of the red in linear light, to the rounding of 8 bits.
    let [red, ..] = texture.bitmap.texel(0, 0);
    assert!((red - 0.5).abs() < 0.003, "{red}");
    // Scaled, turned against the clock (u to where −v was), moved.
    let at = texture.to_uv.transform_point2(Vec2::new(1.0, 1.0));
    assert!(at.distance(Vec2::new(3.5, -2.0)) < 1e-5, "{at}");
}

#[test]
fn pictures_and_buffers_are_found_in_data_and_beside_the_file() {
    let (mut text, binary) = cube();
    text["buffers"][0]["uri"] = json!("the%20data.bin");
    text["images"] = json!([{ "uri": "a.png" }]);
    let path = write(
        "beside",
        &[("model.gltf", text.to_string().as_bytes()), ("the data.bin", &binary), ("a.png", &png())],
    );
    let progress = std::sync::Arc::new(LoadProgress::default());
    let desc = load_telling(&path, &LoadOptions::default(), &progress).unwrap().desc;
    assert_eq!(desc.meshes[0].triangles.len(), 12);
    let names: Vec<String> =
        progress.files().iter().map(|f| f.file_name().unwrap().to_string_lossy().into_owned()).collect();
    assert_eq!(names, ["model.gltf", "the data.bin", "a.png"], "all that is on the disk, and nothing else");
    assert_eq!(progress.film(), Some([1280, 720]));
    std::fs::remove_file(path.with_file_name("a.png")).unwrap();
    let error = load(&path, &[]).expect_err("no picture");
    assert!(format!("{error}").contains("a.png"), "{error}");
}

#[test]
fn an_obj_has_the_materials_of_its_mtl() {
    let obj = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
        usemtl red\nf 1/1 2/2 3/3\nusemtl lamp\nf 1/1 3/3 4/4\nusemtl red\nf 1/1 2/2 4/4\nusemtl glass\nf 2/2 3/3 4/4\n\
        usemtl none\nf 1/1 2/2 3/3\n";
    let mtl = b"newmtl red\nKd 0.7 0.1 0.2\nKs 0.5 0.5 0.5\nNs 98\n\nnewmtl lamp\nKd 0 0 0\nKe 2 3 4\nmap_Kd a.png\n\n\
        newmtl glass\nillum 7\nNi 1.33\n";
    let path = write("mtl", &[("model.obj", obj), ("a.mtl", mtl), ("a.png", &png())]);
    let Loaded { desc, warnings } = read(&path);
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(format!("{}", warnings[0]).contains("`none`"));
    let shape = |name: &str| {
        let named = |id: BsdfId| desc.names.bsdfs[id.0 as usize].id.as_deref() == Some(name);
        desc.shapes.iter().find(|s| named(s.bsdf)).unwrap_or_else(|| panic!("{name}: {:?}", desc.names))
    };
    let ShapeKind::Mesh(id) = shape("red").kind else { panic!() };
    let red = &desc.meshes[id.0 as usize];
    assert_eq!((red.triangles.len(), red.positions.len()), (2, 4));
    assert_eq!(red.uvs[0], Vec2::new(0.0, 1.0), "v is turned");
    let BsdfDesc::RoughPlastic(plastic) = inner(&desc, shape("red").bsdf) else { panic!("{:?}", desc.bsdfs) };
    assert!((plastic.roughness.alpha[0] - 0.02_f32.sqrt()).abs() < 1e-4, "{:?}", plastic.roughness);
    let lamp = shape("lamp");
    let [_, green, _] = lamp.emission.as_ref().unwrap().emitted_rgb();
    assert!((green - 3.0).abs() < 0.05, "{green}");
    let BsdfDesc::Diffuse(paint) = inner(&desc, lamp.bsdf) else { panic!("{:?}", desc.bsdfs) };
    assert!(paint.reflectance.varies());
    assert!(matches!(desc.bsdfs[shape("glass").bsdf.0 as usize], BsdfDesc::Dielectric(_)));
    assert_eq!(desc.shapes.len(), 4);
    // A file without materials is clay, and a model by any ending.
    let bare = write("bare", &[("MODEL.OBJ", b"v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")]);
    assert_eq!(read(&bare).desc.meshes[0].triangles.len(), 1);
}

/// `tobj` takes three numbers for granted.
#[test]
fn colors_of_an_mtl_have_one_number_or_three() {
    let obj = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl grey\nf 1 2 3\n";
    let scene = |name: &str, mtl: &[u8]| read(&write(name, &[("model.obj", obj), ("a.mtl", mtl)]));
    let Loaded { desc, warnings } = scene("grey", b"newmtl grey\nKd 0.5\n");
    assert!(warnings.is_empty(), "{warnings:?}");
    let BsdfDesc::Diffuse(grey) = inner(&desc, desc.shapes[0].bsdf) else { panic!("{:?}", desc.bsdfs) };
    let at = SampledWavelengths::sample(0.3);
    let reflectance = grey.reflectance.sample(&TexturePoint::default(), &at).0;
    assert!((reflectance - 0.5).abs().max_element() < 0.01, "{reflectance}");
    for mtl in [&b"newmtl grey\nKd 0.5 1\n"[..], b"newmtl grey\nKd\n"] {
        let warnings = scene("short", mtl).warnings;
        assert!(warnings[0].to_string().contains("line 2: this colour is not read"), "{warnings:?}");
    }
}

#[test]
fn a_ply_is_clay() {
    let ply =
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let Loaded { desc, warnings } = read(&write("ply", &[("a $b&c.ply", ply)]));
    assert!(warnings.is_empty(), "{warnings:?}");
    assert!(matches!(inner(&desc, desc.shapes[0].bsdf), BsdfDesc::Diffuse(_)));
}

/// What the viewer saves of a model is a scene that includes it, with the camera that was seen.
#[test]
fn changes_of_a_model_are_saved() {
    let path = changed("saved", |text| {
        text["materials"][0]["pbrMetallicRoughness"] = json!({ "metallicFactor": 0 })
    });
    let desc = read(&path).desc;
    let part = &desc.groups[0].shapes[0];
    let BsdfDesc::TwoSided(both) = &desc.bsdfs[part.bsdf.0 as usize] else { panic!("{:?}", desc.bsdfs) };
    let mut edits = Edits::default();
    edits.set(Target::Reflectance(both.front), NewValue::Rgb([0.1, 0.2, 0.3])).unwrap();
    let saved = path.with_file_name("saved.xml");
    edits.write(&saved, &path, &[], &desc).unwrap();
    let again = read(&saved).desc;
    let BsdfDesc::Principled(material) = inner(&again, again.groups[0].shapes[0].bsdf) else { panic!() };
    let rgb = material.base_color.uniform().unwrap().reflected_rgb();
    assert!(rgb.iter().zip([0.1, 0.2, 0.3]).all(|(a, b)| (a - b).abs() < 0.01), "{rgb:?}");
    assert_eq!(again.camera.to_world, desc.camera.to_world);
    // Without a change of the camera, and with one.
    let mut camera = desc.camera.clone();
    camera.perspective_mut().unwrap().fov = 20.0;
    edits.camera = Some(camera);
    edits.write(&saved, &path, &[], &desc).unwrap();
    assert_eq!(read(&saved).desc.camera.perspective().unwrap().fov, 20.0);
}

/// Changes go to the objects of the same name, wherever they stand now.
#[test]
fn changes_are_carried_to_another_reading_by_name() {
    let read = |text: &str| pointillist::scene::load_str("a.xml", text, &[]).unwrap().desc;
    let scene = |bsdfs: &str| {
        format!(
            "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>{bsdfs}<emitter type=\"constant\"/></scene>"
        )
    };
    let (a, b) = ("<bsdf type=\"diffuse\" id=\"a\"/>", "<bsdf type=\"diffuse\" id=\"b\"/>");
    let from = read(&scene(&format!("{a}{b}")));
    let mut edits = Edits::default();
    let grey = NewValue::Rgb([0.25; 3]);
    edits.set(Target::Reflectance(BsdfId(0)), grey).unwrap();
    edits.set(Target::Reflectance(BsdfId(1)), NewValue::Rgb([0.75; 3])).unwrap();
    edits.set(Target::Light(0), NewValue::Scale(2.0)).unwrap();
    let (all, lost) = edits.carried(&from, &read(&scene(&format!("{b}{a}"))));
    assert_eq!((all.get(Target::Reflectance(BsdfId(1))), lost), (Some(grey), 0));
    let (some, lost) = edits.carried(&from, &read(&scene(a)));
    assert_eq!((some.values.len(), lost), (2, 1), "b is gone");
    assert_eq!(some.get(Target::Light(0)), Some(NewValue::Scale(2.0)), "a light without a name");
}
