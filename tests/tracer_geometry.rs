//! The two questions: watertight, free of self-hits, and right.

mod tracer_support;

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use pointillist::tracer::accel::{Accel, PrimRange, Ray};
use pointillist::tracer::shape::{Disk, Sphere, Triangle};
use tracer_support::Random;

/// A subdivided icosahedron of unit radius.
fn icosphere(levels: u32) -> (Vec<DVec3>, Vec<[usize; 3]>) {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut points: Vec<DVec3> = Vec::new();
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        points.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    points.iter_mut().for_each(|p| *p = p.normalize());
    // The faces are the triples at the shortest distance from each other.
    let near = |a: DVec3, b: DVec3| a.distance(b) < 1.1;
    let mut faces = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let (a, b, c) = (points[i], points[j], points[k]);
                if near(a, b) && near(b, c) && near(a, c) {
                    faces.push(if (b - a).cross(c - a).dot(a) > 0.0 { [i, j, k] } else { [i, k, j] });
                }
            }
        }
    }
    assert_eq!(faces.len(), 20);
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut next = Vec::new();
        for [a, b, c] in faces {
            let mut middle = |i: usize, j: usize| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    points.push((points[i] + points[j]).normalize());
                    points.len() - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            next.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = next;
    }
    (points, faces)
}

fn accel(triangles: &[[Vec3; 3]]) -> Accel {
    Accel::new(triangles, &[], Vec::new(), Vec::new())
}

/// Möller and Trumbore 1997, the naive test.
fn moeller_trumbore(ray: &Ray, [a, b, c]: [Vec3; 3]) -> bool {
    let (e1, e2) = (b - a, c - a);
    let p = ray.direction.cross(e2);
    let inverse = 1.0 / e1.dot(p);
    let s = ray.origin - a;
    let u = s.dot(p) * inverse;
    let q = s.cross(e1);
    let v = ray.direction.dot(q) * inverse;
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && e2.dot(q) * inverse > 0.0
}

/// Case N2: rays from inside at vertices and edges. Closed means hit, always; for the naive test it does not.
#[test]
fn closed_meshes_have_no_holes() {
    let (points, faces) = icosphere(4);
    for (shift, size) in [(DVec3::ZERO, 1.0), (DVec3::new(1234.0, -777.0, 3000.0), 1.0), (DVec3::ZERO, 1e-6)]
    {
        let corner = |i: usize| (points[i] * size + shift).as_vec3();
        let mesh: Vec<[Vec3; 3]> = faces.iter().map(|f| f.map(corner)).collect();
        let accel = accel(&mesh);
        let mut random = Random(7);
        let (mut misses, mut naive, mut naive_tried) = (0, 0, 0);
        for i in 0..350_000 {
            let origin = (random.direction() * (0.6 * size * random.next()) + shift).as_vec3();
            let face = mesh[(random.next() * mesh.len() as f64) as usize];
            let along = if i % 4 == 0 { 0.0 } else { random.next() as f32 };
            let target = face[0] + (face[1] - face[0]) * along;
            let mut ray = Ray::new(origin, (target - origin).normalize());
            if i % 5 == 0 {
                ray.direction[i % 3] = 0.0;
            }
            misses += u32::from(accel.closest(&ray).is_none());
            misses += u32::from(!accel.occluded(&ray, PrimRange::NONE));
            // The naive test gets every triangle, without any tree that could lose one.
            if i % 200 == 1 {
                naive_tried += 1;
                naive += u32::from(!mesh.iter().any(|&t| moeller_trumbore(&ray, t)));
            }
        }
        assert_eq!(misses, 0, "size {size}, shift {shift}");
        assert!(naive > 0, "the case is too easy: 0 of {naive_tried} missed");
    }
}

