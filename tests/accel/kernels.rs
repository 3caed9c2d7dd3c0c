//! Every kernel gives the same answers, bit for bit: a picture does not depend on the processor.

use std::collections::HashSet;

use glam::{DVec3, Vec3};

use crate::support::accel::{CLOSED, Primitives, Random, ask, ask_one, icosphere, kernels};
use pointillist::tracer::accel::{Accel, PrimRange, Ray, Shapes, SimdKernel};
use pointillist::tracer::shape::{Cylinder, Disk, Sphere};

#[test]
fn kernels_have_names_and_are_chosen() {
    let names: HashSet<&str> = SimdKernel::ALL.into_iter().map(SimdKernel::name).collect();
    assert_eq!(names.len(), SimdKernel::ALL.len());
    assert!(SimdKernel::best().is_available() && SimdKernel::Scalar.is_available());
    let mut accel = Accel::new(Shapes::default(), &[], &[]);
    assert!(accel.kernel().is_available());
    for kernel in SimdKernel::ALL {
        let before = accel.kernel();
        let set = accel.set_kernel(kernel);
        assert_eq!(set, kernel.is_available());
        assert_eq!(accel.kernel(), if set { kernel } else { before });
    }
    println!("compared here: {}", kernels().iter().map(|k| k.name()).collect::<Vec<_>>().join(", "));
}

/// `count` of each kind in a ball of radius 10, times `size`.
fn soup(random: &mut Random, count: usize, size: f64) -> Primitives {
    let mut all = Primitives::default();
    let mut point = |reach: f64| (random.direction() * (reach * size * random.f64())).as_vec3();
    for i in 0..count {
        let p = point(10.0);
        if i % 2 == 0 {
            all.quad(p, point(2.0), point(2.0));
        }
        all.triangle([p, p + point(2.0), p + point(2.0)]);
        all.disks.extend(Disk::new(point(10.0), point(1.0), point(1.0), DVec3::Z));
        all.spheres.push(Sphere { center: point(10.0), radius: (0.3 * size) as f32, inward: i % 2 == 0 });
        all.cylinders.extend(Cylinder::new(point(10.0), [point(0.5), point(0.5), point(3.0)], false));
    }
    all
}

/// Questions about `all`: rays between random points, some at corners, some with a zero component, some that end,
/// some that skip a range.
fn questions(random: &mut Random, all: &Primitives, size: f64, count: usize) -> Vec<(Ray, PrimRange)> {
    let ids = all.triangles.len() + all.disks.len() + all.spheres.len() + all.cylinders.len();
    (0..count)
        .map(|i| {
            let mut point = |reach: f64| (random.direction() * (reach * size * random.f64())).as_vec3();
            let (origin, mut target) = (point(12.0), point(8.0));
            if i % 3 == 0 && !all.triangles.is_empty() {
                target = all.triangles[(random.f64() * all.triangles.len() as f64) as usize][i % 2];
            }
            let mut direction = target - origin;
            if i % 4 != 0 {
                direction = direction.normalize();
            }
            if i % 5 == 0 {
                direction[i % 3] = 0.0;
            }
            let t_max = if i % 2 == 0 {
                f32::INFINITY
            } else {
                (random.f64() * 1.5) as f32 * (target - origin).length()
            };
            let first = (random.f64() * ids as f64) as u32;
            let skip = PrimRange { first, end: first + (random.f64() * 0.5 * ids as f64) as u32 };
            (Ray { origin, direction, t_max }, if i % 3 == 1 { skip } else { PrimRange::NONE })
        })
        .collect()
}

/// Triangles, parallelograms, disks and spheres in one tree, from a few to thousands, from a thousandth to a thousand.
#[test]
fn kernels_agree_on_random_primitives() {
    for count in [1, 2, 5, 30, 300, 3000] {
        for size in [1e-3, 1.0, 1e3] {
            let random = &mut Random(count as u64);
            let all = soup(random, count, size);
            let asked = questions(random, &all, size, 20_000);
            let answers = ask(&mut all.accel(), &asked);
            let hits = answers.iter().filter(|a| a.0.is_some()).count();
            let occluded = answers.iter().filter(|a| a.1).count();
            let differ = answers.iter().filter(|a| a.0.is_some() != a.1).count();
            println!(
                "{count} of each, size {size}: {hits} hits, {occluded} occluded, {differ} only without a skip"
            );
            assert!(hits > 100 && occluded > 50 && differ > 0, "the case is too easy");
            // Without a skip the two questions agree.
            let told =
                answers.iter().zip(&asked).all(|(a, q)| q.1 != PrimRange::NONE || a.0.is_some() == a.1);
            assert!(told, "occluded is not closest");
        }
    }
}

