//! Normal maps and bump maps: values against Mitsuba's, sampling from both ends against densities, energy, and what a flat map changes.

use std::path::Path;
use std::sync::Arc;

use glam::{Affine2, DVec3, Vec3};

use crate::bsdf::{HEIGHTS, TURNS, cell, direction, for_each_direction};
use crate::support::scenes::{Random, assert_counts, in_world_space, mean};
use pointillist::image::bitmap::Bitmap;
use pointillist::scene::desc::texture::{BitmapTexture, TexturePoint, WrapMode};
use pointillist::scene::desc::*;
use pointillist::scene::load_str;
use pointillist::spectrum::dispersion::Ior;
use pointillist::spectrum::{SampledWavelengths, Spectrum};
use pointillist::tracer::Scene;
use pointillist::tracer::accel::Ray;
use pointillist::tracer::bsdf::{
    Bsdf, BumpMaterial, CoatingMaterial, Material, MaterialModel, MaterialPart, Mirrors, MixtureMaterial,
    PartCoat, ScatteringModel,
};

/// A file beside the pictures of the table scenes.
fn load(shapes: &str) -> SceneDesc {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/plugins/test.xml");
    let text = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/>{shapes}</scene>"
    );
    in_world_space(load_str(&beside.display().to_string(), &text, &[]).expect("valid").desc)
}

#[test]
fn values_are_those_of_mitsuba() {
    let lambda = SampledWavelengths::sample(0.3);
    let (mut scene, mut case) = (None, "");
    let (mut rows, mut lit) = (0, 0);
    for line in include_str!("bump_values.txt").lines().filter(|line| !line.starts_with('#')) {
        if line.starts_with('<') {
            (scene, case) = (Some(Scene::prepare(&load(line)).expect("a scene")), line);
            continue;
        }
        let numbers: Vec<f32> = line.split_whitespace().map(|n| n.parse().expect("a number")).collect();
        let [o, d, w] = [0, 3, 6].map(|i| Vec3::from_slice(&numbers[i..]));
        let scene = scene.as_ref().expect("a shape comes first");
        let hit = scene.closest(&Ray::new(o, d)).unwrap_or_else(|| panic!("{case}: {line} misses"));
        let surface = scene.surface_material(&hit);
        let value =
            surface.bsdf::<Bsdf>(&lambda).eval(surface.frame.to_local(hit.wo), surface.frame.to_local(w));
        // Mitsuba's masking function of Beckmann's facets is a fit, within .35 %.
        let (found, expected) = (value.map_or(0.0, |(f, _)| f.0.x), numbers[9]);
        assert!(
            (found - expected).abs() <= 4e-3 * expected + 2e-4,
            "{case}\n{line}: {found} and not {expected}"
        );
        rows += 1;
        lit += u32::from(expected > 0.01);
    }
    assert!(rows == 160 && lit >= 75, "{rows} rows, {lit} with a value");
}

/// Heights are lengths: a surface that is as much larger as its heights scatters alike, whatever space it is traced in, and in a group.
#[test]
fn heights_are_lengths_of_the_world() {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/plugins/test.xml");
    let values = |size: f64, grouped: bool| -> Vec<f32> {
        let scale = |by: f64| format!("<transform name='to_world'><scale value='{by}'/></transform>");
        let bump = format!(
            "<bsdf type='bumpmap'><texture type='bitmap'><string name='filename' value='bsdf_bumpmap.png'/>\
             <boolean name='raw' value='true'/></texture><float name='scale' value='{}'/><bsdf type='diffuse'/></bsdf>",
            0.3 * size
        );
        let shapes = if grouped {
            // The group is half as large as what it shows.
            let member = format!("<shape type='rectangle'>{}{bump}</shape>", scale(0.5 * size));
            format!(
                "<shape type='shapegroup' id='g'>{member}</shape><shape type='instance'><ref id='g'/>{}</shape>",
                scale(2.0)
            )
        } else {
            format!("<shape type='rectangle'>{}{bump}</shape>", scale(size))
        };
        let text = format!(
            "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>{shapes}</scene>"
        );
        let desc = load_str(&beside.display().to_string(), &text, &[]).expect("valid").desc;
        // Also in a scene that was edited.
        let scene = Scene::prepare(&desc).expect("a scene").edited(&desc).expect("a scene");
        let lambda = SampledWavelengths::sample(0.3);
        let value = |i: u32| {
            let at = DVec3::new(0.23 * f64::from(i % 7) - 0.7, 0.19 * f64::from(i / 7) - 0.6, 1.0) * size;
            let ray = Ray::new(desc.space.point(at).as_vec3(), -Vec3::Z);
            let surface = scene.surface_material(&scene.closest(&ray).expect("it is below"));
            let to_light = surface.frame.to_local(Vec3::new(0.6, 0.5, 0.7).normalize());
            surface.bsdf::<Bsdf>(&lambda).eval(Vec3::Z, to_light).map_or(0.0, |(f, _)| f.0.x)
        };
        (0..49).map(value).collect()
    };
    let expected = values(1.0, false);
    let mean = expected.iter().sum::<f32>() / 49.0;
    assert!(expected.iter().any(|v| (v - mean).abs() > 0.2 * mean), "{expected:?}");
    for (size, grouped) in
        [(0.01, false), (100.0, false), (3e5, false), (1.0, true), (0.01, true), (70.0, true)]
    {
        for (found, expected) in values(size, grouped).iter().zip(&expected) {
            assert!((found - expected).abs() < 2e-3 * mean, "size {size}, {grouped}: {found} {expected}");
        }
    }
}

