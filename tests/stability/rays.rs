//! Rays that pass edges and vertices, that leave a surface, that graze needles, and that come from far away.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use pointillist::math::float::safe_origin;
use pointillist::tracer::accel::{Accel, PrimRange, Ray, Shapes, SimdKernel};
use pointillist::tracer::shape::{Disk, Sphere, SurfacePoint, Triangle};

use crate::Row;
use crate::support::accel::{CLOSED, Leaks, Random, aimed, kernels, leaks, moeller_trumbore};
use crate::support::spawned::{KINDS, OFFSETS, SIZES, self_hits};

/// Rays at each of the closed meshes; the scalar kernel gets every fifth, or all where there is no other.
const AT_EDGES: u64 = 650_000;

/// Rays at each mesh that are asked of the naive test.
const NAIVE: u64 = 400;

/// A ray from inside a closed mesh hits it, whatever vertex or edge it is aimed at, in every kernel, and does not slip through to a farther
/// surface. Möller and Trumbore's test gets every triangle, without any tree that could lose one. `benchmarks edges` asks 10⁷ rays.
#[test]
fn n2_edges_and_vertices() {
    let (mut lost, mut all, mut naive) = (Leaks::default(), 0, 0);
    for closed in &CLOSED {
        let mesh = closed.triangles();
        let mut accel = Accel::new(Shapes { triangles: &mesh, ..Shapes::default() }, &[], &[]);
        for kernel in kernels() {
            assert!(accel.set_kernel(kernel));
            let slow = kernel == SimdKernel::Scalar && SimdKernel::best() != SimdKernel::Scalar;
            // Steps of five would be aimed at vertices and made flat more often than not.
            let every = if slow { 5 } else { 1 };
            let asked = (0..AT_EDGES).into_par_iter().filter(|i| (i / 20).is_multiple_of(every));
            let found = leaks(&accel, &mesh, closed, asked);
            println!("{}, {}: {found:?}", closed.name, kernel.name());
            assert!(found.rays >= AT_EDGES / every / 2);
            lost += found;
        }
        let missed =
            |index: &u64| !mesh.iter().any(|t| moeller_trumbore(&aimed(&mesh, closed, *index).0, *t));
        let misses = (0..NAIVE).into_par_iter().filter(missed).count();
        assert!(misses > 0, "{}: the case is too easy", closed.name);
        (all, naive) = (all + NAIVE, naive + misses);
    }
    Row {
        case: &format!("N2 {:.1e} rays at edges and vertices of seven closed meshes", lost.rays as f64),
        measure: "share that misses",
        figure: (lost.missed + lost.unoccluded + lost.late) as f64 / lost.rays as f64,
        naive: ("Möller and Trumbore", naive as f64 / all as f64),
        bound: 0.0,
    }
    .check();
}

/// Rays that leave a primitive, for each size and offset.
const LEAVING: u64 = 12_000;

/// Rays that leave a surface never hit it again. A fixed distance of 10⁻⁴ fails where coordinates are large. `benchmarks edges` asks 10⁷
/// rays for each size and offset.
#[test]
fn n3_spawned_rays() {
    for kind in KINDS {
        let cases: Vec<[f64; 2]> =
            SIZES.into_iter().flat_map(|size| OFFSETS.map(|offset| [size, offset])).collect();
        let found: Vec<[u64; 2]> =
            cases.par_iter().map(|&[size, offset]| self_hits(kind, size, offset, LEAVING)).collect();
        for (case, [again, _]) in cases.iter().zip(&found) {
            if *again > 0 {
                println!("{kind}, size and offset {case:?}: {again} of {LEAVING}");
            }
        }
        let share =
            |i: usize| found.iter().map(|f| f[i]).sum::<u64>() as f64 / (LEAVING * cases.len() as u64) as f64;
        Row {
            case: &format!("N3 {kind}, sizes 1e-6 to 1e6, up to 1e6 sizes from the origin"),
            measure: "share of rays that hit what they leave",
            figure: share(0),
            naive: ("origin moved by 1e-4", share(1)),
            bound: 0.0,
        }
        .check();
    }
}

