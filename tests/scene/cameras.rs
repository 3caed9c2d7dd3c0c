//! Cameras beyond the three usual ones: reading, errors with their places, and saving.

use std::path::Path;

use glam::{DAffine3, DVec3};

use crate::support::scenes::look;
use pointillist::scene::desc::*;
use pointillist::scene::edit::Edits;
use pointillist::scene::{Loaded, SceneError, load, load_str};

fn sensor(kind: &str, inside: &str) -> Result<Loaded, SceneError> {
    let text = format!(
        "<scene version=\"3.0.0\"><emitter type=\"constant\"/>\n<sensor type=\"{kind}\">{inside}</sensor>\n<shape type=\"sphere\"/></scene>"
    );
    load_str("t.xml", &text, &[])
}

fn camera(kind: &str, inside: &str) -> CameraDesc {
    let loaded = sensor(kind, inside).expect("valid");
    assert!(loaded.warnings.is_empty(), "{kind}: {:?}", loaded.warnings);
    loaded.desc.camera
}

fn float(name: &str, value: f64) -> String {
    format!("<float name=\"{name}\" value=\"{value}\"/>")
}

fn string(name: &str, value: &str) -> String {
    format!("<string name=\"{name}\" value=\"{value}\"/>")
}

#[test]
fn projections_are_read() {
    let kc = camera("perspective_rdist", &(float("fov", 50.0) + &string("kc", "0.1, -0.05")));
    let by_name = camera("perspective", &(float("fov", 50.0) + &float("k1", 0.1) + &float("k2", -0.05)));
    assert_eq!(kc.projection, by_name.projection);
    let distortion = kc.perspective().unwrap().distortion.expect("a distortion");
    assert_eq!(distortion.radial, [0.1, -0.05, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(camera("perspective", "").perspective().unwrap().distortion, None);
    let blades = "<integer name=\"num_blades\" value=\"7\"/>".to_owned()
        + &float("aperture_radius", 0.1)
        + &float("squeeze", 2.0);
    let lens = camera("thinlens", &blades).perspective().unwrap().lens;
    assert_eq!((lens.blades, lens.blade_rotation, lens.squeeze), (7, 0.0, 2.0));
    let ProjectionDesc::Fisheye(fisheye) = camera("fisheye", "").projection else { panic!("no fisheye") };
    assert_eq!(
        (fisheye.mapping, fisheye.fov, fisheye.image_circle),
        (FisheyeMapping::Equidistant, 180.0, 180.0)
    );
    let ProjectionDesc::Fisheye(fisheye) = camera("fisheye", &float("k2", 0.01)).projection else {
        panic!("no fisheye")
    };
    assert_eq!((fisheye.image_circle, fisheye.distortion), (360.0, [0.0, 0.01, 0.0, 0.0]));
    assert_eq!(camera("spherical", "").projection, ProjectionDesc::Spherical);
    assert_eq!(
        camera("cubemap", &string("layout", "Cross")).projection,
        ProjectionDesc::CubeMap(CubeLayout::Cross)
    );
    let eyes = StereoDesc { interocular: 0.063, eyes: StereoEyes::OverUnder };
    assert_eq!(camera("ods", "").projection, ProjectionDesc::Stereo(eyes));
    assert_eq!(camera("radiancemeter", "").projection, ProjectionDesc::Beam(0.0));
}

/// Before the sphere of the whole scene, or twice its radius before the target; the sphere around a box of the side 2 has the radius √3.
#[test]
fn distant_rays_begin_outside_of_the_scene() {
    let down = "<vector name=\"direction\" value=\"0, 0, -2\"/>";
    let whole = camera("distant", down);
    let ProjectionDesc::Beam(radius) = whole.projection else { panic!("no beam") };
    assert!((radius - 3f64.sqrt()).abs() < 1e-12);
    assert!((whole.to_world.translation - DVec3::Z * radius).length() < 1e-12);
    assert!((whole.to_world.matrix3.z_axis + DVec3::Z).length() < 1e-12);
    let point = camera("distant", &format!("{down}<point name=\"target\" value=\"0.5, 0, 0\"/>"));
    assert_eq!(point.projection, ProjectionDesc::Beam(0.0));
    assert!((point.to_world.translation - DVec3::new(0.5, 0.0, 2.0 * radius)).length() < 1e-12);
}

#[test]
fn several_sensors_share_a_film() {
    let film =
        |width: u32| format!("<film type=\"hdrfilm\"><integer name=\"width\" value=\"{width}\"/></film>");
    let two = "<sensor type=\"spherical\"/><sensor type=\"orthographic\"/>";
    let ProjectionDesc::Batch(cameras) = camera("batch", &(two.to_owned() + &film(64))).projection else {
        panic!("no batch")
    };
    assert_eq!(cameras[0].projection, ProjectionDesc::Spherical);
    assert_eq!(cameras[1].projection, ProjectionDesc::Orthographic);
    let odd = sensor("batch", &(two.to_owned() + &film(65))).expect_err("an odd width");
    assert!(odd.to_string().contains("65"), "{odd}");
}

#[test]
fn what_cannot_be_is_refused_at_its_place() {
    let lens = float("aperture_radius", 0.1);
    for (kind, inside, words) in [
        ("perspective_rdist", string("kc", "1"), "two numbers"),
        ("perspective_rdist", string("kc", "a, b"), "`a`"),
        ("perspective", float("k1", f64::INFINITY), "inf"),
        ("thinlens", lens.clone() + "<integer name=\"blades\" value=\"2\"/>", "blades"),
        ("thinlens", lens.clone() + &float("squeeze", 0.0), "squeeze"),
        ("fisheye", float("fov", 400.0), "field of view"),
        ("fisheye", string("mapping", "orthographic") + &float("fov", 190.0), "180"),
        ("fisheye", string("mapping", "equisolid") + &float("k1", 0.1), "equidistant"),
        ("fisheye", string("mapping", "thoby"), "mapping"),
        ("fisheye", float("image_circle", 0.0), "image circle"),
        ("cubemap", string("layout", "2x3"), "layout"),
        ("ods", float("interocular", -1.0), "eyes"),
        ("ods", string("eyes", "third"), "eyes"),
        ("spherical", float("near_clip", 0.0), "near_clip"),
        ("spherical", "<transform name=\"to_world\"><scale value=\"2\"/></transform>".to_owned(), "scale"),
        ("radiancemeter", "<point name=\"origin\" value=\"0, 0, 0\"/>".to_owned(), "belong together"),
        ("radiancemeter", float("radius", -1.0), "radius"),
        ("distant", "<shape type=\"sphere\" name=\"target\"/>".to_owned(), "shape"),
        ("batch", String::new(), "needs sensors"),
        ("batch", "<sensor type=\"batch\"/>".to_owned(), "cannot stand"),
        ("irradiancemeter", String::new(), "stands in the shape"),
    ] {
        let error = sensor(kind, &inside).expect_err(kind);
        let text = format!("{error:?} {error}");
        assert!(text.contains(words), "{kind} {inside}: {text}");
        assert_eq!(error.location().1, 2, "{kind} {inside}: {text}");
    }
}

/// Every projection is saved and read back as it was.
#[test]
fn projections_are_saved() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scene_cameras");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let original = folder.join("original.xml");
    std::fs::write(
        &original,
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/></scene>",
    )
    .unwrap();
    let desc = load(&original, &[]).unwrap().desc;
    let lens =
        LensDesc { blades: 5, blade_rotation: 1.0 / 3.0, squeeze: 1.8, ..LensDesc::round(0.1, 1.0 / 3.0) };
    let distortion = DistortionDesc {
        radial: [0.1, 0.0, -0.3, 0.2, 0.0, 1e-20],
        tangential: [0.01, 0.0],
        prism: [0.0, 0.0, 0.0, 1.0 / 3.0],
    };
    let perspective = |lens, distortion| {
        ProjectionDesc::Perspective(PerspectiveDesc {
            fov: 100.0 / 3.0,
            fov_axis: FovAxis::Larger,
            lens,
            distortion,
        })
    };
    let fisheye = |mapping, distortion| {
        let (fov, fov_axis, image_circle) = (500.0 / 3.0, FovAxis::Diagonal, 100.0);
        ProjectionDesc::Fisheye(FisheyeDesc { mapping, fov, fov_axis, image_circle, distortion })
    };
    let of = |projection| CameraDesc {
        projection,
        near_clip: 0.1 + 0.2,
        ..look(DVec3::new(1.0 / 3.0, 1e-20, 4.0), DVec3::new(-0.1, 0.07, -1.0), 45.0)
    };
    let unclipped =
        |projection| CameraDesc { near_clip: 0.0, far_clip: f64::from(f32::MAX), ..of(projection) };
    let cameras = [
        of(perspective(lens, None)),
        of(perspective(LensDesc::PINHOLE, Some(distortion))),
        of(perspective(lens, Some(distortion))),
        of(fisheye(FisheyeMapping::Equidistant, [0.1, 0.0, 0.0, -0.2])),
        of(fisheye(FisheyeMapping::Stereographic, [0.0; 4])),
        of(ProjectionDesc::Spherical),
        of(ProjectionDesc::CubeMap(CubeLayout::Column)),
        of(ProjectionDesc::Stereo(StereoDesc { interocular: 0.1, eyes: StereoEyes::Right })),
        unclipped(ProjectionDesc::Beam(0.0)),
        unclipped(ProjectionDesc::Beam(1.0 / 3.0)),
        CameraDesc {
            to_world: DAffine3::from_rotation_y(0.3),
            ..unclipped(ProjectionDesc::Batch(vec![
                of(ProjectionDesc::Spherical),
                of(perspective(lens, None)),
                of(ProjectionDesc::Orthographic),
            ]))
        },
    ];
    for (i, camera) in cameras.into_iter().enumerate() {
        let edits = Edits { camera: Some(camera.clone()), ..Edits::default() };
        let saved = folder.join(format!("saved{i}.xml"));
        edits.write(&saved, &original, &[], &desc).unwrap_or_else(|e| panic!("{camera:?}: {e}"));
        let mut read = load(&saved, &[]).unwrap().desc.camera;
        read.place = camera.place;
        if let ProjectionDesc::Batch(cameras) = &mut read.projection {
            cameras.iter_mut().for_each(|part| part.place = camera.place);
        }
        assert_eq!(read, camera);
    }
}
