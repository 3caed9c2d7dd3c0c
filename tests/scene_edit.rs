//! Edits: what can be changed, that an edited scene is the scene of the edited description, and saving.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod tracer_support;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use pointillist::color::Xyz;
use pointillist::scene::desc::*;
use pointillist::scene::edit::*;
use pointillist::scene::{self, load_str};
use pointillist::spectrum::{Spectrum, dispersion::Ior};
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};
use tracer_support::{environment, look};

const SCENE: &str = r#"<scene version="3.0.0">
    <default name="glow" value="5"/>
    <sensor type="perspective"><transform name="to_world"><lookat origin="0.1, 1, 4" target="0, 0.5, 0" up="0, 1, 0"/></transform>
        <float name="fov" value="45"/>
        <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="24"/><rfilter type="tent"/></film>
        <sampler type="independent"><integer name="sample_count" value="12"/></sampler></sensor>
    <bsdf type="twosided" id="white"><bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.6, 0.5"/></bsdf></bsdf>
    <bsdf type="diffuse" id="red"><rgb name="reflectance" value="0.8, 0.1, 0.1"/></bsdf>
    <shape type="rectangle" id="floor"><transform name="to_world"><rotate x="1" angle="-90"/><scale value="4"/></transform><ref id="white"/></shape>
    <shape type="cube"><transform name="to_world"><scale value="0.4"/><translate x="-1" y="0.4"/></transform><ref id="red"/></shape>
    <shape type="cube"><transform name="to_world"><scale value="0.3"/><translate x="1" z="-1" y="0.4"/></transform><ref id="red"/></shape>
    <shape type="sphere"><float name="radius" value="0.5"/><point name="center" x="0.2" y="0.6" z="0.5"/>
        <bsdf type="dielectric"><float name="int_ior" value="1.5"/></bsdf></shape>
    <shape type="rectangle" id="lamp &amp; shade"><transform name="to_world"><rotate x="1" angle="90"/><translate y="3"/></transform>
        <emitter type="area"><rgb name="radiance" value="$glow"/></emitter></shape>
    <shape type="disk"><transform name="to_world"><rotate y="90"  angle="90"/><translate x="-3" y="1"/></transform>
        <emitter type="area"><spectrum name="radiance" value="400:1, 600:2, 700:1"/></emitter></shape>
    <emitter type="constant"><rgb name="radiance" value="0.1, 0.2, 0.4"/></emitter>
    <emitter type="point" id="bulb"><point name="position" x="1" y="2" z="1"/><float name="intensity" value="2"/></emitter>
</scene>
"#;

fn example() -> SceneDesc {
    load_str("example.xml", SCENE, &[]).unwrap().desc
}

/// Everything about a scene but where it was read from.
fn essence(desc: &SceneDesc) -> String {
    let mut desc = desc.clone();
    desc.files.clear();
    desc.camera.place = Place::default();
    desc.shapes.iter_mut().for_each(|s| s.place = Place::default());
    desc.names.bsdfs.iter_mut().chain(&mut desc.names.lights).for_each(|n| n.place = Place::default());
    for light in &mut desc.lights {
        match light {
            LightDesc::Constant { place, .. } | LightDesc::Point { place, .. } => *place = Place::default(),
        }
    }
    // A negative zero is the same matrix.
    desc.camera.to_world.translation += DVec3::ZERO;
    format!("{desc:?}").replace("-0.0", "0.0")
}

#[derive(Default)]
struct Bits(Vec<[u32; 3]>);

