//! The small mesh: a room with two balls of many triangles and a folding screen.

use glam::{Vec3, vec3};

use super::rocks::icosphere;
use super::{Camera, Light, Model, Part};

/// Half the width and depth of the room, and its height, metres.
const ROOM: Vec3 = vec3(2.775, 5.5, 2.8);

/// 163,858 triangles: five walls, a screen of three panels, a lamp, and two balls of 81,920 triangles each.
pub fn spheres() -> Model {
    let (w, h, d) = (ROOM.x, ROOM.y, ROOM.z);
    let mut white = Part::new("white", [0.74, 0.73, 0.70], false);
    let [near, far] = [-d, d];
    white.quad([vec3(-w, 0.0, near), vec3(-w, 0.0, far), vec3(w, 0.0, far), vec3(w, 0.0, near)]);
    white.quad([vec3(-w, h, near), vec3(w, h, near), vec3(w, h, far), vec3(-w, h, far)]);
    white.quad([vec3(-w, 0.0, far), vec3(-w, h, far), vec3(w, h, far), vec3(w, 0.0, far)]);
    let side = |x: f32| [vec3(x, 0.0, near), vec3(x, h, near), vec3(x, h, far), vec3(x, 0.0, far)];
    // The camera looks along +z, so +x is on the left of the picture.
    let mut red = Part::new("red", [0.57, 0.09, 0.06], false);
    red.quad(side(w));
    let mut green = Part::new("green", [0.14, 0.42, 0.10], false);
    green.quad(side(-w));
    let mut screen = Part::new("screen", [0.62, 0.47, 0.24], false);
    for fold in [[(-1.9, 1.4), (-0.7, 2.3)], [(-0.7, 2.3), (0.5, 1.6)], [(0.5, 1.6), (1.8, 2.2)]] {
        let [(x0, z0), (x1, z1)] = fold;
        screen.quad([vec3(x0, 0.0, z0), vec3(x0, 2.9, z0), vec3(x1, 2.9, z1), vec3(x1, 0.0, z1)]);
    }
    let mut balls = [
        (Part::new("ball_blue", [0.16, 0.28, 0.55], true), vec3(1.05, 1.15, 0.1), 1.15),
        (Part::new("ball_white", [0.72, 0.70, 0.66], true), vec3(-1.15, 0.9, -0.9), 0.9),
    ];
    let (vertices, faces) = icosphere(6);
    for (part, centre, radius) in &mut balls {
        part.add(vertices.iter().map(|v| *centre + *v * *radius), &faces);
    }
    let [blue, pale] = balls.map(|b| b.0);
    Model {
        name: "spheres",
        parts: vec![white, red, green, screen, blue, pale],
        light: Light {
            centre: vec3(0.0, h - 0.01, 0.0),
            half: [vec3(0.65, 0.0, 0.0), vec3(0.0, 0.0, 0.55)],
            radiance: [19.0, 15.5, 10.5],
        },
        sky: [0.05, 0.06, 0.08],
        camera: Camera { origin: vec3(0.0, 2.75, -10.8), target: vec3(0.0, 2.7, 0.0), fov: 37.8 },
    }
}
