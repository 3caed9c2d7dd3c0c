//! Groups of shapes and their instances: what is read, what is refused, what can be changed and saved.

use std::path::Path;

use crate::editable::{edits, essence};
use glam::DVec3;
use pointillist::scene::desc::*;
use pointillist::scene::edit::{NewValue, Target, editable, shape_name};
use pointillist::scene::{FindingKind, Loaded, SceneError, load, load_str};

const BESIDE: &str = "<sensor type=\"perspective\"/><emitter type=\"constant\"/>";

/// Two shapes with materials of their own.
const GROUP: &str = r#"<shape type="shapegroup" id="g">
<shape type="sphere" id="ball"><bsdf type="diffuse" id="red"><rgb name="reflectance" value="0.8, 0.1, 0.1"/></bsdf></shape>
<shape type="cube"><transform name="to_world"><translate x="3"/></transform></shape>
</shape>"#;

fn try_read(body: &str) -> Result<Loaded, SceneError> {
    load_str("t.xml", &format!("<scene version=\"3.0.0\">{BESIDE}\n{body}\n</scene>"), &[])
}

fn read(body: &str) -> SceneDesc {
    let loaded = try_read(body).unwrap_or_else(|e| panic!("{body}: {e:?}"));
    assert!(loaded.warnings.is_empty(), "{body}: {:?}", loaded.warnings);
    loaded.desc
}

/// Kind, line and column of the error, which must say `words`.
fn refused(body: &str, words: &str) -> (FindingKind, usize, usize) {
    let error = try_read(body).map(|_| ()).expect_err(body);
    assert!(error.to_string().contains(words), "{error} does not say {words}");
    let (name, line, column) = error.location();
    assert_eq!(name, "t.xml");
    (error.kind(), line, column)
}

#[test]
fn a_group_is_read_once_and_shown_by_its_instances() {
    let desc = read(&format!(
        "{GROUP}\n<shape type=\"instance\" id=\"first\"><ref id=\"g\"/></shape>
        <shape type=\"disk\"/>
        <shape type=\"instance\"><ref name=\"what\" id=\"g\"/>
        <transform name=\"to_world\"><scale x=\"-2\"/><translate y=\"1\"/></transform></shape>"
    ));
    assert_eq!((desc.shapes.len(), desc.groups.len()), (3, 1));
    let group = &desc.groups[0];
    assert_eq!((group.id.as_deref(), group.place.line, group.shapes.len()), (Some("g"), 2, 2));
    assert_eq!(group.shapes[1].to_world.translation, DVec3::new(3.0, 0.0, 0.0));
    assert_ne!(group.shapes[0].bsdf, group.shapes[1].bsdf);
    let instance = |i: usize| (desc.shapes[i].kind.clone(), desc.shapes[i].bsdf);
    assert_eq!(instance(0), (ShapeKind::Instance(GroupId(0)), BsdfId::NONE));
    assert_eq!(instance(2), (ShapeKind::Instance(GroupId(0)), BsdfId::NONE));
    assert_eq!(desc.shapes[0].id.as_deref(), Some("first"));
    let placed = desc.shapes[2].to_world.transform_point3(DVec3::X);
    assert_eq!(placed, DVec3::new(-2.0, 1.0, 0.0));
    assert_eq!((desc.parts(&desc.shapes[0]).len(), desc.parts(&desc.shapes[1]).len()), (2, 1));
    // The disk, then what the group holds: once, although it is shown twice.
    assert_eq!(desc.surfaces().count(), 3);
}

#[test]
fn groups_may_come_later_and_share_what_they_name() {
    let desc = read(&format!(
        "<shape type=\"instance\"><ref id=\"h\"/></shape><bsdf type=\"diffuse\" id=\"m\"/>
        <shape type=\"sphere\" id=\"s\"><ref id=\"m\"/></shape>{GROUP}
        <shape type=\"instance\"><ref id=\"g\"/></shape>
        <shape type=\"shapegroup\" id=\"h\"><ref id=\"s\"/><shape type=\"disk\"><ref id=\"m\"/></shape></shape>"
    ));
    let of = |i: usize| match desc.shapes[i].kind {
        ShapeKind::Instance(GroupId(g)) => desc.groups[g as usize].id.as_deref(),
        _ => None,
    };
    assert_eq!((of(0), of(1), of(2)), (Some("h"), None, Some("g")));
    let [ball, disk] = desc.groups[0].shapes.as_slice() else { panic!("two shapes") };
    assert!(ball.bsdf == disk.bsdf && ball.bsdf == desc.shapes[1].bsdf);
}

#[test]
fn what_is_never_shown_is_remarked_upon() {
    let loaded = try_read(&format!("{GROUP}<shape type=\"disk\"/>")).unwrap();
    let said: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert!(said.len() == 1 && said[0].contains("no instance shows this group"), "{said:?}");
    assert_eq!(loaded.desc.surfaces().count(), 1);
    assert_eq!(loaded.desc.shown(), [false]);
    let turned =
        "<shape type=\"instance\"><ref id=\"g\"/><boolean name=\"flip_normals\" value=\"true\"/></shape>";
    let loaded = try_read(&format!("{GROUP}{turned}")).unwrap();
    assert!(loaded.warnings[0].to_string().contains("has no `flip_normals`"), "{:?}", loaded.warnings);
}