impl SampleSink for Bits {
    fn camera(&mut self, _: [f32; 2], v: Xyz, _: f32) {
        assert!(v.is_finite());
        self.0.push([v.x, v.y, v.z].map(f32::to_bits));
    }
    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// The first samples of a scene, to the bit.
fn samples(scene: &Arc<Scene>, desc: &SceneDesc) -> Vec<[u32; 3]> {
    let camera = Camera::of(desc).unwrap();
    let mut all = Bits::default();
    for hide_emitters in [false, true] {
        let tracer = PathTracer {
            hide_emitters,
            ..PathTracer::new(scene.clone(), camera.clone(), &desc.integrator, 3, UvWindow::PICTURE)
        };
        (0..3000).for_each(|i| tracer.trace(i, &mut (), &mut all));
    }
    all.0
}

/// Sets of edits, each unlike the others.
fn several() -> Vec<Vec<(Target, NewValue)>> {
    let dark = |i| (Target::Emission(i), NewValue::Scale(0.0));
    let out = |i| (Target::Light(i), NewValue::Scale(0.0));
    let (red, glass) = (BsdfId(2), BsdfId(3));
    vec![
        vec![(Target::Emission(4), NewValue::Scale(2.5))],
        vec![(Target::Emission(5), NewValue::Scale(0.3)), (Target::Light(1), NewValue::Scale(7.0))],
        vec![(Target::Reflectance(red), NewValue::Rgb([0.1, 0.7, 1.0 / 3.0]))],
        vec![(Target::Reflectance(BsdfId(0)), NewValue::Rgb([0.25; 3]))],
        vec![(Target::IntIor(glass), NewValue::Number(1.8)), (Target::Light(0), NewValue::Scale(1e-7))],
        vec![dark(4)],
        vec![dark(4), dark(5), out(0), out(1)],
        vec![(Target::Emission(4), NewValue::Scale(1e30)), (Target::Light(1), NewValue::Scale(1e30))],
    ]
}

fn edits(values: &[(Target, NewValue)]) -> Edits {
    let mut edits = Edits::default();
    values.iter().for_each(|(t, v)| edits.set(*t, *v).unwrap());
    edits
}

#[test]
fn an_edited_scene_is_the_scene_of_the_edited_description() {
    let original = example();
    let first = Arc::new(Scene::prepare(&original).unwrap());
    let untouched = samples(&first, &original);
    let mut previous = first.clone();
    for values in several() {
        let desc = edits(&values).apply(&original).unwrap();
        let anew = samples(&Arc::new(Scene::prepare(&desc).unwrap()), &desc);
        // From the scene as read, and from the last edit.
        for from in [&first, &previous] {
            assert!(samples(&Arc::new(from.edited(&desc).unwrap()), &desc) == anew, "{values:?}");
        }
        assert!(anew != untouched, "{values:?} changes nothing");
        previous = Arc::new(previous.edited(&desc).unwrap());
    }
    assert!(samples(&Arc::new(previous.edited(&original).unwrap()), &original) == untouched);
}

/// With every light out, nothing is seen, and nothing is a division by zero.
#[test]
fn a_scene_with_all_lights_out_is_black() {
    let original = example();
    let desc = edits(&several()[6]).apply(&original).unwrap();
    let scene = Arc::new(Scene::prepare(&original).unwrap().edited(&desc).unwrap());
    assert!(samples(&scene, &desc).iter().all(|s| *s == [0; 3]));
    assert_eq!(scene.lights().len(), Scene::prepare(&original).unwrap().lights().len());
}

/// What is more than an edit of values is prepared anew, not taken for one.
#[test]
fn other_changes_are_prepared_anew() {
    let original = example();
    let scene = Scene::prepare(&original).unwrap();
    let changes: [fn(&mut SceneDesc); 5] = [
        |d| d.shapes[1].to_world.translation.y += 1.0,
        |d| drop(d.shapes.remove(1)),
        |d| d.shapes[4].emission = None,
        environment_gone,
        |d| d.shapes[5].flip_normals = true,
    ];
    for change in changes {
        let mut desc = original.clone();
        change(&mut desc);
        let edited = samples(&Arc::new(scene.edited(&desc).unwrap()), &desc);
        assert!(edited == samples(&Arc::new(Scene::prepare(&desc).unwrap()), &desc));
    }
    let mut desc = original.clone();
    desc.shapes[0].bsdf = BsdfId(99);
    assert!(scene.edited(&desc).is_err());
}

fn environment_gone(desc: &mut SceneDesc) {
    desc.lights.remove(0);
}

#[test]
fn what_can_be_changed_and_what_it_is_called() {
    let desc = example();
    let labels = |i| editable(&desc, i).into_iter().map(|e| (e.label, e.target)).collect::<Vec<_>>();
    assert_eq!(labels(0), [("reflectance".to_owned(), Target::Reflectance(BsdfId(0)))]);
    assert_eq!(labels(1), [("reflectance (shared by 2 shapes)".to_owned(), Target::Reflectance(BsdfId(2)))]);
    assert_eq!(labels(3), [("index of refraction".to_owned(), Target::IntIor(BsdfId(3)))]);
    assert_eq!(labels(4)[0], ("emission".to_owned(), Target::Emission(4)));
    assert!(labels(99).is_empty());
    let NewValue::Rgb(rgb) = editable(&desc, 1)[0].value else { panic!("a colour") };
    assert!([0.8, 0.1, 0.1].iter().zip(rgb).all(|(a, b)| (a - b).abs() < 3e-3), "{rgb:?}");
    assert_eq!(editable(&desc, 3)[0].value, NewValue::Number(1.5));
    assert_eq!(shape_name(&desc, 0), "floor");
    assert_eq!(shape_name(&desc, 1), "cube, example.xml:10");
    let all: Vec<String> = lights(&desc).into_iter().map(|e| e.label).collect();
    assert_eq!(all, ["emission of constant, example.xml:18", "emission of bulb"]);
    // Every target has its line in the table, and bounds that it accepts.
    let of_shapes = (0..desc.shapes.len() as u32).flat_map(|i| editable(&desc, i));
    for e in of_shapes.chain(lights(&desc)) {
        assert_eq!(e.target.get(&desc), Ok(e.value));
        e.target.check(e.value).unwrap();
        assert!(e.target.bounds()[0] < e.target.bounds()[1]);
    }
}

#[test]
fn values_out_of_range_are_refused() {
    let bad = [
        (Target::Emission(4), NewValue::Scale(-1.0)),
        (Target::Emission(4), NewValue::Scale(f64::NAN)),
        (Target::Light(0), NewValue::Scale(f64::INFINITY)),
        (Target::Light(0), NewValue::Number(1.0)),
        (Target::Reflectance(BsdfId(2)), NewValue::Rgb([0.5, 1.01, 0.5])),
        (Target::Reflectance(BsdfId(2)), NewValue::Rgb([0.5, -1e-9, 0.5])),
        (Target::Reflectance(BsdfId(2)), NewValue::Rgb([f64::NAN; 3])),
        (Target::IntIor(BsdfId(3)), NewValue::Number(0.0)),
        (Target::IntIor(BsdfId(3)), NewValue::Number(1e-60)),
        (Target::IntIor(BsdfId(3)), NewValue::Number(1001.0)),
    ];
    for (target, value) in bad {
        let mut edits = Edits::default();
        assert!(edits.set(target, value).is_err() && edits.is_empty(), "{target:?} {value:?}");
        // Nor past the check.
        edits.values.push((target, value));
        assert!(edits.apply(&example()).is_err(), "{target:?} {value:?}");
    }
    for target in
        [Target::Emission(0), Target::Light(2), Target::Reflectance(BsdfId(3)), Target::IntIor(BsdfId(9))]
    {
        let value = match target {
            Target::Reflectance(_) => NewValue::Rgb([0.5; 3]),
            Target::IntIor(_) => NewValue::Number(1.5),
            _ => NewValue::Scale(1.0),
        };
        let error = edits(&[(target, value)]).apply(&example()).unwrap_err();
        assert!(matches!(error, EditError::NoTarget { .. }), "{error}");
    }
}

/// A folder of this test alone, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scene_edit").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A camera whose numbers are short in no base.
fn moved() -> CameraDesc {
    CameraDesc {
        fov: 100.0 / 3.0,
        fov_axis: FovAxis::Smaller,
        near_clip: 0.1 + 0.2,
        far_clip: 1e30,
        ..look(DVec3::new(1.0 / 3.0, 1e-20, 4.0), DVec3::new(-0.1, 0.07, -1.0), 45.0)
    }
}

#[test]
fn what_is_saved_is_read_back() {
    let folder = folder("round");
    std::fs::create_dir_all(folder.join("a")).unwrap();
    std::fs::create_dir_all(folder.join("b & \"c\" é")).unwrap();
    let original = folder.join("a/example.xml");
    std::fs::write(&original, SCENE).unwrap();
    let defines =
        vec![("glow".to_owned(), "1".to_owned()), ("glow".to_owned(), "0.3333333333333333".to_owned())];
    let desc = scene::load(&original, &defines).unwrap().desc;
    for (i, values) in several().iter().enumerate() {
        let mut edits = edits(values);
        edits.camera = (i % 2 == 0).then(moved);
        for place in ["a", "b & \"c\" é", ""] {
            let saved = folder.join(place).join(format!("saved{i}.xml"));
            edits.write(&saved, &original, &defines, &desc).unwrap();
            let loaded = scene::load(&saved, &[]).unwrap();
            assert_eq!(essence(&loaded.desc), essence(&edits.apply(&desc).unwrap()), "{values:?} in {place}");
            // Only advice: that the original's sensor does not count.
            assert!(
                loaded.warnings.iter().all(|w| w.to_string().contains("sensor")),
                "{:?}",
                loaded.warnings
            );
        }
    }
    // A name set on the command line still wins over what was saved.
    let other = scene::load(&folder.join("saved0.xml"), &[("glow".to_owned(), "9".to_owned())]).unwrap().desc;
    assert_ne!(format!("{:?}", other.shapes[4].emission), format!("{:?}", desc.shapes[4].emission));
    assert_eq!(std::fs::read_to_string(&original).unwrap(), SCENE);
}

#[test]
fn an_edited_scene_can_be_edited_further() {
    let folder = folder("nested");
    let original = folder.join("example.xml");
    std::fs::write(&original, SCENE).unwrap();
    let mut path = original;
    for (i, scale) in [3.0, 0.5, 1.0 / 3.0].into_iter().enumerate() {
        let desc = scene::load(&path, &[]).unwrap().desc;
        let mut edits = edits(&[
            (Target::Emission(4), NewValue::Scale(scale)),
            (Target::Reflectance(BsdfId(2)), NewValue::Rgb([0.1, 0.2, 0.3 * scale.min(1.0)])),
        ]);
        edits.camera = (i != 1).then(|| CameraDesc { fov: 10.0 + scale, ..moved() });
        let next = folder.join(format!("saved{i}.xml"));
        edits.write(&next, &path, &[], &desc).unwrap();
        assert_eq!(essence(&scene::load(&next, &[]).unwrap().desc), essence(&edits.apply(&desc).unwrap()));
        path = next;
    }
}

#[test]
fn the_original_and_its_parts_are_not_overwritten() {
    let folder = folder("original");
    let original = folder.join("example.xml");
    std::fs::write(&original, SCENE).unwrap();
    let desc = scene::load(&original, &[]).unwrap().desc;
    let edits = edits(&several()[0]);
    let same = folder.join("../original/./example.xml");
    for path in [&original, &same] {
        assert!(matches!(edits.write(path, &original, &[], &desc), Err(SaveError::Original { .. })));
    }
    let saved = folder.join("saved.xml");
    edits.write(&saved, &original, &[], &desc).unwrap();
    edits.write(&saved, &original, &[], &desc).unwrap();
    // Both are parts of the scene when the saved one was opened.
    let again = scene::load(&saved, &[]).unwrap().desc;
    for path in [&original, &saved] {
        assert!(matches!(edits.write(path, &saved, &[], &again), Err(SaveError::Original { .. })));
    }
    assert_eq!(std::fs::read_to_string(&original).unwrap(), SCENE);
    // Neither a failure nor success leaves a partial file.
    let nowhere = folder.join("nowhere/saved.xml");
    assert!(matches!(edits.write(&nowhere, &original, &[], &desc), Err(SaveError::Io { .. })));
    std::fs::create_dir(folder.join("taken.xml")).unwrap();
    assert!(edits.write(&folder.join("taken.xml"), &original, &[], &desc).is_err());
    let mut names: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["example.xml", "saved.xml", "taken.xml"]);
}