/// A turned box of parallelograms is as closed as its triangles, and answers the same.
#[test]
fn parallelograms_are_their_two_triangles() {
    let m = glam::DAffine3::from_axis_angle(DVec3::new(0.3, 0.9, -0.2).normalize(), 0.7)
        * glam::DAffine3::from_scale(DVec3::new(1.0, 0.01, 3.0));
    let mut mesh: Vec<[Vec3; 3]> = Vec::new();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let [a, b, c, d] = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| {
                let mut p = DVec3::ZERO;
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (sign, x, y);
                m.transform_point3(p).as_vec3()
            });
            mesh.extend([[a, b, c], [a, c, d]]);
        }
    }
    let quads = [0, 2, 4, 6, 8, 10];
    let (boxed, halves) = (Accel::new(&mesh, &quads, Vec::new(), Vec::new()), accel(&mesh));
    let mut random = Random(17);
    for i in 0..300_000 {
        let inside = DVec3::new(random.next(), random.next(), random.next()) * 1.8 - 0.9;
        let origin = m.transform_point3(inside).as_vec3();
        let face = mesh[(random.next() * 12.0) as usize];
        let target = face[0] + (face[1] - face[0]) * if i % 4 == 0 { 0.0 } else { random.next() as f32 };
        let ray = Ray::new(origin, (target - origin).normalize());
        let (one, two) = (boxed.closest(&ray).expect("closed"), halves.closest(&ray).expect("closed"));
        assert!((one.t - two.t).abs() <= 2e-4 * one.t.max(0.01), "{one:?} {two:?}");
        assert!(boxed.occluded(&ray, PrimRange::NONE));
        let point = Triangle::new(mesh[one.prim as usize]).expect("has an area").point(one.uv);
        let along = ray.origin + ray.direction * one.t;
        // Within rounding times the inverse cosine, which reaches 300 in this thin box.
        assert!(point.p.distance(along) < 2e-4, "{point:?} {along}");
        // Leaving the point outwards meets nothing, but for the neighbour at an edge, a few ulps away.
        let d = random.direction().as_vec3();
        let d = d * d.dot(point.ng).signum() * point.ng.dot(ray.direction).signum();
        let o = pointillist::math::float::safe_origin(point.p, point.error, point.ng, d);
        if let Some(again) = boxed.closest(&Ray::new(o, d)) {
            assert!(again.prim != one.prim && again.t < 1e-4, "{one:?} {again:?}");
        }
    }
}

/// Case N3: rays that leave a convex body never meet it again, at any scale and place; a ray into it always does.
#[test]
fn spawned_rays_do_not_hit_their_own_surface() {
    let (points, faces) = icosphere(2);
    for scale in [1e-6f64, 1e-3, 1.0, 1e3, 1e6] {
        for offset in [0.0, 1.0, 1e3, 1e6] {
            let shift = DVec3::new(0.31, -0.77, 0.55) * offset * scale.max(1.0);
            let mesh: Vec<[Vec3; 3]> =
                faces.iter().map(|f| f.map(|i| (points[i] * scale + shift).as_vec3())).collect();
            let triangles: Vec<Option<Triangle>> = mesh.iter().map(|&t| Triangle::new(t)).collect();
            let kept: Vec<[Vec3; 3]> = triangles.iter().flatten().zip(&mesh).map(|(_, &m)| m).collect();
            if kept.len() < mesh.len() || offset > 1e4 * scale {
                continue; // Rounding of the vertices has left no sphere: there is nothing convex to test.
            }
            // Each face alone in its plane: rounded vertices make neighbours concave by a hair, which is a true hit.
            let mut random = Random(3);
            for (mesh, triangle) in kept.iter().zip(triangles.iter().flatten()) {
                let alone = accel(&[*mesh]);
                for _ in 0..100 {
                    let (a, b) = (random.next() as f32, random.next() as f32);
                    let uv = if a + b > 1.0 { [1.0 - a, 1.0 - b] } else { [a, b] };
                    let point = triangle.point(uv);
                    // Every direction, also within 1e-6 of the plane.
                    let grazing = if random.next() < 0.5 { 1.0 } else { 1e-6 };
                    let tangent = random.direction().as_vec3();
                    let tangent = (tangent - triangle.n * tangent.dot(triangle.n)).normalize();
                    let d = (tangent + triangle.n * (random.direction().z as f32 * grazing)).normalize();
                    let o = pointillist::math::float::safe_origin(point.p, point.error, point.ng, d);
                    assert_eq!(alone.closest(&Ray::new(o, d)), None, "scale {scale}, offset {offset}, {d}");
                    assert!(!alone.occluded(&Ray::new(o, d), PrimRange::NONE));
                }
            }
        }
    }
}

