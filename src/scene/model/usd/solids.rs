//! Solids of UsdGeom as polygons with smooth normals: sphere, cube, cylinder, cone, capsule, plane.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Vec2, Vec3};

use super::mesh::Polygons;
use super::prim::PrimReader;
use super::primvars::{Interpolation, Primvar};
use super::values::Tuples;

/// Faces around an axis, and from the pole of a ball to its equator.
const AROUND: usize = 96;
const TO_EQUATOR: usize = 24;

/// The types of prims that [`read`] knows.
pub(super) const KINDS: &[&str] =
    &["Sphere", "Cube", "Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1", "Plane"];

/// A point of an outline that is turned around the axis: its distance from it, its height, and its normal.
type OutlinePoint = (Vec2, Vec2);

/// A key that is the same for equal solids: their type and sizes.
pub(super) fn key(prim: &PrimReader) -> String {
    let sizes = ["size", "radius", "height", "width", "length", "axis", "radiusTop", "radiusBottom"];
    let values: Vec<String> = sizes.iter().map(|name| format!("{:?}", prim.value(name))).collect();
    format!("{} {}", prim.kind, values.join(" "))
}

/// The polygons of a solid.
pub(super) fn read(prim: &PrimReader) -> Polygons {
    let number = |name: &str, default: f64| prim.number(name).unwrap_or(default) as f32;
    if prim.word("orientation").is_some_and(|word| word == "leftHanded") {
        prim.fault("the orientation `leftHanded` of a solid is not used: its outside stays outside");
    }
    let axis = || prim.word("axis").unwrap_or_else(|| "Z".to_owned());
    match prim.kind.as_str() {
        "Cube" => cube(number("size", 2.0) * 0.5),
        "Plane" => {
            let half = [number("width", 2.0) * 0.5, number("length", 2.0) * 0.5];
            plane(half, &axis())
        }
        "Sphere" => turned(&[ball(number("radius", 1.0), 0.0)], "Z"),
        "Cone" => {
            let (height, radius) = (number("height", 2.0), number("radius", 1.0));
            turned(&tube([radius, 0.0], height), &axis())
        }
        "Cylinder" => {
            let (height, radius) = (number("height", 2.0), number("radius", 1.0));
            turned(&tube([radius; 2], height), &axis())
        }
        "Cylinder_1" => {
            let height = number("height", 2.0);
            turned(&tube([number("radiusBottom", 1.0), number("radiusTop", 1.0)], height), &axis())
        }
        // A capsule; one with two radii has the larger for both.
        _ => {
            let radius = match prim.kind.as_str() {
                "Capsule" => number("radius", 0.5),
                _ => {
                    let (bottom, top) = (number("radiusBottom", 0.5), number("radiusTop", 0.5));
                    if bottom != top {
                        prim.fault("a capsule with two radii has the larger at both ends");
                    }
                    bottom.max(top)
                }
            };
            turned(&[ball(radius, 0.5 * number("height", 1.0))], &axis())
        }
    }
}

/// The outline of a ball that is cut at its equator and drawn apart by `half` to each side.
fn ball(radius: f32, half: f32) -> Vec<OutlinePoint> {
    let at = |angle: f32, lift: f32| {
        // The poles are points, not small circles.
        let normal =
            if angle.abs() == FRAC_PI_2 { Vec2::new(0.0, angle.signum()) } else { Vec2::from_angle(angle) };
        (radius * normal + Vec2::new(0.0, lift), normal)
    };
    let below = (0..=TO_EQUATOR).map(|i| at(-FRAC_PI_2 + FRAC_PI_2 * i as f32 / TO_EQUATOR as f32, -half));
    let above = (0..=TO_EQUATOR).map(|i| at(FRAC_PI_2 * i as f32 / TO_EQUATOR as f32, half));
    below.chain(above.skip(usize::from(half == 0.0))).collect()
}

/// The outlines of a tube with radii at its bottom and its top, and of its caps.
fn tube([bottom, top]: [f32; 2], height: f32) -> Vec<Vec<OutlinePoint>> {
    let half = 0.5 * height;
    let slope = Vec2::new(height, bottom - top).normalize_or(Vec2::X);
    let mut all = vec![
        vec![(Vec2::new(0.0, -half), Vec2::NEG_Y), (Vec2::new(bottom, -half), Vec2::NEG_Y)],
        vec![(Vec2::new(bottom, -half), slope), (Vec2::new(top, half), slope)],
    ];
    if top != 0.0 {
        all.push(vec![(Vec2::new(top, half), Vec2::Y), (Vec2::new(0.0, half), Vec2::Y)]);
    }
    all
}

/// Turns outlines around an axis.
fn turned(outlines: &[Vec<OutlinePoint>], axis: &str) -> Polygons {
    let mut mesh = Polygons::default();
    let mut normals = Vec::new();
    // x and y turn around z; the other axes follow in their cyclic order.
    let lay = |v: Vec3| match axis {
        "X" => Vec3::new(v.z, v.x, v.y),
        "Y" => Vec3::new(v.y, v.z, v.x),
        _ => v,
    };
    for outline in outlines {
        let first = mesh.points.len() as u32;
        for (point, normal) in outline {
            for i in 0..AROUND {
                let (sin, cos) = (TAU * i as f32 / AROUND as f32).sin_cos();
                mesh.points.push(lay(Vec3::new(point.x * cos, point.x * sin, point.y)));
                normals.extend(lay(Vec3::new(normal.x * cos, normal.x * sin, normal.y)).to_array());
            }
        }
        let around = AROUND as u32;
        for row in 0..outline.len().saturating_sub(1) as u32 {
            for i in 0..around {
                let at = |row: u32, i: u32| first + row * around + i % around;
                mesh.counts.push(4);
                mesh.corners.extend([at(row, i), at(row, i + 1), at(row + 1, i + 1), at(row + 1, i)]);
            }
        }
    }
    mesh.normals = Some(Primvar::of(Tuples::new(3, normals), Interpolation::Vertex));
    mesh
}

fn cube(half: f32) -> Polygons {
    let points = (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0);
    let corners = [0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5];
    Polygons {
        points: points.map(|p| p * half).collect(),
        counts: vec![4; 6],
        corners: corners.to_vec(),
        flat: true,
        ..Polygons::default()
    }
}

/// A plane with its front to the axis: width along x and length along y for z, length along z for x, width along x and length along
/// z for y.
fn plane([width, length]: [f32; 2], axis: &str) -> Polygons {
    let lay = |x: f32, y: f32| match axis {
        "X" => Vec3::new(0.0, y * length, -x * width),
        "Y" => Vec3::new(x * width, 0.0, -y * length),
        _ => Vec3::new(x * width, y * length, 0.0),
    };
    Polygons {
        points: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| lay(x, y)).to_vec(),
        counts: vec![4],
        corners: vec![0, 1, 2, 3],
        flat: true,
        ..Polygons::default()
    }
}
