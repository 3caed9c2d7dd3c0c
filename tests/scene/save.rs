//! Saving edits as a scene that includes the original, and reading that back.

use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::editable::*;
use crate::support::scenes::look;
use pointillist::scene;
use pointillist::scene::desc::*;
use pointillist::scene::edit::*;

/// A folder of this test alone, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scene_edit").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn perspective(fov: f64) -> ProjectionDesc {
    let (fov_axis, lens) = (FovAxis::Smaller, LensDesc::PINHOLE);
    ProjectionDesc::Perspective(PerspectiveDesc { fov, fov_axis, lens, distortion: None })
}

/// A camera whose numbers are short in no base.
fn moved() -> CameraDesc {
    CameraDesc {
        projection: perspective(100.0 / 3.0),
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

/// A camera of parallel rays with its scale, and filters with their sizes, stand in what is saved.
#[test]
fn orthographic_cameras_and_filters_are_read_back() {
    let folder = folder("orthographic");
    let original = folder.join("example.xml");
    std::fs::write(&original, SCENE).unwrap();
    let mut desc = scene::load(&original, &[]).unwrap().desc;
    for filter in [
        ReconstructionFilter::Box,
        ReconstructionFilter::Tent { radius: 1.7 },
        ReconstructionFilter::Gaussian { stddev: 1.0 / 3.0 },
    ] {
        desc.film.rfilter = Some(filter);
        let to_world = moved().to_world * glam::DAffine3::from_scale(DVec3::new(1.0 / 3.0, 2.0, 5.0));
        let camera = CameraDesc { projection: ProjectionDesc::Orthographic, to_world, ..moved() };
        let edits = Edits { camera: Some(camera.clone()), ..Edits::default() };
        let saved = folder.join("saved.xml");
        edits.write(&saved, &original, &[], &desc).unwrap();
        let read = scene::load(&saved, &[]).unwrap().desc;
        assert_eq!(CameraDesc { place: camera.place, ..read.camera }, camera);
        assert_eq!(read.film.rfilter, Some(filter));
    }
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
        edits.camera = (i != 1).then(|| CameraDesc { projection: perspective(10.0 + scale), ..moved() });
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
    let changes: [fn(&mut CameraDesc); 3] = [
        |c| c.projection = perspective(f64::NAN),
        |c| c.near_clip = 0.0,
        |c| c.to_world.translation.x = 1e300,
    ];
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

/// A material that is used nowhere, ids that look like names, a light without a name: all are found again.
#[test]
fn every_object_is_found_again() {
    let folder = folder("every");
    let original = folder.join("example.xml");
    std::fs::write(&original, SCENE).unwrap();
    let desc = scene::load(&original, &[]).unwrap().desc;
    let mut edits = Edits::default();
    let of_shapes = (0..desc.shapes.len() as u32).flat_map(|i| editable(&desc, i));
    for (i, e) in of_shapes.chain(lights_and_media(&desc)).enumerate() {
        let v = (i + 1) as f64 / 17.0;
        let value = match e.value {
            NewValue::Scale(_) => NewValue::Scale(v),
            NewValue::Rgb(_) => NewValue::Rgb([v, 1.0 - v, 0.5]),
            NewValue::Number(_) => NewValue::Number(1.0 + v),
            NewValue::Vector(_) => NewValue::Vector([v, 1.0 - v, 0.1 + 0.2]),
            other => other,
        };
        edits.set(e.target, value).unwrap();
    }
    assert!(edits.values.len() >= 7);
    let saved = folder.join("saved.xml");
    edits.write(&saved, &original, &[], &desc).unwrap();
    assert_eq!(essence(&scene::load(&saved, &[]).unwrap().desc), essence(&edits.apply(&desc).unwrap()));
}

/// Lights that are not shapes keep what they are when their brightness and colour are changed.
#[test]
fn edited_lights_are_saved() {
    let text = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\
        <emitter type=\"directional\"><vector name=\"direction\" value=\"0.1, 0.2, -1\"/></emitter>\
        <emitter type=\"spot\" id=\"stage\"><float name=\"cutoff_angle\" value=\"33\"/></emitter>\
        <emitter type=\"sunsky\"><float name=\"turbidity\" value=\"4.5\"/></emitter></scene>";
    let folder = folder("lights");
    let original = folder.join("lights.xml");
    std::fs::write(&original, text).unwrap();
    let desc = scene::load(&original, &[]).unwrap().desc;
    let values = (0..3).map(|i| (Target::Light(i), NewValue::Scale(0.3 + f64::from(i))));
    let colors = (0..2).map(|i| (Target::LightColor(i), NewValue::Rgb([0.9, 0.5, 0.1])));
    let edits = edits(&values.chain(colors).collect::<Vec<_>>());
    let saved = folder.join("saved.xml");
    edits.write(&saved, &original, &[], &desc).unwrap();
    assert_eq!(essence(&scene::load(&saved, &[]).unwrap().desc), essence(&edits.apply(&desc).unwrap()));
    // A sky has colours of its own.
    assert!(Target::LightColor(2).get(&desc).is_err() && Target::Light(2).get(&desc).is_ok());
}
