//! The ground: a valley between hills, with mountains at its end.

use glam::{Vec3, vec3};

use super::Part;
use super::noise::{fractal, noise, ridges, step};

/// Half the side of the ground, metres.
const HALF: f32 = 90.0;

/// Squares along a side.
const SQUARES: u32 = 580;

/// Middle of the levelled place the temple stands on, and its height.
pub const TEMPLE: Vec3 = vec3(-3.5, 3.4, 2.0);

/// Distance from the path through the valley, to its left negative, metres.
pub fn off_path(x: f32, z: f32) -> f32 {
    x - 5.0 - 7.0 * ((z - 6.0) / 23.0).sin()
}

/// Height of the ground, metres.
pub fn height(x: f32, z: f32) -> f32 {
    let p = vec3(x, 0.0, z);
    let warp = 7.0 * noise(p / 31.0 + vec3(3.3, 0.4, 8.1));
    let beside = step(9.0, 78.0, (off_path(x, z) + warp).abs());
    let behind = step(5.0, 88.0, -z + warp);
    // Lower again before the ground ends, so that no mountain is cut.
    let edge = step(HALF - 2.0, HALF - 26.0, x.abs().max(z.abs()));
    let hills = (0.75 * beside + 0.9 * behind).min(1.25) * edge;
    let mountains = hills * (5.0 + 21.0 * ridges(p / 46.0 + vec3(0.3, 0.7, 0.2), 9));
    let rolling = 1.3 * fractal(p / 19.0 + vec3(0.0, 2.5, 0.0), 4);
    let rough = (0.18 + 0.5 * hills) * fractal(p / 2.6, 6);
    let path = 0.35 * step(2.2, 0.6, off_path(x, z).abs());
    let wild = mountains + rolling + 0.45 * rough - path;
    let knoll = TEMPLE.y * step(26.0, 8.0, p.distance(vec3(TEMPLE.x, 0.0, TEMPLE.z)));
    let level = step(10.5, 7.0, p.distance(vec3(TEMPLE.x, 0.0, TEMPLE.z)));
    (wild * (1.0 - 0.6 * knoll / TEMPLE.y) + knoll) * (1.0 - level) + (TEMPLE.y + 0.02 * rough) * level
}

/// The point of the ground at `x`, `z`, and its normal over half a metre.
pub fn ground(x: f32, z: f32) -> (Vec3, Vec3) {
    let e = 0.25;
    let n = vec3(height(x - e, z) - height(x + e, z), 2.0 * e, height(x, z - e) - height(x, z + e));
    (vec3(x, height(x, z), z), n.normalize())
}

/// Soil, grass and rock, by slope and chance: 672,800 triangles, small in the middle, large far out.
pub fn terrain() -> [Part; 3] {
    let spread = |i: u32| {
        let u = 2.0 * i as f32 / SQUARES as f32 - 1.0;
        HALF * (0.4 + 0.6 * u * u) * u
    };
    let side = SQUARES + 1;
    let vertices: Vec<Vec3> = (0..side * side)
        .map(|i| {
            let (x, z) = (spread(i % side), spread(i / side));
            vec3(x, height(x, z), z)
        })
        .collect();
    let mut parts = [
        (Part::new("soil", [0.34, 0.25, 0.16], true), vec![u32::MAX; vertices.len()]),
        (Part::new("meadow", [0.19, 0.21, 0.075], true), vec![u32::MAX; vertices.len()]),
        (Part::new("cliff", [0.25, 0.22, 0.20], true), vec![u32::MAX; vertices.len()]),
    ];
    for square in 0..SQUARES * SQUARES {
        let a = square / SQUARES * side + square % SQUARES;
        let [a, b, c, d] = [a, a + side, a + side + 1, a + 1];
        // The shorter diagonal follows ridges better.
        let at = |v: u32| vertices[v as usize];
        let split = (at(a).y - at(c).y).abs() <= (at(b).y - at(d).y).abs();
        for face in if split { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] } {
            let (part, new) = &mut parts[kind(face.map(at))];
            let face = face.map(|v| {
                let n = &mut new[v as usize];
                if *n == u32::MAX {
                    *n = part.vertices.len() as u32;
                    part.vertices.push(at(v));
                }
                *n
            });
            part.faces.push(face);
        }
    }
    parts.map(|p| p.0)
}

/// Which part a face of the ground belongs to.
fn kind([a, b, c]: [Vec3; 3]) -> usize {
    let up = (b - a).cross(c - a).normalize().y;
    let middle = (a + b + c) / 3.0;
    let chance = fractal(middle / 3.1, 4);
    let walked = off_path(middle.x, middle.z).abs() + 0.7 * chance;
    let bare = fractal(middle / 9.0 + vec3(4.0, 1.0, 2.0), 4);
    let temple = middle.distance(TEMPLE) + 2.0 * chance;
    match () {
        _ if up < 0.78 + 0.1 * chance || middle.y > 27.0 + 6.0 * chance => 2,
        _ if walked < 1.4 || bare > 0.42 || temple < 8.2 => 0,
        _ => 1,
    }
}
