//! Extensions of glTF materials, and colours of vertices.

use glam::{Vec2, Vec3};
use pointillist::scene::desc::BsdfDesc;
use pointillist::scene::texture::{SpectrumTexture, TexturePoint};
use pointillist::scene::{Loaded, SceneDesc};
use serde_json::{Value, json};

use super::gltf::floats;
use super::models::{changed_with, inner, read};

/// The model with this material: the scene and its warnings.
fn with(test: &str, material: Value) -> (SceneDesc, Vec<String>) {
    let Loaded { desc, warnings } =
        read(&changed_with(test, |text, _| text["materials"] = json!([material])));
    (desc, warnings.iter().map(ToString::to_string).collect())
}

/// The bsdf of the first mesh.
fn bsdf(desc: &SceneDesc) -> &BsdfDesc {
    inner(desc, desc.parts(&desc.shapes[0])[0].bsdf)
}

fn principled(desc: &SceneDesc) -> &pointillist::scene::desc::PrincipledDesc {
    let BsdfDesc::Principled(material) = bsdf(desc) else { panic!("{:?}", bsdf(desc)) };
    material
}

#[test]
fn layers_are_parameters_of_principled() {
    let (desc, warnings) = with(
        "layers",
        json!({
            "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0.5 },
            "extensions": {
                "KHR_materials_clearcoat": { "clearcoatFactor": 0.75, "clearcoatRoughnessFactor": 0.1 },
                "KHR_materials_sheen": { "sheenColorFactor": [0.5, 0.5, 0.5] },
                "KHR_materials_specular": { "specularFactor": 0.5 },
                "KHR_materials_anisotropy": { "anisotropyStrength": 0.5 },
            },
        }),
    );
    let lobes = &principled(&desc).lobes;
    assert_eq!(lobes.clearcoat, 0.75);
    // α of the coat is .1².
    assert!((0.1 - 0.099 * lobes.clearcoat_gloss - 0.01).abs() < 1e-6, "{}", lobes.clearcoat_gloss);
    assert!((lobes.sheen - 0.5).abs() < 1e-6);
    let at_normal = ((lobes.eta - 1.0) / (lobes.eta + 1.0)).powi(2);
    assert!((at_normal - 0.02).abs() < 1e-5, "{at_normal}");
    // glTF: α along u is that of the material a quarter of the way to 1, across it stays.
    let [along, across] = lobes.facets(lobes.roughness).alpha;
    assert!((along - (0.25 + 0.25 * 0.75)).abs() < 1e-5 && (across - 0.25).abs() < 1e-5, "{along} {across}");
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].contains("KHR_materials_clearcoat") && warnings[0].contains("materials[0]"));
}

#[test]
fn layers_have_textures() {
    let texture = json!({ "index": 0 });
    let (desc, _) = with(
        "textured-layers",
        json!({
            "pbrMetallicRoughness": { "metallicFactor": 0 },
            "extensions": {
                "KHR_materials_clearcoat": { "clearcoatFactor": 1, "clearcoatTexture": texture,
                    "clearcoatRoughnessFactor": 0.2, "clearcoatRoughnessTexture": texture },
                "KHR_materials_sheen": { "sheenColorFactor": [1, 1, 1], "sheenColorTexture": texture },
            },
        }),
    );
    let material = principled(&desc);
    // Texels: red, green, blue, white.
    let lobes = |u: f32, v: f32| material.lobes.at(&material.textures, &TexturePoint::from(Vec2::new(u, v)));
    let (red, green) = (lobes(0.25, 0.25), lobes(0.75, 0.25));
    assert_eq!((red.clearcoat, green.clearcoat), (1.0, 0.0));
    assert_eq!(red.clearcoat_gloss, 1.0);
    assert!((0.1 - 0.099 * green.clearcoat_gloss - 0.04).abs() < 1e-3, "{}", green.clearcoat_gloss);
    assert!((red.sheen - 0.2126).abs() < 1e-3 && (green.sheen - 0.7152).abs() < 1e-3);
}

