//! Lights of every solid angle: tiny, near, edge-on, around the lit point, and made of what has no area.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use pointillist::math::frame::Frame;
use pointillist::math::pdf::PdfW;
use pointillist::math::warp;
use pointillist::scene::desc::{Mesh, MeshId, SceneDesc, ShapeKind};
use pointillist::tracer::accel::Ray;
use pointillist::tracer::light::{LightSampleContext, Lights};
use pointillist::tracer::{Scene, mis};

use crate::Row;
use crate::support::accel::icosphere;
use crate::support::scenes::{Random, empty, grey, luminances, material, prepare, shape, sphere};

/// A scene of one light of radiance 1.
fn one_light(kind: ShapeKind, to_world: DAffine3, flip: bool) -> Scene {
    let mut desc = empty();
    let black = material(&mut desc, grey(0.0));
    if matches!(kind, ShapeKind::Mesh(_)) {
        let positions =
            vec![Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(-1.0, 1.0, 0.0)];
        desc.meshes.push(Arc::new(Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() }));
    }
    shape(&mut desc, kind, to_world, black, 1.0);
    desc.shapes[0].flip_normals = flip;
    prepare(&desc)
}

fn lit(p: Vec3, n: Vec3) -> LightSampleContext {
    LightSampleContext { p, n, through: false, glossy: false }
}

/// Numbers in the middles of a grid over the unit square.
fn grid(side: u32) -> impl Iterator<Item = [f32; 2]> {
    let middle = move |i: u32| (i as f32 + 0.5) / side as f32;
    (0..side * side).map(move |i| [middle(i % side), middle(i / side)])
}

/// The irradiance at a point by sampling the light alone, and by that together with directions by the cosine, which the power heuristic weights.
fn irradiance(scene: &Scene, at: LightSampleContext, side: u32) -> [f64; 2] {
    let lights: &Lights = scene.lights();
    let (mut alone, mut both) = (0.0, 0.0);
    let cosine = |wi: Vec3| warp::cosine_hemisphere_pdf(wi.dot(at.n));
    for u in grid(side) {
        if let Some((_, sample)) = lights.sample(at, 0.5, u)
            && sample.wi.dot(at.n) > 0.0
        {
            assert!(sample.wi.is_finite() && sample.pdf.0 > 0.0, "{sample:?}");
            let value = f64::from(sample.wi.dot(at.n)) / f64::from(sample.pdf.0);
            let weight = f64::from(mis::power(sample.pdf, PdfW(cosine(sample.wi))));
            (alone, both) = (alone + value, both + value * weight);
        }
        let wi = Frame::new(at.n).to_world(warp::cosine_hemisphere(u));
        if let Some(hit) = scene.first(&Ray::new(at.p, wi))
            && let Some(light) = hit.emitter()
        {
            let pdf = lights.pdf(light, at, wi, Some(&hit.point));
            both += PI * f64::from(mis::power(PdfW(cosine(wi)), pdf));
        }
    }
    [alone, both].map(|sum| sum / f64::from(side * side))
}

/// The irradiance of a polygon of radiance 1, all above the horizon (Lambert 1760), by the angles between its corners, which do not cancel.
fn of_polygon(corners: &[DVec3], p: DVec3, n: DVec3) -> f64 {
    let around = |i: usize| {
        let [a, b] = [i, (i + 1) % corners.len()].map(|k| (corners[k] - p).normalize());
        let cross = a.cross(b);
        let angle = cross.length().atan2(a.dot(b));
        cross.normalize_or_zero().dot(n) * angle
    };
    (0.5 * (0..corners.len()).map(around).sum::<f64>()).abs()
}

/// The irradiance of a polygon by its solid angle where that is small, by Lambert's formula else.
fn expected(corners: &[DVec3], n: DVec3) -> f64 {
    let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
    let size = corners[0].distance(corners[1]);
    if middle.length() < 300.0 * size {
        return of_polygon(corners, DVec3::ZERO, n);
    }
    let spread = |i: usize| (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]);
    let area = 0.5 * (1..corners.len() - 1).map(spread).sum::<DVec3>();
    let w = middle.normalize();
    area.dot(w).abs() * w.dot(n) / middle.length_squared()
}