/// Needles a thousand times as long as wide, left at every angle; rays from the bare point, as the naive method
/// has them, hit what they leave.
#[test]
fn needles_are_left_for_good() {
    let mut random = Random(23);
    let mut naive = 0;
    for _ in 0..2000 {
        let (along, place) = (random.direction() * 5.0, random.direction() * 3.0);
        let across = random.direction() * (0.005 + 5.0 * random.next().powi(6));
        let mesh = [place, place + along, place + along * random.next() + across].map(|p| p.as_vec3());
        let Some(triangle) = Triangle::new(mesh) else { continue };
        let alone = accel(&[mesh]);
        for _ in 0..100 {
            let (a, b) = (random.next() as f32, random.next() as f32);
            let point = triangle.point(if a + b > 1.0 { [1.0 - a, 1.0 - b] } else { [a, b] });
            let d = random.direction().as_vec3();
            let o = pointillist::math::float::safe_origin(point.p, point.error, point.ng, d);
            assert_eq!(alone.closest(&Ray::new(o, d)), None, "{mesh:?} {d}");
            naive += u32::from(moeller_trumbore(&Ray::new(point.p, d), mesh));
        }
    }
    assert!(naive > 1000, "the case is too easy: {naive}");
}

/// The same for spheres and disks, and for the two halves of a square, which lie in one plane.
#[test]
fn spawned_rays_leave_spheres_disks_and_squares() {
    let mut random = Random(11);
    for scale in [1e-6f32, 1.0, 1e6] {
        for shift in [0.0f32, 1.0, 1e3] {
            let center = Vec3::new(0.3, -0.9, 0.4) * (shift * scale);
            let (a, b) = (Vec3::new(1.0, 0.2, 0.1) * scale, Vec3::new(-0.3, 1.0, 0.2) * scale);
            let sphere = Sphere { center, radius: scale, inward: false };
            let disk = Disk::new(center, a, b, DVec3::Z).expect("has an area");
            let spheres = Accel::new(&[], &[], Vec::new(), vec![sphere]);
            let disks = Accel::new(&[], &[], vec![disk], Vec::new());
            let [p, q, r, s] = [center, center + a, center + a + b, center + b];
            let halves = [[p, q, r], [p, r, s]];
            let square = accel(&halves);
            for _ in 0..3000 {
                let d = random.direction().as_vec3();
                let spawn = |point: &pointillist::tracer::shape::SurfacePoint, d: Vec3| {
                    Ray::new(pointillist::math::float::safe_origin(point.p, point.error, point.ng, d), d)
                };
                let on_sphere = sphere.point_towards(random.direction().as_vec3());
                let out = d * d.dot(on_sphere.ng).signum();
                assert_eq!(spheres.closest(&spawn(&on_sphere, out)), None, "sphere {scale} {shift}");
                let inwards = spheres.closest(&spawn(&on_sphere, -out));
                assert!(inwards.is_some(), "from inside the other side is hit");
                let (x, y) = (random.next() as f32 - 0.5, random.next() as f32 - 0.5);
                assert_eq!(disks.closest(&spawn(&disk.point_at(x, y), d)), None, "disk {scale} {shift}");
                let triangle = Triangle::new(halves[0]).expect("has an area");
                // On the diagonal, where the other half is next.
                let on_diagonal = triangle.point([0.0, random.next() as f32]);
                assert_eq!(square.closest(&spawn(&on_diagonal, d)), None, "square {scale} {shift} {d}");
            }
        }
    }
}

/// A second surface a few dozen ulps away is not skipped.
#[test]
fn a_near_second_surface_is_hit() {
    let face = |z: f32| [Vec3::new(-1.0, -1.0, z), Vec3::new(1.0, -1.0, z), Vec3::new(0.0, 1.0, z)];
    let gap = 64.0 * f32::EPSILON;
    let both = accel(&[face(1.0), face(1.0 + gap)]);
    let lower = Triangle::new(face(1.0)).expect("has an area");
    let mut random = Random(5);
    for _ in 0..10_000 {
        let point = lower.point([random.next() as f32 * 0.3 + 0.2, random.next() as f32 * 0.3 + 0.1]);
        let d = random.direction().as_vec3();
        let d = Vec3::new(d.x, d.y, d.z.abs() + 0.1).normalize();
        let spawn = |d| Ray::new(pointillist::math::float::safe_origin(point.p, point.error, point.ng, d), d);
        assert_eq!(both.closest(&spawn(d)).map(|h| h.prim), Some(1));
        assert_eq!(both.closest(&spawn(-d)), None, "both are behind");
    }
}

