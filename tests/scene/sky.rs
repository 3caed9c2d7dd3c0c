//! Thin lenses and environment maps of scene files: what is read, refused with its place, and saved.

use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3};

use pointillist::image::exr::{Layers, write};
use pointillist::scene::desc::{LensDesc, LightDesc};
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
    let perspective = c.perspective().unwrap();
    assert_eq!((perspective.lens, perspective.fov, c.near_clip), (LensDesc::round(0.25, 3.0), 40.0, 0.5));
    // Without a focus Mitsuba 3.9.1 focuses on the far clip plane.
    let far = "<float name=\"aperture_radius\" value=\"1\"/><float name=\"far_clip\" value=\"77\"/>";
    assert_eq!(lens(far).expect("valid").desc.camera.perspective().unwrap().lens.focus_distance, 77.0);
    let hole = "<float name=\"aperture_radius\" value=\"0\"/>";
    assert_eq!(lens(hole).expect("a pinhole").desc.camera.lens_radius(), 0.0);
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
        camera.perspective_mut().unwrap().lens = LensDesc::round(0.1, 1.0 / 3.0);
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
        (1.0, file("sky.hdr"), FindingKind::File, 4, 36, "header"),
        (1.0, file("scene.xml"), FindingKind::File, 4, 36, "neither"),
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

/// Texels that are no radiance count as black, and one warning says how many.
#[test]
fn texels_that_cannot_be_are_repaired_and_counted() {
    for (texel, says) in [
        (f32::NAN, "1 of 12 texels"),
        (f32::INFINITY, "1 of 12 texels"),
        (-1e-3, "1 have negative components"),
    ] {
        let loaded = sky("repaired", texel, FILE).expect("valid");
        let [warning] = loaded.warnings.as_slice() else { panic!("{:?}", loaded.warnings) };
        assert!(warning.to_string().contains(says) && warning.location().1 == 4, "{warning}");
        let LightDesc::Map { map, .. } = &loaded.desc.lights[0] else { panic!("a map") };
        assert_eq!((map.luminance(2, 1), map.luminance(1, 1) > 0.9), (0.0, true));
    }
}

fn light(version: &str, text: &str) -> Result<Loaded, SceneError> {
    load_str(
        "t.xml",
        &format!("<scene version=\"{version}\">\n{text}\n<sensor type=\"perspective\"/></scene>"),
        &[],
    )
}

#[test]
fn directional_and_spot_are_read_with_mitsubas_defaults() {
    let turn = "<transform name=\"to_world\"><rotate x=\"1\" angle=\"90\"/><translate x=\"3\"/></transform>";
    let loaded = light("3.0.0", &format!("<emitter type=\"directional\">{turn}</emitter>")).expect("valid");
    let LightDesc::Directional { direction, irradiance, .. } = &loaded.desc.lights[0] else {
        panic!("directional")
    };
    assert!((*direction - DVec3::NEG_Y).length() < 1e-12 && *irradiance == Spectrum::d65(1.0));
    let given = "<emitter type=\"directional\"><vector name=\"direction\" value=\"0, 0, -2\"/></emitter>";
    let loaded = light("3.0.0", given).expect("valid");
    let LightDesc::Directional { direction, .. } = &loaded.desc.lights[0] else { panic!("directional") };
    assert!(loaded.warnings.is_empty() && *direction == DVec3::NEG_Z);
    let loaded = light("3.0.0", &format!("<emitter type=\"spot\">{turn}</emitter>")).expect("valid");
    let LightDesc::Spot(spot) = &loaded.desc.lights[0] else { panic!("a spot") };
    assert_eq!((spot.position, spot.beam_width, spot.cutoff_angle), (DVec3::X * 3.0, 15.0, 20.0));
    assert!(loaded.warnings.is_empty() && (spot.axis - DVec3::NEG_Y).length() < 1e-12);
}

