//! Conifers and grass: many thin triangles that lie close together without touching.

use std::f32::consts::TAU;

use glam::{Vec3, vec3};

use super::Part;
use super::noise::Random;

fn around(angle: f32) -> Vec3 {
    vec3(angle.cos(), 0.0, angle.sin())
}

/// Adds a conifer of about 2,460 triangles: a tapering trunk and whorls of drooping fronds. `height` in metres.
pub fn conifer([bark, needles]: [&mut Part; 2], foot: Vec3, height: f32, random: &mut Random) {
    const SIDES: u32 = 8;
    const RINGS: u32 = 6;
    let lean = vec3(random.within(-0.05, 0.05), 1.0, random.within(-0.05, 0.05));
    let along = |t: f32| foot + lean * (t * height);
    let trunk = (0..=RINGS).flat_map(|ring| {
        let t = ring as f32 / RINGS as f32;
        let radius = height * (0.022 * (1.0 - t) + 0.002);
        (0..SIDES).map(move |s| along(t * 0.98 - 0.03) + around(TAU * s as f32 / SIDES as f32) * radius)
    });
    let mut faces = Vec::new();
    for i in 0..RINGS * SIDES {
        let (a, b) = (i, i / SIDES * SIDES + (i + 1) % SIDES);
        faces.extend([[a, a + SIDES, b], [b, a + SIDES, b + SIDES]]);
    }
    bark.add(trunk.collect::<Vec<_>>(), &faces);
    const WHORLS: u32 = 26;
    let fullness = random.within(0.85, 1.2);
    for whorl in 0..WHORLS {
        let t = 0.1 + 0.9 * (whorl as f32 + random.within(-0.25, 0.25)) / WHORLS as f32;
        let first = random.within(0.0, TAU);
        for branch in 0..7 {
            let out = around(first + TAU * (branch as f32 + random.within(-0.2, 0.2)) / 7.0);
            let length = height * (0.26 * (1.0 - t).powf(0.8) + 0.015) * random.within(0.75, 1.1) * fullness;
            frond(needles, along(t.min(0.99)), out, length, random);
        }
    }
}

/// Adds a frond of 13 triangles along a bent twig.
fn frond(part: &mut Part, start: Vec3, out: Vec3, length: f32, random: &mut Random) {
    const PAIRS: u32 = 6;
    let side = out.cross(Vec3::Y);
    let droop = random.within(0.25, 0.5);
    let roll = random.within(-0.25, 0.25);
    let twig = |j: u32| {
        let s = j as f32 / (PAIRS + 1) as f32;
        start + out * (s * length) - Vec3::Y * (length * droop * s * (1.35 - 0.75 * s))
    };
    for j in 0..PAIRS {
        let width = length * 0.36 * (1.0 - 0.12 * j as f32) * random.within(0.8, 1.15);
        for sign in [-1.0, 1.0] {
            let tip = twig(j + 1) + side * (sign * width) + out * (0.45 * width)
                - Vec3::Y * (width * random.within(0.1, 0.5) + sign * roll * width);
            part.triangle([twig(j), twig(j + 1), tip]);
        }
    }
    let end = twig(PAIRS + 1);
    part.triangle([twig(PAIRS) - side * (0.07 * length), end, twig(PAIRS) + side * (0.07 * length)]);
}

/// Adds a tuft of nine bent blades, 27 triangles.
pub fn tuft(part: &mut Part, foot: Vec3, height: f32, random: &mut Random) {
    for _ in 0..9 {
        let out = around(random.within(0.0, TAU));
        let side = out.cross(Vec3::Y) * (height * random.within(0.02, 0.04));
        let rise = height * random.within(0.6, 1.1);
        let bend = rise * random.within(0.15, 0.6);
        let root = foot + out * (height * random.within(0.0, 0.15)) - Vec3::Y * (0.08 * height);
        let knee = root + out * (0.3 * bend) + Vec3::Y * (0.6 * rise);
        let tip = root + out * bend + Vec3::Y * rise;
        part.quad([root - side, root + side, knee + side * 0.7, knee - side * 0.7]);
        part.triangle([knee - side * 0.7, knee + side * 0.7, tip]);
    }
}