/// Random triangles, disks and spheres: the tree finds what asking one by one finds.
#[test]
fn the_tree_is_brute_force() {
    for count in [1usize, 2, 3, 7, 40, 700] {
        let mut random = Random(count as u64);
        let mut point = |size: f64| (random.direction() * size * random.next()).as_vec3();
        let triangles: Vec<[Vec3; 3]> = (0..count)
            .map(|_| {
                let p = point(10.0);
                [p, p + point(2.0), p + point(2.0)]
            })
            .collect();
        let disks: Vec<Disk> =
            (0..count / 5).filter_map(|_| Disk::new(point(10.0), point(1.0), point(1.0), DVec3::Z)).collect();
        let spheres: Vec<Sphere> =
            (0..count / 5).map(|_| Sphere { center: point(10.0), radius: 0.4, inward: false }).collect();
        let tree = Accel::new(&triangles, &[], disks.clone(), spheres.clone());
        let mut singles: Vec<Accel> = triangles.iter().map(|&t| accel(&[t])).collect();
        singles.extend(disks.iter().map(|&d| Accel::new(&[], &[], vec![d], Vec::new())));
        singles.extend(spheres.iter().map(|&s| Accel::new(&[], &[], Vec::new(), vec![s])));
        let mut hits = 0;
        for _ in 0..2000 {
            let o = point(12.0);
            let ray = Ray { origin: o, direction: (point(8.0) - o).normalize(), t_max: 15.0 };
            let brute = singles.iter().filter_map(|s| s.closest(&ray)).map(|h| h.t).reduce(f32::min);
            let found = tree.closest(&ray);
            assert_eq!(found.map(|h| h.t), brute);
            assert_eq!(tree.occluded(&ray, PrimRange::NONE), brute.is_some());
            if let Some(hit) = found {
                hits += 1;
                // Without the nearest, occlusion depends on the others.
                let skip = PrimRange { first: hit.prim, end: hit.prim + 1 };
                let others = singles
                    .iter()
                    .enumerate()
                    .any(|(i, s)| i as u32 != hit.prim && s.closest(&ray).is_some());
                assert_eq!(tree.occluded(&ray, skip), others);
            }
        }
        assert!(hits > 0, "the case is too easy");
    }
}

/// Cases that break builders: nothing, one point in common, a thousand times the same, flat, huge and tiny.
#[test]
fn degenerate_scenes_build_and_answer() {
    assert_eq!(accel(&[]).closest(&Ray::new(Vec3::ZERO, Vec3::Z)), None);
    let t = [Vec3::new(-1.0, -1.0, 2.0), Vec3::new(1.0, -1.0, 2.0), Vec3::new(0.0, 1.0, 2.0)];
    for n in [1usize, 2, 5, 1000, 20_000] {
        let same = accel(&vec![t; n]);
        assert_eq!(same.closest(&Ray::new(Vec3::ZERO, Vec3::Z)).map(|h| h.t), Some(2.0), "{n}");
        assert!(!same.occluded(&Ray::new(Vec3::ZERO, -Vec3::Z), PrimRange::NONE));
    }
    let nested: Vec<[Vec3; 3]> = (0..200).map(|i| t.map(|p| p * 1.2f32.powi(i - 100))).collect();
    let tree = accel(&nested);
    assert!(tree.closest(&Ray::new(Vec3::ZERO, Vec3::Z)).is_some());
    for d in [Vec3::NAN, Vec3::ZERO, Vec3::splat(f32::INFINITY), Vec3::new(0.0, 0.0, 1e-42), Vec3::Z * 1e30] {
        tree.closest(&Ray::new(Vec3::ZERO, d));
        tree.occluded(&Ray::new(d, Vec3::Z), PrimRange::NONE);
    }
}