#[test]
fn what_cannot_be_is_refused_where_it_stands() {
    use FindingKind::{Missing, Parameter, Plugin, Reference, Value};
    let instance = |inside: &str| format!("{GROUP}\n<shape type=\"instance\">{inside}</shape>");
    let refer = "<ref id=\"g\"/>";
    assert_eq!(refused(&instance("<ref id=\"gg\"/>"), "no element with the id `gg`"), (Reference, 6, 33));
    assert_eq!(refused(&instance(""), "names none"), (Missing, 6, 1));
    assert_eq!(refused(&instance(&refer.repeat(2)), "a second one"), (Parameter, 6, 37));
    assert_eq!(refused(&instance("<ref id=\"ball\"/>"), "this is the shape `sphere`"), (Reference, 6, 24));
    assert_eq!(refused(&instance("<ref id=\"red\"/>"), "no material or light"), (Parameter, 6, 24));
    let own = |what: &str| refused(&instance(&format!("{refer}{what}")), "no material or light");
    assert_eq!(own("<bsdf type=\"diffuse\"/>"), (Parameter, 6, 37));
    assert_eq!(own("<emitter type=\"area\"/>"), (Parameter, 6, 37));
    let flat = "<transform name=\"to_world\"><scale y=\"0\"/></transform>";
    assert_eq!(refused(&instance(&format!("{refer}{flat}")), "no inverse").0, Value);

    let group = |inside: &str| format!("{GROUP}\n<shape type=\"shapegroup\" id=\"h\">{inside}</shape>");
    assert_eq!(refused(&group(""), "without shapes"), (Missing, 6, 1));
    assert_eq!(refused(&group("<ref id=\"g\"/>"), "a group in a group"), (Plugin, 6, 33));
    assert_eq!(refused(&group("<ref id=\"h\"/>"), "a group in a group"), (Plugin, 6, 33));
    assert_eq!(refused(&group("<shape type=\"shapegroup\"/>"), "a group in a group"), (Plugin, 6, 33));
    let nested = "<shape type=\"instance\"><ref id=\"g\"/></shape>";
    assert_eq!(refused(&group(nested), "an instance in a group"), (Plugin, 6, 33));
    let lamp = "<shape type=\"disk\"><emitter type=\"area\"/></shape>";
    assert_eq!(refused(&group(lamp), "a light in a group"), (Plugin, 6, 52));
    let disk = "<shape type=\"disk\"/>";
    let own = refused(&group(&format!("{disk}<bsdf type=\"diffuse\"/>")), "no material or light of its own");
    assert_eq!(own, (Parameter, 6, 53));
    assert_eq!(refused("<shape type=\"instanse\"/>", "no shape `instanse`").0, Plugin);
}

/// Materials of a group are changed through any instance; the file that is saved names them as before.
#[test]
fn materials_of_a_group_are_edited_and_saved() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scene_instances");
    std::fs::create_dir_all(&folder).unwrap();
    let original = folder.join("original.xml");
    let body = format!(
        "{GROUP}<shape type=\"instance\"><ref id=\"g\"/></shape><shape type=\"instance\" id=\"two\"><ref id=\"g\"/></shape>
        <shape type=\"disk\"><ref id=\"red\"/></shape>"
    );
    std::fs::write(&original, format!("<scene version=\"3.0.0\">{BESIDE}{body}</scene>")).unwrap();
    let desc = load(&original, &[]).unwrap().desc;
    assert_eq!(
        (shape_name(&desc, 0).as_str(), shape_name(&desc, 1).as_str()),
        ("instance, original.xml:4", "two")
    );
    let found = editable(&desc, 1);
    let labels: Vec<&str> = found.iter().map(|e| e.label.as_str()).collect();
    let expected =
        ["reflectance of red (shared by 3 shapes)", "reflectance of the cube (shared by 2 shapes)"];
    assert_eq!(labels, expected);
    let red = desc.groups[0].shapes[0].bsdf;
    let edits = edits(&[(Target::Reflectance(red), NewValue::Rgb([0.1, 0.2, 0.7]))]);
    let saved = folder.join("saved.xml");
    edits.write(&saved, &original, &[], &desc).unwrap();
    let loaded = load(&saved, &[]).unwrap().desc;
    assert_eq!(essence(&loaded), essence(&edits.apply(&desc).unwrap()));
    assert_ne!(essence(&loaded), essence(&desc));
}

/// The example that comes with the program.
#[test]
fn the_cloister() {
    let loaded = load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/instances.xml"), &[]).unwrap();
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let desc = loaded.desc;
    assert!(desc.shapes.len() > 300 && desc.shown().iter().all(|shown| *shown));
    let mirrored = desc.shapes.iter().filter(|s| s.to_world.matrix3.determinant() < 0.0).count();
    assert!(mirrored >= 40, "{mirrored}");
}
