//! Moves of the camera, edits and their history, without a window.

use std::time::Instant;

use crate::color::Xyz;
use crate::math::random::Random;
use crate::scene::edit::{NewValue, Target};
use crate::stream::{SampleSink, UvWindow};
use crate::tracer::integrator::RenderContext;
use crate::tracer::{Integrator, PathTracer};

use crate::viewer::editor::parameters::{ParameterValue, SceneParameter};
use crate::viewer::editor::*;

#[test]
fn shape_follows_the_axis() {
    let wide = [200, 100];
    assert_eq!(shape(FovAxis::X, wide), DVec2::new(1.0, 0.5));
    assert_eq!(shape(FovAxis::Y, wide), DVec2::new(2.0, 1.0));
    assert_eq!(shape(FovAxis::Smaller, wide), shape(FovAxis::Y, wide));
    assert_eq!(shape(FovAxis::Larger, wide), shape(FovAxis::X, wide));
    assert_eq!(shape(FovAxis::Smaller, [100, 200]), shape(FovAxis::X, [100, 200]));
    assert!((shape(FovAxis::Diagonal, wide).length() - 1.0).abs() < 1e-12);
}

/// An orthographic camera orbits, pans and zooms, and is saved as orthographic.
#[test]
fn parallel_rays_stay_parallel() {
    let text = "<scene version=\"3.0.0\"><sensor type=\"orthographic\"><transform name=\"to_world\"><scale x=\"2\" y=\"3\" z=\"0.5\"/>\
                <lookat origin=\"0,0,5\" target=\"0,0,0\" up=\"0,1,0\"/></transform></sensor>\
                <shape type=\"rectangle\"/><emitter type=\"constant\"/></scene>";
    let desc = crate::scene::load_str("t.xml", text, &[]).expect("valid").desc;
    let home = desc.camera.to_world;
    let scene = Scene::prepare(&desc).expect("valid");
    let mut user = SceneEditor::new(desc, scene).expect("a camera");
    let lengths = |m: DMat3| [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length);
    assert!(user.gesture(Gesture::Dolly(1.0), [200, 100]));
    let near = user.camera_desc().to_world;
    let [x, y, z] = lengths(near.matrix3);
    assert!((x - 1.8).abs() < 1e-9 && (y - 2.7).abs() < 1e-9 && (z - 0.5).abs() < 1e-9, "{x} {y} {z}");
    assert!((near.translation - home.translation).length() < 1e-9, "the eye stays where it is");
    assert!(user.pick([100.0, 50.0], [200, 100]).is_some_and(|pick| pick.shape == 0));
    for gesture in [
        Gesture::Orbit(DVec2::new(0.1, 0.2)),
        Gesture::Pan(DVec2::new(0.1, 0.1)),
        Gesture::Fly(DVec3::ONE),
        Gesture::Look(DVec2::new(0.1, 0.0)),
        Gesture::Fov(500.0),
        Gesture::Fov(-500.0),
    ] {
        assert!(user.gesture(gesture, [200, 100]), "{gesture:?}");
        assert!(user.camera([200, 100]).is_ok(), "{gesture:?}");
    }
    // Panning by a tenth of the width moves the view by a tenth of the visible extent.
    while user.undo().is_some() {}
    user.gesture(Gesture::Pan(DVec2::new(0.1, 0.0)), [200, 100]);
    let moved = user.camera_desc().to_world.translation.distance(home.translation);
    assert!((moved - 0.4).abs() < 1e-9, "{moved}");
}

/// A lens keeps the file's focus until the camera moves, then focuses on the target; a pinhole has no focus.
#[test]
fn a_lens_focuses_on_the_target() {
    let focus_after = |sensor: &str, point: DVec3| {
        let text = format!("<scene version=\"3.0.0\">{sensor}<emitter type=\"constant\"/></scene>");
        let desc = crate::scene::load_str("t.xml", &text, &[]).expect("valid").desc;
        let scene = Scene::prepare(&desc).expect("valid");
        let mut user = SceneEditor::new(desc, scene).expect("a camera");
        let before = user.camera_desc().perspective().expect("a plane of projection").lens.focus_distance;
        user.gesture(Gesture::Focus(point), [200, 100]);
        (before, user.camera_desc().perspective().expect("a plane of projection").lens.focus_distance)
    };
    let lens = "<sensor type=\"thinlens\"><float name=\"aperture_radius\" value=\"0.1\"/>\
                <float name=\"focus_distance\" value=\"2.5\"/></sensor>";
    let (before, after) = focus_after(lens, DVec3::new(1.0, 2.0, 2.0));
    assert!(before == 2.5 && (after - 3.0).abs() < 1e-12, "{before} {after}");
    assert_eq!(focus_after("<sensor type=\"perspective\"/>", DVec3::new(1.0, 2.0, 2.0)), (0.0, 0.0));
}