/// Triangles only, and parallelograms only: leaves of one kind.
#[test]
fn kernels_agree_on_leaves_of_one_kind() {
    let random = &mut Random(41);
    for kind in 0..5 {
        let mut all = soup(random, 800, 1.0);
        match kind {
            0 => all = Primitives { triangles: all.triangles, ..Primitives::default() },
            1 => {
                let halves = all.quads.iter().flat_map(|&q| [q, q + 1]).map(|i| all.triangles[i as usize]);
                let triangles: Vec<_> = halves.collect();
                let quads = (0..triangles.len() as u32).step_by(2).collect();
                all = Primitives { triangles, quads, ..Primitives::default() };
            }
            2 => all = Primitives { disks: all.disks, ..Primitives::default() },
            3 => all = Primitives { cylinders: all.cylinders, ..Primitives::default() },
            _ => all = Primitives { spheres: all.spheres, ..Primitives::default() },
        }
        let asked = questions(random, &all, 1.0, 50_000);
        let hits = ask(&mut all.accel(), &asked).iter().filter(|a| a.0.is_some()).count();
        assert!(hits > 1000, "kind {kind}: {hits}");
    }
}

/// Meshes with shared edges, seen from within and without, at vertices and anywhere: where two triangles claim a hit at
/// the same distance, the kernels pick the same.
#[test]
fn kernels_agree_on_meshes() {
    for (seed, closed) in (1..).zip(&CLOSED) {
        let mesh = closed.triangles();
        let mut accel = Primitives::of(&mesh).accel();
        let random = &mut Random(seed);
        let mut asked = Vec::new();
        for i in 0..40_000 {
            let at = |d: DVec3, reach: f64| (closed.center + d * reach * closed.inside).as_vec3();
            let origin = at(random.direction(), 3.0 * random.f64());
            let face = mesh[(random.f64() * mesh.len() as f64) as usize];
            let (x, y) = (random.f64() as f32, random.f64() as f32);
            let target = match i % 4 {
                0 => face[0],
                1 => face[0] + (face[1] - face[0]) * x,
                2 => face[0] + (face[1] - face[0]) * x + (face[2] - face[0]) * (y * (1.0 - x)),
                _ => at(random.direction(), 2.0),
            };
            let ray = Ray::new(origin, (target - origin).normalize());
            let skip = PrimRange { first: 0, end: mesh.len() as u32 / 2 };
            asked.push((ray, if i % 8 < 4 { PrimRange::NONE } else { skip }));
        }
        let answers = ask(&mut accel, &asked);
        let hits = answers.iter().filter(|a| a.0.is_some()).count();
        let on_corners = answers
            .iter()
            .filter_map(|a| a.0)
            .filter(|h| h.uv[0] <= 0.0 || h.uv[1] <= 0.0 || h.uv[0] + h.uv[1] >= 1.0)
            .count();
        println!("{}: {hits} hits, {on_corners} of them on an edge", closed.name);
        assert!(hits > 20_000 && on_corners > 20, "the case is too easy");
    }
}

/// A ray ends before `t_max`: it misses what is at `t_max` exactly, and hits it when it ends one ulp later.
#[test]
fn rays_end_just_before_their_end() {
    let random = &mut Random(77);
    let all = soup(random, 300, 1.0);
    let mut accel = all.accel();
    let asked = questions(random, &all, 1.0, 5_000);
    let mut hits = 0;
    for (ray, _) in asked {
        let Some(hit) = ask_one(&mut accel, ray).0 else { continue };
        hits += 1;
        assert_eq!(ask_one(&mut accel, Ray { t_max: hit.t, ..ray }), (None, false), "{ray:?} {hit:?}");
        let longer = Ray { t_max: hit.t.next_up(), ..ray };
        assert_eq!(ask_one(&mut accel, longer), (Some(hit), true), "{longer:?}");
    }
    assert!(hits > 1000, "{hits}");
}

/// A scene of any size is walked by rays of any length of direction: scaling both by powers of two scales nothing else.
#[test]
fn powers_of_two_change_no_digit() {
    let (points, faces) = icosphere(2);
    let mesh: Vec<[Vec3; 3]> = faces.iter().map(|f| f.map(|i| points[i].as_vec3())).collect();
    let mut accel = Primitives::of(&mesh).accel();
    for power in [-18, -3, 5, 18] {
        let size = 2f32.powi(power);
        let scaled: Vec<[Vec3; 3]> = mesh.iter().map(|t| t.map(|p| p * size)).collect();
        let mut other = Primitives::of(&scaled).accel();
        let random = &mut Random(13);
        for _ in 0..2_000 {
            let origin = (random.direction() * 2.0 * random.f64()).as_vec3();
            let ray = Ray::new(origin, random.direction().as_vec3());
            let hit = ask_one(&mut accel, ray).0;
            let large = Ray::new(origin * size, ray.direction);
            assert_eq!(
                ask_one(&mut other, large).0.map(|h| (h.t / size, h.prim, h.uv)),
                hit.map(|h| (h.t, h.prim, h.uv))
            );
            let long = Ray::new(origin, ray.direction * size);
            assert_eq!(
                ask_one(&mut accel, long).0.map(|h| (h.t * size, h.prim, h.uv)),
                hit.map(|h| (h.t, h.prim, h.uv))
            );
        }
    }
}
