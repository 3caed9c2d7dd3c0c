//! All methods agree on materials, lights and a lens that paths reach from both ends.

use std::sync::Arc;

use glam::{Affine2, DAffine3, DMat3, DVec3, Vec2, Vec3};

use crate::pairs::{PHOTONS, PLAN, assert_all_pairs};
use crate::support::scenes::*;
use pointillist::image::bitmap::Bitmap;
use pointillist::scene::desc::texture::{BitmapTexture, WrapMode};
use pointillist::scene::desc::*;
use pointillist::scene::load_str;
use pointillist::spectrum::{EmissionMap, Spectrum};

/// A floor and two spheres of these materials.
pub(crate) fn open_room(materials: [BsdfDesc; 2]) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, -4.0, 3.0), DVec3::new(0.0, 4.0, -2.8), 50.0);
    (desc.film.width, desc.film.height) = (8, 8);
    let white = material(&mut desc, grey(0.7));
    shape(&mut desc, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::splat(3.0)), white, 0.0);
    for (bsdf, x) in materials.into_iter().zip([-0.9, 0.9]) {
        let bsdf = material(&mut desc, bsdf);
        shape(&mut desc, sphere(DVec3::new(x, 0.1, 0.8), 0.75), DAffine3::IDENTITY, bsdf, 0.0);
    }
    desc
}

/// With a lamp and the sky.
pub(crate) fn lit(mut desc: SceneDesc) -> SceneDesc {
    let black = material(&mut desc, grey(0.2));
    let turn = DAffine3::from_translation(DVec3::new(0.0, 0.0, 3.5)) * DAffine3::from_rotation_x(2.8);
    shape(&mut desc, ShapeKind::Rectangle, turn * DAffine3::from_scale(DVec3::splat(0.8)), black, 8.0);
    environment(&mut desc);
    desc
}

/// The lit room with spheres of two materials as a scene file says them.
fn room_of(files: [&str; 2]) -> SceneDesc {
    let mut desc = lit(open_room([grey(0.5), grey(0.5)]));
    let [a, b] = files.map(|text| format!("<shape type='sphere'>{text}</shape>"));
    let others = "<sensor type='perspective'/><emitter type='constant'/>";
    let text = format!("<scene version='3.0.0'>{others}{a}{b}</scene>");
    let loaded = load_str("materials.xml", &text, &[]).expect("readable").desc;
    desc.shapes.iter_mut().for_each(|shape| shape.bsdf.0 += loaded.bsdfs.len() as u32);
    // After the floor.
    for (shape, other) in desc.shapes[1..3].iter_mut().zip(&loaded.shapes) {
        shape.bsdf = other.bsdf;
    }
    desc.bsdfs.splice(0..0, loaded.bsdfs);
    desc
}

#[test]
fn principled_materials() {
    let metal = "<bsdf type='principled'><rgb name='base_color' value='.7, .5, .2'/><float name='metallic' value='.7'/>\
        <float name='roughness' value='.5'/><float name='anisotropic' value='.5'/><float name='spec_tint' value='.5'/></bsdf>";
    let velvet = "<bsdf type='principled'><rgb name='base_color' value='.3, .2, .6'/><float name='sheen' value='1'/>\
        <float name='sheen_tint' value='.5'/><float name='flatness' value='.5'/><float name='clearcoat' value='1'/></bsdf>";
    assert_all_pairs("principled", &room_of([metal, velvet]), PLAN, PHOTONS);
}

/// Roughness and shares of metal and glass that vary over the spheres.
#[test]
fn textured_numbers() {
    let board = |name: &str, a: f32, b: f32| {
        format!(
            "<texture name='{name}' type='checkerboard'><float name='color0' value='{a}'/><float name='color1' value='{b}'/>\
             <transform name='to_uv'><scale x='3' y='2'/></transform></texture>"
        )
    };
    let metal = format!(
        "<bsdf type='roughconductor'><string name='material' value='Au'/>{}{}</bsdf>",
        board("alpha_u", 0.3, 0.6),
        board("alpha_v", 0.6, 0.3)
    );
    let paint = format!(
        "<bsdf type='principled'>{}{}{}</bsdf>",
        board("roughness", 0.5, 0.8),
        board("metallic", 0.8, 0.0),
        board("spec_trans", 0.0, 0.5)
    );
    assert_all_pairs("textured numbers", &room_of([&metal, &paint]), PLAN, PHOTONS);
}