#[test]
fn what_a_file_cannot_say_is_refused() {
    let folder = folder("refused");
    let original = folder.join("example.xml");
    std::fs::write(&original, SCENE).unwrap();
    let desc = scene::load(&original, &[]).unwrap().desc;
    let saved = folder.join("saved.xml");
    let one = edits(&several()[0]);
    let define = |value: &str| vec![("glow".to_owned(), value.to_owned())];
    for value in ["$x", "\u{1}", "a\u{0}b"] {
        let error = one.write(&saved, &original, &define(value), &desc).unwrap_err();
        assert!(matches!(error, SaveError::Text { .. }), "{error}");
    }
    let dollar = folder.join("a$b.xml");
    std::fs::write(&dollar, SCENE).unwrap();
    assert!(matches!(one.write(&saved, &dollar, &[], &desc), Err(SaveError::Text { .. })));
    let changes: [fn(&mut CameraDesc); 3] =
        [|c| c.fov = f64::NAN, |c| c.near_clip = 0.0, |c| c.to_world.translation.x = 1e300];
    for change in changes {
        let mut camera = moved();
        change(&mut camera);
        let edits = Edits { camera: Some(camera), values: Vec::new() };
        assert!(matches!(edits.write(&saved, &original, &[], &desc), Err(SaveError::Camera(_))));
    }
    let nan = Edits { camera: None, values: vec![(Target::Emission(4), NewValue::Scale(f64::NAN))] };
    assert!(matches!(nan.write(&saved, &original, &[], &desc), Err(SaveError::Edit(_))));
    assert!(!saved.exists());
}

