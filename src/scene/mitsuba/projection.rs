//! Cameras beyond `perspective`, `thinlens` and `orthographic`: distorted lenses, fisheye lenses, pictures of all directions, one ray, several cameras.

use glam::{DAffine3, DVec2, DVec3};

use super::document::ElementId;
use super::params::Params;
use super::reader::{MeteredShape, Reader};
use super::sensor::{self, AXES};
use super::value;
use crate::scene::desc::{
    CameraDesc, CubeLayout, DistortionDesc, FisheyeDesc, FisheyeMapping, FovAxis, LensDesc, MeterSurface,
    ProjectionDesc, ShapeKind, StereoDesc, StereoEyes,
};
use crate::scene::diagnostic::{FindingKind, SceneError};

/// Names of [`FisheyeMapping`].
pub(crate) const MAPPINGS: &[(&str, FisheyeMapping)] = &[
    ("equidistant", FisheyeMapping::Equidistant),
    ("equisolid", FisheyeMapping::Equisolid),
    ("stereographic", FisheyeMapping::Stereographic),
    ("orthographic", FisheyeMapping::Orthographic),
];

/// Names of [`CubeLayout`].
pub(crate) const LAYOUTS: &[(&str, CubeLayout)] = &[
    ("3x2", CubeLayout::Block),
    ("6x1", CubeLayout::Row),
    ("1x6", CubeLayout::Column),
    ("cross", CubeLayout::Cross),
];

/// Names of [`StereoEyes`].
pub(crate) const EYES: &[(&str, StereoEyes)] =
    &[("both", StereoEyes::OverUnder), ("left", StereoEyes::Left), ("right", StereoEyes::Right)];

/// Names of the radial, tangential and prism coefficients of a distortion, as OpenCV has them.
pub(crate) const RADIAL: [&str; 6] = ["k1", "k2", "k3", "k4", "k5", "k6"];
pub(crate) const TANGENTIAL: [&str; 2] = ["p1", "p2"];
pub(crate) const PRISM: [&str; 4] = ["s1", "s2", "s3", "s4"];

/// Most blades of an aperture.
const BLADES: i64 = 64;

/// Distance of the eyes if none is given: that of people, 6.3 cm, for scenes in metres.
const INTEROCULAR: f64 = 0.063;

fn numbers<const N: usize>(params: &Params<'_>, names: [&'static str; N]) -> Result<[f64; N], SceneError> {
    let mut values = [0.0; N];
    for (value, name) in values.iter_mut().zip(names) {
        *value = params.float_or(name, 0.0)?;
    }
    Ok(values)
}

/// The coefficients of a distortion; `None` where all are 0.
pub(super) fn distortion(params: &Params<'_>) -> Result<Option<DistortionDesc>, SceneError> {
    let (radial, tangential) = (numbers(params, RADIAL)?, numbers(params, TANGENTIAL)?);
    let distortion = DistortionDesc { radial, tangential, prism: numbers(params, PRISM)? };
    Ok((distortion != DistortionDesc::default()).then_some(distortion))
}

/// A lens with its blades and squeeze.
pub(super) fn aperture(params: &Params<'_>, lens: LensDesc) -> Result<LensDesc, SceneError> {
    let other = params.integer("num_blades")?;
    if other.is_some() && params.has("blades") {
        return Err(params.error("num_blades", "either `blades` or `num_blades`, not both").error());
    }
    let blades = match other {
        Some(blades) => blades,
        None => params.integer_or("blades", 0)?,
    };
    if blades != 0 && !(3..=BLADES).contains(&blades) {
        let name = if other.is_some() { "num_blades" } else { "blades" };
        let message = format!("an aperture has 3 to {BLADES} blades, or 0 for a round one");
        return Err(params.error(name, message).error());
    }
    let blade_rotation = params.float_or("blade_rotation", 0.0)?;
    let squeeze = params.float_or("squeeze", 1.0)?;
    if !(0.01..=100.0).contains(&squeeze) {
        let found = params.error("squeeze", "the squeeze of a lens is from 0.01 to 100");
        return Err(found.help("an anamorphic lens has 1.33 to 2, others 1").error());
    }
    Ok(LensDesc { blades: blades as u32, blade_rotation, squeeze, ..lens })
}

/// The camera of Mitsuba 0.6 with the coefficients of r² and r⁴ in `kc`.
pub(super) fn radial_distortion(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
) -> Result<CameraDesc, SceneError> {
    params.without_effect(&["focus_distance"]);
    let text = params.string("kc")?.unwrap_or_default();
    let given: Result<Vec<f64>, String> =
        text.split([',', ' ']).filter(|part| !part.is_empty()).map(value::number).collect();
    let kc = given.map_err(|e| params.error("kc", e).error())?;
    let [k1, k2] = match kc.as_slice() {
        [] => [0.0; 2],
        [k1, k2] => [*k1, *k2],
        _ => return Err(params.error("kc", "`kc` has two numbers, as 0.1, -0.05").error()),
    };
    let radial = [k1, k2, 0.0, 0.0, 0.0, 0.0];
    let distortion = DistortionDesc { radial, ..DistortionDesc::default() };
    let distortion = (distortion != DistortionDesc::default()).then_some(distortion);
    sensor::perspective(reader, params, LensDesc::PINHOLE, distortion)
}