#[test]
fn light_goes_through_by_textures_and_diffusely() {
    let texture = json!({ "index": 0 });
    let (desc, warnings) = with(
        "through",
        json!({
            "pbrMetallicRoughness": { "metallicFactor": 0 },
            "extensions": { "KHR_materials_transmission": { "transmissionFactor": 0.5, "transmissionTexture": texture } },
        }),
    );
    let BsdfDesc::PrincipledThin(pane) = bsdf(&desc) else { panic!("{:?}", bsdf(&desc)) };
    let share = |u: f32| pane.spec_trans.scalar(&TexturePoint::from(Vec2::new(u, 0.25)));
    assert!((share(0.25) - 0.5).abs() < 0.01 && share(0.75) == 0.0, "{}", share(0.25));
    assert!(warnings.is_empty(), "{warnings:?}");
    let (desc, warnings) = with(
        "leaf",
        json!({
            "pbrMetallicRoughness": { "metallicFactor": 0 },
            "extensions": { "KHR_materials_diffuse_transmission": {
                "diffuseTransmissionFactor": 0.5, "diffuseTransmissionTexture": texture } },
        }),
    );
    let BsdfDesc::PrincipledThin(leaf) = bsdf(&desc) else { panic!("{:?}", bsdf(&desc)) };
    // The alpha of the red texel is about a half.
    let share = |u: f32| leaf.diff_trans.scalar(&TexturePoint::from(Vec2::new(u, 0.25)));
    assert!(
        (share(0.25) - 128.0 / 255.0).abs() < 0.01 && (share(0.75) - 1.0).abs() < 0.01,
        "{}",
        share(0.25)
    );
    assert_eq!(warnings.len(), 1, "{warnings:?}");
}

/// A weak grey reflection is an index of refraction; gold is metal, with or without pictures.
#[test]
fn specular_glossiness_is_converted() {
    let glossy = |test: &str, extension: Value| {
        with(test, json!({ "extensions": { "KHR_materials_pbrSpecularGlossiness": extension } }))
    };
    let (desc, warnings) = glossy(
        "matt",
        json!({ "diffuseTexture": { "index": 0 }, "specularFactor": [0.04, 0.04, 0.04],
        "glossinessFactor": 0.25 }),
    );
    assert!(warnings.is_empty(), "{warnings:?}");
    let matt = principled(&desc);
    assert_eq!((matt.lobes.metallic, matt.lobes.roughness), (0.0, 0.75));
    assert!((matt.lobes.eta - 1.5).abs() < 1e-5, "{}", matt.lobes.eta);
    assert!(matches!(matt.base_color, SpectrumTexture::Bitmap(_)));
    let (desc, _) = glossy("gold", json!({ "diffuseFactor": [0, 0, 0, 1], "specularFactor": [1, 0.8, 0.3] }));
    let gold = principled(&desc);
    assert!((gold.lobes.metallic - 1.0).abs() < 0.01, "{}", gold.lobes.metallic);
    let rgb = gold.base_color.uniform().unwrap().reflected_rgb();
    assert!(rgb.iter().zip([1.0, 0.8, 0.3]).all(|(a, b)| (a - b).abs() < 0.02), "{rgb:?}");
    let (desc, warnings) = glossy(
        "painted-gold",
        json!({ "diffuseFactor": [0, 0, 0, 1], "specularGlossinessTexture": { "index": 0 } }),
    );
    assert!(warnings.is_empty(), "{warnings:?}");
    let painted = principled(&desc);
    let SpectrumTexture::Bitmap(base) = &painted.base_color else { panic!("{:?}", painted.base_color) };
    assert_eq!(base.bitmap.texel(0, 0), [1.0, 0.0, 0.0]);
    // Alpha is the glossiness.
    let lobes = painted.lobes.at(&painted.textures, &TexturePoint::from(Vec2::splat(0.25)));
    assert!((lobes.roughness - 127.0 / 255.0).abs() < 0.01 && lobes.metallic > 0.95, "{lobes:?}");
}