/// What is wrong with an `<edit>` is said with its place.
#[test]
fn faults_of_edits_have_a_place() {
    let lamp = r#"object="shape" id="lamp &amp; shade" name="emission_scale""#;
    let cases = [
        (format!(r#"<edit {lamp} value="nan"/>"#), "not a finite number"),
        (format!(r#"<edit {lamp} value="1e999"/>"#), "not a finite number"),
        (format!(r#"<edit {lamp} value=""/>"#), "cannot have 0 numbers"),
        (format!(r#"<edit {lamp} value="1 2"/>"#), "cannot have 2 numbers"),
        (format!(r#"<edit {lamp} value="-1"/>"#), "it is a factor"),
        (format!(r#"<edit {lamp} value="1" index="4"/>"#), "names its object"),
        (format!(r#"<edit {lamp} value="1"/><edit {lamp} value="2"/>"#), "edited twice"),
        (format!(r#"<edit {lamp} value="1"><float name="a" value="1"/></edit>"#), "attributes only"),
        (format!(r#"<edit {lamp}/>"#), "needs the attribute `value`"),
        (format!(r#"<edit {lamp} value="1" what="1"/>"#), "no attribute `what`"),
        (r#"<edit object="shape" id="lamp" name="emission_scale" value="1"/>"#.into(), "no shape with the id"),
        (r#"<edit object="sensor" id="a" name="fov" value="1"/>"#.into(), "no such sort"),
        (r#"<edit object="shape" id="floor" name="emission" value="1"/>"#.into(), "no value of this name"),
        (r#"<edit object="shape" id="floor" name="emission_scale" value="1"/>"#.into(), "has no emission"),
        (r#"<edit object="bsdf" id="white" name="reflectance" value="1 1 1"/>"#.into(), "has no reflectance"),
        (r#"<edit object="bsdf" id="red" name="reflectance" value="1 1 2"/>"#.into(), "from 0 to 1"),
        (r#"<edit object="bsdf" index="3" name="int_ior" value="1"/>"#.into(), "says its `count`"),
        (r#"<edit object="bsdf" index="3" count="5" name="int_ior" value="1"/>"#.into(), "and `type`"),
        (r#"<edit object="bsdf" index="3" count="6" type="dielectric" name="int_ior" value="1"/>"#.into(), "has 5 of"),
        (r#"<edit object="bsdf" index="2" count="5" type="dielectric" name="int_ior" value="1"/>"#.into(), "is `diffuse`"),
        (r#"<edit object="bsdf" index="5" count="5" type="dielectric" name="int_ior" value="1"/>"#.into(), "0 to 4"),
        (r#"<edit object="bsdf" index="-1" count="5" type="a" name="int_ior" value="1"/>"#.into(), "not from 0"),
        (r#"<edit object="emitter" index="9" count="99999999999" type="a" name="emission_scale" value="1"/>"#.into(), "not from 0"),
        (r#"<shape type="disk"><edit object="bsdf" id="red" name="reflectance" value="1"/></shape>"#.into(), "cannot stand in"),
    ];
    for (text, wanted) in cases {
        let scene = SCENE.replace("</scene>", &format!("\n  {text}\n</scene>"));
        let error = load_str("saved.xml", &scene, &[]).expect_err(&text);
        assert!(error.to_string().contains(wanted), "{text}: {error}");
        let (file, line, column) = error.location();
        assert!(file == "saved.xml" && line == 21 && column >= 3, "{text}: {error:?}");
    }
}

/// A material that is used nowhere, ids that look like names, a light without a name: all are found again.
#[test]
fn every_object_is_found_again() {
    let folder = folder("every");
    let original = folder.join("example.xml");
    std::fs::write(&original, SCENE).unwrap();
    let desc = scene::load(&original, &[]).unwrap().desc;
    let mut edits = Edits::default();
    let of_shapes = (0..desc.shapes.len() as u32).flat_map(|i| editable(&desc, i));
    for (i, e) in of_shapes.chain(lights(&desc)).enumerate() {
        let v = (i + 1) as f64 / 17.0;
        let value = match e.value {
            NewValue::Scale(_) => NewValue::Scale(v),
            NewValue::Rgb(_) => NewValue::Rgb([v, 1.0 - v, 0.5]),
            NewValue::Number(_) => NewValue::Number(1.0 + v),
        };
        edits.set(e.target, value).unwrap();
    }
    assert!(edits.values.len() >= 7);
    let saved = folder.join("saved.xml");
    edits.write(&saved, &original, &[], &desc).unwrap();
    assert_eq!(essence(&scene::load(&saved, &[]).unwrap().desc), essence(&edits.apply(&desc).unwrap()));
    // Taking all back is the file again.
    let all: Vec<Target> = edits.values.iter().map(|(t, _)| *t).collect();
    all.into_iter().for_each(|t| edits.unset(t));
    assert!(edits.is_empty());
    assert_eq!(essence(&edits.apply(&desc).unwrap()), essence(&desc));
}

/// Scenes made in code have no names; edits work on them too.
#[test]
fn a_scene_without_a_file() {
    let mut desc = tracer_support::empty();
    let m = tracer_support::material(&mut desc, tracer_support::glass(Ior::Constant(1.5)));
    tracer_support::shape(&mut desc, ShapeKind::Disk, DAffine3::IDENTITY, (m, 1.0));
    environment(&mut desc);
    assert_eq!(shape_name(&desc, 0), "disk");
    let edited = edits(&[(Target::Light(0), NewValue::Scale(2.0))]).apply(&desc).unwrap();
    assert_eq!(*edited.lights[0].spectrum(), Spectrum::Constant(2.0));
}
