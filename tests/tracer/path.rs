//! Path tracing against closed forms: furnaces, direct light, depth, extremes.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3};

use crate::support::scenes::*;
use pointillist::scene::desc::*;
use pointillist::spectrum::{Spectrum, dispersion::Ior};

/// A convex body in a uniform environment reflects its albedo, wherever the camera looks at it.
#[test]
fn white_furnace() {
    for albedo in [0.0f32, 0.18, 0.5, 1.0] {
        let mut desc = empty();
        desc.camera.perspective_mut().unwrap().fov = 10.0;
        let m = material(&mut desc, grey(albedo));
        shape(&mut desc, sphere(DVec3::new(0.0, 0.0, 3.0), 1.0), DAffine3::IDENTITY, m, 0.0);
        environment(&mut desc);
        if albedo == 0.0 {
            assert!(luminances(&desc, 4096).iter().all(|&y| y == 0.0));
        } else {
            assert_mean(&desc, f64::from(albedo), 2e-3, "furnace");
        }
    }
}

/// Inside a closed sphere that emits L and reflects a, radiance is L (1 + a + a² + …), cut by the depth.
#[test]
fn closed_sphere() {
    for albedo in [0.5f32, 0.8] {
        let a = f64::from(albedo);
        for (max_depth, expected) in [
            (None, 1.0 / (1.0 - a)),
            (Some(1), 1.0),
            (Some(2), 1.0 + a),
            (Some(4), 1.0 + a + a * a + a * a * a),
        ] {
            let mut desc = empty();
            let m = material(&mut desc, grey(albedo));
            shape(&mut desc, sphere(DVec3::new(0.2, -0.3, 0.1), 2.0), DAffine3::IDENTITY, m, 1.0);
            desc.shapes[0].flip_normals = true;
            desc.integrator.max_depth = max_depth;
            desc.integrator.rr_depth = 3;
            assert_mean(&desc, expected, 1e-2, &format!("albedo {a}, depth {max_depth:?}"));
        }
    }
}

/// The same with a cube of triangles, seen from within: light sampling on triangles, pair by pair.
#[test]
fn closed_cube() {
    let mut desc = empty();
    let m = material(&mut desc, grey(0.5));
    shape(&mut desc, ShapeKind::Cube, DAffine3::from_scale(DVec3::new(1.0, 2.0, 3.0)), m, 1.0);
    desc.shapes[0].flip_normals = true;
    assert_mean(&desc, 2.0, 2e-2, "cube");
}

/// A floor of albedo a at z = 1, looked at from above, 1e-3 degrees wide: one point.
fn floor(albedo: f32) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.5, 0.25, 0.5), DVec3::new(-0.5, -0.25, 0.5), 1e-3);
    let m = material(&mut desc, grey(albedo));
    // The rectangle's front is +z; turned about x it looks down the −z axis, towards the camera.
    let turn = DAffine3::from_translation(DVec3::Z) * DAffine3::from_rotation_x(PI);
    shape(&mut desc, ShapeKind::Rectangle, turn * DAffine3::from_scale(DVec3::splat(10.0)), m, 0.0);
    desc.integrator.max_depth = Some(2);
    desc
}

/// Irradiance E at the looked-at point becomes radiance a E / π.
fn assert_irradiance(desc: &SceneDesc, expected: f64, what: &str) {
    assert_mean(desc, 0.6 * expected / PI, 1e-2, what);
}

#[test]
fn direct_light_of_a_disk() {
    for (radius, height) in [(0.5, 1.0), (2.0, 0.4), (0.01, 1.0), (3.0, 0.9)] {
        let mut desc = floor(0.6);
        let m = material(&mut desc, grey(0.0));
        let at = DAffine3::from_translation(DVec3::Z * (1.0 - height))
            * DAffine3::from_scale(DVec3::splat(radius));
        shape(&mut desc, ShapeKind::Disk, at, m, 1.0);
        let e = PI * radius * radius / (radius * radius + height * height);
        // The camera must not look through the lamp: it stands at height 0.5.
        if height < 0.5 {
            desc.camera = look(DVec3::new(0.0, 0.0, 0.9), DVec3::Z, 1e-3);
        }
        assert_irradiance(&desc, e, &format!("disk {radius} at {height}"));
    }
}

