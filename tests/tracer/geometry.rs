//! Rays that leave a surface do not hit it again. `stability` tries every kind of primitive at every size and place.

use glam::{DVec3, Vec3};

use crate::support::accel::{Random, ask_one, moeller_trumbore};
use pointillist::tracer::accel::{Accel, Ray, Shapes};
use pointillist::tracer::shape::{Cylinder, Disk, Sphere, Triangle};

fn accel(triangles: &[[Vec3; 3]]) -> Accel {
    Accel::new(Shapes { triangles: &triangles.to_vec(), ..Shapes::default() }, &[], &[])
}

/// Needles a thousand times as long as wide, left at every angle; rays from the bare point, as the naive method
/// has them, hit what they leave.
#[test]
fn needles_are_left_for_good() {
    let mut random = Random(23);
    let mut naive = 0;
    for _ in 0..2000 {
        let (along, place) = (random.direction() * 5.0, random.direction() * 3.0);
        let across = random.direction() * (0.005 + 5.0 * random.f64().powi(6));
        let mesh = [place, place + along, place + along * random.f64() + across].map(|p| p.as_vec3());
        let Some(triangle) = Triangle::new(mesh) else { continue };
        let mut alone = accel(&[mesh]);
        for _ in 0..100 {
            let (a, b) = (random.f64() as f32, random.f64() as f32);
            let point = triangle.point(if a + b > 1.0 { [1.0 - a, 1.0 - b] } else { [a, b] });
            let d = random.direction().as_vec3();
            let o = pointillist::math::float::safe_origin(point.p, point.error, point.ng, d);
            assert_eq!(ask_one(&mut alone, Ray::new(o, d)), (None, false), "{mesh:?} {d}");
            naive += u32::from(moeller_trumbore(&Ray::new(point.p, d), mesh));
        }
    }
    assert!(naive > 1000, "the case is too easy: {naive}");
}

/// Spheres and disks, and for the two halves of a square, which lie in one plane.
#[test]
fn spawned_rays_leave_spheres_disks_and_squares() {
    let mut random = Random(11);
    for scale in [1e-6f32, 1.0, 1e6] {
        for shift in [0.0f32, 1.0, 1e3] {
            let center = Vec3::new(0.3, -0.9, 0.4) * (shift * scale);
            let (a, b) = (Vec3::new(1.0, 0.2, 0.1) * scale, Vec3::new(-0.3, 1.0, 0.2) * scale);
            let sphere = Sphere { center, radius: scale, inward: false };
            let disk = Disk::new(center, a, b, DVec3::Z).expect("has an area");
            let mut spheres = Accel::new(Shapes { spheres: vec![sphere], ..Shapes::default() }, &[], &[]);
            let mut disks = Accel::new(Shapes { disks: vec![disk], ..Shapes::default() }, &[], &[]);
            let [p, q, r, s] = [center, center + a, center + a + b, center + b];
            let halves = [[p, q, r], [p, r, s]];
            let mut square = accel(&halves);
            for _ in 0..3000 {
                let d = random.direction().as_vec3();
                let spawn = |point: &pointillist::tracer::shape::SurfacePoint, d: Vec3| {
                    Ray::new(pointillist::math::float::safe_origin(point.p, point.error, point.ng, d), d)
                };
                let on_sphere = sphere.point_towards(random.direction().as_vec3());
                let out = d * d.dot(on_sphere.ng).signum();
                assert_eq!(ask_one(&mut spheres, spawn(&on_sphere, out)).0, None, "sphere {scale} {shift}");
                let inwards = ask_one(&mut spheres, spawn(&on_sphere, -out)).0;
                assert!(inwards.is_some(), "from inside the other side is hit");
                let (x, y) = (random.f64() as f32 - 0.5, random.f64() as f32 - 0.5);
                assert_eq!(
                    ask_one(&mut disks, spawn(&disk.point_at(x, y), d)).0,
                    None,
                    "disk {scale} {shift}"
                );
                let triangle = Triangle::new(halves[0]).expect("has an area");
                // On the diagonal, where the other half is next.
                let on_diagonal = triangle.point([0.0, random.f64() as f32]);
                assert_eq!(
                    ask_one(&mut square, spawn(&on_diagonal, d)).0,
                    None,
                    "square {scale} {shift} {d}"
                );
            }
        }
    }
}

/// Rays that start on a cylinder, round or not, meet it again only across the inside, and where they should.
#[test]
fn spawned_rays_leave_cylinders() {
    let mut random = Random(12);
    let (mut met, mut left) = (0, 0);
    for scale in [1e-6f32, 1.0, 1e6] {
        for shift in [0.0f32, 1.0, 1e3] {
            for (a, b) in [(Vec3::X, Vec3::Y), (Vec3::new(2.0, 0.3, 0.1), Vec3::new(0.0, 0.5, 0.2))] {
                let base = Vec3::new(0.3, -0.9, 0.4) * (shift * scale);
                let axes = [a, b, Vec3::Z * 3.0].map(|v| v * scale);
                let tube = Cylinder::new(base, axes, false).expect("has a volume");
                let mut alone = Accel::new(Shapes { cylinders: vec![tube], ..Shapes::default() }, &[], &[]);
                for _ in 0..1000 {
                    let (y, x) = (random.f64() as f32 * std::f32::consts::TAU).sin_cos();
                    let from = tube.point_at([x, y], 0.1 + 0.8 * random.f64() as f32);
                    let d = random.direction().as_vec3();
                    let spawn = |d: Vec3| {
                        Ray::new(pointillist::math::float::safe_origin(from.p, from.error, from.ng, d), d)
                    };
                    let out = d * d.dot(from.ng).signum();
                    assert_eq!(ask_one(&mut alone, spawn(out)).0, None, "{scale} {shift} {d}");
                    let Some(hit) = ask_one(&mut alone, spawn(-out)).0 else {
                        left += 1;
                        continue;
                    };
                    met += 1;
                    let point = tube.point(&spawn(-out), hit.t);
                    assert!(point.ng.dot(out) < 0.0, "{scale} {shift}: the other side is met from within");
                    let along_ray = from.p - out * hit.t;
                    let off = (point.p - along_ray).length() / (scale * (1.0 + shift));
                    assert!(off < 1e-5, "{scale} {shift}: {off}");
                }
            }
        }
    }
    assert!(met > 5000 && left > 2000, "{met} {left}");
}
