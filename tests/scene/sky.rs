//! Thin lenses and environment maps of scene files: what is read, refused with its place, and saved.

use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3};

use pointillist::image::exr::{Layers, write};
use pointillist::scene::desc::LightDesc;
use pointillist::scene::edit::Edits;
use pointillist::scene::{FindingKind, Loaded, SceneError, load, load_str};
use pointillist::spectrum::Spectrum;

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scene_sky").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder for tests");
    folder
}

fn scene(sensor: &str, light: &str) -> String {
    format!("<scene version=\"3.0.0\">\n{sensor}\n{light}\n</scene>\n")
}

const CONSTANT: &str = "<emitter type=\"constant\"/>";

fn lens(body: &str) -> Result<Loaded, SceneError> {
    load_str("t.xml", &scene(&format!("<sensor type=\"thinlens\">{body}</sensor>"), CONSTANT), &[])
}

#[test]
fn lenses_are_read_with_mitsubas_defaults() {
    let loaded = lens(
        "<float name=\"aperture_radius\" value=\"0.25\"/><float name=\"focus_distance\" value=\"3\"/>\
         <float name=\"fov\" value=\"40\"/><float name=\"near_clip\" value=\"0.5\"/>",
    )
    .expect("valid");
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let c = loaded.desc.camera;
    assert_eq!((c.aperture_radius, c.focus_distance, c.fov, c.near_clip), (0.25, 3.0, 40.0, 0.5));
    // Without a focus Mitsuba 3.9.1 focuses on the far clip plane.
    let far = "<float name=\"aperture_radius\" value=\"1\"/><float name=\"far_clip\" value=\"77\"/>";
    assert_eq!(lens(far).expect("valid").desc.camera.focus_distance, 77.0);
    let hole = "<float name=\"aperture_radius\" value=\"0\"/>";
    assert_eq!(lens(hole).expect("a pinhole").desc.camera.aperture_radius, 0.0);
}

#[test]
fn lenses_that_cannot_be_are_refused_at_their_place() {
    let radius = "<float name=\"aperture_radius\" value=\"1\"/>";
    for (body, kind, column) in [
        ("", FindingKind::Missing, 1),
        ("<float name=\"aperture_radius\" value=\"-1\"/>", FindingKind::Value, 62),
        (&format!("{radius}<float name=\"focus_distance\" value=\"0\"/>"), FindingKind::Value, 102),
        (&format!("{radius}<float name=\"focus_distance\" value=\"-2\"/>"), FindingKind::Value, 102),
        (&format!("{radius}<float name=\"focus_distance\" value=\"inf\"/>"), FindingKind::Value, 102),
    ] {
        let error = lens(body).expect_err("no lens");
        assert_eq!(
            (error.kind(), error.location().1, error.location().2),
            (kind, 2, column),
            "{body}: {error:?}"
        );
    }
}

/// A camera with a lens is saved as one, and read back the same; Mitsuba's has no principal point.
#[test]
fn a_lens_is_saved() {
    let folder = folder("lens");
    let original = folder.join("scene.xml");
    std::fs::write(&original, scene("<sensor type=\"perspective\"/>", CONSTANT)).expect("written");
    let desc = load(&original, &[]).expect("valid").desc;
    for offset in [DVec2::ZERO, DVec2::new(0.1, 0.0)] {
        let mut camera = desc.camera.clone();
        (camera.aperture_radius, camera.focus_distance) = (0.1, 1.0 / 3.0);
        camera.principal_point_offset = offset;
        camera.to_world.translation = DVec3::new(1.0, 2.0, 1.0 / 3.0);
        let edits = Edits { camera: Some(camera.clone()), values: Vec::new() };
        let saved = folder.join("saved.xml");
        edits.write(&saved, &original, &[], &desc).expect("written");
        let text = std::fs::read_to_string(&saved).expect("just written");
        assert!(text.contains("thinlens") && text.contains("principal") == (offset != DVec2::ZERO), "{text}");
        camera.place = Default::default();
        let mut read = load(&saved, &[]).expect("valid").desc.camera;
        read.place = Default::default();
        assert_eq!(read, camera);
    }
}

/// A scene with an envmap of these parameters beside `sky.exr`, 4 × 3, whose texel (2, 1) is `texel`.
fn sky(name: &str, texel: f32, params: &str) -> Result<Loaded, SceneError> {
    let folder = folder(name);
    let mut layers = Layers { width: 4, height: 3, ..Layers::default() };
    for channel in ["R", "G", "B"] {
        layers.push(channel, (0..12).map(|i| if i == 6 { texel } else { 1.0 }));
    }
    write(&folder.join("sky.exr"), &layers).expect("written");
    std::fs::write(folder.join("sky.hdr"), "#?RADIANCE\n").expect("written");
    let path = folder.join("scene.xml");
    let light = format!("  <emitter type=\"envmap\">\n{params}</emitter>");
    std::fs::write(&path, scene("<sensor type=\"perspective\"/>", &light)).expect("written");
    load(&path, &[])
}

const FILE: &str = "    <string name=\"filename\" value=\"sky.exr\"/>\n";

#[test]
fn maps_are_read() {
    let turn = "<transform name=\"to_world\"><rotate y=\"1\" angle=\"90\"/></transform>\
                <float name=\"scale\" value=\"2\"/>";
    let loaded = sky("read", 5.0, &format!("{FILE}{turn}")).expect("valid");
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let LightDesc::Map { map, scale, to_world, place } = &loaded.desc.lights[0] else { panic!("a map") };
    assert_eq!((map.width(), map.height(), scale, place.line), (4, 3, &Spectrum::Constant(2.0), 3));
    assert!((map.luminance(2, 1) - 5.0).abs() < 1e-5 && (map.luminance(1, 1) - 1.0).abs() < 1e-6);
    assert!((to_world.transform_vector3(DVec3::Z) - DVec3::X).length() < 1e-6);
}

#[test]
fn maps_that_cannot_be_are_refused_at_their_place() {
    let file = |name: &str| format!("    <string name=\"filename\" value=\"{name}\"/>\n");
    let scaled = "<transform name=\"to_world\"><scale value=\"2\"/></transform>";
    for (texel, params, kind, line, column, says) in [
        (1.0, String::new(), FindingKind::Missing, 3, 3, "filename"),
        (1.0, file("nowhere.exr"), FindingKind::File, 4, 36, "nowhere.exr"),
        (1.0, file("sky.hdr"), FindingKind::File, 4, 36, "OpenEXR and PNG"),
        (1.0, file("scene.xml"), FindingKind::File, 4, 36, "neither"),
        (f32::NAN, FILE.into(), FindingKind::Value, 4, 36, "texel (2, 1) is NaN"),
        (-1.0, FILE.into(), FindingKind::Value, 4, 36, "texel (2, 1) is -1"),
        (f32::INFINITY, FILE.into(), FindingKind::Value, 4, 36, "texel (2, 1) is inf"),
        (1.0, format!("{FILE}<float name=\"scale\" value=\"-1\"/>"), FindingKind::Value, 5, 28, "factor"),
        (1.0, format!("{FILE}{scaled}"), FindingKind::Value, 5, 1, "scale or shear"),
        (
            1.0,
            format!("{FILE}</emitter><emitter type=\"constant\">"),
            FindingKind::Parameter,
            5,
            11,
            "second",
        ),
    ] {
        let error = sky("refused", texel, &params).expect_err("no sky");
        assert_eq!(
            (error.kind(), error.location().1, error.location().2),
            (kind, line, column),
            "{params}: {error:?}"
        );
        assert!(error.to_string().contains(says), "{error}");
    }
}