/// Flat lights from 10⁻¹² sr to nearly the hemisphere give the irradiance of the closed form. Sampling the light alone is lost next to it.
///
/// The bound is what a grid of 512² leaves of an integrand with edges.
#[test]
fn n10_flat_lights() {
    let rectangle = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    for (name, kind, corners) in [
        ("rectangle", ShapeKind::Rectangle, &rectangle[..]),
        ("triangle", ShapeKind::Mesh(MeshId(0)), &[(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0)][..]),
        ("disk", ShapeKind::Disk, &[][..]),
    ] {
        let (mut figure, mut naive) = (0.0f64, 0.0f64);
        for height in [1e-6, 1e-3, 0.03, 1.0, 30.0, 1e3, 1e6] {
            // Seen along z, from a place above the inner part of all of them.
            let to_world =
                DAffine3::from_translation(DVec3::new(0.4, 0.3, height)) * DAffine3::from_rotation_x(PI);
            let scene = one_light(kind.clone(), to_world, false);
            let corners: Vec<DVec3> =
                corners.iter().map(|&(x, y)| to_world.transform_point3(DVec3::new(x, y, 0.0))).collect();
            let wanted = match corners.is_empty() {
                false => expected(&corners, DVec3::Z),
                // A disk off the axis by δ (Foote 1915).
                true => {
                    let (h2, d2) = (height * height, 0.25);
                    let sum = 1.0 + d2 + h2;
                    // 1 − (h² + δ² − 1) / √(…), without cancellation.
                    let root = (sum * sum - 4.0 * d2).sqrt();
                    let share = (root * root - (h2 + d2 - 1.0).powi(2)) / (root * (root + (h2 + d2 - 1.0)));
                    0.5 * PI * if h2 + d2 > 1.0 { share } else { 1.0 - (h2 + d2 - 1.0) / root }
                }
            };
            let [alone, both] = irradiance(&scene, lit(Vec3::ZERO, Vec3::Z), 512);
            println!("{name} at {height:e}: {both} of {wanted}, the light alone {alone}");
            (figure, naive) =
                (figure.max((both / wanted - 1.0).abs()), naive.max((alone / wanted - 1.0).abs()));
        }
        Row {
            case: &format!("N10 {name} from 1e-12 sr to the hemisphere"),
            measure: "relative error of the irradiance",
            figure,
            naive: ("samples of the light alone", naive),
            bound: 2e-3,
        }
        .check();
    }
}

/// A light in the plane of the lit surface, or seen edge-on, gives nothing more than rounding lets through, and no sample that is no number.
///
/// The naive method takes the cosine at the light as positive, as one that is not to be negative. The bound is one unit roundoff of
/// coordinates over the least distance to the light, 10⁻³.
#[test]
fn n10_edge_on() {
    let random = &mut Random(13);
    let (mut figure, mut naive) = (0.0f64, 0.0f64);
    for _ in 0..200 {
        let turn = DAffine3::from_axis_angle(random.direction(), random.f64() * 3.0);
        let scene = one_light(ShapeKind::Rectangle, turn, false);
        // In its plane, beside it.
        let p = turn.transform_point3(DVec3::new(1.0 + 10f64.powf(-3.0 * random.f64()), random.f64(), 0.0));
        let n = -p.normalize();
        let at = lit(p.as_vec3(), n.as_vec3());
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let normal = turn.transform_vector3(DVec3::Z);
        let most = of_polygon(
            &corners.map(|(x, y)| turn.transform_point3(DVec3::new(x, y, 0.0)) + normal * 0.5),
            p,
            n,
        );
        let [_, both] = irradiance(&scene, at, 64);
        let unclamped: f64 = grid(64)
            .filter_map(|u| {
                let target = turn.transform_point3(DVec3::new(
                    2.0 * f64::from(u[0]) - 1.0,
                    2.0 * f64::from(u[1]) - 1.0,
                    0.0,
                ));
                let to = target.as_vec3() - at.p;
                let d2 = to.length_squared();
                let wi = to / d2.sqrt();
                let cos = (-wi.dot(normal.as_vec3())).abs().max(1e-4);
                let seen = wi.dot(at.n).max(0.0);
                (seen > 0.0).then_some(4.0 * f64::from(seen * cos / d2) / 4096.0)
            })
            .sum();
        (figure, naive) = (figure.max(both / most), naive.max(unclamped / most));
    }
    Row {
        case: "N10 rectangle in the plane of the lit point",
        measure: "irradiance over that half an edge above it",
        figure,
        naive: ("cosine of at least 1e-4", naive),
        bound: 6e-5,
    }
    .check();
}

