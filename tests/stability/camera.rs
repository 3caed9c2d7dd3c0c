//! Cameras whose transforms are not quite rotations, and the edges of panoramas and distorted lenses.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec3, Vec3};

use pointillist::scene::desc::*;
use pointillist::stream::UvWindow;
use pointillist::tracer::Camera;

use crate::Row;
use crate::support::scenes::{empty, look};

/// A scene whose camera has a sheared transform.
fn sheared(by: f64) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.3, -0.2, -1.0), 60.0);
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(by, 1.0, 0.0), DVec3::new(by, -2.0 * by, 1.0));
    desc.camera.to_world *= DAffine3::from_mat3(shear);
    desc
}

/// The places of the picture where directions are asked for.
fn places() -> impl Iterator<Item = [f64; 2]> {
    (0..100).map(|i| [0.05 + 0.1 * f64::from(i % 10), 0.05 + 0.1 * f64::from(i / 10)])
}

/// The solid angle of a small square of the picture around `uv`, over its area.
fn steradians_per_uv(camera: &Camera, uv: [f64; 2]) -> f64 {
    let step = 1e-3;
    let d = |du: f64, dv: f64| {
        camera.ray([uv[0] + du * step, uv[1] + dv * step], [0.5; 2]).unwrap().direction.as_dvec3()
    };
    let across = (d(0.5, 0.0) - d(-0.5, 0.0)).cross(d(0.0, 0.5) - d(0.0, -0.5));
    across.length() / (step * step)
}

/// Directions are unit vectors, and the density of rays is that of the solid angle they cover.
#[test]
fn b13_sheared_cameras() {
    for by in [1e-3, 0.1] {
        let desc = sheared(by);
        let camera = Camera::of(&desc).unwrap();
        let axes = desc.camera.to_world.matrix3;
        let axes = [axes.x_axis, axes.y_axis, axes.z_axis].map(DVec3::normalize);
        // As if the axes were perpendicular.
        let naive_length = |uv: [f64; 2]| {
            let d = camera.ray(uv, [0.5; 2]).unwrap().direction.as_dvec3();
            let local = DMat3::from_cols(axes[0], axes[1], axes[2]).inverse() * d;
            1.0 / local.length()
        };
        let worst =
            |of: &dyn Fn([f64; 2]) -> f64| places().map(|uv| (of(uv) - 1.0).abs()).fold(0.0, f64::max);
        Row {
            case: &format!("B13 camera sheared by {by}"),
            measure: "length of directions",
            figure: worst(&|uv| f64::from(camera.ray(uv, [0.5; 2]).unwrap().direction.length())),
            naive: ("axes as perpendicular", worst(&naive_length)),
            bound: 3e-7,
        }
        .check();
        let density = |uv: [f64; 2]| camera.start(uv, [0.5; 2]).unwrap().uv_per_steradian;
        let naive_density = |uv: [f64; 2]| {
            let cos = camera.ray(uv, [0.5; 2]).unwrap().direction.as_dvec3().dot(axes[2]);
            f64::from(density([0.5; 2])) * steradians_per_uv(&camera, uv) / cos.powi(3)
        };
        Row {
            case: &format!("B13 camera sheared by {by}"),
            measure: "density of rays × solid angle",
            figure: worst(&|uv| f64::from(density(uv)) * steradians_per_uv(&camera, uv)),
            naive: ("1 / cos³", worst(&naive_density)),
            bound: 5e-4,
        }
        .check();
    }
}

/// A camera of this projection at the origin, with a picture of 64 × 64 pixels.
fn at_origin(projection: ProjectionDesc) -> Camera {
    let mut desc = empty();
    desc.camera = CameraDesc { projection, to_world: DAffine3::IDENTITY, ..desc.camera };
    (desc.film.width, desc.film.height) = (64, 64);
    Camera::of(&desc).unwrap()
}

/// The distance of `p` from the ray of the place where the camera claims to see it, and 0 where it does not claim so.
fn miss(camera: &Camera, p: Vec3, uv: Option<[f64; 2]>) -> f64 {
    let Some(ray) = uv.and_then(|uv| camera.ray(uv, [0.5; 2])) else { return 0.0 };
    let to = p - ray.origin;
    f64::from((to - ray.direction * to.dot(ray.direction)).length())
}

fn seen(camera: &Camera, p: Vec3, window: &UvWindow) -> Option<[f64; 2]> {
    camera.view(p, [0.5; 2], window).map(|view| view.uv.map(f64::from))
}

