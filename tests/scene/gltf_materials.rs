//! Extensions of glTF materials, and colours of vertices.

use glam::{Vec2, Vec3, Vec4};
use pointillist::scene::desc::texture::{SpectrumTexture, TexturePoint};
use pointillist::scene::desc::{
    BsdfDesc, MediumDesc, MediumId, MediumInterface, PhaseDesc, ShapeDesc, single_scattering_albedo,
};
use pointillist::scene::edit::{Edits, NewValue, Target};
use pointillist::scene::{Loaded, SceneDesc};
use pointillist::spectrum::Spectrum;
use pointillist::spectrum::dispersion::Ior;
use pointillist::tracer::Scene;
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

/// Solid glass of one colour with an Abbe number of 20 over the dispersion; what it absorbs is a medium within.
#[test]
fn glass_disperses_and_absorbs() {
    let glass = |test: &str, roughness: f32, dispersion: f32| {
        with(
            test,
            json!({
                "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": roughness, "baseColorFactor": [1, 0.5, 1, 1] },
                "extensions": {
                    "KHR_materials_transmission": { "transmissionFactor": 1 },
                    "KHR_materials_ior": { "ior": 1.6 },
                    "KHR_materials_volume": { "thicknessFactor": 0.5, "attenuationColor": [0.25, 1, 0.81], "attenuationDistance": 0.25 },
                    "KHR_materials_dispersion": { "dispersion": dispersion },
                },
            }),
        )
    };
    let index = |ior: &Ior, nanometers: f32| ior.eval(Vec4::splat(nanometers)).x;
    let (desc, told) = glass("flint", 0.5, 0.8);
    let BsdfDesc::RoughDielectric(flint) = bsdf(&desc) else { panic!("{:?}", bsdf(&desc)) };
    let abbe = (index(&flint.int_ior, 587.5618) - 1.0)
        / (index(&flint.int_ior, 486.1327) - index(&flint.int_ior, 656.2725));
    assert!((index(&flint.int_ior, 587.5618) - 1.6).abs() < 1e-5 && (abbe - 25.0).abs() < 0.01, "{abbe}");
    assert_eq!((flint.roughness.alpha, index(&flint.ext_ior, 500.0)), ([0.25; 2], 1.0));
    // Light passes two surfaces: together they let the base colour through.
    let once = flint.specular_transmittance.uniform().unwrap().reflected_rgb();
    let twice = once.map(|c| c * c);
    assert!(twice.iter().zip([1.0, 0.5, 1.0]).all(|(a, b)| (a - b).abs() < 3e-3), "{twice:?}");
    assert!(told.is_empty() && desc.media.len() == 1, "{told:?}");
    let (desc, _) = glass("smooth-flint", 0.0, 0.8);
    assert!(matches!(bsdf(&desc), BsdfDesc::Dielectric(_)));
    let (desc, told) = glass("crown", 0.5, 0.0);
    let color = principled(&desc).base_color.uniform().unwrap().reflected_rgb();
    assert!(color.iter().zip([1.0, 0.5, 1.0]).all(|(a, b)| (a - b).abs() < 3e-3), "{color:?}");
    assert!(told.is_empty() && desc.media.len() == 1, "{told:?}");
}

/// The media of a solid with these extensions besides a volume, and what is told.
fn solid(test: &str, thickness: f32, extensions: Value) -> (SceneDesc, Vec<String>) {
    let mut extensions = extensions;
    extensions["KHR_materials_volume"] = json!({ "thicknessFactor": thickness,
        "attenuationColor": [0.25, 0.9, 0.81], "attenuationDistance": 0.25 });
    let base = json!({ "metallicFactor": 0 });
    with(test, json!({ "name": "jade", "pbrMetallicRoughness": base, "extensions": extensions }))
}

/// The colour that is left of white light after a distance of the world.
fn left_after(medium: &MediumDesc, distance: f32) -> [f32; 3] {
    let sigma_t = medium.sigma_t.uniform().expect("the same everywhere");
    let at = |nm: u16| {
        let nm = f32::from(nm);
        (nm, (-distance * sigma_t.eval(Vec4::splat(nm)).x).exp())
    };
    let points: Vec<_> = (360..=830).map(at).collect();
    Spectrum::table(&points).expect("a spectrum").reflected_rgb()
}

