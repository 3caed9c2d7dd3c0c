//! Objects that were moved and materials of every kind that were changed: edited, saved and read back they are traced alike, bit for bit.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::edit::samples;
use crate::editable::{edits, essence};
use pointillist::scene;
use pointillist::scene::desc::{BsdfDesc, BsdfId, SceneDesc};
use pointillist::scene::edit::{BsdfNumber, Edits, NewValue, Target, editable};
use pointillist::tracer::Scene;

/// Materials with numbers and textures, meshes, instances, lights.
const SCENE: &str = r#"<scene version="3.0.0">
    <sensor type="perspective"><transform name="to_world"><lookat origin="0, 1.5, 6" target="0, 0.5, 0" up="0, 1, 0"/></transform></sensor>
    <bsdf type="roughconductor" id="metal"><string name="material" value="Au"/><float name="alpha" value="0.2"/></bsdf>
    <bsdf type="roughconductor" id="brushed"><float name="alpha_u" value="0.05"/><float name="alpha_v" value="0.3"/></bsdf>
    <bsdf type="roughdielectric" id="frosted"/>
    <bsdf type="roughplastic" id="plastic"/>
    <bsdf type="principled" id="car"><rgb name="base_color" value="0.7, 0.1, 0.1"/><float name="metallic" value="0.3"/>
        <float name="clearcoat" value="0.8"/><float name="spec_trans" value="0.1"/>
        <texture name="roughness" type="checkerboard"><float name="color0" value="0.2"/><float name="color1" value="0.9"/></texture></bsdf>
    <bsdf type="principledthin" id="leaf"><float name="diff_trans" value="0.7"/></bsdf>
    <bsdf type="blendbsdf" id="blend"><float name="weight" value="0.3"/><ref id="metal"/><bsdf type="diffuse"/></bsdf>
    <bsdf type="mask" id="holes"><float name="opacity" value="0.6"/><bsdf type="diffuse"/></bsdf>
    <bsdf type="diffuse" id="board"><texture name="reflectance" type="checkerboard"/></bsdf>
    <shape type="rectangle" id="floor"><transform name="to_world"><rotate x="1" angle="-90"/><scale value="3"/></transform><ref id="board"/></shape>
    <shape type="obj" id="mesh"><string name="filename" value="mesh.obj"/><ref id="metal"/></shape>
    <shape type="obj"><string name="filename" value="mesh.obj"/><transform name="to_world"><translate x="1.5"/></transform><ref id="brushed"/></shape>
    <shape type="cube" id="cube"><transform name="to_world"><scale value="0.3"/><translate x="-2" y="0.3"/></transform><ref id="frosted"/></shape>
    <shape type="sphere" id="ball"><float name="radius" value="0.4"/><point name="center" x="0.2" y="1.6" z="0"/><ref id="car"/></shape>
    <shape type="cylinder"><float name="radius" value="0.2"/><point name="p1" x="-1" y="1" z="1"/><ref id="leaf"/></shape>
    <shape type="disk"><transform name="to_world"><translate x="1" y="2"/></transform><ref id="holes"/></shape>
    <shape type="sphere"><float name="radius" value="0.2"/><point name="center" x="2" y="1" z="0"/><ref id="blend"/></shape>
    <shape type="shapegroup" id="pair"><shape type="obj"><string name="filename" value="mesh.obj"/><ref id="plastic"/></shape>
        <shape type="sphere"><float name="radius" value="0.3"/><ref id="metal"/></shape></shape>
    <shape type="instance" id="here"><ref id="pair"/><transform name="to_world"><scale value="0.4"/><translate x="-1" y="1"/></transform></shape>
    <shape type="instance"><ref id="pair"/><transform name="to_world"><scale value="0.3"/><translate x="1" z="1"/></transform></shape>
    <shape type="rectangle" id="lamp"><transform name="to_world"><rotate x="1" angle="90"/><translate y="3"/></transform>
        <emitter type="area"><rgb name="radiance" value="5"/></emitter></shape>
    <emitter type="point" id="bulb"><point name="position" x="1" y="2" z="1"/></emitter>
    <emitter type="spot" id="stage"><transform name="to_world"><lookat origin="0, 3, 3" target="0, 0, 0" up="0, 1, 0"/></transform></emitter>
    <emitter type="directional" id="sun"><vector name="direction" value="0.3, -1, 0"/></emitter>
</scene>"#;

/// A bumpy grid of 2·24² triangles.
fn grid() -> String {
    let (n, mut text) = (24, String::new());
    for i in 0..=n {
        for j in 0..=n {
            let [x, z] = [i, j].map(|k| f64::from(k) / f64::from(n) - 0.5);
            text += &format!(
                "v {x} {} {z}\nvt {} {}\n",
                0.2 * (9.0 * x).sin() * (7.0 * z).cos(),
                x + 0.5,
                z + 0.5
            );
        }
    }
    let at = |i: i32, j: i32| i * (n + 1) + j + 1;
    for i in 0..n {
        for j in 0..n {
            let corner = |i: i32, j: i32| format!("{0}/{0}", at(i, j));
            let [a, b, c, d] = [corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j)];
            text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
        }
    }
    text
}

fn load(folder: &str) -> (PathBuf, SceneDesc) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scene_moved").join(folder);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("mesh.obj"), grid()).unwrap();
    let original = folder.join("original.xml");
    std::fs::write(&original, SCENE).unwrap();
    let desc = scene::load(&original, &[]).unwrap().desc;
    (original, desc)
}