/// Near a pole the latitude comes from a small horizontal distance.
#[test]
fn b14_poles_of_a_panorama() {
    let camera = at_origin(ProjectionDesc::Spherical);
    let (mut figure, mut naive) = (0.0f64, 0.0f64);
    for i in 0..40 {
        let v = 10f64.powf(-6.0 + 0.1 * f64::from(i));
        let (sin, cos) = (PI * v).sin_cos();
        let p = (DVec3::new(0.6 * sin, cos, 0.8 * sin) * 3.0).as_vec3();
        let found = seen(&camera, p, &UvWindow::PICTURE).unwrap()[1];
        figure = figure.max((found / v - 1.0).abs());
        let by_cosine = f64::from((p.y / p.length()).clamp(-1.0, 1.0)).acos() / PI;
        naive = naive.max((by_cosine / v - 1.0).abs());
    }
    Row {
        case: "B14 panorama, 1e-6 to 1e-2 from a pole",
        measure: "relative error of v",
        figure,
        naive: ("arc cosine", naive),
        bound: 1e-5,
    }
    .check();
}

/// What lies behind the camera has a place at both edges of the picture: in it, and in the overscan.
#[test]
fn b14_seam_of_a_panorama() {
    let camera = at_origin(ProjectionDesc::Spherical);
    let window = UvWindow { min: [-0.1; 2], max: [1.1; 2] };
    let (mut figure, mut naive) = (0.0f64, 0.0f64);
    for i in 0..20 {
        let u = 0.901 + 0.005 * f64::from(i);
        let ray = camera.ray([u, 0.4], [0.5; 2]).unwrap();
        let p = ray.origin + ray.direction * 2.0;
        let places = [0.25, 0.75].map(|n| camera.view(p, [0.5, n], &window).unwrap());
        // Both, each with half the probability.
        let sum: f64 = places.iter().map(|view| f64::from(view.choices) * 0.5).sum();
        let apart = f64::from((places[0].uv[0] - places[1].uv[0]).abs());
        figure = figure.max((sum - 2.0).abs().max((apart - 1.0).abs()));
        naive = naive.max(2.0 - 1.0);
    }
    Row {
        case: "B14 panorama, beside the seam",
        measure: "places that are missed",
        figure,
        naive: ("one place for a direction", naive),
        bound: 1e-5,
    }
    .check();
}

/// No ray of an eye comes from inside the circle of the eyes.
#[test]
fn b14_points_inside_the_circle_of_the_eyes() {
    let stereo = StereoDesc { interocular: 0.5, eyes: StereoEyes::Right };
    let camera = at_origin(ProjectionDesc::Stereo(stereo));
    let (mut figure, mut naive) = (0.0f64, 0.0f64);
    for i in 0..200 {
        let (angle, distance) = (0.7 * f64::from(i), 0.0025 * f64::from(i));
        let p = DVec3::new(distance * angle.sin(), 0.3, distance * angle.cos());
        figure = figure.max(miss(&camera, p.as_vec3(), seen(&camera, p.as_vec3(), &UvWindow::PICTURE)));
        let ahead = (distance * distance - 0.0625).max(0.0).sqrt();
        let phi = p.x.atan2(-p.z) - 0.25f64.atan2(ahead);
        let uv = [(phi / TAU).rem_euclid(1.0), ahead.atan2(p.y) / PI];
        naive = naive.max(miss(&camera, p.as_vec3(), Some(uv)));
    }
    Row {
        case: "B14 point inside the circle of the eyes",
        measure: "distance from its ray",
        figure,
        naive: ("square root of 0", naive),
        bound: 1e-5,
    }
    .check();
}

/// Beyond the fold of a distortion two directions would have one place.
#[test]
fn b14_distortion_that_folds_over() {
    let distortion = DistortionDesc { radial: [-0.5, 0.0, 0.0, 0.0, 0.0, 0.0], ..DistortionDesc::default() };
    let camera = at_origin(ProjectionDesc::Perspective(PerspectiveDesc {
        fov: 90.0,
        fov_axis: FovAxis::X,
        lens: LensDesc::PINHOLE,
        distortion: Some(distortion),
    }));
    let (mut figure, mut naive) = (0.0f64, 0.0f64);
    for i in 0..300 {
        let (angle, r) = (0.3 * f64::from(i), 0.005 * f64::from(i));
        let p = DVec3::new(r * angle.cos(), r * angle.sin(), 1.0);
        figure = figure.max(miss(&camera, p.as_vec3(), seen(&camera, p.as_vec3(), &UvWindow::PICTURE)));
        let distorted = p * (1.0 - 0.5 * r * r);
        let uv = [0.5 - 0.5 * distorted.x, 0.5 - 0.5 * distorted.y];
        naive = naive.max(miss(&camera, p.as_vec3(), Some(uv)));
    }
    Row {
        case: "B14 distortion that folds over",
        measure: "distance from its ray",
        figure,
        naive: ("the polynomial everywhere", naive),
        bound: 1e-4,
    }
    .check();
}
