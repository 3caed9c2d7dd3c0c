//! Lights (`KHR_lights_punctual`) and cameras that nodes place.

use glam::{DAffine3, DVec3};
use gltf::camera::Projection;
use gltf::khr_lights_punctual::{Kind, Light};

use crate::scene::model::stage::looking;
use crate::scene::model::text::SceneText;

/// The far end of a camera that has none.
const FAR: f64 = 1e9;

/// Writes a light (`KHR_lights_punctual`), which shines along −z of its node.
pub(super) fn light(text: &mut SceneText<'_>, light: &Light<'_>, to_world: &DAffine3) {
    let rgb = light.color().map(|c| (c * light.intensity()).max(0.0));
    let id = text.id(light.name().unwrap_or("light"));
    if !rgb.iter().all(|v| v.is_finite()) {
        return text.note(format!("the light `{id}` has an intensity that is no number: it is left out"));
    }
    text.lit = true;
    let [position, ahead] = [to_world.translation, to_world.transform_vector3(DVec3::NEG_Z)];
    let words = |v: DVec3| format!("{} {} {}", v.x, v.y, v.z);
    match light.kind() {
        Kind::Directional => text.object("emitter", "directional", &[("id", &id)], |text| {
            text.value("vector", "direction", words(ahead));
            text.rgb("irradiance", rgb);
        }),
        Kind::Point => text.object("emitter", "point", &[("id", &id)], |text| {
            text.value("point", "position", words(position));
            text.rgb("intensity", rgb);
        }),
        Kind::Spot { inner_cone_angle, outer_cone_angle } => {
            let outer = f64::from(outer_cone_angle).to_degrees().clamp(0.1, 90.0);
            let inner = f64::from(inner_cone_angle).to_degrees().clamp(0.0, outer * 0.999);
            text.object("emitter", "spot", &[("id", &id)], |text| {
                text.transform("to_world", &looking(to_world));
                text.rgb("intensity", rgb);
                text.value("float", "cutoff_angle", outer);
                text.value("float", "beam_width", inner);
            });
        }
    }
}

/// Writes a camera; the first of the scene counts.
pub(super) fn camera(text: &mut SceneText<'_>, camera: &gltf::Camera<'_>, to_world: &DAffine3) {
    let place = format!("cameras[{}]", camera.index());
    if text.framed {
        return text.tell("the model is seen by its first camera: others are not used", &place);
    }
    let unusable = |text: &mut SceneText<'_>| {
        text.tell("a camera with a field of view or clips that make no picture is not used", &place);
    };
    let (near, far, aspect) = match camera.projection() {
        Projection::Perspective(lens) => (lens.znear(), lens.zfar(), lens.aspect_ratio().map(f64::from)),
        Projection::Orthographic(lens) => {
            (lens.znear(), Some(lens.zfar()), Some(f64::from(lens.xmag()) / f64::from(lens.ymag())))
        }
    };
    let (near, far) = (f64::from(near), far.map_or(FAR, f64::from));
    let is_orthographic = matches!(camera.projection(), Projection::Orthographic(_));
    // Parallel rays may begin at the camera itself.
    let near = if is_orthographic && near == 0.0 { far * 1e-6 } else { near };
    if !(near > 0.0 && near < far && far.is_finite()) {
        return unusable(text);
    }
    let shown = aspect.filter(|aspect| (0.05..20.0).contains(aspect));
    let clips = |text: &mut SceneText<'_>| {
        text.value("float", "near_clip", near);
        text.value("float", "far_clip", far);
    };
    match camera.projection() {
        Projection::Perspective(lens) => {
            let fov = f64::from(lens.yfov()).to_degrees();
            if !(0.1..179.0).contains(&fov) {
                return unusable(text);
            }
            text.camera(fov, "y", shown, |text| {
                text.transform("to_world", &looking(to_world));
                clips(text);
            });
        }
        Projection::Orthographic(lens) => {
            // The transform gives half the width; a picture that is mirrored by a negative one is not.
            let half = f64::from(lens.xmag()).abs();
            if !(half.is_normal() && shown.is_some()) {
                return unusable(text);
            }
            text.sensor("orthographic", shown, |text| {
                let scale = DAffine3::from_scale(DVec3::new(half, half, 1.0));
                text.transform("to_world", &(looking(to_world) * scale));
                clips(text);
            });
        }
    }
    text.framed = true;
    if aspect.is_some() && shown.is_none() {
        text.tell("a camera that is wider or higher than 20 to 1 has the shape of the window", &place);
    }
}