/// 1 − cos of the half angle of a sphere, by subtraction in single precision.
fn naive_cone(r: f32, d: f32) -> f32 {
    1.0 - (1.0 - (r / d) * (r / d)).max(0.0).sqrt()
}

/// A sphere light of every size gives π (r/d)² times the cosine, and π from within; also just above it and just inside.
///
/// The bound is what the issue asks for.
#[test]
fn n11_sphere_lights() {
    let random = &mut Random(19);
    for (distance, tilt) in [
        (1e8, 0.0),
        (1e8, 1.2),
        (1e5, 0.7),
        (1e3, 1.2),
        (10.0, 1.2),
        (2.0, 0.9),
        (1.1, 0.3),
        (1.001_001, 0.0),
        (0.999, 0.5),
        (0.5, 2.0),
        (0.0, 1.0),
    ] {
        let inside = distance < 1.0;
        let (mut figure, mut naive) = (0.0f64, 0.0f64);
        for _ in 0..4 {
            let to = random.direction();
            let center = to * distance;
            let scene = one_light(sphere(center, 1.0), DAffine3::IDENTITY, inside);
            let n = to * f64::cos(tilt) + to.any_orthonormal_vector() * f64::sin(tilt);
            // Exactly as far as single precision has it.
            let d = center.as_vec3().as_dvec3();
            let n = n.normalize().as_vec3();
            let cos = n.as_dvec3().dot(d.normalize_or_zero());
            let wanted = if inside { PI } else { PI * cos / d.length_squared() };
            let at = lit(Vec3::ZERO, n);
            let sum: f64 = grid(1024)
                .filter_map(|u| {
                    let (_, sample) = scene.lights().sample(at, 0.5, u)?;
                    Some(f64::from(sample.wi.dot(n).max(0.0)) / f64::from(sample.pdf.0))
                })
                .sum();
            figure = figure.max((sum / f64::from(1u32 << 20) / wanted - 1.0).abs());
            // The solid angle times the cosine of the axis, and from within all directions by their plain mean.
            let solid = 2.0 * PI * f64::from(naive_cone(1.0, distance as f32));
            naive = naive.max((solid * cos / wanted - 1.0).abs());
        }
        let what = if inside { "from within" } else { "from outside" };
        Row {
            case: &format!("N11 sphere light, {distance} radii from its centre, {what}"),
            measure: "relative error of the irradiance",
            figure,
            naive: ("1 − cos by subtraction", naive),
            bound: 1e-4,
        }
        .check();
    }
}

/// Lights at up to 10¹² give what their solid angle says: no square of a density overflows.
///
/// The bound is the rounding of a density, of half a dozen operations.
#[test]
fn n12_far_lights() {
    for distance in [1e10, 1e11, 9e11] {
        let to_world = DAffine3::from_translation(DVec3::Z * distance) * DAffine3::from_rotation_x(PI);
        let scene = one_light(ShapeKind::Rectangle, to_world, false);
        let at = lit(Vec3::ZERO, Vec3::Z);
        let (mut sum, mut naive) = (0.0, 0.0);
        for u in grid(64) {
            let (_, sample) = scene.lights().sample(at, 0.5, u).unwrap();
            let cosine = warp::cosine_hemisphere_pdf(sample.wi.z);
            let value = f64::from(sample.wi.z / sample.pdf.0) / 4096.0;
            sum += value * f64::from(mis::power(sample.pdf, PdfW(cosine)));
            let [a, b] = [sample.pdf.0 * sample.pdf.0, cosine * cosine];
            naive += value * f64::from(a / (a + b));
        }
        let wanted = 4.0 / (distance * distance);
        Row {
            case: &format!("N12 light of area 4 at a distance of {distance:e}"),
            measure: "relative error of the irradiance",
            figure: (sum / wanted - 1.0).abs(),
            naive: ("p² / (p² + q²)", (naive / wanted - 1.0).abs()),
            bound: 1e-6,
        }
        .check();
    }
}

