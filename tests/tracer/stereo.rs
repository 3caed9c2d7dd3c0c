//! Both eyes of a stereo rig: where points stand in their pictures, and the depths that are comfortable to look at.

use glam::{DAffine3, DQuat, DVec2, DVec3};

use crate::support::scenes::*;
use pointillist::scene::desc::aov::parse;
use pointillist::scene::desc::*;
use pointillist::stream::UvWindow;
use pointillist::tracer::aov::AovTracer;
use pointillist::tracer::{Camera, PrepareOptions};

/// The picture and its overscan.
const OVERSCAN: UvWindow = UvWindow { min: [-2.0; 2], max: [3.0; 2] };

/// A scene whose camera is turned, moved, scaled and shifted.
fn desc(axis: FovAxis, [width, height]: [u32; 2], scale: f64) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(3.0, -2.0, 1.0), DVec3::new(0.3, 0.5, -0.8), 50.0);
    desc.camera.to_world.matrix3 *= scale;
    let seen = PerspectiveDesc { fov_axis: axis, ..*perspective(&desc.camera) };
    desc.camera.projection = ProjectionDesc::Perspective(seen);
    desc.camera.principal_point_offset = DVec2::new(0.1, -0.2);
    (desc.film.width, desc.film.height) = (width, height);
    desc
}

fn perspective(camera: &CameraDesc) -> &PerspectiveDesc {
    match &camera.projection {
        ProjectionDesc::Perspective(perspective) => perspective,
        other => panic!("{other:?}"),
    }
}

fn aspect(desc: &SceneDesc) -> f64 {
    f64::from(desc.film.width) / f64::from(desc.film.height)
}

/// The uv of a point, given along the camera's axes (left, up, forward) in world units, in the pictures of both eyes.
fn seen(desc: &SceneDesc, rig: &StereoRig, point: DVec3) -> [DVec2; 2] {
    let matrix = desc.camera.to_world.matrix3;
    let axes = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(DVec3::normalize);
    let world = desc.camera.to_world.translation + axes[0] * point.x + axes[1] * point.y + axes[2] * point.z;
    rig.eyes(&desc.camera, aspect(desc)).unwrap().map(|eye| {
        let camera = Camera::new(&eye, &desc.film, &PrepareOptions::from_film(&desc.film)).unwrap();
        let view = camera.view(world.as_vec3(), [0.5; 2], &OVERSCAN).expect("in front");
        DVec2::from_array(view.uv.map(f64::from))
    })
}

fn off_axis(interocular: f64, distance: f64) -> StereoRig {
    StereoRig { interocular, convergence: StereoConvergence::OffAxis { distance } }
}

const PARALLEL: StereoRig = StereoRig { interocular: 0.2, convergence: StereoConvergence::Parallel };

/// Points have the disparity of the closed formula and no other: 0 at the distance of convergence, crossed in front of it, uncrossed behind,
/// and the same height for both eyes.
#[test]
fn disparity_is_the_closed_formula() {
    for (axis, size, scale) in [
        (FovAxis::X, [640, 400], 1.0),
        (FovAxis::Y, [640, 400], 1.0),
        (FovAxis::Smaller, [300, 500], 3.0),
        (FovAxis::Diagonal, [500, 300], 0.01),
    ] {
        let desc = desc(axis, size, scale);
        for rig in [off_axis(0.2, 5.0), off_axis(0.05, 2.0), PARALLEL] {
            let disparity = rig.disparity(&desc.camera, aspect(&desc), f64::from(size[0])).unwrap();
            for depth in [1.5, 2.0, 5.0, 40.0] {
                for (x, y) in [(0.0, 0.0), (0.4, -0.3), (-0.5, 0.2)] {
                    let [left, right] = seen(&desc, &rig, DVec3::new(x * depth, y * depth, depth));
                    let found = (left.x - right.x) * f64::from(size[0]);
                    let PerspectiveDesc { fov, fov_axis, .. } = perspective(&desc.camera);
                    let half = fov_axis.half_extent(*fov, aspect(&desc)).x;
                    let per_distance = match rig.convergence {
                        StereoConvergence::Parallel => 0.0,
                        StereoConvergence::OffAxis { distance } => 1.0 / distance,
                    };
                    let formula =
                        f64::from(size[0]) * rig.interocular / (2.0 * half) * (1.0 / depth - per_distance);
                    assert!(
                        (found - formula).abs() < 1e-3,
                        "{axis:?} {rig:?} {depth}: {found} for {formula}"
                    );
                    assert!((disparity.at(depth) - formula).abs() < 1e-9);
                    assert!((left.y - right.y).abs() < 1e-6, "vertical parallax");
                }
            }
            if let StereoConvergence::OffAxis { distance } = rig.convergence {
                assert!(disparity.at(distance).abs() < 1e-9);
                assert!(disparity.at(0.9 * distance) > 0.0 && disparity.at(1.1 * distance) < 0.0);
                // What stands in the plane of convergence is where one camera sees it.
                let one = StereoRig { interocular: 1e-9, ..rig };
                let point = DVec3::new(0.3, 0.2, distance);
                let (eyes, middle) = (seen(&desc, &rig, point), seen(&desc, &one, point));
                assert!(eyes[0].distance(middle[0]) < 1e-6 && eyes[1].distance(middle[0]) < 1e-6);
            } else {
                assert!(disparity.at(f64::INFINITY) == 0.0 && disparity.at(1e6) > 0.0);
            }
        }
    }
}