/// Every mesh with a volume has its medium within, in each of its places, one of which is scaled: distances are those of the world.
#[test]
fn volumes_are_media_within() {
    let through = || json!({ "KHR_materials_transmission": { "transmissionFactor": 1 } });
    let (desc, told) = solid("volume", 0.5, through());
    assert!(told.is_empty(), "{told:?}");
    let [medium] = desc.media.as_slice() else { panic!("{}", desc.media.len()) };
    assert_eq!(desc.names.media[0].id.as_deref(), Some("jade interior"));
    let within = MediumInterface { interior: Some(MediumId(0)), exterior: None };
    let parts: Vec<&ShapeDesc> = desc.shapes.iter().flat_map(|shape| desc.parts(shape)).collect();
    assert!(parts.len() == 2 && parts.iter().all(|part| part.medium_interface == within));
    let left = left_after(medium, 0.25);
    assert!(left.iter().zip([0.25, 0.9, 0.81]).all(|(a, b)| (a - b).abs() < 0.01), "{left:?}");
    assert_eq!(medium.albedo.uniform(), Some(&Spectrum::Constant(0.0)));
    // What is thin bounds nothing.
    let (desc, told) = solid("volume-thin", 0.0, through());
    assert!(told.is_empty() && desc.media.is_empty(), "{told:?}");
    assert!(matches!(bsdf(&desc), BsdfDesc::PrincipledThin(_)));
    // Light that enters in all directions meets the medium, too.
    let diffuse = json!({ "KHR_materials_diffuse_transmission": { "diffuseTransmissionFactor": 1 } });
    let (desc, _) = solid("volume-diffuse", 0.5, diffuse);
    assert!(matches!(bsdf(&desc), BsdfDesc::PrincipledThin(_)));
    assert_eq!(desc.parts(&desc.shapes[0])[0].medium_interface, within);
}

/// The albedo is that of a medium that looks as is asked for, at every wavelength; the attenuation is that of absorption and scattering.
#[test]
fn volumes_scatter() {
    let scattering = |test: &str, scatter: Value| {
        let extensions = json!({ "KHR_materials_transmission": { "transmissionFactor": 1 },
            "KHR_materials_volume_scatter": scatter });
        let (desc, told) = solid(test, 0.5, extensions);
        (desc.media[0].clone(), told)
    };
    let wax = json!({ "multiscatterColorFactor": [0.8, 0.5, 0.4], "scatterAnisotropy": 0.5 });
    let (wax, told) = scattering("scatter", wax);
    assert!(told.is_empty(), "{told:?}");
    assert_eq!(wax.phase, PhaseDesc::HenyeyGreenstein { g: 0.5 });
    let (albedo, asked) = (wax.albedo.uniform().unwrap(), Spectrum::reflectance_rgb([0.8, 0.5, 0.4]));
    for nm in [450.0, 550.0, 650.0] {
        let [found, asked] = [albedo, &asked].map(|spectrum| spectrum.eval(Vec4::splat(nm)).x);
        let wanted = single_scattering_albedo(asked, 0.5);
        assert!((found - wanted).abs() < 1e-4, "{nm} nm: {found}, not {wanted}");
    }
    let left = left_after(&wax, 0.25);
    assert!(left.iter().zip([0.25, 0.9, 0.81]).all(|(a, b)| (a - b).abs() < 0.01), "{left:?}");
    // By the name of older files, and the same to all sides.
    let (grey, _) = scattering("scatter-grey", json!({ "multiscatterColor": [0.5, 0.5, 0.5] }));
    let wanted = Spectrum::Constant(single_scattering_albedo(0.5, 0.0));
    assert!(grey.albedo.uniform() == Some(&wanted) && grey.phase == PhaseDesc::Isotropic, "{grey:?}");
    let (mirror, told) = scattering("scatter-mirror", json!({ "scatterAnisotropy": -1 }));
    assert_eq!(mirror.phase, PhaseDesc::HenyeyGreenstein { g: -0.999 });
    assert!(told.len() == 1 && told[0].contains("scatterAnisotropy"), "{told:?}");
}