/// A map of one normal.
fn map(normal: Vec3, nested: u32) -> NormalMapDesc {
    let bitmap = Arc::new(Bitmap::from_linear(1, vec![(normal.normalize() * 0.5 + 0.5).to_array()]));
    let normals = BitmapTexture::new(bitmap, Affine2::IDENTITY, WrapMode::Repeat, false);
    let bump = BumpDesc { bsdf: BsdfId(nested), flip_invalid_normals: true, use_shadowing_function: true };
    NormalMapDesc { normals, bump }
}

fn bumped(material: &Material, map: &NormalMapDesc, share: f32) -> MaterialPart {
    let front = Mirrors { before: Vec3::ONE, after: Vec3::ONE };
    let bump = BumpMaterial::new(&map.clone().into(), front);
    MaterialPart { material: material.clone(), share: share.into(), turned: false, bump, coat: None }
}

/// Materials without deltas in tilted frames.
fn materials() -> Vec<(String, Bsdf)> {
    let one = || Spectrum::Constant(1.0).into();
    let rough = |alpha: [f32; 2]| Roughness { facets: Facets::Ggx, alpha };
    let white = Material::new(&BsdfDesc::grey(1.0)).expect("no mixture");
    let (int_ior, ext_ior) = (Ior::Constant(1.5), Ior::Constant(1.0));
    let glass = RoughDielectricDesc {
        int_ior,
        ext_ior,
        specular_reflectance: one(),
        specular_transmittance: one(),
        roughness: rough([0.4; 2]),
        alpha: None,
    };
    let (eta, k) = (Spectrum::Constant(0.0), Spectrum::Constant(1.0));
    let metal =
        RoughConductorDesc { eta, k, specular_reflectance: one(), roughness: rough([0.3, 0.6]), alpha: None };
    let [glass, metal] =
        [glass.into(), metal.into()].map(|d: BsdfDesc| Material::new(&d).expect("no mixture"));
    let lambda = SampledWavelengths::sample(0.3);
    let of = |name: &str, parts: Vec<MaterialPart>| {
        (
            name.to_owned(),
            Bsdf::Mixture(
                MixtureMaterial { parts, has_holes: false }.bsdf(&TexturePoint::default(), &lambda),
            ),
        )
    };
    let gentle = map(Vec3::new(0.3, -0.2, 1.0), 0);
    let steep = map(Vec3::new(-0.8, 0.6, 0.7), 0);
    let plain = |mut map: NormalMapDesc| {
        (map.bump.flip_invalid_normals, map.bump.use_shadowing_function) = (false, false);
        map
    };
    let flat = |material: &Material, share| MaterialPart { bump: None, ..bumped(material, &gentle, share) };
    vec![
        of("gentle white", vec![bumped(&white, &gentle, 1.0)]),
        of("steep white", vec![bumped(&white, &steep, 1.0)]),
        of("steep white as it is", vec![bumped(&white, &plain(steep.clone()), 1.0)]),
        of("steep metal", vec![bumped(&metal, &steep, 1.0)]),
        of("gentle glass", vec![bumped(&glass, &gentle, 1.0)]),
        of("steep glass as it is", vec![bumped(&glass, &plain(steep.clone()), 1.0)]),
        of(
            "steep white, metal and flat white",
            vec![bumped(&white, &steep, 0.4), bumped(&metal, &gentle, 0.3), flat(&white, 0.3)],
        ),
    ]
}