#[test]
fn direct_light_of_a_rectangle() {
    for (x, y, h) in [(0.4, 0.3, 1.0), (2.0, 1.0, 0.3), (5.0, 0.01, 1.0)] {
        let mut desc = floor(0.6);
        desc.camera = look(DVec3::new(0.0, 0.0, 0.9), DVec3::Z, 1e-3);
        let m = material(&mut desc, grey(0.0));
        let at =
            DAffine3::from_translation(DVec3::Z * (1.0 - h)) * DAffine3::from_scale(DVec3::new(x, y, 1.0));
        shape(&mut desc, ShapeKind::Rectangle, at, m, 1.0);
        // Four times a parallel rectangle above its corner (Howell's catalogue, B-3).
        let (a, b) = (x / h, y / h);
        let term = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
        assert_irradiance(&desc, 2.0 * (term(a, b) + term(b, a)), &format!("rectangle {x} × {y} at {h}"));
    }
}

#[test]
fn direct_light_of_a_sphere() {
    for (radius, distance) in [(0.3, 1.0), (1e-3, 1.0), (0.5, 0.51), (50.0, 100.0)] {
        let mut desc = floor(0.6);
        desc.camera = look(DVec3::new(0.02, 0.0, 0.999), DVec3::new(-0.02, 0.0, 0.001), 1e-3);
        let m = material(&mut desc, grey(0.0));
        shape(&mut desc, sphere(DVec3::Z * (1.0 - distance), radius), DAffine3::IDENTITY, m, 1.0);
        let e = PI * (radius / distance).powi(2);
        assert_irradiance(&desc, e, &format!("sphere {radius} at {distance}"));
    }
}

#[test]
fn direct_light_of_a_point() {
    let mut desc = floor(0.6);
    let position = DVec3::new(1.0, 0.0, 0.0);
    desc.lights.push(LightDesc::Point {
        position,
        intensity: Spectrum::Constant(3.0),
        place: Place::default(),
    });
    // The looked-at point is (0, 0, 1): distance √2, cosine 1/√2.
    assert_irradiance(&desc, 3.0 / 2.0 / 2f64.sqrt(), "point");
}

/// Many lights of very different power: the choice among them must not change the sum.
#[test]
fn several_lights_add_up() {
    let mut desc = floor(0.6);
    let m = material(&mut desc, grey(0.0));
    let mut expected = 0.0;
    for (i, power) in [1.0f32, 0.01, 30.0, 0.0].into_iter().enumerate() {
        let center = DVec3::new(i as f64 - 1.5, 1.0, 0.0);
        shape(&mut desc, sphere(center, 0.1), DAffine3::IDENTITY, m, power);
        let d = DVec3::Z - center;
        expected += PI * f64::from(power) * 0.01 / d.length_squared() * (1.0 / d.length());
    }
    let position = DVec3::new(-1.0, 0.0, 0.0);
    desc.lights.push(LightDesc::Point {
        position,
        intensity: Spectrum::Constant(0.2),
        place: Place::default(),
    });
    expected += 0.2 / 2.0 / 2f64.sqrt();
    assert_irradiance(&desc, expected, "five lights");
}

/// One-sided lights and materials are black from behind, two-sided materials are not.
#[test]
fn sides() {
    let mut desc = floor(0.6);
    environment(&mut desc);
    desc.shapes[0].flip_normals = true;
    assert!(luminances(&desc, 1024).iter().all(|&y| y == 0.0), "the back of a diffuse surface is black");
    let black = material(&mut desc, grey(0.0));
    desc.shapes[0].bsdf =
        material(&mut desc, BsdfDesc::TwoSided(TwoSidedDesc { front: black, back: BsdfId(0) }));
    assert_mean(&desc, 0.6, 1e-2, "two-sided back");

    for flip in [false, true] {
        let mut desc = empty();
        let m = material(&mut desc, grey(0.0));
        let at = DAffine3::from_translation(DVec3::Z) * DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        for kind in [ShapeKind::Disk, ShapeKind::Rectangle] {
            desc.shapes.clear();
            shape(&mut desc, kind, at, m, 1.0);
            desc.shapes[0].flip_normals = flip;
            // +z stays the front under a mirroring transform; the camera sees the back.
            let seen = luminances(&desc, 64).iter().any(|&y| y > 0.0);
            assert_eq!(seen, flip);
        }
    }
}

