//! Cameras with their films and reconstruction filters.

use glam::{DAffine3, DVec2};

use super::document::ElementId;
use super::integrator;
use super::params::Params;
use super::projection;
use super::reader::{PluginTable, Reader};
use crate::scene::desc::{
    CameraDesc, Crop, DistortionDesc, FilmDesc, FovAxis, LensDesc, PerspectiveDesc, ProjectionDesc,
    ReconstructionFilter,
};
use crate::scene::diagnostic::{FindingKind, SceneError, shorten};
use crate::scene::limits;
use crate::scene::suggest;

/// A camera, its film, and the sample count of its sampler.
pub(crate) struct Sensor {
    pub(crate) camera: CameraDesc,
    pub(crate) film: FilmDesc,
    pub(crate) samples: Option<u64>,
    /// The medium that the camera is in; its description is not read here.
    pub(crate) medium: Option<ElementId>,
}

/// Every camera.
pub(super) const PLUGINS: PluginTable<CameraDesc> = &[
    ("perspective", pinhole),
    ("thinlens", thinlens),
    ("orthographic", orthographic),
    ("perspective_rdist", projection::radial_distortion),
    ("fisheye", projection::fisheye),
    ("spherical", projection::spherical),
    ("cubemap", projection::cube_map),
    ("ods", projection::stereo),
    ("radiancemeter", projection::radiance_meter),
    ("distant", projection::distant),
    ("irradiancemeter", projection::irradiance_meter),
    ("batch", projection::batch),
];

/// Names of [`FovAxis`].
pub(crate) const AXES: &[(&str, FovAxis)] = &[
    ("x", FovAxis::X),
    ("y", FovAxis::Y),
    ("diagonal", FovAxis::Diagonal),
    ("smaller", FovAxis::Smaller),
    ("larger", FovAxis::Larger),
];

/// Films of Mitsuba 3 and 0.6. They differ in what they write, which is not the scene's business here.
pub(super) const FILMS: &[&str] = &["hdrfilm", "specfilm", "ldrfilm", "tiledhdrfilm", "mfilm"];

/// Every filter that can be splatted, with Mitsuba's defaults.
pub(crate) const FILTERS: &[(&str, ReconstructionFilter)] = &[
    ("box", ReconstructionFilter::Box),
    ("tent", ReconstructionFilter::Tent { radius: 1.0 }),
    ("gaussian", ReconstructionFilter::Gaussian { stddev: 0.5 }),
];

/// Radius of a tent and standard deviation of a Gaussian, least and greatest: a splat reaches three pixels.
const RADII: (f64, f64) = (0.25, 3.0);
const DEVIATIONS: (f64, f64) = (0.1, 0.75);

/// Filters of Mitsuba that have negative lobes: where samples are few, the weights of a pixel would sum to nothing or less. The tent
/// stands in for them: of the filters above it is the nearest to each (squared difference over the line .004, .014 and .038,
/// the Gaussian's .010, .041 and .070).
pub(super) const REPLACED: &[&str] = &["mitchell", "catmullrom", "lanczos"];

/// Diagonal of 35 mm film (36 × 24 mm), which focal lengths refer to, in mm.
const FILM_DIAGONAL_MM: f64 = 43.266_615_305_567_87;

/// Reads a camera with its film and sampler.
pub(crate) fn read(reader: &mut Reader<'_>, id: ElementId) -> Result<Sensor, SceneError> {
    let params = Params::new(reader.document, id)?;
    let camera = reader.plugin(&params, PLUGINS, &[])?(reader, &params)?;
    let film = match params.object("film")? {
        Some(id) => film(reader, id)?,
        None => DEFAULT_FILM,
    };
    let samples = match params.object("sampler")? {
        Some(id) => integrator::sampler(reader, id)?,
        None => None,
    };
    let medium = params.object("medium")?;
    if let ProjectionDesc::Batch(cameras) = &camera.projection
        && !film.width.is_multiple_of(cameras.len() as u32)
    {
        let message = format!(
            "the film is {} pixels wide, which {} sensors cannot share evenly",
            film.width,
            cameras.len()
        );
        return Err(params
            .fault(FindingKind::Value, message)
            .help("give it a multiple of their number")
            .error());
    }
    reader.finish(params);
    Ok(Sensor { camera, film, samples, medium })
}

