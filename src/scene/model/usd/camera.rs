//! Cameras of UsdGeom. Focal lengths and apertures are tenths of a unit of the scene.

use glam::{DAffine3, DVec3};

use super::prim::PrimReader;
use crate::scene::model::stage::looking;
use crate::scene::model::text::SceneText;

/// A camera of a stage.
#[derive(Clone, Debug)]
pub(super) struct StageCamera {
    pub(super) path: String,
    focal: f64,
    aperture: [f64; 2],
    offset: [f64; 2],
    clips: [f64; 2],
    f_stop: f64,
    focus: f64,
    orthographic: bool,
}

impl StageCamera {
    /// Reads a `Camera`; defaults are those of UsdGeom.
    pub(super) fn read(prim: &PrimReader) -> Self {
        let number = |name: &str, default: f64| prim.number(name).unwrap_or(default);
        let clips = prim.doubles("clippingRange", 2).unwrap_or_else(|| vec![1.0, 1e6]);
        let exposure = prim.number("exposure").unwrap_or(0.0);
        if exposure != 0.0 {
            prim.fault(
                "`exposure` of a camera is not used: the exposure of the picture is set in the program",
            );
        }
        let projection = prim.word("projection").unwrap_or_default();
        Self {
            path: prim.path.clone(),
            focal: number("focalLength", 50.0),
            aperture: [number("horizontalAperture", 20.955), number("verticalAperture", 15.2908)],
            offset: [number("horizontalApertureOffset", 0.0), number("verticalApertureOffset", 0.0)],
            clips: [clips[0], clips[1]],
            f_stop: number("fStop", 0.0),
            focus: number("focusDistance", 0.0),
            orthographic: projection == "orthographic",
        }
    }

    /// Writes the camera; the first of a stage counts.
    pub(super) fn write(&self, text: &mut SceneText<'_>, to_world: &DAffine3) {
        if text.framed {
            return text.tell("the stage is seen by its first camera: others are not used", &self.path);
        }
        let [width, height] = self.aperture;
        let [mut near, far] = self.clips;
        // A near clip of 0 is usual for parallel rays, and the default of some exporters for others.
        if near <= 0.0 {
            near = far * 1e-7;
        }
        let fov = (2.0 * (0.5 * width / self.focal).atan()).to_degrees();
        let usable = width > 0.0 && height > 0.0 && near > 0.0 && near < far && far.is_finite();
        if !usable || !(self.orthographic || (0.1..179.0).contains(&fov)) {
            return text
                .tell("a camera with apertures or clips that make no picture is not used", &self.path);
        }
        let aspect = Some(width / height).filter(|aspect| (0.05..20.0).contains(aspect));
        if aspect.is_none() {
            text.tell(
                "a camera that is wider or higher than 20 to 1 has the shape of the window",
                &self.path,
            );
        }
        let at = looking(to_world);
        let clips = |text: &mut SceneText<'_>| {
            text.value("float", "near_clip", near);
            text.value("float", "far_clip", far);
        };
        // The film is moved, so that the axis meets it on the other side of its middle; v is downwards there.
        let offset = |text: &mut SceneText<'_>| {
            if self.offset != [0.0; 2] {
                text.value("float", "principal_point_offset_x", self.offset[0] / width);
                text.value("float", "principal_point_offset_y", -self.offset[1] / height);
            }
        };
        if self.orthographic {
            let half = 0.05 * width;
            text.sensor("orthographic", aspect, |text| {
                text.transform("to_world", &(at * DAffine3::from_scale(DVec3::new(half, half, 1.0))));
                clips(text);
                offset(text);
            });
            text.framed = true;
            return;
        }
        // A lens needs a distance at which it is sharp.
        let lens = self.f_stop > 0.0 && self.focus > 0.0;
        let kind = if lens { "thinlens" } else { "perspective" };
        text.sensor(kind, aspect, |text| {
            text.value("float", "fov", fov);
            text.value("string", "fov_axis", "x");
            text.transform("to_world", &at);
            clips(text);
            if lens {
                // The diameter of the lens is its focal length over its f-number; both of these are in tenths of a unit.
                text.value("float", "aperture_radius", 0.1 * self.focal / (2.0 * self.f_stop));
                text.value("float", "focus_distance", self.focus);
            }
            offset(text);
        });
        text.framed = true;
    }
}