/// Any distance and any colour give a medium that can be traced, or none, which is told.
#[test]
fn volumes_of_any_numbers_can_be_traced() {
    for (i, (distance, color, is_medium)) in [
        (1e300, [0.5, 0.5, 0.5], true),
        (1e-25, [0.5, 0.25, 0.5], true),
        (1e-5, [0.0, 0.0, 0.0], true),
        (1.0, [1.0, 0.0, 0.0], true),
        (1.0, [2.0, -1.0, 0.5], true),
        (1e-300, [0.5, 0.5, 0.5], false),
        (0.0, [0.5, 0.5, 0.5], false),
        (-1.0, [0.5, 0.5, 0.5], false),
    ]
    .into_iter()
    .enumerate()
    {
        let (desc, told) = with(
            &format!("volume-extreme-{i}"),
            json!({ "extensions": {
                "KHR_materials_transmission": { "transmissionFactor": 1 },
                "KHR_materials_volume": { "thicknessFactor": 1, "attenuationColor": color, "attenuationDistance": distance },
                "KHR_materials_volume_scatter": { "multiscatterColorFactor": [1, 0.5, 0] },
            } }),
        );
        assert_eq!(desc.media.len(), usize::from(is_medium), "{distance} {color:?}");
        assert!(is_medium || !told.is_empty(), "{distance} {color:?}");
        if let Some(medium) = desc.media.first() {
            let [sigma_t, albedo] = [&medium.sigma_t, &medium.albedo].map(|c| c.uniform().unwrap().max());
            assert!(sigma_t >= 0.0 && f64::from(sigma_t) <= MediumDesc::LARGEST && albedo <= 1.0);
        }
        assert!(Scene::prepare(&desc).is_ok(), "{distance} {color:?}");
    }
}

/// The back of what shines is a shape of its own, whose normals point into the medium.
#[test]
fn a_medium_is_behind_both_sides_of_what_shines() {
    let (desc, _) = with(
        "volume-lamp",
        json!({
            "pbrMetallicRoughness": { "metallicFactor": 0 }, "doubleSided": true, "emissiveFactor": [1, 1, 1],
            "extensions": {
                "KHR_materials_transmission": { "transmissionFactor": 1 },
                "KHR_materials_volume": { "thicknessFactor": 1, "attenuationColor": [0.5, 0.5, 0.5], "attenuationDistance": 1 },
            },
        }),
    );
    assert_eq!(desc.shapes.len(), 4, "two sides in two places");
    for ShapeDesc { flip_normals, medium_interface: MediumInterface { interior, exterior }, .. } in
        &desc.shapes
    {
        let [within, outside] = if *flip_normals { [exterior, interior] } else { [interior, exterior] };
        assert_eq!((*within, *outside), (Some(MediumId(0)), None), "{flip_normals}");
    }
}

/// A change of a medium is saved by its name.
#[test]
fn changes_of_the_medium_of_a_model_are_saved() {
    let path = changed_with("volume-saved", |text, _| {
        text["materials"][0]["extensions"] = json!({
            "KHR_materials_transmission": { "transmissionFactor": 1 },
            "KHR_materials_volume": { "thicknessFactor": 1, "attenuationColor": [0.5, 0.5, 0.5], "attenuationDistance": 1 },
        });
    });
    let desc = read(&path).desc;
    let mut edits = Edits::default();
    edits.set(Target::Density(MediumId(0)), NewValue::Scale(3.0)).unwrap();
    let saved = path.with_file_name("saved.xml");
    edits.write(&saved, &path, &[], &desc).unwrap();
    let again = read(&saved).desc;
    assert!((again.media[0].scale / desc.media[0].scale - 3.0).abs() < 1e-6, "{}", again.media[0].scale);
}