/// COLOR_0 times factor, times texture; its opacity where the material blends.
#[test]
fn colors_of_vertices_are_multiplied() {
    let scene = |test: &str, material: Value, colors: [f32; 4]| {
        read(&changed_with(test, |text, binary| {
            text["materials"] = json!([material]);
            let colors = floats(text, binary, "VEC4", &colors.repeat(24));
            text["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
        }))
    };
    let color_at = |color: &SpectrumTexture, attributes: [f32; 4]| {
        let at = TexturePoint { attributes, ..Vec2::splat(0.25).into() };
        color.scalar(&at)
    };
    let paint =
        json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0 } });
    let Loaded { desc, .. } = scene("colors-factor", paint, [0.5, 1.0, 0.25, 1.0]);
    let mesh = &desc.meshes[0];
    assert_eq!(mesh.attributes[0].values[..3], [0.25, 0.5, 0.125], "{:?}", mesh.attributes[0].name);
    let textured =
        json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicFactor": 0 } });
    let Loaded { desc, warnings } = scene("colors-texture", textured.clone(), [0.5, 0.5, 0.5, 0.5]);
    assert!(warnings.is_empty(), "{warnings:?}");
    let SpectrumTexture::Product(_) = &principled(&desc).base_color else { panic!("{:?}", desc.bsdfs) };
    let red = color_at(&principled(&desc).base_color, [0.5, 0.5, 0.5, 0.0]);
    assert!((red - 0.5 * 0.2126).abs() < 1e-3, "{red}");
    assert_eq!(desc.meshes[0].attributes.len(), 1, "an opaque material has no opacity");
    let mut blended = textured;
    blended["alphaMode"] = json!("BLEND");
    blended["pbrMetallicRoughness"]["baseColorFactor"] = json!([1, 1, 1, 0.5]);
    let Loaded { desc, warnings } = scene("colors-alpha", blended.clone(), [0.5, 0.5, 0.5, 0.5]);
    assert!(warnings.is_empty(), "{warnings:?}");
    let BsdfDesc::Mask(mask) = &desc.bsdfs[desc.parts(&desc.shapes[0])[0].bsdf.0 as usize] else { panic!() };
    // Attributes are laid out by name: colour, then opacity.
    let opacity = color_at(&mask.opacity, [0.5, 0.5, 0.5, 0.25]);
    assert!((opacity - 0.25 * 128.0 / 255.0).abs() < 1e-3, "{opacity}");
    blended["alphaMode"] = json!("MASK");
    let Loaded { warnings, .. } = scene("colors-mask", blended, [0.5, 0.5, 0.5, 0.5]);
    assert!(warnings.len() == 1 && warnings[0].to_string().contains("MASK"), "{warnings:?}");
}

/// Normal textures have transforms of their own, as all others.
#[test]
fn normal_textures_have_transforms() {
    let (desc, warnings) = with(
        "normals",
        json!({ "normalTexture": { "index": 0, "extensions": {
        "KHR_texture_transform": { "scale": [3, 2], "offset": [0.5, 0] } } } }),
    );
    assert!(warnings.is_empty(), "{warnings:?}");
    let BsdfDesc::NormalMap(map) = bsdf(&desc) else { panic!("{:?}", bsdf(&desc)) };
    let at = map.normals.to_uv.transform_point2(Vec2::ONE);
    assert!(at.distance(Vec2::new(3.5, 2.0)) < 1e-6, "{at}");
}

#[test]
fn pictures_may_be_webp() {
    // One texel of pure red without loss (RFC 9649).
    let mut webp = Vec::new();
    let red = image::RgbImage::from_pixel(1, 1, image::Rgb([255, 0, 0]));
    red.write_to(&mut std::io::Cursor::new(&mut webp), image::ImageFormat::WebP).unwrap();
    let path = changed_with("webp", |text, binary| {
        text["bufferViews"]
            .as_array_mut()
            .unwrap()
            .push(json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": webp.len() }));
        binary.extend(&webp);
        text["buffers"][0]["byteLength"] = json!(binary.len());
        let view = text["bufferViews"].as_array().unwrap().len() - 1;
        text["images"].as_array_mut().unwrap().push(json!({ "bufferView": view, "mimeType": "image/webp" }));
        text["textures"] = json!([{ "extensions": { "EXT_texture_webp": { "source": 1 } } }]);
        text["extensionsRequired"] = json!(["EXT_texture_webp"]);
    });
    let Loaded { desc, warnings } = read(&path);
    assert!(warnings.is_empty(), "{warnings:?}");
    let SpectrumTexture::Bitmap(texture) = &principled(&desc).base_color else { panic!() };
    assert_eq!((texture.bitmap.width(), Vec3::from(texture.bitmap.texel(0, 0))), (1, Vec3::X));
}

#[test]
fn a_picture_stands_in_for_one_that_is_not_supported() {
    let basisu = json!({ "KHR_texture_basisu": { "source": 0 } });
    let Loaded { warnings, .. } =
        read(&changed_with("fallback", |text, _| text["textures"][0]["extensions"] = basisu.clone()));
    assert!(warnings.len() == 1 && warnings[0].to_string().contains("KHR_texture_basisu"), "{warnings:?}");
    let path = changed_with("no-fallback", |text, _| text["textures"][0] = json!({ "extensions": basisu }));
    let error = pointillist::scene::load(&path, &[]).expect_err("no picture").to_string();
    assert!(error.contains("textures[0]") && error.contains("KHR_texture_basisu"), "{error}");
}

/// The fallback of a compressed mesh is shown; where there is none, the extension is named.
#[test]
fn data_stand_in_for_compressed_ones() {
    let compressed = |with_data: bool| {
        changed_with(if with_data { "draco-fallback" } else { "draco" }, |text, _| {
            text["meshes"][0]["primitives"][0]["extensions"] =
                json!({ "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": { "POSITION": 0 } } });
            if !with_data {
                text["accessors"][0].as_object_mut().unwrap().remove("bufferView");
            }
        })
    };
    let Loaded { warnings, .. } = read(&compressed(true));
    assert!(warnings.len() == 1 && warnings[0].to_string().contains("KHR_draco"), "{warnings:?}");
    let error = pointillist::scene::load(&compressed(false), &[]).expect_err("no data").to_string();
    assert!(error.contains("meshes[0]") && error.contains("KHR_draco_mesh_compression"), "{error}");
    let path = changed_with("meshopt", |text, _| {
        text["buffers"].as_array_mut().unwrap().push(
            json!({ "byteLength": 8, "extensions": { "EXT_meshopt_compression": { "fallback": true } } }),
        );
        text["bufferViews"][0]["buffer"] = json!(1);
    });
    let error = pointillist::scene::load(&path, &[]).expect_err("no data").to_string();
    assert!(error.contains("buffers[1]") && error.contains("EXT_meshopt_compression"), "{error}");
}