/// The left eye sees more of a near thing's left side: a near point is farther right in its picture.
#[test]
fn the_left_eye_is_at_the_left() {
    let desc = desc(FovAxis::X, [640, 400], 1.0);
    let [left, right] = seen(&desc, &off_axis(0.2, 5.0), DVec3::new(0.0, 0.0, 1.0));
    assert!(left.x > right.x + 0.05, "{left} {right}");
    let [left, right] = seen(&desc, &off_axis(0.2, 5.0), DVec3::new(0.0, 0.0, 500.0));
    assert!(left.x < right.x - 0.01, "{left} {right}");
}

#[test]
fn the_subject_gives_what_is_not_said() {
    use ConvergenceChoice::{Distance, Parallel, Subject};
    let pinhole = desc(FovAxis::X, [640, 400], 1.0).camera;
    let seen = PerspectiveDesc { lens: LensDesc::round(0.1, 6.0), ..*perspective(&pinhole) };
    let lens = CameraDesc { projection: ProjectionDesc::Perspective(seen), ..pinhole.clone() };
    let rig =
        |choice, interocular, camera: &CameraDesc, middle| StereoRig::of(interocular, choice, camera, middle);
    assert_eq!(rig(Subject, None, &lens, Some(3.0)), Ok(off_axis(0.2, 6.0)));
    assert_eq!(rig(Subject, None, &pinhole, Some(3.0)), Ok(off_axis(0.1, 3.0)));
    assert_eq!(rig(Subject, Some(0.5), &pinhole, Some(3.0)), Ok(off_axis(0.5, 3.0)));
    assert_eq!(rig(Distance(9.0), None, &pinhole, None), Ok(off_axis(0.3, 9.0)));
    assert_eq!(rig(Parallel, Some(0.2), &pinhole, None), Ok(PARALLEL));
    assert_eq!(rig(Parallel, None, &lens, None), Ok(PARALLEL));
    for choice in [Subject, Parallel] {
        assert_eq!(rig(choice, None, &pinhole, None), Err(StereoRigError::NoSubject));
    }
    for (text, choice) in [("subject", Subject), ("parallel", Parallel), ("2.5", Distance(2.5))] {
        assert_eq!(ConvergenceChoice::parse(text), Ok(choice));
    }
}

