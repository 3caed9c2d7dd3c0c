//! A camera as the element that the reader and Mitsuba read.

use std::fmt::Write as _;

use glam::{DMat4, DVec2};

use crate::scene::desc::{CameraDesc, FilmDesc, FovAxis, ReconstructionFilter, SceneDesc};
use crate::scene::mitsuba::load_str;

use super::save::SaveError;

/// A complete `<sensor>`: `camera`, and film and sample count of `desc`. Stands in front of the include, because the
/// first of two sensors counts, here as in Mitsuba.
///
/// # Errors
///
/// [`SaveError::Camera`] when the reader would not read the same camera and film back.
pub(super) fn xml(camera: &CameraDesc, desc: &SceneDesc) -> Result<String, SaveError> {
    let lens = camera.aperture_radius > 0.0;
    let mut out = format!("    <sensor type=\"{}\">\n", if lens { "thinlens" } else { "perspective" });
    let rows = DMat4::from(camera.to_world).transpose().to_cols_array().map(|v| format!("{v:?}")).join(" ");
    let _ = writeln!(
        out,
        "        <transform name=\"to_world\">\n            <matrix value=\"{rows}\"/>\n        </transform>"
    );
    let mut float = |name: &str, v: f64| {
        let _ = writeln!(out, "        <float name=\"{name}\" value=\"{v:?}\"/>");
    };
    float("fov", camera.fov);
    float("near_clip", camera.near_clip);
    float("far_clip", camera.far_clip);
    if lens {
        float("aperture_radius", camera.aperture_radius);
        float("focus_distance", camera.focus_distance);
    }
    // Mitsuba's thin lens has none, and refuses what it does not know.
    if !lens || camera.principal_point_offset != DVec2::ZERO {
        float("principal_point_offset_x", camera.principal_point_offset.x);
        float("principal_point_offset_y", camera.principal_point_offset.y);
    }
    let _ = writeln!(out, "        <string name=\"fov_axis\" value=\"{}\"/>", axis(camera.fov_axis));
    out.push_str(&film(&desc.film));
    if let Some(n) = desc.samples_per_pixel {
        let _ = writeln!(
            out,
            "        <sampler type=\"independent\">\n            <integer name=\"sample_count\" value=\"{n}\"/>\n        </sampler>"
        );
    }
    out.push_str("    </sensor>\n");
    check(&out, camera, &desc.film).map(|()| out)
}

fn axis(axis: FovAxis) -> &'static str {
    match axis {
        FovAxis::X => "x",
        FovAxis::Y => "y",
        FovAxis::Diagonal => "diagonal",
        FovAxis::Smaller => "smaller",
        FovAxis::Larger => "larger",
    }
}

fn film(film: &FilmDesc) -> String {
    let mut out = String::from("        <film type=\"hdrfilm\">\n");
    let mut integer = |name: &str, v: u32| {
        let _ = writeln!(out, "            <integer name=\"{name}\" value=\"{v}\"/>");
    };
    integer("width", film.width);
    integer("height", film.height);
    if let Some(crop) = film.crop {
        integer("crop_offset_x", crop.x);
        integer("crop_offset_y", crop.y);
        integer("crop_width", crop.width);
        integer("crop_height", crop.height);
    }
    let filter = film.rfilter.map(|f| match f {
        ReconstructionFilter::Box => "box",
        ReconstructionFilter::Tent => "tent",
        ReconstructionFilter::Gaussian => "gaussian",
    });
    if let Some(name) = filter {
        let _ = writeln!(out, "            <rfilter type=\"{name}\"/>");
    }
    out.push_str("        </film>\n");
    out
}

/// Reads the element back: what the reader refuses or understands otherwise must not be written.
fn check(sensor: &str, camera: &CameraDesc, film: &FilmDesc) -> Result<(), SaveError> {
    let text = format!("<scene version=\"3.0.0\">{sensor}</scene>");
    let read = load_str("camera", &text, &[]).map_err(|e| SaveError::Camera(e.to_string()))?.desc;
    let numbers =
        |c: &CameraDesc| (c.to_world, c.fov, c.fov_axis, c.principal_point_offset, c.near_clip, c.far_clip);
    let lens_of =
        |c: &CameraDesc| (c.aperture_radius, if c.aperture_radius > 0.0 { c.focus_distance } else { 0.0 });
    let same_film = (read.film.width, read.film.height, read.film.crop, read.film.rfilter)
        == (film.width, film.height, film.crop, film.rfilter);
    let same_lens = lens_of(&read.camera) == lens_of(camera);
    if numbers(&read.camera) == numbers(camera) && same_lens && same_film {
        return Ok(());
    }
    Err(SaveError::Camera("a number of it does not survive being written".to_owned()))
}