/// R + T = 1: glass in a uniform environment cannot be seen, with and without dispersion.
#[test]
fn glass_furnace() {
    let bk7 = Ior::named("bk7").expect("a named glass");
    assert!(bk7.is_dispersive(), "the case is too easy");
    for ior in [Ior::Constant(1.5), Ior::Constant(2.4), Ior::Constant(0.7), Ior::Constant(1.0), bk7] {
        let mut desc = empty();
        desc.camera.perspective_mut().unwrap().fov = 30.0;
        let m = material(&mut desc, glass(ior.clone()));
        shape(&mut desc, sphere(DVec3::Z * 3.0, 1.0), DAffine3::IDENTITY, m, 0.0);
        environment(&mut desc);
        assert_mean(&desc, 1.0, 1e-2, &format!("{ior:?}"));
    }
}

/// Roulette begins at vertex 1024 at the latest: in a closed white room nothing else ends a path, and this test.
#[test]
fn a_closed_white_room_ends_whatever_the_roulette_depth() {
    let mut desc = empty();
    let white = material(&mut desc, grey(1.0));
    let white = material(&mut desc, BsdfDesc::TwoSided(TwoSidedDesc { front: white, back: white }));
    shape(&mut desc, ShapeKind::Cube, DAffine3::from_scale(DVec3::splat(4.0)), white, 0.0);
    shape(&mut desc, sphere(DVec3::Z * 2.0, 0.5), DAffine3::IDENTITY, white, 1.0);
    desc.integrator.rr_depth = u32::MAX;
    let values = luminances(&desc, 64);
    assert!(values.iter().any(|&y| y > 0.0) && values.iter().all(|y| y.is_finite()));
}

/// An interface between equal media changes nothing, to the bit.
#[test]
fn equal_media_are_invisible() {
    let mut desc = empty();
    desc.camera.perspective_mut().unwrap().fov = 40.0;
    let black = material(&mut desc, grey(0.0));
    let lamp = DAffine3::from_translation(DVec3::Z * 5.0) * DAffine3::from_rotation_x(PI);
    shape(&mut desc, ShapeKind::Rectangle, lamp, black, 1.0);
    desc.integrator.rr_depth = 100;
    let without = luminances(&desc, 4096);
    let m = material(&mut desc, glass(Ior::Constant(1.0)));
    shape(&mut desc, sphere(DVec3::Z * 2.0, 1.0), DAffine3::IDENTITY, m, 0.0);
    assert!(without.iter().any(|&y| y > 0.0) && without.contains(&0.0), "the case is too easy");
    let with = luminances(&desc, 4096);
    let differing = with.iter().zip(&without).filter(|(a, b)| (*a - *b).abs() > 1e-6).count();
    // Directions are the same but for rounding in the frame: only the very edge of the lamp may move.
    assert!(differing <= 2, "{differing} of 4096 paths differ");
}

/// An empty scene, a scene without lights, a camera inside a surface, and a mirror maze without light.
#[test]
fn extremes_give_black_not_panic() {
    let black = |desc: &SceneDesc| luminances(desc, 1024).iter().all(|&y| y == 0.0);
    let mut desc = empty();
    assert!(black(&desc));
    assert!(prepare(&desc).notices().is_empty());

    let mut unusable = empty();
    let m = material(&mut unusable, grey(0.9));
    shape(&mut unusable, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::splat(1e20)), m, 1.0);
    assert!(black(&unusable));
    let notices = prepare(&unusable).notices().join("; ");
    assert!(notices.contains("were dropped") && notices.contains("no light of the scene"), "{notices}");

    let m = material(&mut desc, grey(0.9));
    shape(&mut desc, ShapeKind::Rectangle, DAffine3::IDENTITY, m, 0.0);
    shape(&mut desc, ShapeKind::Rectangle, DAffine3::IDENTITY, m, 0.0);
    assert!(black(&desc), "a camera inside coincident faces");

    let none = || Spectrum::Constant(0.0);
    let one = || Spectrum::Constant(1.0);
    let mirror = material(
        &mut desc,
        BsdfDesc::Conductor(ConductorDesc { eta: none(), k: one(), specular_reflectance: one().into() }),
    );
    shape(&mut desc, ShapeKind::Cube, DAffine3::IDENTITY, mirror, 0.0);
    desc.shapes[2].flip_normals = true;
    assert!(black(&desc), "a mirror box must not hold a path for ever");

    desc.lights.push(LightDesc::Point { position: DVec3::ZERO, intensity: one(), place: Place::default() });
    assert!(luminances(&desc, 1024).iter().all(|y| y.is_finite()), "a light in the camera, on a surface");
}