#[test]
fn principled_glass_and_leaf() {
    let glass = "<bsdf type='principled'><rgb name='base_color' value='.8, .9, .8'/><float name='spec_trans' value='.7'/>\
        <float name='roughness' value='.6'/></bsdf>";
    let leaf = "<bsdf type='principledthin'><rgb name='base_color' value='.3, .7, .2'/><float name='spec_trans' value='.4'/>\
        <float name='diff_trans' value='1.2'/><float name='roughness' value='.6'/><float name='sheen' value='.5'/></bsdf>";
    assert_all_pairs("glass and leaf", &room_of([glass, leaf]), PLAN, PHOTONS);
}

#[test]
fn mixtures() {
    let leaf = "<bsdf type='mask'><float name='opacity' value='.6'/><bsdf type='diffuse'>\
        <rgb name='reflectance' value='.3, .7, .2'/></bsdf></bsdf>";
    let paint = "<bsdf type='blendbsdf'><float name='weight' value='.4'/><bsdf type='roughdielectric'><float name='alpha' value='.3'/>\
        <float name='int_ior' value='1.5'/></bsdf><bsdf type='blendbsdf'><float name='weight' value='.5'/><bsdf type='twosided'>\
        <bsdf type='roughconductor'><float name='alpha' value='.3'/></bsdf></bsdf><bsdf type='plastic'/></bsdf></bsdf>";
    assert_all_pairs("mixtures", &room_of([leaf, paint]), PLAN, PHOTONS);
}

/// A floor of tilted normals, some so steep that they face away from who looks, a sphere with bumps, and glass with both.
#[test]
fn normal_maps_and_bump_maps() {
    let picture = |side: usize, texel: fn(f32, f32) -> [f32; 3]| {
        let angle = |i: usize| i as f32 / side as f32 * std::f32::consts::TAU;
        let texels = (0..side * side).map(|i| texel(angle(i % side), angle(i / side)));
        let bitmap = Arc::new(Bitmap::from_linear(side, texels.collect()));
        BitmapTexture::new(bitmap, Affine2::from_scale(Vec2::splat(3.0)), WrapMode::Repeat, false)
    };
    let normals = |steep: f32| {
        let mut map = picture(8, |x, y| [0.5 + 0.5 * x.sin(), 0.5 + 0.5 * (x + 2.0 * y).cos(), 1.0]);
        let flatten = |i: usize| {
            let [x, y, _] = map.bitmap.texel(i % 8, i / 8).map(|v| (2.0 * v - 1.0) * steep);
            (Vec3::new(x, y, 1.0).normalize() * 0.5 + 0.5).to_array()
        };
        map.bitmap = Arc::new(Bitmap::from_linear(8, (0..64).map(flatten).collect()));
        map
    };
    let bump = |bsdf| BumpDesc { bsdf, flip_invalid_normals: true, use_shadowing_function: true };
    let metal = "<bsdf type='roughconductor'><float name='alpha' value='.4'/></bsdf>";
    let glass = "<bsdf type='roughdielectric'><float name='alpha' value='.4'/><float name='int_ior' value='1.5'/></bsdf>";
    let mut desc = room_of([metal, glass]);
    let [floor, first, second] = [0, 1, 2].map(|i| desc.shapes[i].bsdf);
    let heights = picture(16, |x, y| [0.1 * x.sin() * y.cos(); 3]);
    let maps: [BsdfDesc; 3] = [
        NormalMapDesc { normals: normals(1.5), bump: bump(floor) }.into(),
        BumpMapDesc { heights, scale: 0.8, bump: bump(first) }.into(),
        NormalMapDesc { normals: normals(0.4), bump: bump(second) }.into(),
    ];
    for (i, map) in maps.into_iter().enumerate() {
        desc.shapes[i].bsdf = material(&mut desc, map);
    }
    // A part of the floor stays flat.
    let bsdfs = [desc.shapes[0].bsdf, floor];
    desc.shapes[0].bsdf =
        material(&mut desc, BlendDesc { weight: Spectrum::Constant(0.3).into(), bsdfs }.into());
    assert_all_pairs("bumps", &desc, PLAN, PHOTONS);
}

#[test]
fn lobes_of_version_0_6() {
    let phong = "<bsdf type='phong'><float name='exponent' value='15'/><rgb name='specular_reflectance' value='.5, .3, .2'/>\
        <rgb name='diffuse_reflectance' value='.2, .3, .4'/></bsdf>";
    let ward = "<bsdf type='ward'><float name='alpha_u' value='.5'/><float name='alpha_v' value='.2'/>\
        <rgb name='specular_reflectance' value='.4, .4, .3'/><rgb name='diffuse_reflectance' value='.3, .2, .5'/></bsdf>";
    assert_all_pairs("phong and ward", &room_of([phong, ward]), PLAN, PHOTONS);
}