/// What a kind of material leaves no part for is told.
#[test]
fn extensions_without_a_part_are_told() {
    let parts =
        json!({ "KHR_materials_clearcoat": { "clearcoatFactor": 1 }, "KHR_materials_transmission": {} });
    let both = |kind: &str| {
        let mut extensions = parts.clone();
        extensions[kind] = json!({});
        json!({ "extensions": extensions })
    };
    let (desc, told) = with("unlit", both("KHR_materials_unlit"));
    assert!(matches!(bsdf(&desc), BsdfDesc::Diffuse(_)));
    for name in ["clearcoat` is not used", "transmission` is not used", "unlit` is rendered as a diffuse"] {
        assert!(
            told.iter().any(|words| words.contains(&format!("KHR_materials_{name}"))),
            "{name}: {told:?}"
        );
    }
    let (_, told) = with("glossy", both("KHR_materials_pbrSpecularGlossiness"));
    let unused = |name: &str| told.iter().any(|w| w.contains(&format!("{name}` is not used beside")));
    assert!(unused("KHR_materials_transmission") && !unused("KHR_materials_clearcoat"), "{told:?}");
}

#[test]
fn a_cutoff_above_one_cuts_all() {
    let opaque = |cutoff: f32| {
        let (desc, _) = with("cutoff", json!({ "alphaMode": "MASK", "alphaCutoff": cutoff }));
        let BsdfDesc::Mask(mask) = &desc.bsdfs[desc.parts(&desc.shapes[0])[0].bsdf.0 as usize] else {
            return true;
        };
        !mask.opacity.is_black()
    };
    assert!(opaque(1.0) && !opaque(1.5));
}

/// A skin that cannot be used leaves its mesh where it is, and names of materials are not those of meshes.
#[test]
fn a_model_with_faults_is_shown_without_them() {
    let path = changed_with("odd-names", |text, _| {
        text["materials"][0]["name"] = json!("mesh 0");
        text["skins"] = json!([{ "joints": [99] }]);
    });
    assert!(pointillist::scene::load(&path, &[]).is_err(), "node 99 is not there");
    let path = changed_with("odd-skin", |text, _| {
        text["materials"][0]["name"] = json!("mesh 0");
        let nodes = text["nodes"].as_array_mut().unwrap();
        let outside = nodes.len();
        nodes.push(json!({}));
        text["nodes"][1]["skin"] = json!(0);
        text["skins"] = json!([{ "joints": [outside] }]);
    });
    let Loaded { desc, warnings } = read(&path);
    assert_eq!(desc.meshes.len(), 1);
    let told: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    assert!(told.iter().any(|words| words.contains("skin") && words.contains("skins[0]")), "{told:?}");
}
