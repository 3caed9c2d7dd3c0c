//! The stage for a model that has neither lights nor a camera: a light all around, and a camera that sees all of the model.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec3};

use crate::scene::desc::{CameraDesc, SceneDesc, ShapeDesc, ShapeKind};

/// Field of view along the smaller side of the picture, in degrees: that of a portrait lens, which does not distort.
pub(super) const FOV: f64 = 35.0;

/// From the model to the camera: a view from the front, its left side and above. Up is +y and the front +z, as in glTF.
const TO_CAMERA: DVec3 = DVec3::new(0.56, 0.38, 0.8);

/// From the model to the lamp: beside the camera at its left, above it.
const TO_LAMP: DVec3 = DVec3::new(-0.25, 0.85, 0.7);

/// Radiance in the middle of the lamp, and its standard deviation as an angle in radians: a soft box that gives an irradiance of
/// about 2.6 where it is faced, half as much again as the sky.
const LAMP: [f64; 2] = [8.0, 0.23];

/// Columns and rows of the picture of the sky.
const SKY: [usize; 2] = [256, 128];

/// A sky for models as a picture in latitude and longitude (PFM): a horizon as bright as paper, blue above it, a grey floor
/// below, and a soft lamp. A white surface that faces the lamp has a radiance of about 1.
pub(super) fn sky() -> Vec<u8> {
    let [width, height] = SKY;
    let mut out = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
    let lamp = TO_LAMP.normalize();
    for row in (0..height).rev() {
        for column in 0..width {
            let (theta, phi) =
                (PI * (row as f64 + 0.5) / height as f64, TAU * (column as f64 + 0.5) / width as f64);
            let direction = DVec3::new(phi.sin() * theta.sin(), theta.cos(), -phi.cos() * theta.sin());
            let [peak, width] = LAMP;
            let angle = direction.dot(lamp).clamp(-1.0, 1.0).acos();
            let light =
                air(direction.y) + DVec3::new(1.0, 0.96, 0.9) * peak * (-0.5 * (angle / width).powi(2)).exp();
            out.extend(light.as_vec3().to_array().iter().flat_map(|v| v.to_le_bytes()));
        }
    }
    out
}

/// The sky without the lamp, by the sine of the elevation.
fn air(y: f64) -> DVec3 {
    let (zenith, horizon, floor) =
        (DVec3::new(0.30, 0.38, 0.52), DVec3::new(0.62, 0.64, 0.66), DVec3::new(0.22, 0.21, 0.20));
    if y > 0.0 { horizon.lerp(zenith, y.sqrt()) } else { horizon.lerp(floor, (-y * 6.0).min(1.0).sqrt()) }
}

/// The transform of what looks along −z with +x to the right, as one that looks along +z with +x to the left, without scale.
pub(super) fn looking(to_world: &DAffine3) -> DAffine3 {
    let ahead = to_world.transform_vector3(DVec3::NEG_Z).normalize();
    let up = to_world.transform_vector3(DVec3::Y);
    let left = up.cross(ahead).normalize_or(ahead.any_orthonormal_vector());
    DAffine3::from_mat3_translation(DMat3::from_cols(left, ahead.cross(left), ahead), to_world.translation)
}

/// Moves the camera so that it sees the whole model, from the front, its side and above.
pub(crate) fn frame(desc: &mut SceneDesc) {
    let Some((center, radius)) = bounds(desc) else { return };
    let backwards = TO_CAMERA.normalize();
    let Some(perspective) = desc.camera.perspective() else { return };
    let distance = radius / (0.5 * perspective.fov).to_radians().sin();
    let left = DVec3::Y.cross(-backwards).normalize();
    let up = (-backwards).cross(left);
    desc.camera = CameraDesc {
        to_world: DAffine3::from_mat3_translation(
            DMat3::from_cols(left, up, -backwards),
            center + distance * backwards,
        ),
        near_clip: 1e-3 * distance,
        far_clip: 1e3 * distance,
        ..desc.camera.clone()
    };
}

/// Middle of the box around all shapes, and the distance from there of what is farthest.
fn bounds(desc: &SceneDesc) -> Option<(DVec3, f64)> {
    let mut boxed = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    points(desc, &mut |p| boxed = [boxed[0].min(p), boxed[1].max(p)]);
    let center = 0.5 * (boxed[0] + boxed[1]);
    let mut radius2: f64 = 0.0;
    points(desc, &mut |p| radius2 = radius2.max(p.distance_squared(center)));
    (center.is_finite() && radius2 > 0.0 && radius2.is_finite()).then(|| (center, radius2.sqrt()))
}

/// Calls `visit` with every vertex of meshes and every control point of curves in the world. Other shapes of models are lights.
fn points(desc: &SceneDesc, visit: &mut impl FnMut(DVec3)) {
    for shape in &desc.shapes {
        let instance = matches!(shape.kind, ShapeKind::Instance(_));
        let outer = if instance { shape.to_world } else { DAffine3::IDENTITY };
        for ShapeDesc { kind, to_world, .. } in desc.parts(shape) {
            let to_world = outer * *to_world;
            let mut at = |p: glam::Vec3| visit(to_world.transform_point3(p.as_dvec3()));
            match kind {
                ShapeKind::Mesh(id) => {
                    let mesh = desc.meshes.get(id.0 as usize);
                    mesh.iter().flat_map(|mesh| &mesh.positions).for_each(|p| at(*p));
                }
                ShapeKind::Curves(curves) => curves.points.iter().for_each(|p| at(p.truncate())),
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The irradiance that [`LAMP`] and [`sky`] promise.
    #[test]
    fn white_that_faces_the_lamp_is_white() {
        let bytes = sky();
        let header = bytes.len() - SKY[0] * SKY[1] * 12;
        let irradiance = |normal: DVec3| -> f64 {
            let texel = |i: usize| {
                let (row, column) = (SKY[1] - 1 - i / SKY[0], i % SKY[0]);
                let theta = PI * (row as f64 + 0.5) / SKY[1] as f64;
                let phi = TAU * (column as f64 + 0.5) / SKY[0] as f64;
                let direction = DVec3::new(phi.sin() * theta.sin(), theta.cos(), -phi.cos() * theta.sin());
                let at = header + 12 * i + 4;
                let green = f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
                f64::from(green) * theta.sin() * direction.dot(normal).max(0.0)
            };
            let sum: f64 = (0..SKY[0] * SKY[1]).map(texel).sum();
            sum * (PI / SKY[1] as f64) * (TAU / SKY[0] as f64)
        };
        let facing = irradiance(TO_LAMP.normalize()) / PI;
        assert!((0.9..1.5).contains(&facing), "{facing}");
        let away = irradiance(-TO_LAMP.normalize()) / PI;
        assert!((0.15..0.5).contains(&away), "{away}");
    }
}