/// A fisheye lens.
pub(super) fn fisheye(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<CameraDesc, SceneError> {
    let to_world = sensor::rigid(params)?;
    let mapping = sensor::one_of(params, "mapping", MAPPINGS, "mapping of a fisheye lens")?;
    params.default("mapping", MAPPINGS[0].0);
    let mapping = mapping.unwrap_or(FisheyeMapping::Equidistant);
    let fov = params.float_or("fov", 180.0)?;
    let widest = 2.0 * mapping.largest_angle();
    if fov <= 0.0 || fov > widest {
        let message =
            format!("the field of view of this fisheye lens is above 0 and at most {widest} degrees");
        return Err(params.error("fov", message).error());
    }
    params.default("fov_axis", "smaller");
    let fov_axis = sensor::one_of(params, "fov_axis", AXES, "axis of a field of view")?;
    let fov_axis = fov_axis.unwrap_or(FovAxis::Smaller);
    let distortion = numbers(params, ["k1", "k2", "k3", "k4"])?;
    let is_distorted = distortion != [0.0; 4];
    if is_distorted && mapping != FisheyeMapping::Equidistant {
        let found =
            params.error("mapping", "a fisheye lens with coefficients is equidistant, as OpenCV has it");
        return Err(found.help("leave `mapping` away, or k1 to k4").error());
    }
    let image_circle = params.float("image_circle")?.unwrap_or(if is_distorted { 360.0 } else { fov });
    if image_circle <= 0.0 || image_circle > 360.0 {
        let message = "the angle of an image circle is above 0 and at most 360 degrees";
        return Err(params.error("image_circle", message).error());
    }
    let offset = sensor::principal_point(params)?;
    let fisheye = FisheyeDesc { mapping, fov, fov_axis, image_circle, distortion };
    sensor::camera(reader, params, to_world, offset, ProjectionDesc::Fisheye(fisheye))
}

/// All directions by longitude and latitude.
pub(super) fn spherical(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<CameraDesc, SceneError> {
    panorama(reader, params, ProjectionDesc::Spherical)
}

/// All directions on a cube.
pub(super) fn cube_map(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<CameraDesc, SceneError> {
    params.default("layout", LAYOUTS[0].0);
    let layout = sensor::one_of(params, "layout", LAYOUTS, "layout of the faces of a cube")?;
    panorama(reader, params, ProjectionDesc::CubeMap(layout.unwrap_or(CubeLayout::Block)))
}

/// All directions for two eyes.
pub(super) fn stereo(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<CameraDesc, SceneError> {
    let interocular = params.float_or("interocular", INTEROCULAR)?;
    if interocular < 0.0 {
        return Err(params.error("interocular", "the distance of the eyes is 0 or above").error());
    }
    params.default("eyes", EYES[0].0);
    let eyes = sensor::one_of(params, "eyes", EYES, "choice of eyes")?.unwrap_or(StereoEyes::OverUnder);
    panorama(reader, params, ProjectionDesc::Stereo(StereoDesc { interocular, eyes }))
}

fn panorama(
    reader: &Reader<'_>,
    params: &Params<'_>,
    projection: ProjectionDesc,
) -> Result<CameraDesc, SceneError> {
    let to_world = sensor::rigid(params)?;
    sensor::camera(reader, params, to_world, DVec2::ZERO, projection)
}

/// One ray, along z or from `origin` in the direction `direction`, without clip planes; of a beam with the parameter `radius`.
pub(super) fn radiance_meter(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<CameraDesc, SceneError> {
    params.without_effect(&["shutter_open", "shutter_close", "near_clip", "far_clip"]);
    let radius = params.float_or("radius", 0.0)?;
    if radius < 0.0 {
        return Err(params.error("radius", "the radius of a beam is 0 or above").error());
    }
    let to_world = match (params.point("origin")?, params.point("direction")?) {
        (None, None) => sensor::rigid(params)?,
        (Some(origin), Some(direction)) => {
            if params.has("to_world") {
                let found = params.error("origin", "either `to_world`, or `origin` and `direction`");
                return Err(found.error());
            }
            along(direction, origin)
                .ok_or_else(|| params.error("direction", "a direction has a length above 0").error())?
        }
        _ => {
            let found = params.fault(FindingKind::Missing, "`origin` and `direction` belong together");
            return Err(found.help("give both, or `to_world`").error());
        }
    };
    Ok(unclipped(reader, params, to_world, ProjectionDesc::Beam(radius)))
}

/// A camera without clip planes.
fn unclipped(
    reader: &Reader<'_>,
    params: &Params<'_>,
    to_world: DAffine3,
    projection: ProjectionDesc,
) -> CameraDesc {
    CameraDesc {
        projection,
        to_world,
        principal_point_offset: DVec2::ZERO,
        near_clip: 0.0,
        far_clip: f64::from(f32::MAX),
        medium: None,
        place: reader.place(params.span()),
    }
}

/// Parallel rays into the whole scene, or to the point `target`, which [`aim`] gives their place once all shapes are known.
pub(super) fn distant(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<CameraDesc, SceneError> {
    params.without_effect(&["shutter_open", "shutter_close", "near_clip", "far_clip"]);
    if let Some(target) = params.get("target")
        && target.tag.name == "shape"
    {
        let found = params.fault(FindingKind::Value, "a shape as the `target` of `distant` is not supported");
        return Err(found.help("give a <point>, or leave it away for the whole scene").error());
    }
    let target = params.point("target")?;
    let to_world = match params.point("direction")? {
        None => sensor::rigid(params)?,
        Some(_) if params.has("to_world") => {
            return Err(params.error("direction", "either `to_world` or `direction`, not both").error());
        }
        Some(direction) => along(direction, DVec3::ZERO)
            .ok_or_else(|| params.error("direction", "a direction has a length above 0").error())?,
    };
    reader.known.distant = Some(target);
    Ok(unclipped(reader, params, to_world, ProjectionDesc::Beam(0.0)))
}

/// Places the rays of `distant` before the scene, whose shapes lie in this box: those to a target twice the radius of its sphere away, as Mitsuba,
/// those into the whole scene on a disk in front of it.
pub(super) fn aim(camera: &mut CameraDesc, target: Option<DVec3>, [low, high]: [DVec3; 2]) {
    let (middle, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
    let ahead = camera.to_world.matrix3.z_axis.normalize_or_zero();
    (camera.to_world.translation, camera.projection) = match target {
        Some(target) => (target - 2.0 * radius * ahead, ProjectionDesc::Beam(0.0)),
        None => (middle - radius * ahead, ProjectionDesc::Beam(radius)),
    };
}

/// Camera space with this direction as its z.
fn along(direction: DVec3, origin: DVec3) -> Option<DAffine3> {
    let z = direction.try_normalize()?;
    let x = z.any_orthonormal_vector();
    Some(DAffine3::from_mat3_translation(glam::DMat3::from_cols(x, z.cross(x), z), origin))
}

/// Light that arrives at the shape around it, which [`Known::meter`](super::reader::Known::meter) holds.
pub(super) fn irradiance_meter(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
) -> Result<CameraDesc, SceneError> {
    params.without_effect(&["shutter_open", "shutter_close", "near_clip", "far_clip", "to_world"]);
    let Some(MeteredShape { kind, to_world, flip_normals, .. }) = reader.known.meter.take() else {
        let found =
            params.fault(FindingKind::Value, "an `irradiancemeter` stands in the shape that it measures");
        return Err(found.help("put it into a <shape>: a rectangle, a disk or a sphere").error());
    };
    let sign = if flip_normals { -1.0 } else { 1.0 };
    let surface = match kind {
        ShapeKind::Rectangle => MeterSurface::Rectangle,
        ShapeKind::Disk => MeterSurface::Disk,
        ShapeKind::Sphere { center, radius } => MeterSurface::Sphere { center, radius: sign * radius },
        _ => {
            let message = "an `irradiancemeter` measures a rectangle, a disk or a sphere, and no other shape";
            return Err(params.fault(FindingKind::Plugin, message).error());
        }
    };
    let to_world = match surface {
        MeterSurface::Sphere { .. } => to_world,
        _ => to_world * DAffine3::from_scale(DVec3::new(1.0, 1.0, sign)),
    };
    let message = "the picture shows the irradiance / π, as a white and matt surface would";
    params.note(params.type_fault(message).advice());
    let size = to_world.matrix3.x_axis.length();
    let camera = unclipped(reader, params, to_world, ProjectionDesc::Irradiance(surface));
    // Rays begin above the surface, which they do not meet.
    Ok(CameraDesc { near_clip: 1e-4 * size, ..camera })
}

/// Several cameras side by side.
pub(super) fn batch(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<CameraDesc, SceneError> {
    params.without_effect(&["shutter_open", "shutter_close"]);
    let to_world = sensor::rigid(params)?;
    let nested = params.objects("sensor");
    if nested.is_empty() {
        let found = params.fault(FindingKind::Missing, "a batch needs sensors");
        return Err(found.help("put <sensor> elements into it, from left to right").error());
    }
    let cameras = nested.into_iter().map(|(id, _)| part(reader, id)).collect::<Result<Vec<_>, _>>()?;
    Ok(unclipped(reader, params, to_world, ProjectionDesc::Batch(cameras)))
}

/// One of the cameras of a batch.
fn part(reader: &mut Reader<'_>, id: ElementId) -> Result<CameraDesc, SceneError> {
    let params = Params::new(reader.document, id)?;
    if let name @ ("batch" | "distant" | "irradiancemeter") = params.plugin() {
        return Err(params.type_fault(format!("`{name}` cannot stand in a batch")).error());
    }
    let camera = reader.plugin(&params, sensor::PLUGINS, &[])?(reader, &params)?;
    for tag in ["film", "sampler", "medium"] {
        params.tag_without_effect(tag, &format!("the {tag} is that of the batch"));
    }
    reader.finish(params);
    Ok(camera)
}