/// Transforms of one shape after the other: near, turned, stretched, mirrored, far away.
fn transforms(desc: &SceneDesc) -> Vec<(Target, NewValue)> {
    let by = [
        DAffine3::from_translation(DVec3::new(0.3, 0.1, -0.2)),
        DAffine3::from_rotation_y(0.7),
        DAffine3::from_scale(DVec3::new(1.5, 0.8, 1.1)),
        DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)),
        DAffine3::from_translation(DVec3::new(40.0, 30.0, -200.0)),
        DAffine3::from_rotation_x(0.01),
    ];
    let shapes = desc.shapes.iter().enumerate();
    shapes
        .map(|(i, s)| (Target::ToWorld(i as u32), NewValue::Transform(by[i % by.len()] * s.to_world)))
        .collect()
}

/// After each move, and after all of them, the scene that was made from the one before is the scene of the description.
#[test]
fn moved_objects_are_traced_as_if_they_had_always_been_there() {
    let (_, original) = load("refit");
    let first = Scene::prepare(&original).unwrap();
    let mut all = Edits::default();
    let mut scene = Arc::new(first);
    for (target, value) in transforms(&original) {
        all.set(target, value).unwrap();
        let desc = all.apply(&original).unwrap();
        scene = Arc::new(scene.edited(&desc).unwrap());
        assert!(
            samples(&scene, &desc) == samples(&Arc::new(Scene::prepare(&desc).unwrap()), &desc),
            "{target:?}"
        );
    }
    let back = Arc::new(scene.edited(&original).unwrap());
    assert!(samples(&back, &original) == samples(&Arc::new(Scene::prepare(&original).unwrap()), &original));
}

/// Values within their bounds for everything that can be edited, and a transform for every shape.
fn everything(desc: &SceneDesc) -> Edits {
    let mut values = Vec::new();
    let of_shapes = (0..desc.shapes.len() as u32).flat_map(|i| editable(desc, i));
    for (i, one) in of_shapes.chain(scene::edit::lights_and_media(desc)).enumerate() {
        let v = 0.1 + 0.7 * (i as f64 * 0.618).fract();
        let [low, high] = one.target.bounds();
        values.push((
            one.target,
            match one.value {
                NewValue::Scale(_) => NewValue::Scale(v),
                NewValue::Rgb(_) => NewValue::Rgb([v, 1.0 - v, 0.5]),
                NewValue::Number(_) => NewValue::Number(low + (high.min(low + 2.0) - low) * v),
                NewValue::Switch(on) => NewValue::Switch(!on),
                NewValue::Vector(_) => NewValue::Vector([v, 2.0, -v]),
                other => other,
            },
        ));
    }
    values.extend(transforms(desc));
    edits(&values)
}

/// All edits at once, saved and read back: the same description, and the same samples as those of the scene that was edited.
#[test]
fn everything_is_saved_and_traced_alike() {
    let (original, desc) = load("saved");
    let edits = everything(&desc);
    let has = |wanted: fn(&Target) -> bool| edits.values.iter().any(|(target, _)| wanted(target));
    assert!(has(|t| matches!(t, Target::Textures(_))) && has(|t| matches!(t, Target::LightDirection(_))));
    assert!(
        has(|t| matches!(t, Target::SpecularTransmittance(_))) && has(|t| matches!(t, Target::ToWorld(_)))
    );
    for number in [
        BsdfNumber::Alpha,
        BsdfNumber::AlphaU,
        BsdfNumber::AlphaV,
        BsdfNumber::Metallic,
        BsdfNumber::Eta,
        BsdfNumber::SpecTrans,
        BsdfNumber::DiffTrans,
        BsdfNumber::Clearcoat,
        BsdfNumber::Weight,
        BsdfNumber::Opacity,
    ] {
        assert!(
            edits.values.iter().any(|(t, _)| matches!(t, Target::Number(_, n) if *n == number)),
            "{number:?}"
        );
    }
    let saved = original.with_file_name("saved.xml");
    edits.write(&saved, &original, &[], &desc).unwrap();
    let (loaded, applied) = (scene::load(&saved, &[]).unwrap().desc, edits.apply(&desc).unwrap());
    assert_eq!(essence(&loaded), essence(&applied));
    let edited = Arc::new(Scene::prepare(&desc).unwrap().edited(&applied).unwrap());
    let anew = Arc::new(Scene::prepare(&loaded).unwrap());
    assert!(samples(&edited, &applied) == samples(&anew, &loaded));
    assert!(samples(&edited, &applied) != samples(&Arc::new(Scene::prepare(&desc).unwrap()), &desc));
}

/// A number that a texture has is no number to edit; without its textures a material has their means.
#[test]
fn textures_are_switched_off() {
    let (_, desc) = load("textures");
    let of = |name: &str| {
        let index = desc.names.bsdfs.iter().position(|n| n.id.as_deref() == Some(name)).unwrap();
        BsdfId(index as u32)
    };
    let (car, board) = (of("car"), of("board"));
    assert!(Target::Number(car, BsdfNumber::Roughness).get(&desc).is_err());
    assert_eq!(Target::Textures(car).get(&desc), Ok(NewValue::Switch(true)));
    assert!(
        Target::Reflectance(board).get(&desc).is_err() && Target::Textures(of("metal")).get(&desc).is_err()
    );
    let off = edits(&[(Target::Textures(board), NewValue::Switch(false))]).apply(&desc).unwrap();
    let BsdfDesc::Diffuse(matt) = &off.bsdfs[board.0 as usize] else { panic!("a diffuse board") };
    assert!((matt.reflectance.mean_scalar() - 0.3).abs() < 1e-3, "the mean of 0.4 and 0.2");
    assert!(Target::Reflectance(board).get(&off).is_ok());
    let on = edits(&[(Target::Textures(board), NewValue::Switch(true))]).apply(&desc).unwrap();
    assert_eq!(essence(&on), essence(&desc));
}
