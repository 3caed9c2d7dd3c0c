//! Edits: what can be changed, and that an edited scene is the scene of the edited description.

use crate::editable::*;
use std::sync::Arc;

use glam::DAffine3;

use crate::support::scenes::environment;
use pointillist::color::Xyz;
use pointillist::scene::desc::*;
use pointillist::scene::edit::*;
use pointillist::scene::load_str;
use pointillist::spectrum::{Spectrum, dispersion::Ior};
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::integrator::RenderContext;
use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};

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
pub fn samples(scene: &Arc<Scene>, desc: &SceneDesc) -> Vec<[u32; 3]> {
    let camera = Camera::of(desc).unwrap();
    let mut all = Bits::default();
    for hide_emitters in [false, true] {
        let context =
            RenderContext::new(scene.clone(), camera.clone(), &desc.integrator, 3, UvWindow::PICTURE);
        let tracer = PathTracer { context: RenderContext { hide_emitters, ..context } };
        (0..3000).for_each(|i| tracer.trace(i, &mut (), &mut all));
    }
    all.0
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

/// Another colour of the same brightness; the factor and the colour go together in either order.
#[test]
fn emissions_are_tinted() {
    let desc = example();
    let (color, scale) = (Target::EmissionColor(4), Target::Emission(4));
    let wanted = [1.0, 0.25, 0.1];
    let tinted = |order: [(Target, NewValue); 2]| {
        let mut changed = desc.clone();
        order.into_iter().for_each(|(target, value)| target.set(&mut changed, value).unwrap());
        changed
    };
    let steps = [(color, NewValue::Rgb(wanted)), (scale, NewValue::Scale(3.0))];
    for order in [steps, [steps[1], steps[0]]] {
        let changed = tinted(order);
        let NewValue::Rgb(rgb) = color.get(&changed).unwrap() else { panic!("a colour") };
        assert!(wanted.iter().zip(rgb).all(|(a, b)| (a - b).abs() < 0.01), "{rgb:?}");
        let [before, after] = [&desc, &changed].map(|d| d.shapes[4].emission.as_ref().unwrap().luminance());
        assert!((after / before - 3.0).abs() < 1e-3, "{before} {after}");
    }
    assert!(color.set(&mut desc.clone(), NewValue::Rgb([2.0, 0.0, 0.0])).is_err());
}

#[test]
fn what_can_be_changed_and_what_it_is_called() {
    let desc = example();
    let labels = |i| editable(&desc, i).into_iter().map(|e| (e.label, e.target)).collect::<Vec<_>>();
    assert_eq!(labels(0), [("reflectance".to_owned(), Target::Reflectance(BsdfId(0)))]);
    assert_eq!(labels(1), [("reflectance (shared by 2 shapes)".to_owned(), Target::Reflectance(BsdfId(2)))]);
    let glass = BsdfId(3);
    let of_glass = [
        ("index of refraction".to_owned(), Target::IntIor(glass)),
        ("specular reflectance".to_owned(), Target::SpecularReflectance(glass)),
        ("specular transmittance".to_owned(), Target::SpecularTransmittance(glass)),
    ];
    assert_eq!(labels(3), of_glass);
    assert_eq!(labels(4)[0], ("emission".to_owned(), Target::Emission(4)));
    assert!(labels(99).is_empty());
    let NewValue::Rgb(rgb) = editable(&desc, 1)[0].value else { panic!("a colour") };
    assert!([0.8, 0.1, 0.1].iter().zip(rgb).all(|(a, b)| (a - b).abs() < 3e-3), "{rgb:?}");
    assert_eq!(editable(&desc, 3)[0].value, NewValue::Number(1.5));
    assert_eq!(shape_name(&desc, 0), "floor");
    assert_eq!(shape_name(&desc, 1), "cube, example.xml:10");
    let all: Vec<String> = lights_and_media(&desc).into_iter().map(|e| e.label).collect();
    let [sky, bulb] = ["constant, example.xml:18", "bulb"];
    let of = |what: &str, light: &str| format!("{what} of {light}");
    let expected = [
        (sky, "emission"),
        (sky, "emission colour"),
        (bulb, "emission"),
        (bulb, "emission colour"),
        (bulb, "position"),
    ];
    assert_eq!(all, expected.map(|(light, what)| of(what, light)));
    // Every target has its line in the table, and bounds that it accepts.
    let of_shapes = (0..desc.shapes.len() as u32).flat_map(|i| editable(&desc, i));
    for e in of_shapes.chain(lights_and_media(&desc)) {
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

/// What is wrong with an `<edit>` is said with its place.
#[test]
fn faults_of_edits_have_a_place() {
    let lamp = r#"object="shape" id="lamp &amp; shade" name="emission_scale""#;
    let cases = [
        (format!(r#"<edit {lamp} value="nan"/>"#), "not a finite number"),
        (format!(r#"<edit {lamp} value="1e999"/>"#), "not a finite number"),
        (format!(r#"<edit {lamp} value=""/>"#), "cannot have these numbers: it is a factor"),
        (format!(r#"<edit {lamp} value="1 2"/>"#), "cannot have these numbers: it is a factor"),
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
        (r#"<edit object="shape" id="floor" name="to_world" value="1 0 0 0 0 1 0 0 0 0 1 0"/>"#.into(), "sixteen"),
        (
            r#"<edit object="shape" id="floor" name="to_world" value="1 0 0 0  0 1 0 0  0 0 0 0  0 0 0 1"/>"#.into(),
            "invertible",
        ),
        (r#"<edit object="emitter" id="bulb" name="position" value="1 2"/>"#.into(), "three finite numbers"),
        (r#"<edit object="bsdf" id="red" name="alpha" value="0.1"/>"#.into(), "has no roughness"),
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

/// Scenes made in code have no names; edits work on them too.
#[test]
fn a_scene_without_a_file() {
    let mut desc = crate::support::scenes::empty();
    let m = crate::support::scenes::material(&mut desc, crate::support::scenes::glass(Ior::Constant(1.5)));
    crate::support::scenes::shape(&mut desc, ShapeKind::Disk, DAffine3::IDENTITY, m, 1.0);
    environment(&mut desc);
    assert_eq!(shape_name(&desc, 0), "disk");
    let edited = edits(&[(Target::Light(0), NewValue::Scale(2.0))]).apply(&desc).unwrap();
    assert_eq!(*edited.lights[0].spectrum(), Spectrum::Constant(2.0));
}