/// A scene with an object of every editable kind.
const SCENE: &str = r#"<scene version="3.0.0">
    <sensor type="perspective"><transform name="to_world"><lookat origin="0, 1, 6" target="0, 0.5, 0" up="0, 1, 0"/></transform></sensor>
    <bsdf type="diffuse" id="wall"><rgb name="reflectance" value="0.8, 0.3, 0.2"/></bsdf>
    <bsdf type="roughconductor" id="metal"><float name="alpha" value="0.2"/></bsdf>
    <bsdf type="diffuse" id="board"><texture name="reflectance" type="checkerboard"/></bsdf>
    <bsdf type="mask" id="holes"><float name="opacity" value="0.7"/><bsdf type="plastic"/></bsdf>
    <shape type="rectangle" id="floor"><transform name="to_world"><rotate x="1" angle="-90"/><scale value="3"/></transform><ref id="board"/></shape>
    <shape type="cube" id="box"><transform name="to_world"><scale value="0.4"/><translate x="-1" y="0.4"/></transform><ref id="wall"/></shape>
    <shape type="sphere" id="ball"><float name="radius" value="0.5"/><point name="center" x="0.7" y="0.6" z="0"/><ref id="metal"/></shape>
    <shape type="disk" id="sieve"><transform name="to_world"><translate y="1" z="1"/></transform><ref id="holes"/></shape>
    <shape type="cylinder" id="glass"><float name="radius" value="0.2"/><bsdf type="dielectric"/></shape>
    <shape type="sphere" id="car"><float name="radius" value="0.3"/><point name="center" x="-1" y="1.3" z="0"/>
        <bsdf type="principled"><float name="metallic" value="0.5"/><float name="spec_trans" value="0.2"/></bsdf></shape>
    <shape type="shapegroup" id="pair"><shape type="cube"><transform name="to_world"><scale value="0.1"/></transform><ref id="wall"/></shape>
        <shape type="sphere"><float name="radius" value="0.1"/><point name="center" y="0.2" x="0" z="0"/><ref id="metal"/></shape></shape>
    <shape type="instance" id="here"><ref id="pair"/></shape>
    <shape type="instance" id="there"><ref id="pair"/><transform name="to_world"><translate x="0.5" y="1.5"/></transform></shape>
    <shape type="rectangle" id="lamp"><transform name="to_world"><rotate x="1" angle="90"/><translate y="3"/></transform>
        <emitter type="area"><rgb name="radiance" value="5"/></emitter></shape>
    <emitter type="point" id="bulb"><point name="position" x="1" y="2" z="1"/></emitter>
    <emitter type="spot" id="stage"><transform name="to_world"><lookat origin="0, 3, 3" target="0, 0, 0" up="0, 1, 0"/></transform></emitter>
</scene>"#;

fn editor() -> SceneEditor {
    let desc = crate::scene::load_str("t.xml", SCENE, &[]).expect("valid").desc;
    let scene = Scene::prepare(&desc).expect("valid");
    SceneEditor::new(desc, scene).expect("a camera")
}

/// Waits until the scene of the last change is prepared.
fn settle(editor: &mut SceneEditor) {
    while editor.is_preparing() {
        editor.follow().expect("the scene can be prepared");
        std::thread::yield_now();
    }
}

#[derive(Default)]
struct Bits(Vec<[u32; 3]>);