/// A light that touches a wall, and an albedo above 1: finite, and the depth bounds it.
#[test]
fn touching_light_and_too_white_walls_stay_finite() {
    let mut desc = floor(1.5);
    desc.integrator.max_depth = Some(50);
    let m = material(&mut desc, grey(1.5));
    let touching = DAffine3::from_translation(DVec3::new(0.0, 0.0, 1.0)) * DAffine3::from_rotation_y(1.57);
    shape(&mut desc, ShapeKind::Rectangle, touching, m, 1.0);
    let luminances = luminances(&desc, 10_000);
    assert!(luminances.iter().all(|y| y.is_finite() && *y >= 0.0));
    assert!(
        luminances.iter().filter(|y| **y > 0.0).count() > 1000,
        "the light is seen, and lights the floor"
    );
}

/// Lights disappear for the camera, not for what they light.
#[test]
fn hidden_lights() {
    let mut desc = empty();
    let m = material(&mut desc, grey(0.5));
    let facing = |z: f64| DAffine3::from_translation(DVec3::Z * z) * DAffine3::from_rotation_x(PI);
    shape(&mut desc, ShapeKind::Rectangle, facing(4.0), m, 0.0);
    environment(&mut desc);
    let lit = mean(&desc, 4096).0;
    shape(&mut desc, ShapeKind::Disk, facing(2.0), m, 7.0);
    assert!((mean(&desc, 4096).0 / 7.0 - 1.0).abs() < 0.6, "seen");
    desc.integrator.hide_emitters = true;
    let hidden = mean(&desc, 65_536).0;
    // The lamp radiates towards the camera; to the wall it is only an obstacle.
    assert!(hidden > 0.0 && hidden < lit, "{hidden} against {lit}");
}

/// Scale invariance: a scene 2 or 2^-20 times as large gives the same picture, to the bit.
#[test]
fn scale_by_a_power_of_two_changes_nothing() {
    let build = |scale: f64| {
        let s = DAffine3::from_scale(DVec3::splat(scale));
        let mut desc = empty();
        desc.camera = look(DVec3::new(0.3, -0.2, -3.0) * scale, DVec3::new(0.0, 0.1, 1.0), 50.0);
        (desc.camera.near_clip, desc.camera.far_clip) = (0.1 * scale, 100.0 * scale);
        let white = material(&mut desc, grey(0.7));
        let clear = material(&mut desc, glass(Ior::Constant(1.5)));
        shape(&mut desc, ShapeKind::Cube, s * DAffine3::from_scale(DVec3::splat(4.0)), white, 0.0);
        desc.shapes[0].flip_normals = true;
        shape(&mut desc, sphere(DVec3::new(0.5, 0.0, 0.3), 0.7), s, clear, 0.0);
        let lamp = DAffine3::from_translation(DVec3::Y * 3.0) * DAffine3::from_rotation_x(PI / 2.0);
        shape(&mut desc, ShapeKind::Rectangle, s * lamp, white, 5.0);
        shape(
            &mut desc,
            ShapeKind::Disk,
            s * DAffine3::from_translation(DVec3::new(-1.0, 0.0, 1.0)),
            white,
            2.0,
        );
        luminances(&desc, 4096)
    };
    let one = build(1.0);
    for k in [-20, -3, 1, 20] {
        assert!(build(2f64.powi(k)) == one, "2^{k}");
    }
}
