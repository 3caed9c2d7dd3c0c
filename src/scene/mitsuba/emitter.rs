//! Lights.

use std::sync::Arc;

use glam::DVec3;

use super::document::ElementId;
use super::emission::ReadEmission;
use super::params::Params;
use super::reader::{PluginTable, Reader};
use super::sensor::{field_of_view, is_rigid};
use super::{emission, sky, texture};
use crate::image::bitmap::Bitmap;
use crate::scene::desc::emission_texture::EmissionProfile;
use crate::scene::desc::texture::SpectrumTexture;
use crate::scene::desc::{LightDesc, ProjectorDesc, SpotDesc, SpotTextureDesc};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::limits;
use crate::spectrum::Spectrum;

/// Every light that is not a shape.
pub(super) const PLUGINS: PluginTable<LightDesc> = &[
    ("constant", constant),
    ("directional", directional),
    ("envmap", envmap),
    ("point", point),
    ("projector", projector),
    ("sky", sky::sky),
    ("spot", spot),
    ("sun", sky::sun),
    ("sunsky", sky::sun_sky),
];

/// A shape that emits along its normal.
const BEAM: &str = "directionalarea";

/// Every light that is part of a shape.
pub(super) const AREA: &[&str] = &["area", BEAM];

/// Remark on a medium that an emitter names.
const AROUND: &str = "the medium around an emitter is the one in which it lies: naming it has no effect";

