//! Points on curved surfaces that are seen from far away.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use pointillist::scene::desc::{CurveBasis, Curves, ShapeKind};
use pointillist::tracer::accel::Ray;

use crate::Row;
use crate::support::scenes::{Random, empty, grey, material, prepare, shape, sphere};

/// Half the length of what is along z.
const LONG: f64 = 4.0;

/// A shape of radius 1 around the origin or around z.
fn round(kind: &str) -> ShapeKind {
    let curve = |basis| {
        // A B-spline ends at its second and its last control point but one.
        let reach = if basis == CurveBasis::Linear { 1.0 } else { 3.0 };
        let ends: &[f32] =
            if basis == CurveBasis::Linear { &[-1.0, 1.0] } else { &[-1.0, -1.0 / 3.0, 1.0 / 3.0, 1.0] };
        let points = ends.iter().map(|z| (Vec3::Z * (LONG as f32 * reach * z)).extend(1.0)).collect();
        ShapeKind::Curves(Arc::new(Curves { basis, points, starts: vec![0] }))
    };
    match kind {
        "sphere" => sphere(DVec3::ZERO, 1.0),
        "disk" => ShapeKind::Disk,
        "cylinder" => ShapeKind::Cylinder { p0: DVec3::NEG_Z * LONG, p1: DVec3::Z * LONG, radius: 1.0 },
        "linear curve" => curve(CurveBasis::Linear),
        _ => curve(CurveBasis::BSpline),
    }
}

/// Where `ray` meets the shape first, and its normal there: in double precision, by way of the point of the ray that is nearest to the centre.
fn exact(kind: &str, ray: &Ray) -> Option<(DVec3, DVec3)> {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    if kind == "disk" {
        let p = o - d * (o.z / d.z);
        return (p.length() < 1.0).then_some((p, DVec3::Z));
    }
    let across = if kind == "sphere" { DVec3::ONE } else { DVec3::new(1.0, 1.0, 0.0) };
    let (o2, d2) = (o * across, d * across);
    let nearest = -o2.dot(d2) / d2.length_squared();
    let half = ((1.0 - (o2 + d2 * nearest).length_squared()) / d2.length_squared()).sqrt();
    let p = o + d * (nearest - half);
    (p.z.abs() < 0.9 * LONG).then_some((p, (p * across).normalize()))
}

/// Points and normals are those of the ray, from 10⁴ and 10⁶ radii away: a distance that is rounded to single precision moves the point along
/// the surface.
///
/// The bounds are the roundings of a unit normal and of a point, and of a curve of the third degree the accuracy of its hits.
#[test]
fn b6_points_from_far_away() {
    for kind in ["sphere", "disk", "cylinder", "linear curve", "cubic curve"] {
        let mut desc = empty();
        let bsdf = material(&mut desc, grey(0.5));
        shape(&mut desc, round(kind), DAffine3::IDENTITY, bsdf, 0.0);
        let scene = prepare(&desc);
        for far in [1e4, 1e6] {
            let random = &mut Random(3);
            let (mut figure, mut naive, mut hits) = (0.0f64, 0.0f64, 0);
            for _ in 0..20_000 {
                let from = random.direction();
                let target = random.direction() * random.f64();
                let origin = (from * far).as_vec3();
                let ray = Ray::new(origin, (target - from * far).normalize().as_vec3());
                let (Some(at), Some((p, n))) = (scene.first(&ray), exact(kind, &ray)) else { continue };
                // At the silhouette a point is as little defined as the ray.
                if n.dot(ray.direction.as_dvec3()).abs() < 1e-2 {
                    continue;
                }
                hits += 1;
                let rounded = ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(at.hit.t);
                let (error, without) = match kind {
                    "disk" => ((at.point.p.as_dvec3() - p).length(), (rounded - p).with_z(0.0).length()),
                    "sphere" => (at.point.ng.as_dvec3().distance(n), rounded.normalize().distance(n)),
                    _ => (at.point.ng.as_dvec3().distance(n), rounded.with_z(0.0).normalize().distance(n)),
                };
                (figure, naive) = (figure.max(error), naive.max(without));
            }
            assert!(hits > 5_000, "{kind} {far}: {hits} hits");
            Row {
                case: &format!("B6 {kind} seen from {far:e} radii away"),
                measure: if kind == "disk" {
                    "error of the point in radii"
                } else {
                    "error of the normal in radians"
                },
                figure,
                naive: ("distance in single precision", naive),
                bound: if kind == "cubic curve" { 2e-6 } else { 3e-7 },
            }
            .check();
        }
    }
}
