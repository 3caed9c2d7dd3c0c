//! A round temple in ruins: steps, fluted columns, some of them broken, and what is left of the ring on top.

use std::f32::consts::TAU;

use glam::{Mat3, Vec3, vec3};

use super::Part;
use super::noise::Random;

/// Columns around the ring.
const COLUMNS: u32 = 12;

/// Radius of the ring of columns and height of a whole one, metres.
const RING: f32 = 4.6;
const COLUMN: f32 = 5.6;

fn around(angle: f32) -> Vec3 {
    vec3(angle.cos(), 0.0, angle.sin())
}

/// Adds a prism with fluted sides, closed at the top: `base` to `base + axis`, radii below and above.
fn drum(part: &mut Part, base: Vec3, frame: Mat3, length: f32, radii: [f32; 2], flutes: u32, depth: f32) {
    let sides = flutes * 4;
    let rim = |y: f32, radius: f32| {
        (0..sides).map(move |s| {
            let groove = if s % 4 == 0 { 0.0 } else { depth * [0.0, 0.7, 1.0, 0.7][s as usize % 4] };
            let p = around(-TAU * s as f32 / sides as f32) * (radius * (1.0 - groove));
            base + frame * vec3(p.x, y, p.z)
        })
    };
    let top = frame * vec3(0.0, length, 0.0) + base;
    let vertices = rim(0.0, radii[0]).chain(rim(length, radii[1])).chain([top]);
    let mut faces = Vec::new();
    for a in 0..sides {
        let b = (a + 1) % sides;
        faces.extend([[a, b, sides + b], [a, sides + b, sides + a], [sides + a, sides + b, 2 * sides]]);
    }
    part.add(vertices.collect::<Vec<_>>(), &faces);
}

/// Adds a column of `drums` drums out of six; six carry a capital.
fn column(part: &mut Part, foot: Vec3, out: Vec3, drums: u32, random: &mut Random) {
    let side = out.cross(Vec3::Y);
    part.block(foot + Vec3::Y * 0.12, [out * 0.52, Vec3::Y * 0.12, side * 0.52]);
    let length = (COLUMN - 0.74) / 6.0;
    for n in 0..drums {
        let radius = |n: u32| 0.43 - 0.013 * n as f32;
        let frame = Mat3::from_rotation_y(random.within(-0.03, 0.03));
        let shift = vec3(random.within(-0.012, 0.012), 0.0, random.within(-0.012, 0.012));
        let base = foot + shift + Vec3::Y * (0.24 + length * n as f32);
        drum(part, base, frame, length - 0.008, [radius(n), radius(n + 1)], 20, 0.07);
    }
    if drums == 6 {
        let top = foot + Vec3::Y * (COLUMN - 0.5);
        drum(part, top, Mat3::IDENTITY, 0.22, [0.36, 0.54], 16, 0.0);
        part.block(top + Vec3::Y * 0.36, [out * 0.55, Vec3::Y * 0.14, side * 0.55]);
    }
}

/// The temple on level ground around `centre`.
pub fn ruin(centre: Vec3, random: &mut Random) -> Part {
    let mut part = Part::new("marble", [0.66, 0.60, 0.50], false);
    for (step, radius) in [6.3, 5.9, 5.5].into_iter().enumerate() {
        let base = centre + Vec3::Y * (0.28 * step as f32 - 0.25);
        drum(
            &mut part,
            base,
            Mat3::IDENTITY,
            0.28 + if step == 0 { 0.02 } else { 0.0 },
            [radius; 2],
            18,
            0.0,
        );
    }
    let floor = centre + Vec3::Y * 0.6;
    let drums = [6, 6, 6, 2, 6, 6, 6, 6, 4, 1, 3, 6];
    let at = |i: u32| around(TAU * (i as f32 + 0.3) / COLUMNS as f32);
    for i in 0..COLUMNS {
        column(&mut part, floor + at(i) * RING, at(i), drums[i as usize], random);
        let next = (i + 1) % COLUMNS;
        if drums[i as usize] == 6 && drums[next as usize] == 6 {
            let (a, b) = (at(i) * RING, at(next) * RING);
            let (along, out) = ((b - a) / 2.0, (a + b).normalize());
            let middle = floor + (a + b) / 2.0;
            part.block(middle + Vec3::Y * (COLUMN + 0.3), [along * 1.04, Vec3::Y * 0.3, out * 0.42]);
            part.block(middle + Vec3::Y * (COLUMN + 0.7), [along * 1.07, Vec3::Y * 0.1, out * 0.56]);
        }
    }
    // Drums that fell lie where they rolled.
    for (angle, distance, turn) in
        [(0.6, 7.4, 0.4), (1.1, 8.3, 2.1), (1.9, 7.1, 1.2), (2.6, 8.0, 0.1), (5.4, 3.0, 1.0)]
    {
        let lying = Mat3::from_rotation_y(turn) * Mat3::from_rotation_z(1.53);
        let lift = if distance < 5.0 { 0.6 } else { 0.0 };
        drum(
            &mut part,
            centre + around(angle) * distance + Vec3::Y * (0.38 + lift),
            lying,
            0.8,
            [0.42, 0.41],
            20,
            0.07,
        );
    }
    part
}
