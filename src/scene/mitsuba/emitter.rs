//! Lights.

use glam::DVec3;

use super::document::ElementId;
use super::params::Params;
use super::reader::Reader;
use super::spectrum::{self, Role};
use crate::scene::desc::LightDesc;
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::spectrum::Spectrum;

/// Reader of one light that is not a shape.
type Plugin = fn(&mut Reader<'_>, &Params<'_>) -> Result<LightDesc, SceneError>;

/// Every light that is not a shape.
const PLUGINS: &[(&str, Plugin)] = &[("constant", constant), ("point", point)];

/// Reads a light of the scene itself.
pub(crate) fn read(reader: &mut Reader<'_>, id: ElementId) -> Result<(), SceneError> {
    let params = Params::new(reader.document, id)?;
    let Some((_, plugin)) = PLUGINS.iter().find(|(name, _)| *name == params.plugin()) else {
        if params.plugin() == "area" {
            let found =
                reader.document.finding(FindingKind::Plugin, params.span(), "an area light needs a shape");
            return Err(found.help("put it into the <shape> that shall emit").error());
        }
        let names: Vec<&str> = PLUGINS.iter().map(|p| p.0).chain(["area"]).collect();
        return Err(reader.unknown_plugin(&params, &names));
    };
    let light = plugin(reader, &params)?;
    let environments = |l: &LightDesc| matches!(l, LightDesc::Constant { .. });
    if environments(&light) && reader.lights.iter().any(environments) {
        let found =
            reader.document.finding(FindingKind::Parameter, params.span(), "a second light all around");
        return Err(found.help("a scene has at most one `constant` emitter").error());
    }
    reader.lights.push(light);
    let name = reader.name(id);
    reader.names.lights.push(name);
    reader.finish(params);
    Ok(())
}

/// The radiance of the `area` emitter inside a shape.
pub(crate) fn area(reader: &mut Reader<'_>, id: ElementId) -> Result<Spectrum, SceneError> {
    let params = Params::new(reader.document, id)?;
    if params.plugin() != "area" {
        let known = PLUGINS.iter().any(|(name, _)| *name == params.plugin());
        if known {
            let message = format!("a `{}` emitter cannot be part of a shape", params.plugin());
            let found = reader.document.finding(FindingKind::Plugin, params.span(), message);
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
