//! Watertightness: a ray from inside a closed mesh hits it, whatever vertex or edge it is aimed at, in every kernel. `stability` has more
//! meshes of triangles.

use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;

use crate::support::accel::{CLOSED, Closed, Random, aimed, icosphere, kernels, leaks, moeller_trumbore};
use pointillist::tracer::accel::{Accel, PrimRange, Ray, Shapes, SimdKernel};
use pointillist::tracer::shape::Triangle;

/// Rays at each mesh. Those of the vector kernels are all of them; the scalar kernel gets every fifth,
/// or all where there is no other.
const RAYS: u64 = 250_000;

/// Rays at each mesh that are asked of the naive test.
const NAIVE: u64 = 400;

fn assert_closed(closed: &Closed, quads: &[u32], rays: u64) {
    let mesh = closed.triangles();
    assert_eq!(mesh.len(), 27_648);
    let mut accel = Accel::new(Shapes { triangles: &mesh, quads, ..Shapes::default() }, &[], &[]);
    for kernel in kernels() {
        assert!(accel.set_kernel(kernel));
        let every =
            if kernel == SimdKernel::Scalar && SimdKernel::best() != SimdKernel::Scalar { 5 } else { 1 };
        // Steps of five would be aimed at vertices and made flat more often than not.
        let of_scalar = (0..rays).into_par_iter().filter(|i| (i / 20).is_multiple_of(every));
        let count = leaks(&accel, &mesh, closed, of_scalar);
        println!("{}, {}: {count:?}", closed.name, kernel.name());
        assert!(count.rays >= rays / every / 2);
        assert_eq!(
            (count.missed, count.unoccluded, count.late),
            (0, 0, 0),
            "{}, {}, of {}",
            closed.name,
            kernel.name(),
            count.rays
        );
    }
    // The naive test gets every triangle, without any tree that could lose one.
    let missed = |index: &u64| !mesh.iter().any(|&t| moeller_trumbore(&aimed(&mesh, closed, *index).0, t));
    let naive = (0..NAIVE).into_par_iter().filter(missed).count();
    println!("{}: the naive test misses {naive} of {NAIVE}", closed.name);
    assert!(naive > 0, "{}: the case is too easy", closed.name);
}

/// Every other cell is tested as a parallelogram and its neighbours as triangles: no miss, and no ray that slips through to a farther surface.
#[test]
fn no_holes_between_parallelograms_and_triangles() {
    let quads: Vec<u32> = (0..27_648).step_by(2).filter(|i| (i / 2 + i / 96) % 2 == 0).collect();
    for closed in &CLOSED[4..6] {
        assert_closed(closed, &quads, RAYS);
    }
}

/// A sphere of 5,120 triangles down to a millionth: coarse enough for edges to be seen at every angle.
#[test]
fn small_spheres_have_no_holes() {
    let (points, faces) = icosphere(4);
    for (shift, size) in [(DVec3::ZERO, 1.0), (DVec3::new(1234.0, -777.0, 3000.0), 1.0), (DVec3::ZERO, 1e-6)]
    {
        let corner = |i: usize| (points[i] * size + shift).as_vec3();
        let mesh: Vec<[Vec3; 3]> = faces.iter().map(|f| f.map(corner)).collect();
        let closed = Closed { center: shift, inside: DVec3::splat(0.6 * size), ..CLOSED[0] };
        let mut accel = Accel::new(Shapes { triangles: &mesh, ..Shapes::default() }, &[], &[]);
        for kernel in kernels() {
            assert!(accel.set_kernel(kernel));
            let count = leaks(&accel, &mesh, &closed, (0..100_000).into_par_iter());
            assert_eq!(
                (count.missed, count.unoccluded, count.late),
                (0, 0, 0),
                "{}, size {size}",
                kernel.name()
            );
        }
    }
}

/// A turned box of parallelograms is as closed as its triangles, and answers the same.
#[test]
fn parallelograms_are_their_two_triangles() {
    let m = DAffine3::from_axis_angle(DVec3::new(0.3, 0.9, -0.2).normalize(), 0.7)
        * DAffine3::from_scale(DVec3::new(1.0, 0.01, 3.0));
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
    let mut boxed = Accel::new(Shapes { triangles: &mesh, quads: &quads, ..Shapes::default() }, &[], &[]);
    let mut halves = Accel::new(Shapes { triangles: &mesh, ..Shapes::default() }, &[], &[]);
    for (seed, kernel) in (17..).zip(kernels()) {
        assert!(boxed.set_kernel(kernel) && halves.set_kernel(kernel));
        compare_box(&boxed, &halves, (&mesh, m), &mut Random(seed));
    }
}

fn compare_box(boxed: &Accel, halves: &Accel, (mesh, m): (&[[Vec3; 3]], DAffine3), random: &mut Random) {
    for i in 0..100_000 {
        let inside = DVec3::new(random.f64(), random.f64(), random.f64()) * 1.8 - 0.9;
        let origin = m.transform_point3(inside).as_vec3();
        let face = mesh[(random.f64() * 12.0) as usize];
        let target = face[0] + (face[1] - face[0]) * if i % 4 == 0 { 0.0 } else { random.f64() as f32 };
        let ray = Ray::new(origin, (target - origin).normalize());
        let (one, two) = (boxed.closest(&ray).expect("closed"), halves.closest(&ray).expect("closed"));
        assert!((one.t - two.t).abs() <= 2e-4 * one.t.max(0.01), "{one:?} {two:?}");
        assert!(boxed.occluded(&ray, PrimRange::NONE));
        let point = Triangle::new(mesh[one.prim as usize]).expect("has an area").point(one.uv);
        let along = ray.origin + ray.direction * one.t;
        // Within rounding times the inverse cosine: 2e-4 up to an inverse cosine of 1000, which few rays of this thin box exceed.
        let cosine = ray.direction.dot(point.ng).abs();
        assert!(point.p.distance(along) < 2e-4 * (1e-3 / cosine).max(1.0), "{point:?} {along} {cosine}");
        // Leaving the point outwards meets nothing, but for the neighbour at an edge, a few ulps away.
        let d = random.direction().as_vec3();
        let d = d * d.dot(point.ng).signum() * point.ng.dot(ray.direction).signum();
        let o = pointillist::math::float::safe_origin(point.p, point.error, point.ng, d);
        if let Some(again) = boxed.closest(&Ray::new(o, d)) {
            assert!(again.prim != one.prim && again.t < 1e-4, "{one:?} {again:?}");
        }
    }
}
