//! Lights that touch each other: back to back, tessellated, meeting in edges. None may shadow its neighbour.

use std::sync::Arc;

use std::f64::consts::PI;

use glam::{DAffine3, DVec3, Vec3};

use crate::support::scenes::*;
use pointillist::scene::desc::*;

/// A floor of albedo 0.6 at z = 1, looked at from close by: one point, at the origin of x and y.
fn floor() -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.02, 0.0, 0.999), DVec3::new(-0.02, 0.0, 0.001), 1e-3);
    let m = material(&mut desc, grey(0.6));
    let turn = DAffine3::from_translation(DVec3::Z) * DAffine3::from_rotation_x(PI);
    shape(&mut desc, ShapeKind::Rectangle, turn * DAffine3::from_scale(DVec3::splat(30.0)), m, 0.0);
    desc.integrator.max_depth = Some(2);
    desc
}

/// A rectangle of n × n cells in place of [`ShapeKind::Rectangle`], two triangles each.
fn tessellated(n: u32) -> Mesh {
    let corner = |i: u32| i as f32 / n as f32 * 2.0 - 1.0;
    let positions =
        (0..=n).flat_map(|y| (0..=n).map(move |x| Vec3::new(corner(x), corner(y), 0.0))).collect();
    let row = n + 1;
    let cell = |x: u32, y: u32| {
        let a = y * row + x;
        [[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]
    };
    let triangles = (0..n).flat_map(|y| (0..n).flat_map(move |x| cell(x, y))).collect();
    Mesh { positions, triangles, ..Mesh::default() }
}

/// Mean luminance and standard error with one light under `to_world`.
fn lit_by(n: Option<u32>, to_world: DAffine3) -> (f64, f64) {
    let mut desc = floor();
    let m = material(&mut desc, grey(0.0));
    let kind = match n {
        Some(n) => {
            desc.meshes.push(Arc::new(tessellated(n)));
            ShapeKind::Mesh(MeshId(0))
        }
        None => ShapeKind::Rectangle,
    };
    shape(&mut desc, kind, to_world, m, 1.0);
    mean(&desc, 1 << 17)
}

/// A light of 2 triangles and one of 200 give the same: neighbours that share an edge do not shadow each other, also
/// where the light is met at a grazing angle or lies far from the origin.
#[test]
fn a_tessellated_light_is_as_bright_as_a_whole_one() {
    let up = |x: f64, z: f64| DAffine3::from_translation(DVec3::new(x, 0.0, z));
    for (what, to_world) in [
        ("above", up(0.0, 0.0)),
        ("grazing", up(8.0, 0.9) * DAffine3::from_scale(DVec3::new(7.0, 3.0, 1.0))),
        ("inclined", up(1.5, 0.2) * DAffine3::from_rotation_y(-1.1)),
        ("next to it", up(0.0, 0.999) * DAffine3::from_scale(DVec3::splat(0.02))),
    ] {
        let (whole, whole_error) = lit_by(None, to_world);
        assert!(whole > 1e-4, "{what}: the case is dark");
        for n in [1, 10] {
            let (parts, error) = lit_by(Some(n), to_world);
            let z = (parts - whole) / (error * error + whole_error * whole_error).sqrt();
            assert!(z.abs() < 4.0, "{what}, {} triangles: {parts} instead of {whole}, z = {z:.1}", 2 * n * n);
        }
    }
}

/// How Mitsuba's scenes say "emits on both sides": two shapes in the same place, one with `flip_normals`. From either
/// side the light is what the shape on that side gives alone: the back never hides or shadows the front.
#[test]
fn coincident_shapes_back_to_back_emit_on_both_sides() {
    let ball = sphere(DVec3::ZERO, 0.7);
    for kind in [ShapeKind::Rectangle, ShapeKind::Disk, ShapeKind::Mesh(MeshId(0)), ball] {
        for (i, turn) in [0.0, 0.3, 1.2, 1.5].into_iter().enumerate() {
            let build = |sides: &[bool]| {
                let mut desc = floor();
                desc.meshes.push(Arc::new(tessellated(3)));
                let m = material(&mut desc, grey(0.0));
                let at = DAffine3::from_translation(DVec3::new(0.4 * i as f64, 0.1, -0.3))
                    * DAffine3::from_rotation_y(-turn);
                for &flip in sides {
                    shape(&mut desc, kind.clone(), at, m, 1.0);
                    desc.shapes.last_mut().expect("just added").flip_normals = flip;
                }
                desc
            };
            let front = mean(&build(&[false]), 1 << 16);
            for sides in [[false, true], [true, false]] {
                let both = mean(&build(&sides), 1 << 16);
                // Half of the samples choose the side that faces away: more noise, the same mean.
                let z = (both.0 - front.0) / both.1.hypot(front.1);
                assert!(z.abs() < 4.0, "{kind:?} turned {turn}: {both:?} instead of {front:?}");
            }
        }
    }
}

/// `twosided` is about scattering: around the material of a light it makes the dark side reflect, not emit.
#[test]
fn a_two_sided_material_does_not_emit_from_the_back() {
    for flip in [false, true] {
        let mut desc = empty();
        let white = material(&mut desc, grey(0.5));
        let both = material(&mut desc, BsdfDesc::TwoSided(TwoSidedDesc { front: white, back: white }));
        // The camera looks along +z, at the back of a rectangle whose normal is +z.
        shape(&mut desc, ShapeKind::Rectangle, DAffine3::from_translation(DVec3::Z), both, 3.0);
        desc.shapes[0].flip_normals = flip;
        environment(&mut desc);
        // Reflection of the environment of radiance 1, and the emission only from the front.
        assert_mean(&desc, if flip { 3.5 } else { 0.5 }, 1e-2, &format!("front seen: {flip}"));
    }
}

/// Back to back with different emission and material: each side shows its own, in whatever order they come.
#[test]
fn each_side_shows_its_own() {
    for kind in [ShapeKind::Rectangle, ShapeKind::Disk, ShapeKind::Cube] {
        for order in [[false, true], [true, false]] {
            let mut desc = empty();
            let black = material(&mut desc, grey(0.0));
            let at = DAffine3::from_translation(DVec3::Z * 3.0);
            for flip in order {
                shape(&mut desc, kind.clone(), at, black, if flip { 5.0 } else { 2.0 });
                desc.shapes.last_mut().expect("just added").flip_normals = flip;
            }
            // A cube's outside is seen, of the others the side of the flipped normal.
            let expected = if matches!(kind, ShapeKind::Cube) { 2.0 } else { 5.0 };
            assert_mean(&desc, expected, 1e-2, &format!("{kind:?} {order:?}"));
        }
    }
}
