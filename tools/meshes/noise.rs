//! Random directions and gradient noise. Source of the noise: Perlin, *Improving Noise* (2002), with a hash for the table.

use glam::{Vec3, vec3};

pub use pointillist::math::random::Random;

/// A direction, uniform on the sphere.
pub fn direction(random: &mut Random) -> Vec3 {
    let (z, angle) = (random.within(-1.0, 1.0), random.within(0.0, std::f32::consts::TAU));
    let r = (1.0 - z * z).sqrt();
    vec3(r * angle.cos(), z, r * angle.sin())
}

/// Slope of the noise at a corner of the lattice, times the offset from it.
fn slope(corner: [i32; 3], offset: Vec3) -> f32 {
    let mut h = 0x811c_9dc5u32;
    for c in corner {
        h = (h ^ c as u32).wrapping_mul(0x85eb_ca6b);
        h ^= h >> 13;
    }
    h = h.wrapping_mul(0xc2b2_ae35);
    let [x, y, z] = offset.to_array();
    let (a, b) = [(x, y), (x, z), (y, z)][(h >> 8) as usize % 3];
    (if h >> 16 & 1 == 0 { a } else { -a }) + if h >> 17 & 1 == 0 { b } else { -b }
}

/// Noise of wavelength 1, about -1 to 1, zero at whole coordinates.
pub fn noise(p: Vec3) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let s = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let [i, j, k] = cell.to_array().map(|c| c as i32);
    let at = |dx: i32, dy: i32, dz: i32| {
        slope([i + dx, j + dy, k + dz], f - vec3(dx as f32, dy as f32, dz as f32))
    };
    let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let edge = |dy, dz| lerp(at(0, dy, dz), at(1, dy, dz), s.x);
    lerp(lerp(edge(0, 0), edge(1, 0), s.y), lerp(edge(0, 1), edge(1, 1), s.y), s.z)
}

/// Where each octave looks, so that their lattices do not meet.
fn octave(p: Vec3, n: u32) -> Vec3 {
    p * (1u32 << n) as f32 + n as f32 * vec3(17.31, 5.77, 11.13)
}

/// Fractal noise: octaves of half the wavelength and half the height each.
pub fn fractal(p: Vec3, octaves: u32) -> f32 {
    (0..octaves).map(|n| noise(octave(p, n)) / (1u32 << n) as f32).sum()
}

/// Fractal noise with sharp ridges, about 0 to 2: every octave is strong only where the one before it was high.
pub fn ridges(p: Vec3, octaves: u32) -> f32 {
    let (mut sum, mut weight) = (0.0, 1.0);
    for n in 0..octaves {
        let ridge = (1.0 - noise(octave(p, n)).abs()).powi(2) * weight;
        weight = ridge.clamp(0.0, 1.0);
        sum += ridge / (1u32 << n) as f32;
    }
    sum
}

/// 0 up to `from`, 1 beyond `to`, smooth between.
pub fn step(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