/// An icosphere, and among its triangles some that have no area, no place, or an area of 10⁻³⁰.
fn faulty(with_faults: bool) -> SceneDesc {
    let (points, faces) = icosphere(2);
    let mut positions: Vec<Vec3> = points.iter().map(|p| p.as_vec3()).collect();
    let mut triangles: Vec<[u32; 3]> = faces.iter().map(|f| f.map(|i| i as u32)).collect();
    let mut add = |corners: [Vec3; 3]| {
        let first = positions.len() as u32;
        positions.extend(corners);
        triangles.insert(triangles.len() / 2, [first, first + 1, first + 2]);
    };
    // Small, but a triangle as any other.
    add([Vec3::ZERO, Vec3::X * 1.4e-15, Vec3::Y * 1.4e-15]);
    if with_faults {
        let (a, b) = (Vec3::X, Vec3::Y);
        add([a, b, a + (b - a) * 0.5]);
        add([a, a, b]);
        add([a, a, a]);
        add([Vec3::ZERO, Vec3::X * 1e-23, Vec3::Y * 1e-23]);
        add([a, b, Vec3::new(0.0, f32::NAN, 0.0)]);
        add([a, b, Vec3::new(0.0, 0.0, f32::INFINITY)]);
        add([a, b, Vec3::new(0.0, 0.0, 3e12)]);
    }
    let mut desc = empty();
    let white = material(&mut desc, grey(0.5));
    desc.camera.perspective_mut().unwrap().fov = 40.0;
    desc.meshes.push(Arc::new(Mesh { positions, triangles, ..Mesh::default() }));
    shape(&mut desc, ShapeKind::Mesh(MeshId(0)), DAffine3::from_translation(DVec3::Z * 4.0), white, 1.0);
    shape(&mut desc, sphere(DVec3::new(0.0, -2.5, 5.0), 1.2), DAffine3::IDENTITY, white, 0.0);
    desc
}

/// Triangles without area or place are left out of the tree and of the lights, and counted in a notice: paths are the same bits as without
/// them, and the probabilities of all lights add up to 1. Areas as they are give a sum that is no number.
#[test]
fn n5_degenerate_triangles() {
    let [clean, faults] = [false, true].map(faulty);
    let (scene, whole) = (prepare(&faults), prepare(&clean));
    let told = scene.notices().iter().find(|n| n.contains("7 primitives have no area"));
    assert!(told.is_some() && whole.notices().is_empty(), "{:?} {:?}", scene.notices(), whole.notices());
    assert_eq!(scene.lights().len(), whole.lights().len());
    assert_eq!(luminances(&faults, 4096), luminances(&clean, 4096));
    let random = &mut Random(23);
    let mut figure = 0.0f64;
    for _ in 0..200 {
        let p = (random.direction() * 3.0 + DVec3::Z * 4.0).as_vec3();
        let at = lit(p, random.direction().as_vec3());
        let sum: f64 =
            (0..scene.lights().len()).map(|i| f64::from(scene.lights().probability(i as u32, at))).sum();
        figure = figure.max((sum - 1.0).abs());
    }
    let mesh = &faults.meshes[0];
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    let areas: Vec<f32> = mesh.triangles.iter().map(area).collect();
    let total: f32 = areas.iter().sum();
    Row {
        case: "N5 mesh of 320 triangles that emits, with 7 that are none and one of area 1e-30",
        measure: "error of the sum of the probabilities of all lights",
        figure,
        naive: ("areas as they are", areas.iter().map(|a| f64::from(a / total)).sum::<f64>() - 1.0),
        bound: 1e-5,
    }
    .check();
}
