//! Rays that leave every kind of primitive, small and large, near the origin and far from it.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use pointillist::scene::desc::*;
use pointillist::tracer::Scene;
use pointillist::tracer::accel::Ray;
use pointillist::tracer::interaction::SurfaceInteraction;

use super::scenes::{Random, empty, grey, material, shape, sphere};

/// Sizes of a primitive.
pub const SIZES: [f64; 5] = [1e-6, 1e-3, 1.0, 1e3, 1e6];

/// Distances from the origin in sizes.
pub const OFFSETS: [f64; 4] = [0.0, 1.0, 1e3, 1e6];

/// Every kind of primitive. All are convex, so that no ray that leaves the front meets one again.
pub const KINDS: [&str; 9] = [
    "triangle",
    "rectangle",
    "disk",
    "sphere",
    "cylinder",
    "linear curve",
    "cubic curve",
    "instance of a triangle",
    "instance of a sphere",
];

fn triangle() -> Mesh {
    // The first vertex is at the origin, where coordinates leave no room by their own rounding.
    let positions = vec![Vec3::ZERO, Vec3::new(1.0, 0.1, -0.3), Vec3::new(-0.2, 0.9, 0.2)];
    Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() }
}

fn curves(basis: CurveBasis, size: f64) -> ShapeKind {
    // `to_world` leaves radii as they are.
    let point = |x: f32, radius: f64| Vec3::new(x, 0.3 * x, -0.2 * x).extend((radius * size) as f32);
    let points = vec![point(-1.5, 0.02), point(-0.5, 0.025), point(0.5, 0.03), point(1.5, 0.035)];
    ShapeKind::Curves(Arc::new(Curves { basis, points, starts: vec![0] }))
}

/// The primitive `kind` of this size around `center`.
pub fn alone(kind: &str, size: f64, center: DVec3) -> Scene {
    let mut desc = empty();
    desc.meshes.push(Arc::new(triangle()));
    let bsdf = material(&mut desc, grey(0.5));
    let at = DAffine3::from_translation(center) * DAffine3::from_scale(DVec3::splat(size));
    let turned = at * DAffine3::from_axis_angle(DVec3::new(0.3, 0.5, -0.8).normalize(), 0.9);
    let (mesh, ball) = (ShapeKind::Mesh(MeshId(0)), sphere(DVec3::ZERO, 1.0));
    let (of, at) = match kind {
        "triangle" => (mesh, turned),
        "rectangle" => (ShapeKind::Rectangle, turned * DAffine3::from_scale(DVec3::new(1.0, 0.6, 1.0))),
        "disk" => (ShapeKind::Disk, turned),
        "sphere" => (ball, at),
        "cylinder" => {
            let (p0, p1) = (DVec3::NEG_Z, DVec3::Z);
            (ShapeKind::Cylinder { p0, p1, radius: 0.05 }, turned)
        }
        "linear curve" => (curves(CurveBasis::Linear, size), at),
        "cubic curve" => (curves(CurveBasis::BSpline, size), at),
        _ => {
            let inside = if kind == "instance of a triangle" { mesh } else { ball };
            let mut group = empty();
            shape(&mut group, inside, DAffine3::IDENTITY, bsdf, 0.0);
            desc.groups.push(GroupDesc { id: None, place: Place::default(), shapes: group.shapes });
            let stretched = DAffine3::from_scale(DVec3::new(1.0, 0.4, 1.7));
            (ShapeKind::Instance(GroupId(0)), turned * stretched)
        }
    };
    shape(&mut desc, of, at, bsdf, 0.0);
    let scene = Scene::prepare(&desc).expect("a valid scene");
    assert!(scene.notices().is_empty(), "{kind} of size {size} at {center}: {:?}", scene.notices());
    scene
}

/// Rays from each hit.
const EACH: u64 = 16;

/// How many of `rays` that leave a primitive hit it again: as they are spawned, and from a point at a fixed distance from the surface.
pub fn self_hits(kind: &str, size: f64, offset: f64, rays: u64) -> [u64; 2] {
    let center = DVec3::new(0.31, -0.77, 0.55) * (offset * size);
    let scene = alone(kind, size, center);
    let random = &mut Random(size.to_bits() ^ offset.to_bits() >> 7 ^ kind.len() as u64);
    let mut again = [0, 0];
    let mut left = rays;
    while left > 0 {
        let origin = (center + random.direction() * (3.0 * size)).as_vec3();
        let target = (center + random.direction() * (size * random.f64())).as_vec3();
        let Some(at) = (target - origin).try_normalize().and_then(|d| scene.first(&Ray::new(origin, d)))
        else {
            continue;
        };
        for _ in 0..EACH.min(left) {
            let d = leaving(kind, &at, random);
            let fixed = Ray::new(at.point.p + at.point.ng * d.dot(at.point.ng).signum() * 1e-4, d);
            for (again, ray) in again.iter_mut().zip([at.spawn(d), fixed]) {
                *again += u64::from(scene.first(&ray).is_some());
            }
        }
        left -= EACH.min(left);
    }
    again
}

/// A direction away from the surface, half of them within 1e-6 of it: to the front of what has an inside, else to either side.
fn leaving(kind: &str, at: &SurfaceInteraction, random: &mut Random) -> Vec3 {
    let flat = matches!(kind, "triangle" | "rectangle" | "disk" | "instance of a triangle");
    let n = at.point.ng;
    let d = random.direction().as_vec3();
    let grazing = if random.f64() < 0.5 { 1.0 } else { 1e-6 };
    let along = d - n * d.dot(n);
    let d = (along.normalize_or(n.any_orthonormal_vector()) + n * (d.dot(n) * grazing)).normalize();
    if flat || d.dot(n) > 0.0 { d } else { -d }
}