impl SampleSink for Bits {
    fn camera(&mut self, _: [f32; 2], v: Xyz, _: f32) {
        self.0.push([v.x, v.y, v.z].map(f32::to_bits));
    }
    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// The first samples of a scene, as bit patterns.
fn samples(scene: Arc<Scene>, camera: Camera, desc: &SceneDesc) -> Vec<[u32; 3]> {
    let context = RenderContext::new(scene, camera, &desc.integrator, 3, UvWindow::PICTURE);
    let (tracer, mut all) = (PathTracer::from(context), Bits::default());
    (0..1500).for_each(|i| tracer.trace(i, &mut (), &mut all));
    all.0
}

/// The first samples of the scene being traced, as bit patterns.
fn traced(editor: &SceneEditor) -> Vec<[u32; 3]> {
    samples(editor.scene(), editor.camera([64, 48]).expect("a camera"), editor.desc())
}

/// Another value of the same kind.
fn other(value: ParameterValue, random: &mut Random) -> ParameterValue {
    let u = random.f64();
    match value {
        ParameterValue::Scale(_) => ParameterValue::Scale(3.0 * u),
        ParameterValue::Color(_) => ParameterValue::Color([u, 1.0 - u, random.f64()].map(|c| c as f32)),
        ParameterValue::Number { min, max, .. } => {
            let value = min + (max.min(min + 1.5) - min) * u;
            ParameterValue::Number { value, min, max }
        }
        ParameterValue::Switch(on) => ParameterValue::Switch(!on),
        ParameterValue::Vector { value, step } => {
            ParameterValue::Vector { value: value.map(|v| v + 0.5 * (random.f64() - 0.5)), step }
        }
    }
}

/// Applies one random change; a third of them continue the previous history entry.
fn change_at_random(user: &mut SceneEditor, random: &mut Random) {
    let count = |n: usize, random: &mut Random| ((n as f64 * random.f64()) as usize).min(n - 1);
    if random.f64() < 0.67 {
        user.end_change();
    }
    let by = DVec2::new(random.f64() - 0.5, random.f64() - 0.5) * 0.2;
    match count(10, random) {
        0 => _ = user.gesture(Gesture::Orbit(by), [64, 48]),
        1 => _ = user.gesture(Gesture::Dolly(by.x), [64, 48]),
        2 => _ = user.set_fov(30.0 + 20.0 * random.f64()),
        3 => {
            let shapes = user.original().shapes.len();
            if user.begin_transform(count(shapes, random) as u32) {
                let turn = DAffine3::from_rotation_y(by.x) * DAffine3::from_translation(by.extend(0.1));
                let stretch = DAffine3::from_scale(DVec3::new(1.0 + by.x, 1.0, 1.0 - by.y));
                let steps = [DAffine3::from_translation(by.extend(by.x)), turn, stretch];
                user.set_transform(steps[count(3, random)]).expect("invertible");
            }
        }
        4 if random.f64() < 0.2 => user.switch(Effect::ALL[count(Effect::ALL.len(), random)]).unwrap_or(()),
        _ => {
            let shapes = user.original().shapes.len();
            let selected = count(shapes + 1, random);
            user.select((selected < shapes).then_some(selected as u32));
            let mut parameters = user.selection().map_or(Vec::new(), |selection| selection.parameters);
            parameters.extend(user.lens_parameters());
            let parameter = parameters.swap_remove(count(parameters.len(), random));
            let value = other(parameter.value, random);
            user.edit(SceneParameter { value, ..parameter }).expect("a value within its bounds");
        }
    }
}

/// The number of changes that can be undone.
fn depth(mut history: UndoHistory<EditorState>) -> usize {
    std::iter::from_fn(|| history.undo()).count()
}

/// After a thousand random changes and as many undos, scene, description, edits and samples equal those of the file. Redone, they equal
/// those of the last change, and the incrementally prepared scene equals one prepared from the description.
#[test]
fn a_thousand_changes_are_undone() {
    let (mut user, mut random) = (editor(), Random(42));
    let (first, file, picture) = (user.state().clone(), format!("{:?}", user.desc()), traced(&user));
    let mut undone = 0;
    while undone < 1000 {
        change_at_random(&mut user, &mut random);
        settle(&mut user);
        undone = depth(user.history.clone());
        if undone % 100 == 0 {
            let anew = Arc::new(Scene::prepare(user.desc()).expect("valid"));
            let camera = user.camera([64, 48]).expect("a camera");
            assert!(traced(&user) == samples(anew, camera, user.desc()), "after {undone} changes");
        }
    }
    let (last, changed, last_picture) = (user.state().clone(), format!("{:?}", user.desc()), traced(&user));
    assert!(changed != file && last_picture != picture);
    let mut names = Vec::new();
    while let Some(name) = user.undo() {
        names.push(name);
        user.follow().expect("the scene can be prepared");
    }
    settle(&mut user);
    assert!(names.len() >= 1000 && user.undo_name().is_none());
    for wanted in [
        "move of `ball`",
        "orbit of the camera",
        "turn of `here`",
        "reflectance of `box`",
        "radius of the lens",
    ] {
        assert!(names.iter().any(|name| name == wanted), "no {wanted}");
    }
    assert!(
        *user.state() == first && user.edits() == Edits::default() && format!("{:?}", user.desc()) == file
    );
    assert!(traced(&user) == picture, "the file's samples");
    while user.redo().is_some() {
        user.follow().expect("the scene can be prepared");
    }
    settle(&mut user);
    assert!(
        *user.state() == last && format!("{:?}", user.desc()) == changed && traced(&user) == last_picture
    );
}

/// A drag is one named history entry, a lens can be opened, and the pivot moves where it is set.
#[test]
fn objects_and_lens_are_edited() {
    let mut user = editor();
    let (ball, size) = (2, [64, 48]);
    assert!(user.begin_transform(ball));
    let start = user.selected_pivot().expect("a ball");
    assert!(start.abs_diff_eq(DVec3::new(0.7, 0.6, 0.0), 1e-9));
    let before = user.project(start, size).expect("before the camera");
    for step in 1..=5 {
        user.set_transform(DAffine3::from_translation(DVec3::X * 0.1 * f64::from(step))).expect("invertible");
    }
    settle(&mut user);
    let pivot = user.selected_pivot().expect("a ball");
    assert!(pivot.abs_diff_eq(DVec3::new(1.2, 0.6, 0.0), 1e-9), "{pivot}");
    assert!(
        user.pick(user.project(user.selected_pivot().expect("a ball"), size).expect("seen"), size)
            .is_some_and(|p| p.shape == ball)
    );
    assert!(user.project(start + DVec3::X * 0.5, size).expect("seen")[0] > before[0]);
    assert!(user.project(DVec3::Z * 9.0, size).is_none(), "behind the camera");
    assert!(user.set_transform(DAffine3::ZERO).is_err());
    user.end_change();
    assert_eq!((user.undo_name(), user.redo_name()), (Some("move of `ball`"), None));
    user.select(None);
    let set_lens = |user: &mut SceneEditor, label: &str, number| {
        let found = user.lens_parameters().into_iter().find(|parameter| parameter.label == label);
        let value = ParameterValue::Number { value: number, min: 0.0, max: 100.0 };
        user.edit(SceneParameter { value, ..found.expect("a lens") }).expect("a number")
    };
    assert!(set_lens(&mut user, "radius of the lens", 0.2));
    settle(&mut user);
    assert!(set_lens(&mut user, "distance in focus", 4.0));
    let camera = user.edits().camera.expect("a changed camera");
    let lens = camera.perspective().expect("a plane of projection").lens;
    assert!(lens.radius == 0.2 && (lens.focus_distance - 4.0).abs() < 1e-12, "{camera:?}");
    assert_eq!(user.desc().camera.lens_radius(), 0.2);
    let undone: Vec<String> = std::iter::from_fn(|| user.undo()).collect();
    assert_eq!(undone, ["distance in focus", "radius of the lens", "move of `ball`"]);
}

/// While scenes take long to prepare, edits arrive faster than scenes are ready: the last edit is traced in the end, and no call blocks.
#[test]
fn the_last_of_many_edits_is_traced() {
    let mut user = editor();
    user.took = Duration::from_secs(1);
    user.begin_transform(1);
    let start = Instant::now();
    for step in 1..=50 {
        let by = DAffine3::from_translation(DVec3::Y * 0.01 * f64::from(step));
        user.set_transform(by).expect("invertible");
        user.took = Duration::from_secs(1);
    }
    assert!(start.elapsed() < 50 * PATIENCE, "{:?}", start.elapsed());
    let wanted = DAffine3::from_translation(DVec3::Y * 0.5) * user.original().shapes[1].to_world;
    settle(&mut user);
    assert_eq!(user.desc().shapes[1].to_world, wanted);
    assert_eq!(user.edits().values, [(Target::ToWorld(1), NewValue::Transform(wanted))]);
}

/// A reloaded scene keeps the history and the edits of objects that still exist.
#[test]
fn history_survives_another_reading() {
    let mut old = editor();
    old.begin_transform(2);
    old.set_transform(DAffine3::from_translation(DVec3::Y)).expect("invertible");
    old.end_change();
    old.gesture(Gesture::Dolly(1.0), [64, 48]);
    settle(&mut old);
    let desc = crate::scene::load_str("t.xml", &SCENE.replace("id=\"box\"", "id=\"crate\""), &[])
        .expect("valid")
        .desc;
    let scene = Scene::prepare(&desc).expect("valid");
    let mut new = SceneEditor::new(desc, scene).expect("a camera");
    assert_eq!(new.take_over(old), 0);
    assert_eq!(new.desc().shapes[2].to_world.translation, DVec3::Y);
    assert_eq!(new.undo().as_deref(), Some("dolly of the camera"));
    assert_eq!(new.undo().as_deref(), Some("move of `ball`"));
    new.follow().expect("the scene can be prepared");
    settle(&mut new);
    assert!(new.edits().is_empty() && new.desc().shapes[2].to_world.translation == DVec3::ZERO);
}

/// Starting over returns to the scene and the camera as they were opened, with the effects that were forced then, as one change.
#[test]
fn starting_over_can_be_undone() {
    let mut user = editor();
    user.force(Forced { effect: Effect::Transmission, on: false }).expect("possible");
    let opened = user.state().clone();
    user.start_over();
    assert!(user.undo().is_none(), "nothing has changed");
    assert!(user.gesture(Gesture::Dolly(1.0), [200, 100]) && user.set_fov(20.0));
    user.end_change();
    user.switch(Effect::Transmission).expect("possible");
    let changed = user.state().clone();
    assert_ne!(changed, opened);
    user.start_over();
    user.follow().expect("the scene can be prepared");
    settle(&mut user);
    assert_eq!((user.state(), user.forced()), (&opened, opened.forced.as_slice()));
    assert_eq!(user.undo().as_deref(), Some("start over"));
    assert_eq!(*user.state(), changed);
}