/// A coat over metal and over a map, and rough ones that absorb over matt and glossy shares.
#[test]
fn coats() {
    let copper = "<bsdf type='coating'><rgb name='sigma_a' value='.1, .4, .6'/><bsdf type='roughconductor'>\
        <string name='material' value='Cu'/><float name='alpha' value='.4'/></bsdf></bsdf>";
    let paint = "<bsdf type='roughcoating'><float name='alpha' value='.3'/><float name='sigma_a' value='.3'/><float name='thickness' value='.5'/>\
        <bsdf type='blendbsdf'><float name='weight' value='.5'/><bsdf type='diffuse'/><bsdf type='plastic'/></bsdf></bsdf>";
    assert_all_pairs("coats", &room_of([copper, paint]), PLAN, PHOTONS);
}

#[test]
fn diffuse_models_of_version_0_6() {
    let clay = "<bsdf type='roughdiffuse'><rgb name='reflectance' value='.7, .4, .3'/><float name='alpha' value='.6'/></bsdf>";
    let lampshade = "<bsdf type='mixturebsdf'><string name='weights' value='.6, .3'/><bsdf type='difftrans'>\
        <rgb name='transmittance' value='.8, .7, .5'/></bsdf><bsdf type='twosided'><bsdf type='diffuse'/></bsdf></bsdf>";
    assert_all_pairs("clay and lampshade", &room_of([clay, lampshade]), PLAN, PHOTONS);
}

#[test]
fn a_pane_and_nothing() {
    let pane = "<bsdf type='thindielectric'><float name='int_ior' value='2'/></bsdf>";
    assert_all_pairs("pane", &room_of([pane, "<bsdf type='null'/>"]), PLAN, PHOTONS);
}

/// A sun in a sky that is dim and blue, turned.
#[test]
fn a_map_all_around() {
    let mut desc = open_room([grey(0.6), grey(0.3)]);
    let mut texels = vec![[0.1, 0.2, 0.4]; 16 * 8];
    texels[2 * 16 + 5] = [40.0, 35.0, 25.0];
    let map = Arc::new(EmissionMap::new(16, &texels).expect("texels"));
    let to_world = DAffine3::from_rotation_x(1.2) * DAffine3::from_rotation_y(0.7);
    let (scale, place) = (Spectrum::Constant(1.0), Place::default());
    desc.lights.push(LightDesc::Map { map, scale, to_world, place });
    assert_all_pairs("map", &desc, PLAN, PHOTONS);
}

#[test]
fn a_lens() {
    let mut desc = lit(open_room([grey(0.6), grey(0.3)]));
    desc.camera.perspective_mut().unwrap().lens = LensDesc::round(0.4, 3.0);
    assert_all_pairs("lens", &desc, PLAN, PHOTONS);
}

/// A camera of parallel rays, which see the lamp, the sky and the floor.
#[test]
fn an_orthographic_camera() {
    let mut desc = lit(open_room([grey(0.6), grey(0.3)]));
    desc.camera.projection = ProjectionDesc::Orthographic;
    desc.camera.to_world.matrix3 *= DMat3::from_diagonal(DVec3::new(3.5, 3.5, 1.0));
    assert_all_pairs("orthographic", &desc, PLAN, PHOTONS);
}

/// A spot, soft to its edge, and parallel light from the side.
#[test]
fn a_spot_and_parallel_light() {
    let mut desc = open_room([grey(0.6), grey(0.3)]);
    let (intensity, irradiance) = (Spectrum::d65(30.0), Spectrum::emission_rgb([1.5, 1.0, 0.6]));
    let (position, axis, place) =
        (DVec3::new(0.5, -0.5, 4.0), DVec3::new(-0.1, 0.1, -1.0).normalize(), Place::default());
    let spot =
        SpotDesc { position, axis, beam_width: 5.0, cutoff_angle: 40.0, intensity, texture: None, place };
    let direction = DVec3::new(0.6, 0.5, -1.0).normalize();
    desc.lights = vec![LightDesc::Spot(spot), LightDesc::Directional { direction, irradiance, place }];
    assert_all_pairs("spot and directional", &desc, PLAN, PHOTONS);
}

/// A sky by the model, with a sun ten times as wide as the true one.
#[test]
fn a_sky_and_its_sun() {
    let text = "<scene version=\"3.0.0\"><emitter type=\"sunsky\"><float name=\"sun_aperture\" value=\"5\"/>\
                <vector name=\"sun_direction\" value=\"0.5, -0.4, 0.6\"/></emitter><sensor type=\"perspective\"/></scene>";
    let mut desc = open_room([grey(0.6), grey(0.3)]);
    desc.lights = load_str("sky.xml", text, &[]).expect("valid").desc.lights;
    assert_all_pairs("sunsky", &desc, PLAN, PHOTONS);
}