/// A second surface 64 ulp away is hit, at every size and offset: triangles, disks, and spheres in one another.
#[test]
fn n3_near_second_surface() {
    let random = &mut Random(5);
    let (mut asked, mut skipped, mut naive) = (0, 0, 0);
    for (size, offset) in SIZES.into_iter().flat_map(|size| OFFSETS.map(|offset| (size, offset))) {
        let center = (DVec3::new(0.31, -0.77, 0.55) * (offset * size)).as_vec3();
        let size = size as f32;
        let gap = 64.0 * f32::EPSILON * (center.abs().max_element() + size);
        // Wide enough that a ray at 0.1 to the surface does not pass by.
        let wide = size + 100.0 * gap;
        let up = Vec3::Z * gap;
        let face = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)]
            .map(|p| center + p * wide);
        let disk = |center| Disk::new(center, Vec3::X * wide, Vec3::Y * wide, DVec3::Z).unwrap();
        let ball = |radius| Sphere { center, radius, inward: false };
        let triangles = vec![face, face.map(|p| p + up)];
        let accel = |shapes| Accel::new(shapes, &[], &[]);
        let triangles = accel(Shapes { triangles: &triangles, ..Shapes::default() });
        let disks = accel(Shapes { disks: vec![disk(center), disk(center + up)], ..Shapes::default() });
        let balls = accel(Shapes { spheres: vec![ball(size), ball(size + gap)], ..Shapes::default() });
        for _ in 0..2000 {
            let [x, y] = [random.f64(), random.f64()].map(|u| 0.3 * u as f32);
            let points = [
                (&triangles, Triangle::new(face).unwrap().point([x + 0.2, y + 0.1])),
                (&disks, disk(center).point_at(x, y)),
                (&balls, ball(size).point_towards(random.direction().as_vec3())),
            ];
            for (accel, SurfacePoint { p, error, ng }) in points {
                let d = random.direction().as_vec3();
                let d = (d - ng * d.dot(ng) + ng * (d.dot(ng).abs() + 0.1)).normalize();
                let next = |origin| accel.closest(&Ray::new(origin, d)).map(|hit| hit.prim);
                asked += 1;
                skipped += u32::from(next(safe_origin(p, error, ng, d)) != Some(1));
                naive += u32::from(next(p + ng * 1e-4) != Some(1));
            }
        }
    }
    Row {
        case: "N3 second surface 64 ulp away, sizes 1e-6 to 1e6, up to 1e6 sizes from the origin",
        measure: "share of rays that skip it",
        figure: f64::from(skipped) / f64::from(asked),
        naive: ("origin moved by 1e-4", f64::from(naive) / f64::from(asked)),
        bound: 0.0,
    }
    .check();
}

/// The distance by Möller and Trumbore's test.
fn naive_distance(ray: &Ray, [a, b, c]: [Vec3; 3]) -> Option<f32> {
    let (e1, e2) = (b - a, c - a);
    let inverse = 1.0 / e1.dot(ray.direction.cross(e2));
    moeller_trumbore(ray, [a, b, c]).then(|| e2.dot((ray.origin - a).cross(e1)) * inverse)
}

/// A needle or sliver: as long as 1, as wide as 1e-9 to 1.
fn sliver(random: &mut Random) -> [Vec3; 3] {
    let (along, place) = (random.direction(), random.direction());
    let across = along.any_orthonormal_vector() * 10f64.powf(-9.0 * random.f64());
    [place, place + along, place + along * random.f64() + across].map(|p| p.as_vec3())
}