#[test]
fn bad_rigs_are_refused() {
    let mut camera = desc(FovAxis::X, [640, 400], 1.0).camera;
    let message = |error: StereoRigError| error.to_string();
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let rig = off_axis(bad, 1.0);
        let error = message(rig.eyes(&camera, 1.0).unwrap_err());
        assert!(error.contains("distance between the eyes"), "{error}");
        assert!(StereoRig::of(Some(bad), ConvergenceChoice::Subject, &camera, Some(1.0)).is_err());
        let rig = off_axis(0.1, bad);
        let error = message(rig.disparity(&camera, 1.0, 640.0).unwrap_err());
        assert!(error.contains("converge"), "{error}");
        assert!(StereoRig::of(None, ConvergenceChoice::Subject, &camera, Some(bad)).is_err());
        for (width, distance) in [(bad, 0.7), (0.6, bad)] {
            let screen = StereoScreen { width, distance };
            let error = ComfortableDepth::of(&PARALLEL, &camera, 1.0, screen).unwrap_err();
            assert!(matches!(error, StereoRigError::Screen { .. }), "{error}");
        }
    }
    for (text, part) in [
        ("toed-in", "different heights"),
        ("-1", "above 0"),
        ("NaN", "above 0"),
        ("far", "`far`"),
        ("", "``"),
    ] {
        let error = message(ConvergenceChoice::parse(text).unwrap_err());
        assert!(error.contains(part), "{error}");
    }
    camera.projection = ProjectionDesc::Orthographic;
    camera.place.line = 12;
    let error = message(PARALLEL.eyes(&camera, 1.0).unwrap_err());
    assert!(error.contains("line 12") && error.contains("`perspective`"), "{error}");
}

/// At the ends of the comfortable depths the eyes of the viewer converge 1° nearer and 1° farther than the screen, as drawn with rays on it.
#[test]
fn comfort_ends_at_one_degree() {
    let desc = desc(FovAxis::X, [640, 400], 1.0);
    let screen = StereoScreen::default();
    let (pupils, rig) = (0.063, off_axis(0.1, 3.0));
    let comfort = ComfortableDepth::of(&rig, &desc.camera, aspect(&desc), screen).unwrap();
    assert!(comfort.near < 3.0 && comfort.far > 3.0, "{comfort:?}");
    let vergence = |depth: f64| {
        let [left, right] = seen(&desc, &rig, DVec3::new(0.0, 0.0, depth));
        let parallax = (right.x - left.x) * screen.width;
        2.0 * ((pupils - parallax) / (2.0 * screen.distance)).atan().to_degrees()
    };
    let of_screen = 2.0 * (pupils / (2.0 * screen.distance)).atan().to_degrees();
    for (depth, conflict) in [(comfort.near, 1.0), (comfort.far, -1.0)] {
        let found = vergence(depth) - of_screen;
        assert!((found - conflict).abs() < 1e-3, "{depth}: {found}");
    }
    let text = comfort.to_string();
    assert!(text.contains("0.6 m wide from 0.7 m") && text.contains("Lambooij"), "{text}");
    // Half of the screen has half of the parallax.
    let small = StereoScreen { width: 0.3, ..screen };
    let small = ComfortableDepth::of(&rig, &desc.camera, aspect(&desc), small).unwrap();
    assert!(small.near < comfort.near && small.far > comfort.far);
    // Parallel eyes put all in front of the screen; on a small one from afar everything from somewhere on is comfortable.
    let parallel = ComfortableDepth::of(&PARALLEL, &desc.camera, aspect(&desc), screen).unwrap();
    assert!(parallel.far == f64::INFINITY && parallel.to_string().contains("units on are"), "{parallel}");
    // In a cinema the eyes would diverge before they converge 1° farther: the limit is parallel lines of sight.
    let cinema = StereoScreen { width: 10.0, distance: 15.0 };
    let cinema = ComfortableDepth::of(&rig, &desc.camera, aspect(&desc), cinema).unwrap();
    let [left, right] = seen(&desc, &rig, DVec3::new(0.0, 0.0, cinema.far));
    assert!(((right.x - left.x) * 10.0 - pupils).abs() < 1e-4, "{cinema:?}");
}

/// The cameras of both eyes for the pictures of `desc`.
fn cameras(desc: &SceneDesc, rig: &StereoRig) -> [Camera; 2] {
    let eyes = rig.eyes(&desc.camera, aspect(desc)).unwrap();
    eyes.map(|eye| Camera::new(&eye, &desc.film, &PrepareOptions::from_film(&desc.film)).unwrap())
}

/// The layers `disparity` and `position` of what each eye sees at `uv`.
fn disparities(desc: &SceneDesc, rig: &StereoRig, uv: [f64; 2]) -> [[f32; 4]; 2] {
    let layers = parse("disparity,position").expect("a list of layers").layers;
    let (scene, [left, right]) = (prepare(desc), cameras(desc, rig));
    [&left, &right].map(|eye| {
        let mut values = [f32::NAN; 4];
        let tracer = AovTracer::new(&scene, eye, &layers).with_eyes([&left, &right], desc.film.width);
        tracer.along(&eye.ray(uv, [0.5; 2]).expect("a ray"), &mut values);
        values
    })
}

