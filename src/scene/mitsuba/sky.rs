//! Daylight: `sunsky`, and of Mitsuba 0.6 `sky` and `sun` by themselves.
//!
//! Up is +z in the light's own space, as in Mitsuba 3; in a file of version 0.6, also one that is included, it is +y, as it was then. (Mitsuba 3 reads the sun's
//! direction of such a file as it stands: with the sun below the horizon, if up is +y.)

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};

use super::params::Params;
use super::reader::{Reader, Role};
use super::sensor::is_rigid;
use super::spectrum;
use crate::scene::desc::{LightDesc, SunSkyDesc};
use crate::scene::diagnostic::SceneError;
use crate::spectrum::daylight::{self, DateTime, SKY_SIZE, SUN_APERTURE, TURBIDITY};
use crate::spectrum::{EmissionMap, Spectrum};

/// Parameters of place and time.
const TIME: [&str; 9] =
    ["latitude", "longitude", "timezone", "year", "month", "day", "hour", "minute", "second"];

/// Least half angle of the sun in degrees: a radius of 0, which was a single direction in Mitsuba 0.6, is nearly that.
const LEAST_HALF_ANGLE: f64 = 0.01;

pub(super) fn sun_sky(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<LightDesc, SceneError> {
    let scales = [factor(params, "sky_scale")?, factor(params, "sun_scale")?];
    daylight(reader, params, scales)
}

/// The sky alone, of Mitsuba 0.6.
pub(super) fn sky(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<LightDesc, SceneError> {
    daylight(reader, params, [factor(params, "scale")?, 0.0])
}

/// The sun alone, of Mitsuba 0.6.
pub(super) fn sun(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<LightDesc, SceneError> {
    daylight(reader, params, [0.0, factor(params, "scale")?])
}

fn factor(params: &Params<'_>, name: &'static str) -> Result<f64, SceneError> {
    let factor = params.float_or(name, 1.0)?;
    if factor < 0.0 {
        return Err(params.error(name, "a factor on light is not negative").error());
    }
    Ok(factor)
}

fn daylight(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    [sky_scale, sun_scale]: [f64; 2],
) -> Result<LightDesc, SceneError> {
    params.without_effect(&["resolution", "sampling_weight", "sky_sampling_weight", "sun_sampling_weight"]);
    for (name, usual) in [("stretch", 1.0), ("horizon_stretch", 1.0)] {
        if params.float(name)?.is_some_and(|v| v != usual) {
            let found =
                params.error(name, format!("`{name}` is not supported: the sky is as the model has it"));
            params.note(found.warning());
        }
    }
    for name in ["complex_sun", "extend"] {
        if params.boolean(name, false)? {
            let message = match name {
                "extend" => "the sky is not continued below the horizon",
                _ => "the sun is equally bright all over its disc, with the same light in all",
            };
            params.note(params.error(name, message).warning());
        }
    }
    let turbidity = params.float_or("turbidity", 3.0)?;
    if !(TURBIDITY[0]..=TURBIDITY[1]).contains(&turbidity) {
        return Err(params.error("turbidity", "the model has turbidities from 1 to 10").error());
    }
    let albedo = spectrum::read(reader, params, "albedo", Role::Reflectance)?;
    let albedo = albedo.unwrap_or(Spectrum::Constant(0.3));
    let half_angle = half_angle(params)?;
    let to_world = params.to_world()?;
    if !is_rigid(&to_world) {
        return Err(params.error("to_world", "the transform of a sky cannot scale or shear").error());
    }
    let old = reader.document.is_old(params.span());
    let up = to_world.transform_vector3(if old { DVec3::Y } else { DVec3::Z });
    let sun_direction = sun_direction(params, &to_world, old)?;
    let elevation = sun_direction.dot(up).clamp(-1.0, 1.0).asin();
    if elevation < 0.0 {
        let found = params.error("sun_direction", "the sun is below the horizon: neither sky nor sun shine");
        params.note(found.help("up is +z in the light's own space; turn it by `to_world`").warning());
    }
    let [sky_scale, sun_scale] =
        [sky_scale, sun_scale].map(|scale| if elevation < 0.0 { 0.0 } else { scale as f32 });
    let refused = || params.error("turbidity", "the model has no such sky").error();
    let mut texels = daylight::sky(turbidity, &albedo, elevation).ok_or_else(refused)?;
    texels.iter_mut().flatten().for_each(|v| *v *= sky_scale);
    let sky = EmissionMap::new(SKY_SIZE[0], &texels).map_err(|_| refused())?;
    // The same power from a disc of another size.
    let cone = |half: f64| 1.0 - half.to_radians().cos();
    let sun_scale = sun_scale * (cone(0.5 * SUN_APERTURE) / cone(half_angle)) as f32;
    // The picture's own space has +y up and the sun above +z.
    let ahead = (sun_direction - up * sun_direction.dot(up))
        .try_normalize()
        .unwrap_or_else(|| up.any_orthonormal_vector());
    Ok(LightDesc::SunSky(SunSkyDesc {
        sky: Arc::new(sky),
        to_world: DAffine3::from_mat3(DMat3::from_cols(up.cross(ahead), up, ahead)),
        sun_direction,
        sun_half_angle: half_angle,
        sun: daylight::sun(turbidity, elevation).scaled(sun_scale),
        scale: Spectrum::Constant(1.0),
        place: reader.place(params.span()),
    }))
}

/// Half of the angle under which the sun is seen, in degrees: of `sun_aperture`, or of 0.6's `sun_radius_scale`.
fn half_angle(params: &Params<'_>) -> Result<f64, SceneError> {
    if params.has("sun_aperture") && params.has("sun_radius_scale") {
        return Err(params
            .error("sun_radius_scale", "either `sun_radius_scale` or `sun_aperture`, not both")
            .error());
    }
    let name = if params.has("sun_radius_scale") { "sun_radius_scale" } else { "sun_aperture" };
    let half_angle = match (name, params.float(name)?) {
        (_, None) => 0.5 * SUN_APERTURE,
        ("sun_aperture", Some(aperture)) if aperture > 0.0 => 0.5 * aperture,
        ("sun_radius_scale", Some(scale)) if scale >= 0.0 => 0.5 * SUN_APERTURE * scale,
        _ => -1.0,
    };
    if !(0.0..90.0).contains(&half_angle) {
        return Err(params
            .error(name, "the sun is seen under more than 0 and less than 180 degrees")
            .error());
    }
    Ok(half_angle.max(LEAST_HALF_ANGLE))
}

/// Unit direction to the sun, world space, as given or by place and time.
fn sun_direction(params: &Params<'_>, to_world: &DAffine3, old: bool) -> Result<DVec3, SceneError> {
    let timed = TIME.iter().filter(|name| params.has(name)).count();
    if let Some(direction) = params.point("sun_direction")? {
        if timed > 0 {
            let message = "either `sun_direction` or place and time of the sun, not both";
            return Err(params.error("sun_direction", message).error());
        }
        let nowhere = || params.error("sun_direction", "a direction has a length other than zero").error();
        return direction.try_normalize().ok_or_else(nowhere);
    }
    let value = |name, usual: f64, [least, most]: [f64; 2]| match params.float_or(name, usual)? {
        v if (least..=most).contains(&v) => Ok(v),
        _ => Err(params.error(name, format!("`{name}` is from {least} to {most}")).error()),
    };
    let whole = |name, usual, range| Ok::<_, SceneError>(value(name, usual, range)? as i32);
    // Mitsuba's default: Tokyo, on an afternoon in July.
    let place = [value("latitude", 35.6894, [-90.0, 90.0])?, value("longitude", 139.6917, [-360.0, 360.0])?];
    let time = DateTime {
        year: whole("year", 2010.0, [-4000.0, 9999.0])?,
        month: whole("month", 7.0, [1.0, 12.0])?,
        day: whole("day", 10.0, [1.0, 31.0])?,
        hour: value("hour", 15.0, [0.0, 24.0])?,
        minute: value("minute", 0.0, [0.0, 60.0])?,
        second: value("second", 0.0, [0.0, 60.0])?,
        timezone: value("timezone", 9.0, [-24.0, 24.0])?,
    };
    let [elevation, azimuth] = daylight::solar_position(&time, place);
    let ((high, level), (east, north)) = (elevation.sin_cos(), azimuth.sin_cos());
    // North is −x and east −y in Mitsuba 3; in 0.6 they were −z and +x.
    let local = match old {
        false => DVec3::new(-north * level, -east * level, high),
        true => DVec3::new(east * level, high, -north * level),
    };
    Ok(to_world.transform_vector3(local).normalize())
}