/// Reads a light of the scene itself.
pub(crate) fn read(reader: &mut Reader<'_>, id: ElementId) -> Result<(), SceneError> {
    let params = Params::new(reader.document, id)?;
    if AREA.contains(&params.plugin()) {
        // It is read where a shape refers to it, which may come later.
        if params.element().attribute("id").is_none() {
            return Err(without_shape(reader, id));
        }
        reader.known.lone_area_lights.push(id);
        return Ok(());
    }
    let light = reader.plugin(&params, PLUGINS, AREA)?(reader, &params)?;
    params.tag_without_effect("medium", AROUND);
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

/// The error of an area light that no shape has.
fn without_shape(reader: &Reader<'_>, id: ElementId) -> SceneError {
    let span = reader.document.element(id).span;
    let found = reader.document.finding(FindingKind::Plugin, span, "an area light needs a shape");
    found.help("put it, or a <ref> to its id, into the <shape> that shall emit").error()
}

/// Refuses area lights outside of shapes that no shape refers to.
pub(crate) fn finish(reader: &mut Reader<'_>) -> Result<(), SceneError> {
    for id in std::mem::take(&mut reader.known.lone_area_lights) {
        if !reader.known.area_lights.contains(&id) {
            let error = Err(without_shape(reader, id));
            reader.or_instead(error, "it is left out", |_| ())?;
        }
    }
    Ok(())
}

/// The emission of a shape.
pub(crate) struct AreaEmission {
    /// Radiance, or radiant exitance along the normal; the factor on a texture.
    pub(crate) radiance: Spectrum,
    pub(crate) profile: EmissionProfile,
}

/// The emission by the emitter inside a shape.
pub(crate) fn area(reader: &mut Reader<'_>, id: ElementId) -> Result<AreaEmission, SceneError> {
    let params = Params::new(reader.document, id)?;
    if !AREA.contains(&params.plugin()) {
        if PLUGINS.iter().any(|(name, _)| *name == params.plugin()) {
            let message = format!("a `{}` emitter cannot be part of a shape", params.plugin());
            let found = params.fault(FindingKind::Plugin, message);
            return Err(found.help("put it outside of the shape").error());
        }
        return Err(reader.unknown_plugin(&params, AREA));
    }
    reader.known.area_lights.insert(id);
    let along_normal = params.plugin() == BEAM;
    if along_normal {
        let message = "light that leaves along the normal is found from the light only: `path` shows none of it, as Mitsuba's; `bidirectional` and `light` do, and `photon` on surfaces with a diffuse part";
        let found = params.type_fault(message).help(
            "the methods bidirectional and light show it, and photon does on surfaces with a diffuse part: --integrator bidirectional",
        );
        params.note(found.advice());
    }
    let ReadEmission { spectrum: radiance, texture } = emission::read(reader, &params, "radiance")?;
    params.tag_without_effect("medium", AROUND);
    reader.finish(params);
    Ok(AreaEmission { radiance, profile: EmissionProfile { texture, along_normal } })
}

fn constant(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<LightDesc, SceneError> {
    params.without_effect(&["to_world"]);
    let radiance = emission::even(reader, params, "radiance")?;
    Ok(LightDesc::Constant { radiance, place: reader.place(params.span()) })
}

fn envmap(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<LightDesc, SceneError> {
    params.without_effect(&["mis_compensation", "sampling_weight"]);
    let name = params.filename("an envmap", "exr")?;
    let scale = params.float_or("scale", 1.0)?;
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
    let bytes = reader
        .document
        .files
        .read(&path, limits::IMAGE_BYTES)
        .map_err(|e| at(e.kind(), e.to_string()).error())?;
    let bitmap = Bitmap::decode(&path, &bytes, false, limits::IMAGE_PIXELS).map_err(|e| {
        let found = at(FindingKind::File, e.to_string());
        found.help("an environment is a picture in latitude and longitude, best OpenEXR or Radiance").error()
    })?;
    texture::tell_remarks(reader, &bitmap, span);
    let map = emission::map(reader, params, span, &path, bitmap.into_linear())?;
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
    let intensity = emission::even(reader, params, "intensity")?;
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
    let irradiance = emission::even(reader, params, "irradiance")?;
    Ok(LightDesc::Directional { direction, irradiance, place: reader.place(params.span()) })
}

fn spot(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<LightDesc, SceneError> {
    let to_world = params.to_world()?;
    let cutoff_angle = params.float_or("cutoff_angle", 20.0)?;
    if !(cutoff_angle > 0.0 && cutoff_angle <= 180.0) {
        return Err(params.error("cutoff_angle", "the cutoff is above 0 and at most 180 degrees").error());
    }
    let beam_width = params.float_or("beam_width", 0.75 * cutoff_angle)?;
    if !(0.0..=cutoff_angle).contains(&beam_width) {
        let found = params
            .error("beam_width", format!("the beam is not within the cutoff of {cutoff_angle} degrees"));
        return Err(found.help("both are angles to the axis").error());
    }
    let texture = texture::read(reader, params, "texture")?.filter(|t| *t != Spectrum::Constant(1.0));
    if texture.as_ref().is_some_and(SpectrumTexture::asks_place) {
        let found =
            params.error("texture", "the texture of a spot is a picture: a `volume` shows on surfaces only");
        return Err(found.help("give a <texture type=\"bitmap\">").error());
    }
    let texture = texture.map(|texture| Arc::new(SpotTextureDesc { texture, to_world: to_world.matrix3 }));
    let intensity = emission::even(reader, params, "intensity")?;
    let axis = to_world.transform_vector3(DVec3::Z).normalize();
    let (position, place) = (to_world.translation, reader.place(params.span()));
    Ok(LightDesc::Spot(SpotDesc { position, axis, beam_width, cutoff_angle, intensity, texture, place }))
}

fn projector(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<LightDesc, SceneError> {
    let to_world = params.to_world()?;
    if !is_rigid(&to_world) {
        let found = params.error("to_world", "the transform of a projector cannot scale or shear");
        return Err(found
            .help("use lookat, rotate and translate; `scale` makes the picture brighter")
            .error());
    }
    let scale = params.float("scale")?.unwrap_or(1.0);
    if scale < 0.0 {
        return Err(params.error("scale", "a factor on light is not negative").error());
    }
    let (fov, axis) = field_of_view(params)?;
    let ReadEmission { spectrum, texture: picture } = emission::read(reader, params, "irradiance")?;
    let [width, height] = picture.as_ref().map_or([1; 2], |picture| picture.size());
    let half_size = axis.half_extent(fov, width as f64 / height as f64);
    let (irradiance, place) = (spectrum.scaled(scale as f32), reader.place(params.span()));
    Ok(LightDesc::Projector(ProjectorDesc { to_world, half_size, picture, irradiance, place }))
}
