//! Cameras.

use glam::{DAffine3, DVec2};

use super::document::ElementId;
use super::params::Params;
use super::reader::Reader;
use super::{film, integrator};
use crate::scene::desc::{CameraDesc, FilmDesc, FovAxis};
use crate::scene::diagnostic::{FindingKind, SceneError};

/// A camera, its film, and the sample count of its sampler.
pub(crate) struct Sensor {
    pub(crate) camera: CameraDesc,
    pub(crate) film: FilmDesc,
    pub(crate) samples: Option<u64>,
}

/// Reader of one camera.
type Plugin = fn(&mut Reader<'_>, &Params<'_>) -> Result<CameraDesc, SceneError>;

/// Every camera.
const PLUGINS: &[(&str, Plugin)] = &[("perspective", pinhole), ("thinlens", thinlens)];

/// Names of [`FovAxis`].
const AXES: &[(&str, FovAxis)] = &[
    ("x", FovAxis::X),
    ("y", FovAxis::Y),
    ("diagonal", FovAxis::Diagonal),
    ("smaller", FovAxis::Smaller),
    ("larger", FovAxis::Larger),
];

/// Diagonal of 35 mm film (36 × 24 mm), which focal lengths refer to, in mm.
const FILM_DIAGONAL_MM: f64 = 43.266_615_305_567_87;

/// Reads a camera with its film and sampler.
pub(crate) fn read(reader: &mut Reader<'_>, id: ElementId) -> Result<Sensor, SceneError> {
    let params = Params::new(reader.document, id)?;
    let Some((_, plugin)) = PLUGINS.iter().find(|(name, _)| *name == params.plugin()) else {
        let names: Vec<&str> = PLUGINS.iter().map(|p| p.0).collect();
        return Err(reader.unknown_plugin(&params, &names));
    };
    let camera = plugin(reader, &params)?;
    let film = match params.object("film")? {
        Some(id) => film::read(reader, id)?,
        None => film::default(),
    };
    let samples = match params.object("sampler")? {
        Some(id) => integrator::sampler(reader, id)?,
        None => None,
    };
    reader.finish(params);
    Ok(Sensor { camera, film, samples })
}

fn pinhole(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<CameraDesc, SceneError> {
    params.without_effect(&["focus_distance"]);
    perspective(reader, params)
}

/// A pinhole camera with a lens in place of the hole.
fn thinlens(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<CameraDesc, SceneError> {
    let camera = perspective(reader, params)?;
    let Some(aperture_radius) = params.float("aperture_radius")? else {
        let found = reader.document.finding(
            FindingKind::Missing,
            params.span(),
            "a thin lens needs `aperture_radius`",
        );
        let help = "add <float name=\"aperture_radius\" value=\"…\"/> in units of the scene; 0 is a pinhole";
        return Err(found.help(help).error());
    };
    if aperture_radius < 0.0 {
        return Err(params.error("aperture_radius", "the radius of a lens is 0 or above").error());
    }
    // Mitsuba's default, too.
    let focus_distance = params.float("focus_distance")?.unwrap_or(camera.far_clip);
    if focus_distance < f64::MIN_POSITIVE {
        let found = params.error("focus_distance", "a lens is focused at a distance above 0");
        return Err(found.help("give the distance along the line of sight, in units of the scene").error());
    }
    Ok(CameraDesc { aperture_radius, focus_distance, ..camera })
}

/// The camera without its lens.
fn perspective(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<CameraDesc, SceneError> {
    params.without_effect(&["shutter_open", "shutter_close"]);
    let to_world = params.to_world()?;
    if !is_rigid(&to_world) {
        let found = params.error("to_world", "the transform of a camera cannot scale or shear");
        return Err(found
            .help("use lookat, rotate and translate; scaling by -1 mirrors and is fine")
            .error());
    }
    let (fov, fov_axis) = field_of_view(params)?;
    let near_clip = params.float("near_clip")?.unwrap_or(1e-2);
    let far_clip = params.float("far_clip")?.unwrap_or(1e4);
    if near_clip <= 0.0 || far_clip <= near_clip {
        let name = if near_clip <= 0.0 { "near_clip" } else { "far_clip" };
        return Err(params.error(name, "0 < near_clip < far_clip must hold").error());
    }
    let offset = |name| params.float(name).map(|v| v.unwrap_or(0.0));
    Ok(CameraDesc {
        to_world,
        fov,
        fov_axis,
        principal_point_offset: DVec2::new(
            offset("principal_point_offset_x")?,
            offset("principal_point_offset_y")?,
        ),
        near_clip,
        far_clip,
        aperture_radius: 0.0,
        focus_distance: 0.0,
        place: reader.place(params.span()),
    })
}

/// The field of view in degrees and its axis, from `fov` or `focal_length` (in mm on 35 mm film).
fn field_of_view(params: &Params<'_>) -> Result<(f64, FovAxis), SceneError> {
    if let Some(fov) = params.float("fov")? {
        if params.has("focal_length") {
            return Err(params.error("focal_length", "either `fov` or `focal_length`, not both").error());
        }
        if fov <= 0.0 || fov >= 180.0 {
            return Err(params.error("fov", "a field of view is above 0 and below 180 degrees").error());
        }
        return Ok((fov, axis(params)?));
    }
    let given = params.string("focal_length")?;
    let text = given.as_deref().unwrap_or("50mm").trim();
    let millimetres = super::value::number(text.strip_suffix("mm").unwrap_or(text)).map_err(|e| {
        params.error("focal_length", e).help("write a length in millimetres, as 50mm").error()
    })?;
    let fov = 2.0 * (FILM_DIAGONAL_MM / (2.0 * millimetres)).atan().to_degrees();
    if millimetres <= 0.0 || fov <= 0.0 || fov >= 180.0 {
        return Err(params
            .error("focal_length", "a focal length is a positive number of millimetres")
            .error());
    }
    Ok((fov, FovAxis::Diagonal))
}

fn axis(params: &Params<'_>) -> Result<FovAxis, SceneError> {
    let Some(name) = params.string("fov_axis")? else { return Ok(FovAxis::X) };
    let found = AXES.iter().find(|(n, _)| n.eq_ignore_ascii_case(name.trim()));
    found.map(|(_, axis)| *axis).ok_or_else(|| {
        let names: Vec<&str> = AXES.iter().map(|a| a.0).collect();
        let found = params.error("fov_axis", "this is no axis of a field of view");
        found.help(super::suggest::hint(&name, &names)).error()
    })
}

/// True for rotations and mirrors.
pub(super) fn is_rigid(m: &DAffine3) -> bool {
    let gram = m.matrix3.transpose() * m.matrix3;
    let off = (gram - glam::DMat3::IDENTITY).to_cols_array();
    off.iter().all(|v| v.abs() < 1e-3)
}
