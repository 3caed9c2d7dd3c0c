//! Closed meshes, and the naive test that they are too hard for.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use pointillist::tracer::accel::Ray;

/// Cells along an edge of the cube that every closed mesh is a map of: 27,648 triangles.
const CELLS: i32 = 48;

/// A closed surface whose inside holds the ellipsoid `center + inside · unit ball`.
pub struct Closed {
    pub name: &'static str,
    /// From the surface of the cube [-1, 1]³.
    pub map: fn(DVec3) -> DVec3,
    pub center: DVec3,
    pub inside: DVec3,
}

fn bumpy(p: DVec3) -> DVec3 {
    let n = p.normalize();
    n * (1.0 + 0.08 * (9.0 * n.x).sin() * (7.0 * n.y).cos() * (8.0 * n.z + 1.0).sin())
}

const fn closed(name: &'static str, map: fn(DVec3) -> DVec3, center: [f64; 3], inside: [f64; 3]) -> Closed {
    Closed { name, map, center: DVec3::from_array(center), inside: DVec3::from_array(inside) }
}

/// The closed meshes that rays must not leave.
pub const CLOSED: [Closed; 7] = [
    closed("bumpy sphere", bumpy, [0.0; 3], [0.6; 3]),
    closed("bumpy sphere far out", bumpy, [1234.0, -777.0, 3000.0], [0.6; 3]),
    closed("tiny bumpy sphere", |p| bumpy(p) * 1e-3, [0.0; 3], [0.6e-3; 3]),
    closed("huge bumpy sphere", |p| bumpy(p) * 1e3, [0.0; 3], [600.0; 3]),
    closed("cube", |p| p, [0.0; 3], [0.95; 3]),
    closed("cube off the centre", |p| p, [17.3, -4.1, 0.77], [0.95; 3]),
    closed("ellipsoid", |p| p.normalize() * DVec3::new(1.0, 1e-3, 100.0), [0.0; 3], [0.9, 0.9e-3, 90.0]),
];

impl Closed {
    /// The triangles, two per cell, `abc` and `acd`. A vertex is the same bits in all of them.
    pub fn triangles(&self) -> Vec<[Vec3; 3]> {
        let at = |axis: usize, side: i32, i: i32, j: i32| {
            let mut p = DVec3::ZERO;
            let place = |k: i32| f64::from(2 * k - CELLS) / f64::from(CELLS);
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (f64::from(side), place(i), place(j));
            ((self.map)(p) + self.center).as_vec3()
        };
        let mut mesh = Vec::new();
        for (axis, side) in [(0, -1), (0, 1), (1, -1), (1, 1), (2, -1), (2, 1)] {
            for (i, j) in (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| (i, j))) {
                let corner = |x: i32, y: i32| at(axis, side, i + x, j + y);
                let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                mesh.extend([[a, b, c], [a, c, d]]);
            }
        }
        mesh
    }
}

/// A subdivided icosahedron of unit radius.
pub fn icosphere(levels: u32) -> (Vec<DVec3>, Vec<[usize; 3]>) {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut points: Vec<DVec3> = Vec::new();
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        points.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    points.iter_mut().for_each(|p| *p = p.normalize());
    // The faces are the triples at the shortest distance from each other.
    let near = |a: DVec3, b: DVec3| a.distance(b) < 1.1;
    let mut faces = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let (a, b, c) = (points[i], points[j], points[k]);
                if near(a, b) && near(b, c) && near(a, c) {
                    faces.push(if (b - a).cross(c - a).dot(a) > 0.0 { [i, j, k] } else { [i, k, j] });
                }
            }
        }
    }
    assert_eq!(faces.len(), 20);
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut next = Vec::new();
        for [a, b, c] in faces {
            let mut middle = |i: usize, j: usize| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    points.push((points[i] + points[j]).normalize());
                    points.len() - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            next.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = next;
    }
    (points, faces)
}

/// The naive test (Möller and Trumbore 1997).
pub fn moeller_trumbore(ray: &Ray, [a, b, c]: [Vec3; 3]) -> bool {
    let (e1, e2) = (b - a, c - a);
    let p = ray.direction.cross(e2);
    let inverse = 1.0 / e1.dot(p);
    let s = ray.origin - a;
    let u = s.dot(p) * inverse;
    let q = s.cross(e1);
    let v = ray.direction.dot(q) * inverse;
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && e2.dot(q) * inverse > 0.0
}