const PLACES: [[f64; 2]; 4] = [[0.5, 0.5], [0.1, 0.2], [0.95, 0.4], [0.3, 0.99]];

/// A picture of 640×400 pixels along z.
fn ahead() -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(1.0, 2.0, -3.0), DVec3::Z, 50.0);
    (desc.film.width, desc.film.height) = (640, 400);
    environment(&mut desc);
    desc
}

/// On a plane across the axis the layer is the closed formula: 0 at the distance of convergence, for both eyes and everywhere in the picture.
/// What is not there has the disparity of infinity.
#[test]
fn the_layer_of_a_plane_is_the_closed_formula() {
    for rig in [off_axis(0.2, 5.0), PARALLEL] {
        let formula = rig.disparity(&ahead().camera, 1.6, 640.0).unwrap();
        for depth in [1.5, 5.0, 40.0] {
            let mut desc = ahead();
            let matt = material(&mut desc, grey(0.5));
            let (size, at) = (DVec3::splat(4.0 * depth), DVec3::new(1.0, 2.0, depth - 3.0));
            let plane = DAffine3::from_scale_rotation_translation(size, DQuat::IDENTITY, at);
            shape(&mut desc, ShapeKind::Rectangle, plane, matt, 0.0);
            for uv in PLACES {
                for [found, ..] in disparities(&desc, &rig, uv) {
                    let expected = formula.at(depth);
                    assert!(
                        (f64::from(found) - expected).abs() < 1e-3,
                        "{rig:?} {depth}: {found}, {expected}"
                    );
                }
            }
        }
        for [found, ..] in disparities(&ahead(), &rig, [0.2, 0.7]) {
            let expected = formula.at(f64::INFINITY);
            assert!(
                (f64::from(found) - expected).abs() < 1e-3,
                "{rig:?}: {found} for {expected} at infinity"
            );
        }
    }
}

/// On a surface of any depth the layer leads from the place in one picture to that in the other.
#[test]
fn the_layer_leads_to_the_other_picture() {
    let mut desc = ahead();
    let matt = material(&mut desc, grey(0.5));
    // The camera is within the box and sees it everywhere.
    let place = DAffine3::from_scale_rotation_translation(
        DVec3::new(3.0, 2.0, 7.0),
        DQuat::from_rotation_y(0.4),
        DVec3::new(1.0, 2.0, -2.0),
    );
    shape(&mut desc, ShapeKind::Cube, place, matt, 0.0);
    let rig = off_axis(0.2, 5.0);
    let cameras = cameras(&desc, &rig);
    let mut different = Vec::new();
    for uv in PLACES {
        for (own, [disparity, x, y, z]) in [0, 1].into_iter().zip(disparities(&desc, &rig, uv)) {
            let other =
                cameras[1 - own].view(glam::Vec3::new(x, y, z), [0.5; 2], &OVERSCAN).expect("in front");
            // A point is farther right for the left eye by the disparity.
            let sign = if own == 0 { -1.0 } else { 1.0 };
            let led = uv[0] * 640.0 + sign * f64::from(disparity);
            assert!((led - f64::from(other.uv[0]) * 640.0).abs() < 2e-3, "{uv:?}, eye {own}: {led}");
            assert!((f64::from(other.uv[1]) - uv[1]).abs() < 1e-5, "at the same height");
            different.push(disparity);
        }
    }
    different.sort_by(f32::total_cmp);
    assert!(different[7] - different[0] > 2.0, "the scene has different depths: {different:?}");
}

/// Without a second eye there is no disparity.
#[test]
fn one_eye_has_no_disparity() {
    let layers = parse("disparity").expect("a list of layers").layers;
    let (desc, mut value) = (ahead(), [f32::NAN]);
    let (scene, camera) = (prepare(&desc), Camera::of(&desc).unwrap());
    AovTracer::new(&scene, &camera, &layers).along(&camera.ray([0.5; 2], [0.5; 2]).unwrap(), &mut value);
    assert_eq!(value, [0.0]);
}
