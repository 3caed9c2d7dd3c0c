//! Rays that pass edges and vertices, and rays that come from far away.

use glam::Vec3;
use rayon::prelude::*;

use pointillist::tracer::accel::{Accel, PrimRange, Ray, Shapes, SimdKernel};
use pointillist::tracer::shape::Sphere;

use crate::Row;
use crate::support::accel::{CLOSED, Leaks, Random, aimed, kernels, leaks, moeller_trumbore};

/// Rays at each of the closed meshes; the scalar kernel gets every fifth, or all where there is no other.
const AT_EDGES: u64 = 650_000;

/// Rays at each mesh that are asked of the naive test.
const NAIVE: u64 = 400;

/// A ray from inside a closed mesh hits it, whatever vertex or edge it is aimed at, in every kernel, and does not slip through to a farther
/// surface. Möller and Trumbore's test gets every triangle, without any tree that could lose one.
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
