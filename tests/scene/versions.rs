//! Files of every version of the format: old names, includes and search paths.

use std::path::{Path, PathBuf};

use glam::DVec3;
use miette::Severity;
use pointillist::scene::desc::{BsdfDesc, ConductorDesc, DiffuseDesc, FovAxis, LightDesc, SceneDesc};
use pointillist::scene::{Loaded, SceneWarning, load, load_str};
use pointillist::spectrum::Spectrum;

fn file(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scene/versions").join(name);
    std::fs::read_to_string(path).unwrap()
}

fn read(version: &str, body: &str) -> Loaded {
    let text = format!("<scene version=\"{version}\">{body}</scene>");
    load_str("t.xml", &text, &[]).unwrap_or_else(|e| panic!("{body}: {e:?}"))
}

fn is_advice(warning: &SceneWarning) -> bool {
    miette::Diagnostic::severity(warning) == Some(Severity::Advice)
}

/// The two files have the same values, in the names of 0.6 and of 3. Mitsuba 3.9.1 reads the same scene from both.
#[test]
fn an_old_file_is_the_same_scene_as_its_new_form() {
    let (old, new) = (file("old.xml"), file("new.xml"));
    let read = |text: &str| load_str("t.xml", text, &[]).unwrap_or_else(|e| panic!("{e:?}"));
    let (old, new) = (read(&old), read(&new));
    assert!(new.warnings.is_empty(), "{:?}", new.warnings);
    assert!(old.warnings.len() == 1 && is_advice(&old.warnings[0]), "{:?}", old.warnings);
    assert!(old.warnings[0].to_string().contains("0.6.0"));
    let essence = |loaded: Loaded| format!("{:?}", loaded.desc);
    assert_eq!(essence(old), essence(new.clone()));
    // Printed by Mitsuba 3.9.1: 51.5286 degrees horizontally.
    let SceneDesc { camera, film, .. } = new.desc;
    let diagonal = (camera.perspective().unwrap().fov.to_radians() / 2.0).tan();
    let horizontal = 2.0 * (diagonal * 20.0 / 20f64.hypot(16.0)).atan().to_degrees();
    assert!(
        camera.perspective().unwrap().fov_axis == FovAxis::Diagonal && (horizontal - 51.528_625).abs() < 1e-4,
        "{horizontal}"
    );
    assert_eq!(film.crop.map(|c| (c.x, c.y, c.width, c.height)), Some((3, 2, 7, 5)));
}

/// What version 0.6 and older had and Mitsuba 3 refuses.
#[test]
fn elements_that_are_gone() {
    let body = "<sensor type=\"perspective\"><transform name=\"toWorld\">\
                <lookAt origin=\"1,2,3\" target=\"4,6,8\" up=\"0,1,0\"/></transform></sensor>\
                <emitter type=\"constant\"><blackbody name=\"radiance\" temperature=\"6500K\" scale=\"2\"/></emitter>\
                <bsdf type=\"diffuse\"><srgb name=\"reflectance\" value=\"#ff8000\"/></bsdf>\
                <bsdf type=\"diffuse\"><srgb name=\"reflectance\" value=\"0.5\" intent=\"reflectance\"/></bsdf>\
                <bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"0.1 0.2, 0.3\"/></bsdf>";
    let loaded = read("0.5.0", body);
    assert!(loaded.warnings.iter().all(is_advice), "{:?}", loaded.warnings);
    let desc = loaded.desc;
    assert_eq!(desc.camera.to_world.translation, glam::DVec3::new(1.0, 2.0, 3.0));
    let reflectance = |i: usize| match &desc.bsdfs[i] {
        BsdfDesc::Diffuse(DiffuseDesc { reflectance }) => reflectance.clone(),
        other => panic!("{other:?}"),
    };
    let orange = [1.0, 0.215_860_5, 0.0]; // 128/255 on the sRGB curve
    assert_eq!(reflectance(0), Spectrum::reflectance_rgb(orange));
    let Some(&Spectrum::Constant(grey)) = reflectance(1).uniform() else { panic!("grey") };
    assert!((grey - 0.214_041_14).abs() < 1e-6, "{grey}");
    assert_eq!(reflectance(2), Spectrum::reflectance_rgb([0.1, 0.2, 0.3]));
    let LightDesc::Constant { radiance, .. } = &desc.lights[0] else { panic!("{:?}", desc.lights) };
    // Twice what Mitsuba 3.9.1 gives for its `blackbody`.
    let at = |nm: f32| radiance.eval(glam::Vec4::splat(nm)).x;
    assert!((at(550.0) / 86_126.148 - 1.0).abs() < 1e-4, "{}", at(550.0));
    // Before version 0.4 the world was mirrored, so that its cameras are no sensors; a file of version 3 has no `lookAt`.
    let look = "<sensor type=\"perspective\"><transform name=\"to_world\"><lookAt origin=\"1\" target=\"0\"/></transform></sensor>";
    for (version, body) in [("0.3.0", "<camera type=\"perspective\"/>"), ("3.0.0", look)] {
        let error = load_str("t.xml", &format!("<scene version=\"{version}\">{body}</scene>"), &[]);
        assert!(error.is_err_and(|e| e.to_string().contains("unknown element")), "{body}");
    }
}