/// Where a triangle is hit lies between its vertices: along the ray its distance is in their range, whatever the angle.
///
/// The bound is 16 unit roundoffs of the largest distance of a vertex: the range is of rounded differences, and weights that are not
/// negative and add up to 1 leave it by no more than their own rounding.
#[test]
fn n6_grazing_and_skinny() {
    let random = &mut Random(29);
    let (mut hits, mut figure, mut naive) = (0, 0.0f64, 0.0f64);
    for i in 0..4000 {
        let mesh = sliver(random);
        let Some(triangle) = Triangle::new(mesh) else { continue };
        let accel = Accel::new(Shapes { triangles: &vec![mesh], ..Shapes::default() }, &[], &[]);
        for _ in 0..200 {
            let (a, b) = (random.f64() as f32, random.f64() as f32);
            let target = triangle.point(if a + b > 1.0 { [1.0 - a, 1.0 - b] } else { [a, b] }).p;
            // From 1e-4 to 1e3 away, and above the plane by down to 1e-9 of that.
            let away = 10f32.powf(7.0 * random.f64() as f32 - 4.0);
            let side = random.direction().as_vec3();
            let side = (side - triangle.n * side.dot(triangle.n)).normalize_or_zero();
            let rise = 10f32.powf(-9.0 * random.f64() as f32);
            let origin = target + (side + triangle.n * rise) * away;
            let Some(d) = (target - origin).try_normalize() else { continue };
            let ray = Ray::new(origin, if i % 2 == 0 { d } else { -d });
            let along = |p: Vec3| (p.as_dvec3() - origin.as_dvec3()).dot(ray.direction.as_dvec3());
            let of = mesh.map(along);
            let scale = mesh.map(|p| p.distance(origin)).into_iter().fold(0.0f32, f32::max);
            let range = of.iter().fold((f64::MAX, f64::MIN), |(l, h), t| (l.min(*t), h.max(*t)));
            let length = ray.direction.as_dvec3().length_squared();
            let outside = |t: f32| {
                let t = f64::from(t) * length;
                (range.0 - t).max(t - range.1).max(0.0) / f64::from(scale)
            };
            if let Some(hit) = accel.closest(&ray) {
                (hits, figure) = (hits + 1, figure.max(outside(hit.t)));
            }
            if let Some(t) = naive_distance(&ray, mesh) {
                naive = naive.max(outside(t));
            }
        }
    }
    assert!(hits > 50_000, "the case is too easy: {hits} hits");
    Row {
        case: &format!("N6 {hits} hits of slivers and needles, grazing and from 1e-4 to 1e3 lengths away"),
        measure: "distance outside the range of the vertices",
        figure,
        naive: ("Möller and Trumbore", naive),
        bound: 1e-6,
    }
    .check();
}

/// The distance to a sphere by the quadratic formula in single precision.
fn naive_sphere(ray: &Ray, center: Vec3, radius: f32) -> Option<f32> {
    let f = ray.origin - center;
    let (b, c) = (f.dot(ray.direction), f.length_squared() - radius * radius);
    let discriminant = b * b - ray.direction.length_squared() * c;
    (discriminant >= 0.0).then(|| -b - discriminant.sqrt()).filter(|t| *t > 0.0)
}

/// A unit sphere seen from up to 1e7 radii away is hit where its disk is, and nowhere beside it.
///
/// The bound is 2 unit roundoffs: the distance is rounded once. A wrong decision counts as 1.
#[test]
fn b6_n12_hits_from_far_away() {
    let random = &mut Random(7);
    for far in [1e4, 1e6, 1e7] {
        let ball = Sphere { center: Vec3::ZERO, radius: 1.0, inward: false };
        let accel = Accel::new(Shapes { spheres: vec![ball], ..Shapes::default() }, &[], &[]);
        let (mut figure, mut naive) = (0.0f64, 0.0f64);
        for _ in 0..100_000 {
            let from = random.direction() * far;
            let origin = from.as_vec3();
            let beside = from.normalize().any_orthonormal_vector() * 1.4 * random.f64();
            let ray = Ray::new(origin, (beside - from).normalize().as_vec3());
            let (o, d) = (origin.as_dvec3(), ray.direction.as_dvec3());
            let length = d.length();
            let w = d / length;
            let nearest = o - w * o.dot(w);
            let miss2 = nearest.length_squared();
            if (miss2 - 1.0).abs() < 1e-6 {
                continue;
            }
            let exact = (miss2 < 1.0).then(|| (-o.dot(w) - (1.0 - miss2).sqrt()) / length);
            let error = |t: Option<f32>| match (t, exact) {
                (Some(t), Some(exact)) => (f64::from(t) / exact - 1.0).abs(),
                (None, None) => 0.0,
                _ => 1.0,
            };
            let t = accel.closest(&ray).map(|hit| hit.t);
            assert_eq!(t.is_some(), accel.occluded(&ray, PrimRange::NONE));
            figure = figure.max(error(t));
            naive = naive.max(error(naive_sphere(&ray, Vec3::ZERO, 1.0)));
        }
        Row {
            case: &format!("B6 N12 sphere seen from {far:e} radii away"),
            measure: "largest relative error of the distance, 1 where hit and miss differ",
            figure,
            naive: ("b² − 4ac in single precision", naive),
            bound: 1e-7,
        }
        .check();
    }
}
