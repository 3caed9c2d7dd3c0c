//! Reads the texture `volume`, and what it and the coefficients of media may hold: `gridvolume`, whose file is Mitsuba's `.vol`, and `constvolume`.

use std::path::Path;
use std::sync::Arc;

use super::document::ElementId;
use super::grid_file::{GridFile, parse};
use super::params::Params;
use super::reader::{PluginTable, Reader, Role};
use super::spectrum;
use super::texture::{choice, wrap};
use crate::scene::desc::texture::{SpectrumTexture, WrapMode};
use crate::scene::desc::volume::VolumeTexture;
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::limits;
use crate::spectrum::Spectrum;
use glam::{DAffine3, DVec3};

/// Every `<volume type="…">`.
pub(super) const PLUGINS: PluginTable<SpectrumTexture> =
    &[("gridvolume", grid), (CONSTANT, |reader, params| constant(reader, params, Role::Reflectance))];

/// The plugin that does not vary.
const CONSTANT: &str = "constvolume";

/// The texture `volume`: what it holds, where a surface lies.
pub(super) fn volume(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<SpectrumTexture, SceneError> {
    let Some(id) = params.object("volume")? else {
        let found = params.fault(FindingKind::Missing, "a texture `volume` holds a <volume>");
        return Err(found.help("add <volume type=\"gridvolume\"> with its file").error());
    };
    read(reader, id, Role::Reflectance)
}

/// What a `<volume>` holds, in which a colour has this role.
pub(super) fn read(
    reader: &mut Reader<'_>,
    id: ElementId,
    role: Role,
) -> Result<SpectrumTexture, SceneError> {
    let params = Params::new(reader.document, id)?;
    let plugin = reader.plugin(&params, PLUGINS, &[])?;
    let read = match params.plugin() {
        CONSTANT => constant(reader, &params, role)?,
        _ => plugin(reader, &params)?,
    };
    reader.finish(params);
    Ok(read)
}

/// The same everywhere.
fn constant(reader: &mut Reader<'_>, params: &Params<'_>, role: Role) -> Result<SpectrumTexture, SceneError> {
    params.default("value", 1);
    params.without_effect(&["to_world"]);
    // A number of a texture need not be a share of light.
    let is_number = params.get("value").is_some_and(|e| matches!(e.tag.name, "float" | "integer"));
    let role = if is_number && role == Role::Reflectance { Role::Unbounded } else { role };
    let value = spectrum::read(reader, params, "value", role)?;
    Ok(value.unwrap_or(Spectrum::Constant(1.0)).into())
}

fn grid(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<SpectrumTexture, SceneError> {
    let name = params.filename("a gridvolume", "vol")?;
    let span = params.get("filename").map_or(params.span(), |e| e.span_of("value"));
    let path = reader.document.resolve(&name, span);
    params.without_effect(&["accel", "max_value", "raw"]);
    let nearest = choice(params, "filter_type", &["trilinear", "nearest"])? == 1;
    let wrap = wrap(params, WrapMode::Clamp)?;
    let to_world = params.to_world()?;
    let use_box = params.boolean("use_grid_bbox", false)?;
    let at = |message: String| reader.document.finding(FindingKind::File, span, message);
    let file = match reader.known.grids.get(&path) {
        Some(known) => known.clone(),
        None => {
            let bytes = reader.document.files.read(&path, limits::GRID_BYTES);
            let bytes = bytes.map_err(|e| reader.document.finding(e.kind(), span, e.to_string()).error())?;
            let file = parse(&bytes).map_err(|message| {
                let found = at(format!("{}: {message}", path.display()));
                found.help("a gridvolume is a `.vol` of version 3, as Mitsuba writes it").error()
            })?;
            reader.known.texels += file.grid.len();
            if reader.known.texels > limits::TOTAL_TEXELS {
                let message =
                    format!("the textures of this scene have more than {} texels", limits::TOTAL_TEXELS);
                return Err(reader.document.finding(FindingKind::Limit, span, message).error());
            }
            let file = Arc::new(file);
            tell(params, &path, &file);
            reader.known.grids.insert(path, file.clone());
            file
        }
    };
    let [low, high] = file.bounds;
    let mut to_unit = to_world;
    if use_box {
        if !(high - low).cmpgt(DVec3::ZERO).all() {
            let found = at("the box of this grid is empty".to_owned());
            return Err(found.help("leave out `use_grid_bbox`: the grid then fills the unit cube").error());
        }
        to_unit *= DAffine3::from_translation(low) * DAffine3::from_scale(high - low);
    }
    let to_grid = to_unit.inverse();
    if !to_grid.is_finite() {
        return Err(params.error("to_world", "the transform of a grid can be inverted").error());
    }
    rayon::spawn(Spectrum::prepare_textures);
    Ok(SpectrumTexture::Volume(Arc::new(VolumeTexture::new(file.grid.clone(), to_grid, wrap, nearest))))
}

/// Tells what of a file is not used.
fn tell(params: &Params<'_>, path: &Path, file: &GridFile) {
    let path = path.display();
    if !matches!(file.channels, 1 | 3) {
        let message =
            format!("{path} has {} channels: their mean counts, as a number without colour", file.channels);
        params.note(params.error("filename", message).warning());
    }
    if file.rest > 0 {
        let message = format!("{path} has {} bytes behind its values, which are not used", file.rest);
        params.note(params.error("filename", message).advice());
    }
}