/// The names of parameters change, not ids, values or `$names`, and only in old files.
#[test]
fn only_names_of_parameters_change() {
    let body = "<default name=\"fovAngle\" value=\"33\"/><sensor type=\"perspective\">\
                <float name=\"fov\" value=\"$fovAngle\"/></sensor><emitter type=\"constant\"/>\
                <bsdf type=\"diffuse\" id=\"aB\"/><shape type=\"cube\" id=\"theCube\"><ref id=\"aB\"/></shape>";
    let desc = read("0.6.0", body).desc;
    assert_eq!(
        (desc.camera.perspective().unwrap().fov, desc.shapes[0].id.as_deref()),
        (33.0, Some("theCube"))
    );
    let near = "<sensor type=\"perspective\"><float name=\"nearClip\" value=\"0.5\"/></sensor><emitter type=\"constant\"/>";
    assert_eq!(read("1.0.0", near).desc.camera.near_clip, 0.5);
    for version in ["2.0.0", "2.1", "3.0.0"] {
        let loaded = read(version, near);
        assert_eq!((loaded.desc.camera.near_clip, loaded.warnings.len()), (1e-2, 1));
        assert!(loaded.warnings[0].to_string().contains("nearClip"));
    }
    let unknown = read("9.0.0", near);
    assert!(unknown.warnings[0].to_string().contains("9.0.0") && !is_advice(&unknown.warnings[0]));
}

fn folder(name: &str, files: &[(&str, &str)]) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path); // not there the first time
    for (name, text) in files {
        let file = path.join(name);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, text).unwrap();
    }
    path
}

/// An index in front of a metal, which version 0.6 had, divides the metal's.
#[test]
fn metals_outside_of_air() {
    let metal = |body: &str| {
        let body = format!(
            "<sensor type=\"perspective\"/><emitter type=\"constant\"/><bsdf type=\"conductor\">{body}</bsdf>"
        );
        match read("3.0.0", &body).desc.bsdfs.remove(0) {
            BsdfDesc::Conductor(ConductorDesc { eta, k, .. }) => (eta, k),
            other => panic!("{other:?}"),
        }
    };
    let index = "<float name=\"eta\" value=\"1.5\"/><float name=\"k\" value=\"3\"/>";
    let at = |outside: &str| metal(&format!("{index}<float name=\"ext_eta\" value=\"{outside}\"/>"));
    assert_eq!(at("1"), metal(index));
    assert_eq!(at("1.5"), (Spectrum::Constant(1.0), Spectrum::Constant(2.0)));
    let (eta, _) = metal(&format!("{index}<string name=\"ext_eta\" value=\"water\"/>"));
    assert!((eta.max() * 1.333 - 1.5).abs() < 1e-2, "{eta:?}");
}

/// The axis of a sky is that of the version of the file it stands in, whatever includes it.
#[test]
fn a_sky_keeps_the_version_of_its_file() {
    let sky = "<emitter type=\"sunsky\"><vector name=\"sun_direction\" x=\"1\" y=\"2\" z=\"3\"/></emitter>";
    let root = |version: &str| {
        format!(
            "<scene version=\"{version}\"><sensor type=\"perspective\"/><include filename=\"part.xml\"/></scene>"
        )
    };
    for (part, outer, up) in [
        ("0.6.0", "3.0.0", "y"),
        ("3.0.0", "0.6.0", "z"),
        ("0.6.0", "0.6.0", "y"),
        ("", "0.6.0", "y"),
        ("", "3.0.0", "z"),
    ] {
        let version = if part.is_empty() { String::new() } else { format!(" version=\"{part}\"") };
        let part = format!("<scene{version}>{sky}</scene>");
        let folder = folder("versions_sky", &[("root.xml", &root(outer)), ("part.xml", &part)]);
        let desc = load(&folder.join("root.xml"), &[]).unwrap_or_else(|e| panic!("{e:?}")).desc;
        let [LightDesc::SunSky(sky)] = desc.lights.as_slice() else { panic!("{:?}", desc.lights) };
        let axis = sky.to_world.transform_vector3(DVec3::Y);
        let wanted = if up == "y" { DVec3::Y } else { DVec3::Z };
        assert!(axis.distance(wanted) < 1e-9, "{part} in {outer}: up is {axis}");
    }
}

/// A file is looked for beside the file that names it, beside the root, then along `<path>`; each file has a version of its own.
#[test]
fn includes_are_found_in_order() {
    let sphere = |radius: &str| {
        format!(
            "<scene version=\"3.0.0\"><shape type=\"sphere\"><float name=\"radius\" value=\"{radius}\"/></shape></scene>"
        )
    };
    let root = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/>\
                <path value=\"far\"/><include filename=\"parts\\all.xml\"/><include filename=\"old.xml\"/></scene>";
    let all = "<scene version=\"3.0.0\"><include filename=\"here.xml\"/><include filename=\"root.xml\"/>\
               <include filename=\"far.xml\"/></scene>";
    // An included file may be one plugin.
    let old = "<shape version=\"0.6.0\" type=\"sphere\"><transform name=\"toWorld\"><translate x=\"7\"/></transform></shape>";
    let folder = folder(
        "versions_includes",
        &[
            ("root.xml.scene", root),
            ("parts/all.xml", all),
            ("parts/here.xml", &sphere("1")),
            ("here.xml", &sphere("11")),
            ("far/here.xml", &sphere("12")),
            ("root.xml", &sphere("2")),
            ("far/root.xml", &sphere("13")),
            ("far/far.xml", &sphere("3")),
            ("old.xml", old),
        ],
    );
    let loaded = load(&folder.join("root.xml.scene"), &[]).unwrap_or_else(|e| panic!("{e:?}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let shapes = format!("{:?}", loaded.desc.shapes.iter().map(|s| &s.kind).collect::<Vec<_>>());
    let radii: Vec<&str> = shapes.split("radius: ").skip(1).map(|r| &r[..1]).collect();
    assert_eq!(radii, ["1", "2", "3", "1"]);
    assert_eq!(loaded.desc.shapes[3].to_world.translation.x, 7.0);
}
