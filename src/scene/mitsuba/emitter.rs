//! Lights.

use std::sync::Arc;

use glam::DVec3;

use super::document::ElementId;
use super::params::Params;
use super::reader::{PluginTable, Reader, Role};
use super::sensor::is_rigid;
use super::spectrum;
use crate::image::linear;
use crate::scene::desc::LightDesc;
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::files::read_bytes;
use crate::scene::limits;
use crate::spectrum::{EmissionMap, Spectrum};

/// Every light that is not a shape.
const PLUGINS: PluginTable<LightDesc> = &[("constant", constant), ("envmap", envmap), ("point", point)];

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
        return Err(found.help("a scene has at most one `constant` or `envmap` emitter").error());
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
    let picture = linear::decode(&path, &bytes, limits::IMAGE_PIXELS).map_err(|e| {
        let found = at(FindingKind::File, e.to_string());
        found.help("an environment is a picture in latitude and longitude, OpenEXR or PNG").error()
    })?;
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