/// A tilted rough mirror and a tilted matt surface under a flat coat and a tilted one, smooth and rough.
pub fn flat_and_tilted() -> Vec<(String, Bsdf)> {
    let read = |coat: &str| {
        let text = format!(
            "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>\
             <bsdf type='{coat}'><float name='alpha' value='.4'/><float name='sigma_a' value='.2'/><bsdf type='diffuse'/></bsdf></scene>"
        );
        let desc = load_str("coat.xml", &text, &[]).expect("valid").desc;
        let coat = desc.bsdfs.iter().find_map(|bsdf| bsdf.coat()).expect("a coat");
        CoatingMaterial::new(&coat, [])
    };
    let rough = Roughness { facets: Facets::Ggx, alpha: [0.4; 2] };
    let (eta, k) = (Spectrum::Constant(0.0), Spectrum::Constant(1.0));
    let specular_reflectance = Spectrum::Constant(1.0).into();
    let metal = RoughConductorDesc { eta, k, specular_reflectance, roughness: rough, alpha: None };
    let lambda = SampledWavelengths::sample(0.3);
    let mut all = Vec::new();
    for plugin in ["coating", "roughcoating"] {
        for tilted in [false, true] {
            for (name, desc) in [("white", BsdfDesc::grey(1.0)), ("metal", metal.clone().into())] {
                let material = Material::new(&desc).expect("no mixture");
                let part = bumped(&material, &map(Vec3::new(0.4, -0.2, 1.0), 0), 1.0);
                let coat = Some(PartCoat { coat: read(plugin), tilted });
                let parts = vec![MaterialPart { coat, ..part }];
                let bsdf =
                    MixtureMaterial { parts, has_holes: false }.bsdf(&TexturePoint::default(), &lambda);
                let over = if tilted { "tilted" } else { "flat" };
                all.push((format!("{over} {plugin} over {name}"), Bsdf::Mixture(bsdf)));
            }
        }
    }
    all
}

const VIEWS: [f32; 5] = [1.0, 0.6, 0.15, 0.02, -0.4];

/// Counts and weights of one end's samples against the density and the value that `expected` states.
pub fn check_samples(
    what: &str,
    expected: impl Fn(Vec3) -> (f32, f32),
    mut sample: impl FnMut([f32; 2], f32) -> Option<(Vec3, f32)>,
) {
    let n = 40_000u32;
    let (mut cells, mut value) = (vec![0.0; HEIGHTS * TURNS], 0.0);
    for_each_direction(16, |cell, wi, area| {
        let (pdf, f) = expected(wi);
        cells[cell] += f64::from(n) * f64::from(pdf) * area;
        value += f64::from(f) * area;
    });
    let (mut counts, mut random) = (vec![0; HEIGHTS * TURNS], Random(17));
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..n {
        let Some((wi, weight)) = sample([random.f32(), random.f32()], random.f32()) else { continue };
        counts[cell(wi)] += 1;
        sum += f64::from(weight);
        squares += f64::from(weight).powi(2);
    }
    // Where a tilted hemisphere ends within a cell, the grid is off by up to a per cent of it.
    assert_counts(&counts, &cells, 0.04, what);
    let (mean, n) = (sum / f64::from(n), f64::from(n));
    let error = ((squares / n - mean * mean).max(0.0) / n).sqrt();
    let off = (mean - value).abs();
    assert!(off < 4.5 * error + 1e-2 * value + 1e-4, "{what}: weights {mean} ± {error}, value {value}");
}

#[test]
fn samples_follow_density_and_value_from_both_ends() {
    for (name, bsdf) in materials() {
        for z in VIEWS {
            for phi in [0.7, 2.6] {
                let wo = direction(z, phi);
                let what = format!("{name}, cos θₒ = {z}, φ = {phi}");
                let from_eye = |wi| bsdf.eval(wo, wi).map_or((0.0, 0.0), |(f, pdf)| (pdf.0, f.0.x));
                check_samples(&what, from_eye, |u, lobe| {
                    bsdf.sample(wo, u, lobe).map(|s| (s.wi, s.weight.0.x))
                });
                // What goes from `wo` to an eye at `wi`, with the cosine at the eye in place of that at the light.
                let from_light = |wi: Vec3| {
                    let f = bsdf.eval(wi, wo).map_or(0.0, |(f, _)| f.0.x);
                    (bsdf.pdf_from_light(wo, wi), f * (wi.z / wo.z).abs())
                };
                check_samples(&format!("{what}, from the light"), from_light, |u, lobe| {
                    let s = bsdf.sample_from_light(wo, u, lobe)?;
                    Some((s.wi, s.weight.0.x * s.eta2))
                });
            }
        }
    }
}

