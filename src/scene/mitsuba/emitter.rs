//! Lights.

use std::sync::Arc;

use glam::DVec3;

use super::document::ElementId;
use super::params::Params;
use super::reader::{PluginTable, Reader, Role};
use super::sensor::is_rigid;
use super::{sky, spectrum};
use crate::image::bitmap::Bitmap;
use crate::scene::desc::{LightDesc, SpotDesc};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::files::read_bytes;
use crate::scene::limits;
use crate::spectrum::emission_map::{self, TexelRepairs};
use crate::spectrum::{EmissionMap, Spectrum};

/// Every light that is not a shape.
const PLUGINS: PluginTable<LightDesc> = &[
    ("constant", constant),
    ("directional", directional),
    ("envmap", envmap),
    ("point", point),
    ("sky", sky::sky),
    ("spot", spot),
    ("sun", sky::sun),
    ("sunsky", sky::sun_sky),
];

/// Reads a light of the scene itself.
pub(crate) fn read(reader: &mut Reader<'_>, id: ElementId) -> Result<(), SceneError> {
    let params = Params::new(reader.document, id)?;
    if params.plugin() == "area" {
        let found = params.fault(FindingKind::Plugin, "an area light needs a shape");
        return Err(found.help("put it into the <shape> that shall emit").error());
    }
    let light = reader.plugin(&params, PLUGINS, &["area"])?(reader, &params)?;
    if light.is_environment() && reader.lists.lights.iter().any(LightDesc::is_environment) {
        let found = params.fault(FindingKind::Parameter, "a second light all around");
        return Err(found.help("a scene has at most one `constant`, `envmap` or `sunsky` emitter").error());
    }
    reader.lists.lights.push(light);
    let name = reader.name(id);
    reader.lists.names.lights.push(name);
    reader.finish(params);
    Ok(())
}

/// The radiance of the `area` emitter inside a shape.
pub(crate) fn area(reader: &mut Reader<'_>, id: ElementId) -> Result<Spectrum, SceneError> {
    let params = Params::new(reader.document, id)?;
    if params.plugin() != "area" {
        if PLUGINS.iter().any(|(name, _)| *name == params.plugin()) {
            let message = format!("a `{}` emitter cannot be part of a shape", params.plugin());
            let found = params.fault(FindingKind::Plugin, message);
            return Err(found.help("put it outside of the shape").error());
        }
        return Err(reader.unknown_plugin(&params, &["area"]));
    }
    let radiance = emission(reader, &params, "radiance")?;
    reader.finish(params);
    Ok(radiance)
}

fn emission(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    name: &'static str,
) -> Result<Spectrum, SceneError> {
    params.without_effect(&["sampling_weight"]);
    Ok(spectrum::read(reader, params, name, Role::Emission)?.unwrap_or_else(|| Spectrum::d65(1.0)))
}

fn constant(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<LightDesc, SceneError> {
    params.without_effect(&["to_world"]);
    let radiance = emission(reader, params, "radiance")?;
    Ok(LightDesc::Constant { radiance, place: reader.place(params.span()) })
}

fn envmap(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<LightDesc, SceneError> {
    params.without_effect(&["mis_compensation", "sampling_weight"]);
    let name = params.filename("an envmap", "exr")?;
    let scale = params.float("scale")?.unwrap_or(1.0);
    if scale < 0.0 {
        return Err(params.error("scale", "a factor on light is not negative").error());
    }
    let to_world = params.to_world()?;
    if !is_rigid(&to_world) {
        let found = params.error("to_world", "the transform of an envmap cannot scale or shear");
        return Err(found.help("rotate it; scaling by -1 mirrors and is fine").error());
    }
    let span = params.get("filename").map_or(params.span(), |e| e.span_of("value"));
    let at = |kind, message: String| reader.document.finding(kind, span, message);
    let path = reader.document.resolve(&name, span);
    let bytes = read_bytes(&path, limits::IMAGE_BYTES).map_err(|e| at(e.kind(), e.to_string()).error())?;
    let bitmap = Bitmap::decode(&path, &bytes, false, limits::IMAGE_PIXELS).map_err(|e| {
        let found = at(FindingKind::File, e.to_string());
        found.help("an environment is a picture in latitude and longitude, best OpenEXR or Radiance").error()
    })?;
    let mut picture = bitmap.into_linear();
    let TexelRepairs { not_finite, negative } = emission_map::repair(picture.pixels_mut());
    if not_finite + negative > 0 {
        let all = picture.pixels().len();
        let message = format!(
            "{not_finite} of {all} texels of {} are infinite or no numbers and count as black; {negative} have negative components, which count as 0",
            path.display()
        );
        params.note(at(FindingKind::Value, message).label("of this picture").warning());
    }
    let map = EmissionMap::new(picture.width(), picture.pixels())
        .map_err(|e| at(FindingKind::Value, format!("{}: {e}", path.display())).error())?;
    Ok(LightDesc::Map {
        map: Arc::new(map),
        scale: Spectrum::Constant(scale as f32),
        to_world,
        place: reader.place(params.span()),
    })
}

fn point(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<LightDesc, SceneError> {
    if params.has("position") && params.has("to_world") {
        return Err(params.error("position", "either `position` or `to_world`, not both").error());
    }
    let position = match params.point("position")? {
        Some(p) => p,
        None => params.to_world()?.transform_point3(DVec3::ZERO),
    };
    let intensity = emission(reader, params, "intensity")?;
    Ok(LightDesc::Point { position, intensity, place: reader.place(params.span()) })
}

fn directional(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<LightDesc, SceneError> {
    if params.has("direction") && params.has("to_world") {
        return Err(params.error("direction", "either `direction` or `to_world`, not both").error());
    }
    let direction = match params.point("direction")? {
        Some(d) => d,
        None => params.to_world()?.transform_vector3(DVec3::Z),
    };
    let nowhere = || params.error("direction", "a direction has a length other than zero").error();
    let direction = direction.try_normalize().ok_or_else(nowhere)?;
    let irradiance = emission(reader, params, "irradiance")?;
    Ok(LightDesc::Directional { direction, irradiance, place: reader.place(params.span()) })
}

fn spot(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<LightDesc, SceneError> {
    let to_world = params.to_world()?;
    let cutoff_angle = params.float("cutoff_angle")?.unwrap_or(20.0);
    if !(cutoff_angle > 0.0 && cutoff_angle <= 180.0) {
        return Err(params.error("cutoff_angle", "the cutoff is above 0 and at most 180 degrees").error());
    }
    let beam_width = params.float("beam_width")?.unwrap_or(0.75 * cutoff_angle);
    if !(0.0..=cutoff_angle).contains(&beam_width) {
        let found = params
            .error("beam_width", format!("the beam is not within the cutoff of {cutoff_angle} degrees"));
        return Err(found.help("both are angles to the axis").error());
    }
    if let Some(texture) = params.get("texture") {
        let found = reader.document.finding(
            FindingKind::Parameter,
            texture.span,
            "a spot's texture is not projected",
        );
        params.note(found.help("the light has the same colour in all directions here").warning());
    }
    let intensity = emission(reader, params, "intensity")?;
    let axis = to_world.transform_vector3(DVec3::Z).normalize();
    let (position, place) = (to_world.translation, reader.place(params.span()));
    Ok(LightDesc::Spot(SpotDesc { position, axis, beam_width, cutoff_angle, intensity, place }))
}