fn pinhole(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<CameraDesc, SceneError> {
    params.without_effect(&["focus_distance"]);
    let distortion = projection::distortion(params)?;
    perspective(reader, params, LensDesc::PINHOLE, distortion)
}

/// A pinhole camera with a lens in place of the hole.
fn thinlens(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<CameraDesc, SceneError> {
    let distortion = projection::distortion(params)?;
    let camera = perspective(reader, params, LensDesc::PINHOLE, distortion)?;
    let Some(aperture_radius) = params.float("aperture_radius")? else {
        let found = params.fault(FindingKind::Missing, "a thin lens needs `aperture_radius`");
        let help = "add <float name=\"aperture_radius\" value=\"…\"/> in units of the scene; 0 is a pinhole";
        return Err(found.help(help).error());
    };
    if aperture_radius < 0.0 {
        return Err(params.error("aperture_radius", "the radius of a lens is 0 or above").error());
    }
    // Mitsuba's default, too.
    let focus_distance = params.float_or("focus_distance", camera.far_clip)?;
    if focus_distance < f64::MIN_POSITIVE {
        let found = params.error("focus_distance", "a lens is focused at a distance above 0");
        return Err(found.help("give the distance along the line of sight, in units of the scene").error());
    }
    let lens = projection::aperture(params, LensDesc::round(aperture_radius, focus_distance))?;
    let mut camera = camera;
    if let Some(perspective) = camera.perspective_mut() {
        perspective.lens = lens;
    }
    Ok(camera)
}

/// A camera of parallel rays, whose transform gives the size of what it shows.
fn orthographic(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<CameraDesc, SceneError> {
    let to_world = params.to_world()?;
    let offset = principal_point(params)?;
    camera(reader, params, to_world, offset, ProjectionDesc::Orthographic)
}

/// A camera with this lens.
pub(super) fn perspective(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    lens: LensDesc,
    distortion: Option<DistortionDesc>,
) -> Result<CameraDesc, SceneError> {
    let to_world = rigid(params)?;
    let (fov, fov_axis) = field_of_view(params)?;
    let offset = principal_point(params)?;
    let projection = ProjectionDesc::Perspective(PerspectiveDesc { fov, fov_axis, lens, distortion });
    camera(reader, params, to_world, offset, projection)
}

/// The transform of a camera that cannot be scaled.
pub(super) fn rigid(params: &Params<'_>) -> Result<DAffine3, SceneError> {
    let to_world = params.to_world()?;
    if !is_rigid(&to_world) {
        let found = params.error("to_world", "the transform of a camera cannot scale or shear");
        let help = "use lookat, rotate and translate; scaling by -1 mirrors and is fine";
        return Err(found.help(help).error());
    }
    Ok(to_world)
}

pub(super) fn principal_point(params: &Params<'_>) -> Result<DVec2, SceneError> {
    let x = params.float_or("principal_point_offset_x", 0.0)?;
    let y = params.float_or("principal_point_offset_y", 0.0)?;
    Ok(DVec2::new(x, y))
}

/// A camera of this projection, with the parameters that all cameras share.
pub(super) fn camera(
    reader: &Reader<'_>,
    params: &Params<'_>,
    to_world: DAffine3,
    principal_point_offset: DVec2,
    projection: ProjectionDesc,
) -> Result<CameraDesc, SceneError> {
    params.without_effect(&["shutter_open", "shutter_close"]);
    let near_clip = params.float_or("near_clip", 1e-2)?;
    let far_clip = params.float_or("far_clip", 1e4)?;
    if near_clip <= 0.0 || far_clip <= near_clip {
        let name = if near_clip <= 0.0 { "near_clip" } else { "far_clip" };
        return Err(params.error(name, "0 < near_clip < far_clip must hold").error());
    }
    Ok(CameraDesc {
        projection,
        to_world,
        principal_point_offset,
        near_clip,
        far_clip,
        medium: None,
        place: reader.place(params.span()),
    })
}

/// The field of view in degrees and its axis, from `fov` or `focal_length` (in mm on 35 mm film).
pub(super) fn field_of_view(params: &Params<'_>) -> Result<(f64, FovAxis), SceneError> {
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
        let message = "a focal length is a positive number of millimetres";
        return Err(params.error("focal_length", message).error());
    }
    Ok((fov, FovAxis::Diagonal))
}

fn axis(params: &Params<'_>) -> Result<FovAxis, SceneError> {
    Ok(one_of(params, "fov_axis", AXES, "axis of a field of view")?.unwrap_or(FovAxis::X))
}

/// The value of a parameter that is one of a table of names.
pub(super) fn one_of<T: Copy>(
    params: &Params<'_>,
    name: &'static str,
    table: &[(&'static str, T)],
    what: &str,
) -> Result<Option<T>, SceneError> {
    let Some(given) = params.string(name)? else { return Ok(None) };
    let found = table.iter().find(|(n, _)| n.eq_ignore_ascii_case(given.trim()));
    found.map(|(_, value)| Some(*value)).ok_or_else(|| {
        let names: Vec<&str> = table.iter().map(|a| a.0).collect();
        params.error(name, format!("this is no {what}")).help(suggest::hint(&given, &names)).error()
    })
}

/// True for rotations and mirrors.
pub(super) fn is_rigid(m: &DAffine3) -> bool {
    let gram = m.matrix3.transpose() * m.matrix3;
    let off = (gram - glam::DMat3::IDENTITY).to_cols_array();
    off.iter().all(|v| v.abs() < 1e-3)
}

/// The film of a camera without one: Mitsuba's size.
const DEFAULT_FILM: FilmDesc = FilmDesc { width: 768, height: 576, crop: None, rfilter: None };

/// Reads a film with its reconstruction filter.
fn film(reader: &mut Reader<'_>, id: ElementId) -> Result<FilmDesc, SceneError> {
    let params = Params::new(reader.document, id)?;
    if !FILMS.contains(&params.plugin()) {
        let found = params.type_fault(format!("the film `{}` is not known", shorten(params.plugin())));
        params.note(found.help("its size, crop and filter are used").advice());
    }
    params.without_effect(&[
        "file_format",
        "pixel_format",
        "component_format",
        "compensate",
        "sample_border",
        "banner",
        "high_quality_edges",
        "attach_log",
        "gamma",
        "exposure",
        "tonemap_method",
        "label",
    ]);
    let width = side(&params, "width", i64::from(DEFAULT_FILM.width))?;
    let height = side(&params, "height", i64::from(DEFAULT_FILM.height))?;
    if width * height > limits::FILM_PIXELS {
        let message = format!("the film has more than {} pixels", limits::FILM_PIXELS);
        return Err(params.error("width", message).error());
    }
    let crop = crop(&params, width, height)?;
    let rfilter = match params.object("rfilter")? {
        Some(id) => Some(filter(reader, id)?),
        None => None,
    };
    reader.finish(params);
    Ok(FilmDesc { width: width as u32, height: height as u32, crop, rfilter })
}

fn side(params: &Params<'_>, name: &'static str, default: i64) -> Result<i64, SceneError> {
    let v = params.integer_or(name, default)?;
    if (1..=limits::FILM_SIDE).contains(&v) {
        return Ok(v);
    }
    Err(params.error(name, format!("a film is 1 to {} pixels wide and high", limits::FILM_SIDE)).error())
}

/// The part to render; `None` when it is the whole film.
fn crop(params: &Params<'_>, width: i64, height: i64) -> Result<Option<Crop>, SceneError> {
    let x = params.integer_or("crop_offset_x", 0)?;
    let y = params.integer_or("crop_offset_y", 0)?;
    let w = params.integer_or("crop_width", width)?;
    let h = params.integer_or("crop_height", height)?;
    let fits = |offset: i64, size: i64, whole: i64| {
        offset >= 0 && size >= 1 && offset.checked_add(size).is_some_and(|end| end <= whole)
    };
    for (name, ok) in [("crop_width", fits(x, w, width)), ("crop_height", fits(y, h, height))] {
        if !ok {
            let message = format!("the crop leaves the film of {width} × {height} pixels");
            return Err(params.error(name, message).error());
        }
    }
    let whole = (x, y, w, h) == (0, 0, width, height);
    Ok((!whole).then_some(Crop { x: x as u32, y: y as u32, width: w as u32, height: h as u32 }))
}

fn filter(reader: &mut Reader<'_>, id: ElementId) -> Result<ReconstructionFilter, SceneError> {
    let params = Params::new(reader.document, id)?;
    let default = |name| FILTERS.iter().find(|(known, _)| *known == name).map(|(_, filter)| *filter);
    let filter = match default(params.plugin()) {
        Some(ReconstructionFilter::Tent { radius }) => {
            ReconstructionFilter::Tent { radius: size(&params, "radius", radius, RADII)? }
        }
        Some(ReconstructionFilter::Gaussian { stddev }) => {
            ReconstructionFilter::Gaussian { stddev: size(&params, "stddev", stddev, DEVIATIONS)? }
        }
        Some(ReconstructionFilter::Box) => ReconstructionFilter::Box,
        None if REPLACED.contains(&params.plugin()) => {
            let message = format!("a tent of radius 1 stands in for the filter `{}`", params.plugin());
            let help = "where samples are few, negative lobes leave pixels without weight";
            params.note(params.type_fault(message).help(help).advice());
            params.without_effect(&["A", "B", "C", "lobes"]);
            ReconstructionFilter::Tent { radius: 1.0 }
        }
        None => {
            let name = shorten(params.plugin());
            let found = params.type_fault(format!("a Gaussian stands in for the filter `{name}`"));
            let names: Vec<&str> = FILTERS.iter().map(|f| f.0).collect();
            params.note(found.help(suggest::hint(params.plugin(), &names)).advice());
            params.rest_without_effect();
            ReconstructionFilter::Gaussian { stddev: 0.5 }
        }
    };
    reader.finish(params);
    Ok(filter)
}

/// The size of a filter, in pixels; the nearest one that can be splatted, with a remark.
fn size(
    params: &Params<'_>,
    name: &'static str,
    default: f64,
    (least, greatest): (f64, f64),
) -> Result<f64, SceneError> {
    let wanted = params.float(name)?.unwrap_or(default);
    if wanted <= 0.0 {
        return Err(params.error(name, format!("the `{name}` of a filter is above 0")).error());
    }
    let size = wanted.clamp(least, greatest);
    if size != wanted {
        let found = params.error(name, format!("{size} pixels stand in for this `{name}`"));
        params.note(found.help(format!("it can be from {least} to {greatest} pixels")).advice());
    }
    Ok(size)
}