/// In files of version 0.6 up is +y and the sun's size a factor; the light is a sky in present files with +z up.
#[test]
fn daylight_of_both_versions() {
    let old = "<emitter type=\"sunsky\"><vector name=\"sun_direction\" x=\"-0.865804\" y=\"0.416766\" z=\"-0.276929\"/>\
               <float name=\"sun_radius_scale\" value=\"2\"/></emitter>";
    let new = "<emitter type=\"sunsky\"><vector name=\"sun_direction\" x=\"-0.865804\" y=\"0.276929\" z=\"0.416766\"/>\
               <float name=\"sun_aperture\" value=\"1.0716\"/></emitter>";
    let read = |version, text: &str| match light(version, text).expect("valid").desc.lights.swap_remove(0) {
        LightDesc::SunSky(sky) => sky,
        other => panic!("{other:?}"),
    };
    let (old, new) = (read("0.6.0", old), read("3.0.0", new));
    assert!((old.sun_half_angle - new.sun_half_angle).abs() < 1e-9 && old.sun == new.sun);
    assert!((old.to_world.matrix3.y_axis - DVec3::Y).length() < 1e-12);
    assert!((new.to_world.matrix3.y_axis - DVec3::Z).length() < 1e-12);
    assert_eq!(old.sky.luminance(100, 40), new.sky.luminance(100, 40));
    let [sky, sun] = ["sky", "sun"].map(|kind| read("0.6.0", &format!("<emitter type=\"{kind}\"/>")));
    assert!(sky.sun.is_black() && !sky.sky.is_black() && !sun.sun.is_black() && sun.sky.is_black());
}

#[test]
fn lights_that_cannot_be_are_refused_at_their_place() {
    let float = |name: &str, value: f64| format!("<float name=\"{name}\" value=\"{value}\"/>");
    let vector = |name: &str, value: &str| format!("<vector name=\"{name}\" value=\"{value}\"/>");
    let turn = "<transform name=\"to_world\"><rotate x=\"1\" angle=\"9\"/></transform>";
    for (kind, params, says) in [
        ("directional", vector("direction", "0, 0, 0"), "other than zero"),
        ("directional", vector("direction", "0, 0, 1") + turn, "not both"),
        ("spot", float("cutoff_angle", 0.0), "above 0"),
        ("spot", float("cutoff_angle", 181.0), "at most 180"),
        ("spot", float("beam_width", 21.0), "within the cutoff"),
        ("spot", float("beam_width", -1.0), "within the cutoff"),
        ("sunsky", float("turbidity", 0.5), "from 1 to 10"),
        ("sunsky", float("turbidity", 11.0), "from 1 to 10"),
        ("sunsky", float("sun_scale", -1.0), "not negative"),
        ("sunsky", float("sun_aperture", 0.0), "0 and less"),
        ("sunsky", float("sun_aperture", 180.0), "0 and less"),
        ("sunsky", float("month", 13.0), "from 1 to 12"),
        ("sunsky", float("latitude", 91.0), "from -90 to 90"),
        ("sunsky", vector("sun_direction", "0, 0, 0"), "other than zero"),
        ("sunsky", vector("sun_direction", "0, 0, 1") + &float("hour", 3.0), "not both"),
        ("sunsky", "<transform name=\"to_world\"><scale value=\"2\"/></transform>".into(), "scale or shear"),
    ] {
        let error =
            light("3.0.0", &format!("<emitter type=\"{kind}\">{params}</emitter>")).expect_err("no light");
        assert!(error.to_string().contains(says) && error.location().1 == 2, "{kind} {params}: {error}");
    }
    let night = light(
        "3.0.0",
        &format!("<emitter type=\"sunsky\">{}</emitter>", vector("sun_direction", "1, 0, -1")),
    );
    let night = night.expect("valid");
    assert!(night.desc.lights[0].is_black() && night.warnings[0].to_string().contains("below the horizon"));
}
