//! The large mesh: the ground, and what stands and lies on it.

use glam::{Vec3, vec3};

use super::noise::{Random, fractal};
use super::rocks::{boulder, icosphere};
use super::terrain::{TEMPLE, ground, height, off_path, terrain};
use super::{Camera, Light, Model, Part, plants, ruin};

/// Where the camera stands, x and z.
const EYE: [f32; 2] = [9.5, 37.0];

/// About 1.6 million triangles: a valley with rocks, conifers, grass and a ruined temple.
pub fn bigmesh() -> Model {
    let mut random = Random(1);
    let mut parts = Vec::from(terrain());
    parts.extend(rocks(&mut random));
    let mut bark = Part::new("bark", [0.16, 0.11, 0.07], true);
    let mut needles = Part::new("needles", [0.06, 0.13, 0.05], false);
    for _ in 0..130 {
        let foot = place(&mut random, [0.0; 2], 75.0, |p, n| {
            let wood = fractal(p / 22.0 + vec3(7.0, 0.0, 1.0), 3) > -0.15;
            wood && n.y > 0.72 && off_path(p.x, p.z).abs() > 4.0 && p.distance(TEMPLE) > 12.0 && clear(p, 5.0)
        });
        let size = random.within(0.0, 1.0);
        plants::conifer([&mut bark, &mut needles], foot, 3.0 + 8.0 * size * size.sqrt(), &mut random);
    }
    let mut grass = Part::new("grass", [0.27, 0.30, 0.09], false);
    for _ in 0..6000 {
        let foot = place(&mut random, [EYE[0], EYE[1] - 8.0], 34.0, |p, n| {
            let patch = fractal(p / 4.0, 3) > -0.1;
            patch && n.y > 0.8 && off_path(p.x, p.z).abs() > 1.5 && p.distance(TEMPLE) > 8.0 && far(p, 2.5)
        });
        let size = random.within(0.12, 0.45);
        plants::tuft(&mut grass, foot, size, &mut random);
    }
    parts.extend([bark, needles, grass, ruin::ruin(TEMPLE, &mut random)]);
    let sun = vec3(-56.0, 60.0, 26.0);
    let side = sun.cross(Vec3::Y).normalize();
    Model {
        name: "bigmesh",
        parts,
        light: Light {
            centre: sun,
            half: [side * 9.0, side.cross(sun.normalize()) * 9.0],
            radiance: [150.0, 116.0, 74.0],
        },
        sky: [0.40, 0.56, 0.86],
        camera: Camera {
            origin: vec3(EYE[0], height(EYE[0], EYE[1]) + 1.9, EYE[1]),
            target: vec3(0.0, 5.6, 0.0),
            fov: 42.0,
        },
    }
}

/// True when `p` is `least` metres from the camera.
fn far(p: Vec3, least: f32) -> bool {
    p.distance(vec3(EYE[0], p.y, EYE[1])) > least
}

/// True when `p` is twice `least` metres from the camera and does not stand within `least` of what it sees of the temple.
fn clear(p: Vec3, least: f32) -> bool {
    let eye = vec3(EYE[0], 0.0, EYE[1]);
    let (to, sight) = (p.with_y(0.0) - eye, TEMPLE.with_y(0.0) - eye);
    let along = (to.dot(sight) / sight.length_squared()).clamp(0.0, 1.0);
    far(p, 2.0 * least) && to.distance(sight * along) > least
}

/// A random place on the ground within `half` metres of `middle` along each axis, denser there, that `fits`.
fn place(random: &mut Random, middle: [f32; 2], half: f32, fits: impl Fn(Vec3, Vec3) -> bool) -> Vec3 {
    loop {
        let mut along = || {
            let u = random.within(-1.0, 1.0);
            half * u * (0.35 + 0.65 * u.abs())
        };
        let (p, n) = ground(middle[0] + along(), middle[1] + along());
        if fits(p, n) {
            return p;
        }
    }
}

/// Boulders of four sizes, the smaller the more; half of them darker.
fn rocks(random: &mut Random) -> [Part; 2] {
    let mut parts =
        [Part::new("granite", [0.40, 0.37, 0.34], true), Part::new("basalt", [0.20, 0.19, 0.19], true)];
    for (level, count, sizes) in
        [(5, 6, [2.2, 4.5]), (4, 24, [0.9, 2.2]), (3, 90, [0.3, 0.9]), (2, 300, [0.08, 0.3])]
    {
        let sphere = icosphere(level);
        for i in 0..count {
            let size = random.within(sizes[0], sizes[1]);
            let foot = place(random, [2.0, 10.0], if level > 3 { 55.0 } else { 36.0 }, |p, n| {
                let clear = off_path(p.x, p.z).abs() > 1.5 + size && p.distance(TEMPLE) > 8.5 + size;
                clear && n.y > 0.6 && far(p, 4.0 + 2.5 * size)
            });
            boulder(
                &mut parts[usize::from(i % 3 == 0)],
                &sphere,
                foot + Vec3::Y * (0.15 * size),
                size,
                random,
            );
        }
    }
    parts
}
