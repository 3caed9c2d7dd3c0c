//! Spheres of triangles, and boulders cut from them.

use std::collections::HashMap;

use glam::{Mat3, Quat, Vec3, vec3};

use super::Part;
use super::noise::{Random, direction, fractal};

/// The unit sphere as an icosahedron whose triangles were quartered `level` times: 20 · 4^level triangles.
pub fn icosphere(level: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let g = (1.0 + 5f32.sqrt()) / 2.0;
    let mut vertices: Vec<Vec3> = (0..12)
        .map(|i| {
            let (a, b) = (if i & 1 == 0 { 1.0 } else { -1.0 }, if i & 2 == 0 { g } else { -g });
            [vec3(0.0, a, b), vec3(a, b, 0.0), vec3(b, 0.0, a)][i / 4].normalize()
        })
        .collect();
    // Its faces are the triples of vertices that touch each other.
    let touch = |a: u32, b: u32| vertices[a as usize].distance(vertices[b as usize]) < 1.1;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if touch(a, b) && touch(b, c) && touch(c, a) {
                    let [p, q, r] = [a, b, c].map(|v| vertices[v as usize]);
                    let outward = (q - p).cross(r - p).dot(p) > 0.0;
                    faces.push(if outward { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    for _ in 0..level {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                vertices.push((vertices[a as usize] + vertices[b as usize]).normalize());
                vertices.len() as u32 - 1
            })
        };
        let mut finer = Vec::with_capacity(4 * faces.len());
        for [a, b, c] in faces {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = finer;
    }
    (vertices, faces)
}

/// Adds a boulder: a sphere cut by planes, weathered by noise, flattened and turned.
pub fn boulder(
    part: &mut Part,
    (vertices, faces): &(Vec<Vec3>, Vec<[u32; 3]>),
    at: Vec3,
    size: f32,
    random: &mut Random,
) {
    let planes: Vec<(Vec3, f32)> = (0..11).map(|_| (direction(random), random.within(0.55, 0.95))).collect();
    let place = direction(random) * 50.0;
    let axis = vec3(random.within(-0.35, 0.35), 1.0, random.within(-0.35, 0.35)).normalize();
    let turn = Mat3::from_quat(Quat::from_axis_angle(axis, random.within(0.0, std::f32::consts::TAU)));
    let stretch = vec3(random.within(0.85, 1.3), random.within(0.55, 0.95), random.within(0.75, 1.1));
    let shape = |d: &Vec3| {
        let cut = planes.iter().map(|(n, w)| w / d.dot(*n).max(1e-3)).fold(1.0, f32::min);
        let worn = cut * (1.0 + 0.14 * fractal(*d * 1.7 + place, 3) + 0.035 * fractal(*d * 9.0 + place, 5));
        at + turn * (*d * worn * stretch) * size
    };
    part.add(vertices.iter().map(shape), faces);
}
