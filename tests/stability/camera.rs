//! Cameras whose transforms are not quite rotations.

use glam::{DAffine3, DMat3, DVec3};

use pointillist::scene::desc::SceneDesc;
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
