//! Orthonormal bases around a normal, also where it points nearly down.

use glam::{DVec3, Vec3};

use pointillist::math::frame::Frame;
use pointillist::math::random::Random;

use crate::Row;

/// Frisvad, *Building an Orthonormal Basis from a 3D Unit Vector Without Normalization*, 2012, listing 2.
fn frisvad(n: Vec3) -> Frame {
    if n.z < -0.999_999_9 {
        return Frame { s: -Vec3::Y, t: -Vec3::X, n };
    }
    let a = 1.0 / (1.0 + n.z);
    let b = -n.x * n.y * a;
    Frame { s: Vec3::new(1.0 - n.x * n.x * a, b, -n.x), t: Vec3::new(b, 1.0 - n.y * n.y * a, -n.y), n }
}

/// The largest error of a product of two axes, and of the determinant.
fn error(Frame { s, t, n }: Frame) -> f64 {
    let [s, t, n] = [s, t, n].map(|v: Vec3| v.as_dvec3());
    let dots = [s.dot(t), s.dot(n), t.dot(n), s.dot(s) - 1.0, t.dot(t) - 1.0, s.cross(t).dot(n) - 1.0];
    dots.into_iter().fold(0.0, |most, dot| most.max(dot.abs()))
}

/// Ten million normals, half of them at log-uniform angles of 1e-8 to 1 from −z. The bound is some roundings of numbers up to 1.
#[test]
fn n8_basis_near_minus_z() {
    let mut random = Random(8);
    let (mut worst, mut worst_naive) = (0f64, 0f64);
    for i in 0..10_000_000 {
        let n = if i % 2 == 0 {
            random.direction()
        } else {
            let angle = 10f64.powf(-8.0 * random.f64());
            let (sin, cos) = (std::f64::consts::TAU * random.f64()).sin_cos();
            DVec3::new(angle.sin() * cos, angle.sin() * sin, -angle.cos())
        };
        let n = n.as_vec3();
        (worst, worst_naive) = (worst.max(error(Frame::new(n))), worst_naive.max(error(frisvad(n))));
    }
    Row {
        case: "N8 orthonormal basis, 1e7 normals, half of them near −z",
        measure: "largest error of products and determinant",
        figure: worst,
        naive: ("Frisvad 2012", worst_naive),
        bound: 1e-6,
    }
    .check();
}
