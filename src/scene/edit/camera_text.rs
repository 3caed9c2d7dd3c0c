//! A camera as a sensor of a scene file.

use std::fmt::Write as _;

use glam::{DMat4, DVec2};

use crate::scene::desc::{CameraDesc, FovAxis, PerspectiveDesc, ProjectionDesc};
use crate::scene::mitsuba::{AXES, EYES, LAYOUTS, MAPPINGS, PRISM, RADIAL, TANGENTIAL};

/// The lines of the parameters of a sensor.
struct ParameterLines {
    indent: String,
    text: String,
}

impl ParameterLines {
    fn float(&mut self, name: &str, value: f64) {
        let _ = writeln!(self.text, "{}<float name=\"{name}\" value=\"{value:?}\"/>", self.indent);
    }

    fn string(&mut self, name: &str, value: &str) {
        let _ = writeln!(self.text, "{}<string name=\"{name}\" value=\"{value}\"/>", self.indent);
    }

    /// Those of several numbers that are not 0.
    fn others_than_zero(&mut self, names: &[&str], values: &[f64]) {
        let pairs = names.iter().zip(values).filter(|(_, value)| **value != 0.0);
        pairs.for_each(|(name, value)| self.float(name, *value));
    }
}

/// The beginning of a `<sensor>` at this indentation, with all parameters of the camera; film, sampler, medium and the end are to follow.
pub(super) fn sensor_parameters(camera: &CameraDesc, indent: &str) -> String {
    let inside = format!("{indent}    ");
    let text = format!("{indent}<sensor type=\"{}\">\n", plugin(camera));
    let mut lines = ParameterLines { indent: inside.clone(), text };
    let rows = DMat4::from(camera.to_world).transpose().to_cols_array().map(|v| format!("{v:?}")).join(" ");
    let _ = writeln!(
        lines.text,
        "{inside}<transform name=\"to_world\">\n{inside}    <matrix value=\"{rows}\"/>\n{inside}</transform>"
    );
    match &camera.projection {
        ProjectionDesc::Perspective(perspective) => lines.float("fov", perspective.fov),
        ProjectionDesc::Fisheye(fisheye) => lines.float("fov", fisheye.fov),
        ProjectionDesc::Beam(radius) => {
            if *radius > 0.0 {
                lines.float("radius", *radius);
            }
            return lines.text;
        }
        ProjectionDesc::Batch(cameras) => {
            for camera in cameras {
                lines.text += &sensor_parameters(camera, &inside);
                let _ = writeln!(lines.text, "{inside}</sensor>");
            }
            return lines.text;
        }
        _ => (),
    }
    lines.float("near_clip", camera.near_clip);
    lines.float("far_clip", camera.far_clip);
    if let ProjectionDesc::Perspective(PerspectiveDesc { lens, .. }) = &camera.projection
        && lens.radius > 0.0
    {
        lines.float("aperture_radius", lens.radius);
        lines.float("focus_distance", lens.focus_distance);
        if !lens.is_round() {
            let _ = writeln!(lines.text, "{inside}<integer name=\"blades\" value=\"{}\"/>", lens.blades);
            lines.float("blade_rotation", lens.blade_rotation);
            lines.float("squeeze", lens.squeeze);
        }
    }
    // Of Mitsuba's cameras only `perspective` has one, and what they do not know they refuse.
    if plugin(camera) == "perspective" || camera.principal_point_offset != DVec2::ZERO {
        lines.float("principal_point_offset_x", camera.principal_point_offset.x);
        lines.float("principal_point_offset_y", camera.principal_point_offset.y);
    }
    match &camera.projection {
        ProjectionDesc::Perspective(PerspectiveDesc { fov_axis, distortion, .. }) => {
            lines.string("fov_axis", axis(*fov_axis));
            if let Some(distortion) = distortion {
                lines.others_than_zero(&RADIAL, &distortion.radial);
                lines.others_than_zero(&TANGENTIAL, &distortion.tangential);
                lines.others_than_zero(&PRISM, &distortion.prism);
            }
        }
        ProjectionDesc::Fisheye(fisheye) => {
            lines.string("fov_axis", axis(fisheye.fov_axis));
            lines.string("mapping", name_of(MAPPINGS, fisheye.mapping));
            lines.float("image_circle", fisheye.image_circle);
            lines.others_than_zero(&RADIAL[..4], &fisheye.distortion);
        }
        ProjectionDesc::CubeMap(layout) => lines.string("layout", name_of(LAYOUTS, *layout)),
        ProjectionDesc::Stereo(stereo) => {
            lines.float("interocular", stereo.interocular);
            lines.string("eyes", name_of(EYES, stereo.eyes));
        }
        ProjectionDesc::Orthographic
        | ProjectionDesc::Spherical
        | ProjectionDesc::Beam(_)
        | ProjectionDesc::Irradiance(_)
        | ProjectionDesc::Batch(_) => (),
    }
    lines.text
}

/// The plugin of a camera.
fn plugin(camera: &CameraDesc) -> &'static str {
    match &camera.projection {
        ProjectionDesc::Perspective(perspective) if perspective.lens.radius > 0.0 => "thinlens",
        ProjectionDesc::Perspective(_) => "perspective",
        ProjectionDesc::Orthographic => "orthographic",
        ProjectionDesc::Fisheye(_) => "fisheye",
        ProjectionDesc::Spherical => "spherical",
        ProjectionDesc::CubeMap(_) => "cubemap",
        ProjectionDesc::Stereo(_) => "ods",
        ProjectionDesc::Beam(_) => "radiancemeter",
        ProjectionDesc::Irradiance(_) => "irradiancemeter",
        ProjectionDesc::Batch(_) => "batch",
    }
}

fn axis(axis: FovAxis) -> &'static str {
    name_of(AXES, axis)
}

/// The name of a value in a table of names.
fn name_of<T: Copy + PartialEq>(table: &[(&'static str, T)], value: T) -> &'static str {
    table.iter().find(|(_, known)| *known == value).map_or("", |(name, _)| name)
}