/// Nothing goes through what lets no light through, and no more comes back than arrives, at any angle.
#[test]
fn nothing_below_the_surface_and_no_energy_from_nowhere() {
    let mut random = Random(5);
    for (name, bsdf) in materials() {
        let opaque = !name.contains("glass");
        for z in [1.0, 0.5, 0.1, 0.01, 0.001, -0.001, -0.3, -1.0] {
            let (mut sum, n) = (0.0, 4000);
            let wo = direction(z, 6.0 * random.f32());
            for _ in 0..n {
                let w = random.direction().as_vec3();
                if opaque && (w.z < 0.0 || z < 0.0) {
                    assert!(bsdf.eval(wo, w).is_none_or(|(f, _)| f.is_black()), "{name}: {wo} to {w}");
                }
                let s = bsdf.sample(wo, [random.f32(), random.f32()], random.f32());
                let Some(s) = s else { continue };
                assert!(!opaque || s.wi.z > 0.0, "{name}: {wo} to {}", s.wi);
                assert_eq!(s.transmitted, s.wi.z * wo.z < 0.0, "{name}");
                assert!(s.weight.is_finite() && s.weight.0.min_element() >= 0.0, "{name}: {:?}", s.weight);
                sum += f64::from(s.weight.0.x * s.eta2) / f64::from(n);
            }
            assert!(sum <= 1.001, "{name}, {z}: {sum} comes back");
        }
    }
}

/// A mirror in a tilted frame sends light both ways along the same paths with the same weights but for the cosines.
#[test]
fn mirrors_are_the_same_from_both_ends() {
    let (eta, k) = (Spectrum::Constant(0.0), Spectrum::Constant(1.0));
    let mirror = ConductorDesc { eta, k, specular_reflectance: Spectrum::Constant(1.0).into() };
    let mirror = Material::new(&mirror.into()).expect("no mixture");
    let parts = vec![bumped(&mirror, &map(Vec3::new(0.5, 0.3, 0.8), 0), 1.0)];
    let bsdf = MixtureMaterial { parts, has_holes: false }
        .bsdf(&TexturePoint::default(), &SampledWavelengths::sample(0.3));
    let (mut random, mut compared, mut turned) = (Random(3), 0, 0);
    for _ in 0..2000 {
        let eye = direction(random.f32(), 6.2 * random.f32());
        let Some(s) = bsdf.sample(eye, [0.5; 2], 0.5) else { continue };
        // From the light one of two frames is taken at random: both lobe numbers together find the way back.
        let back = [0.0, 0.999_999].map(|lobe| bsdf.sample_from_light(s.wi, [0.5; 2], lobe));
        let back = back.into_iter().flatten().find(|back| back.wi.distance(eye) < 1e-4);
        let back = back.unwrap_or_else(|| panic!("from {} no way leads back to {eye}", s.wi));
        turned += u32::from(back.pdf.0 < 0.5);
        let shadow = s.weight.0.x;
        // In tilted cosines a mirror is symmetric, and its weight from the light has both ends' true ones.
        let expected = shadow * eye.z / s.wi.z / back.pdf.0;
        let off = (back.weight.0.x - expected).abs();
        assert!(off < 1e-3 * expected, "{eye}: {} and not {expected}", back.weight.0.x);
        compared += 1;
    }
    assert!(compared > 500 && turned > 50, "{compared} ways, {turned} by the turned normal");
}

/// A room whose floor has `bsdf`.
fn floor(bsdf: &str) -> SceneDesc {
    let at = "<transform name=\"to_world\"><lookat origin=\"0, -3, 2\" target=\"0, 0, 0\" up=\"0, 0, 1\"/></transform>";
    let text = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\">{at}<film type=\"hdrfilm\"><integer name=\"width\" value=\"16\"/>\
         <integer name=\"height\" value=\"16\"/></film></sensor><emitter type=\"constant\"/>\
         <shape type=\"rectangle\">{bsdf}</shape></scene>"
    );
    load_str("floor.xml", &text, &[]).expect("valid").desc
}

/// A flat map leaves the picture as it is, up to rounding, and the effect `bump` taken out of a steep one as well.
#[test]
fn flat_maps_change_nothing() {
    use pointillist::tracer::effects::{Effect, without};
    let plain = floor("<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"0.6\"/></bsdf>");
    let with = |normal: Vec3| {
        let mut desc = plain.clone();
        let inner = BsdfId(desc.bsdfs.len() as u32);
        let own = desc.shapes[0].bsdf.0 as usize;
        desc.bsdfs.push(desc.bsdfs[own].clone());
        desc.bsdfs[own] = map(normal, inner.0).into();
        desc
    };
    let of = |desc: &SceneDesc| mean(desc, 20_000).0;
    let (expected, flat) = (of(&plain), of(&with(Vec3::Z)));
    assert!((flat / expected - 1.0).abs() < 1e-5, "{flat:?} and not {expected:?}");
    let mut steep = with(Vec3::new(1.0, 0.0, 0.5));
    let tilted = of(&steep);
    assert!((tilted / expected - 1.0).abs() > 0.02, "{tilted:?} and {expected:?}");
    without(&mut steep, Effect::Bump).expect("it can be left out");
    assert_eq!(of(&steep), expected);
}