/// From the least thickness to the greatest by a texture, the greatest without one.
#[test]
fn films_have_their_thickness_in_nanometers() {
    let film = |test: &str, extension: Value| {
        let (desc, told) = with(
            test,
            json!({
                "pbrMetallicRoughness": { "metallicFactor": 1 },
                "extensions": { "KHR_materials_iridescence": extension },
            }),
        );
        assert!(told.is_empty(), "{told:?}");
        principled(&desc).thin_film.clone()
    };
    let plain = film("film", json!({ "iridescenceFactor": 0.5, "iridescenceIor": 1.7 })).expect("a film");
    let at = |texture: &SpectrumTexture, u: f32| texture.scalar(&TexturePoint::from(Vec2::new(u, 0.25)));
    assert_eq!((plain.eta, at(&plain.weight, 0.0), at(&plain.thickness, 0.0)), (1.7, 0.5, 400.0));
    let textured = film(
        "film-textured",
        json!({ "iridescenceFactor": 1, "iridescenceTexture": { "index": 0 }, "iridescenceThicknessTexture": { "index": 0 },
            "iridescenceThicknessMinimum": 200, "iridescenceThicknessMaximum": 900 }),
    )
    .expect("a film");
    // Texels: red, then green.
    assert_eq!((at(&textured.weight, 0.25), at(&textured.weight, 0.75)), (1.0, 0.0));
    assert_eq!((at(&textured.thickness, 0.25), at(&textured.thickness, 0.75)), (200.0, 900.0));
    assert!(film("no-film", json!({ "iridescenceThicknessMaximum": 900 })).is_none());
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
    let told: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    assert!(
        told[0].contains("without triangles is left out"),
        "an opacity of a quarter is below the cutoff: {told:?}"
    );
    assert!(told.len() == 2 && told[1].contains("MASK"), "{told:?}");
}

/// Opacity that grows from 0 to 1 along u, times .8, reaches the cutoff of .2 at a quarter of each face of the cube.
#[test]
fn opacity_of_vertices_cuts_triangles() {
    let masked = |test: &str, opacities: [f32; 4], factor: f64| {
        changed_with(test, |text, binary| {
            let colors: Vec<f32> = opacities.iter().flat_map(|a| [0.25 + 0.5 * a, 1.0, 1.0, *a]).collect();
            let colors = floats(text, binary, "VEC4", &colors.repeat(6));
            text["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
            text["materials"] = json!([{ "name": "painted", "alphaMode": "MASK", "alphaCutoff": 0.2,
                "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, factor] } }]);
        })
    };
    let Loaded { desc, warnings } = read(&masked("cut", [0.0, 1.0, 0.0, 1.0], 0.8));
    assert!(warnings.is_empty(), "{warnings:?}");
    let mesh = &desc.meshes[0];
    let area: f32 = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            (b - a).cross(c - a).length() / 2.0
        })
        .sum();
    assert!((area - 6.0 * 4.0 * 0.75).abs() < 1e-4, "{area}");
    let colors = &mesh.attributes.iter().find(|a| a.name == "vertex_color").unwrap().values;
    for t in &mesh.triangles {
        for i in t.map(|i| i as usize) {
            let (uv, color, normal) = (mesh.uvs[i], colors[3 * i], mesh.normals[i]);
            assert!(uv.x > 0.25 - 1e-5 && (color - (0.25 + 0.5 * uv.x)).abs() < 1e-5, "{uv} {color}");
            let normal_of_face = mesh.positions[i].abs().dot(normal.abs());
            assert!((normal_of_face - 1.0).abs() < 1e-5, "{normal}");
        }
        // No triangle is turned around.
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        assert!((b - a).cross(c - a).dot(mesh.normals[t[0] as usize]) > 0.0);
    }
    // All or nothing.
    assert_eq!(read(&masked("uncut", [0.3; 4], 0.8)).desc.meshes[0].triangles.len(), 12);
    let error = pointillist::scene::load(&masked("cut-away", [0.2; 4], 0.8), &[]);
    let warnings = error.map(|loaded| loaded.warnings.len());
    assert!(warnings.is_err() || warnings.is_ok_and(|n| n > 0), "a mesh without triangles is told");
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
    let avif = json!({ "EXT_texture_avif": { "source": 0 } });
    let Loaded { warnings, .. } =
        read(&changed_with("fallback", |text, _| text["textures"][0]["extensions"] = avif.clone()));
    assert!(warnings.len() == 1 && warnings[0].to_string().contains("EXT_texture_avif"), "{warnings:?}");
    let path = changed_with("no-fallback", |text, _| text["textures"][0] = json!({ "extensions": avif }));
    let error = pointillist::scene::load(&path, &[]).expect_err("no picture").to_string();
    assert!(error.contains("textures[0]") && error.contains("EXT_texture_avif"), "{error}");
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
        nodes.push(json!({ "children": [outside] }));
        text["nodes"][1]["skin"] = json!(0);
        text["skins"] = json!([{ "joints": [outside] }]);
    });
    let Loaded { desc, warnings } = read(&path);
    assert_eq!(desc.meshes.len(), 1);
    let told: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    assert!(told.iter().any(|words| words.contains("skin") && words.contains("skins[0]")), "{told:?}");
}
