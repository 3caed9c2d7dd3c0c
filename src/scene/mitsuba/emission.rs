//! Emission that may vary: a spectrum, or a texture of unbounded values.
//!
//! A texture that shines is lit by D65, as an `<rgb>` is, whether it stands in a `<spectrum type="d65">` or not. (Without that
//! Mitsuba's spectral mode takes it as a reflectance of an equal-energy white; its RGB mode knows no difference.)

use std::path::Path;
use std::sync::Arc;

use super::document::ElementId;
use super::params::Params;
use super::reader::{PluginTable, Reader, Role};
use super::source::Span;
use super::spectrum;
use super::texture::{self, BitmapParams};
use crate::image::grid::Grid;
use crate::scene::desc::emission_texture::{EmissionTexels, EmissionTexture};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::limits;
use crate::spectrum::emission_map::{self, TexelRepairs};
use crate::spectrum::{EmissionMap, Spectrum};

/// Every texture that can shine.
const PLUGINS: PluginTable<EmissionTexture> =
    &[("bitmap", bitmap), ("checkerboard", checkerboard), ("volume", volume)];

/// Light is sampled over texture coordinates, which say nothing of space.
fn volume(_: &mut Reader<'_>, params: &Params<'_>) -> Result<EmissionTexture, SceneError> {
    let found = params.type_fault("a `volume` does not shine here: it colours what light falls on");
    Err(found.help("give a <texture type=\"bitmap\">").error())
}

/// The emission of a light.
pub(super) struct ReadEmission {
    /// The spectrum, or the factor 1 on the texture.
    pub(super) spectrum: Spectrum,
    pub(super) texture: Option<Arc<EmissionTexture>>,
}

/// The emission `name` of a light, which may be a texture; D65 of luminance 1 if it is not given.
pub(super) fn read(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    name: &'static str,
) -> Result<ReadEmission, SceneError> {
    let given = params.get_id(name).map(|id| (id, reader.document.element(id)));
    let varying = match given {
        // A spectrum may be written as a texture that is the same everywhere.
        Some((id, element)) if element.tag.name == "texture" && !spectrum::is_plugin(element) => {
            Some(ReadEmission { spectrum: Spectrum::Constant(1.0), texture: Some(textured(reader, id)?) })
        }
        Some((id, element)) if element.value("type") == Some("d65") => lit_by_d65(reader, id)?,
        _ => None,
    };
    let Some(varying) = varying else {
        return Ok(ReadEmission { spectrum: even(reader, params, name)?, texture: None });
    };
    params.without_effect(&["sampling_weight"]);
    Ok(varying)
}

/// A `d65` around a texture, which is how Mitsuba's spectral mode is told to light one.
fn lit_by_d65(reader: &mut Reader<'_>, id: ElementId) -> Result<Option<ReadEmission>, SceneError> {
    let params = Params::new(reader.document, id)?;
    let Some(texture) = params.object("texture")? else { return Ok(None) };
    let scale = params.float("scale")?.unwrap_or(1.0);
    if scale < 0.0 {
        return Err(params.error("scale", "a factor on light is not negative").error());
    }
    let texture = Some(textured(reader, texture)?);
    reader.finish(params);
    Ok(Some(ReadEmission { spectrum: Spectrum::Constant(scale as f32), texture }))
}

/// The emission `name` of a light, the same everywhere.
pub(super) fn even(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    name: &'static str,
) -> Result<Spectrum, SceneError> {
    params.without_effect(&["sampling_weight"]);
    params.default(name, "d65");
    Ok(spectrum::read(reader, params, name, Role::Emission)?.unwrap_or_else(|| Spectrum::d65(1.0)))
}

/// Reads a texture that shines; once, however often it is referred to.
fn textured(reader: &mut Reader<'_>, id: ElementId) -> Result<Arc<EmissionTexture>, SceneError> {
    if let Some(known) = reader.known.emission_textures.get(&id) {
        return Ok(known.clone());
    }
    let params = Params::new(reader.document, id)?;
    let texture = Arc::new(reader.plugin(&params, PLUGINS, &[])?(reader, &params)?);
    reader.finish(params);
    reader.known.emission_textures.insert(id, texture.clone());
    Ok(texture)
}

fn bitmap(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<EmissionTexture, SceneError> {
    let BitmapParams { path, raw, bitmap, to_uv, wrap, nearest, span } = texture::picture(reader, params)?;
    let map = match reader.known.emission_maps.get(&(path.clone(), raw)) {
        Some(known) => known.clone(),
        None => {
            let (width, height) = (bitmap.width(), bitmap.height());
            reader.known.texels += width * height;
            if reader.known.texels > limits::TOTAL_TEXELS {
                let message =
                    format!("the textures of this scene have more than {} texels", limits::TOTAL_TEXELS);
                return Err(reader.document.finding(FindingKind::Limit, span, message).error());
            }
            let texels = (0..width * height).map(|i| bitmap.texel(i % width, i / width)).collect();
            let grid = Grid::from_rows(width, height, texels).expect("a bitmap has full rows");
            let map = Arc::new(map(reader, params, span, &path, grid)?);
            reader.known.emission_maps.insert((path, raw), map.clone());
            map
        }
    };
    Ok(EmissionTexture { texels: EmissionTexels::Picture(map), to_uv, wrap, nearest })
}

fn checkerboard(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<EmissionTexture, SceneError> {
    let to_uv = texture::to_uv(params)?;
    let mut color = |name: &'static str, default: f32| {
        let given = params.get_id(name);
        if given.is_some_and(|id| reader.document.element(id).tag.name == "texture") {
            let found = params.error(name, "the squares of a checkerboard that shines have one colour each");
            return Err(found.help("write an <rgb>, a <spectrum> or a <float>").error());
        }
        let given = spectrum::read(reader, params, name, Role::Emission)?;
        Ok(given.unwrap_or(Spectrum::d65(default)))
    };
    let colors = [color("color0", 0.4)?, color("color1", 0.2)?];
    Ok(EmissionTexture::checkerboard(colors, to_uv))
}

/// The texels of the picture at `path`, named at `span`, as light. Those that are no radiance count as 0, with a warning.
pub(super) fn map(
    reader: &Reader<'_>,
    params: &Params<'_>,
    span: Span,
    path: &Path,
    mut picture: Grid<[f32; 3]>,
) -> Result<EmissionMap, SceneError> {
    let at = |kind, message: String| reader.document.finding(kind, span, message);
    let TexelRepairs { not_finite, negative } = emission_map::repair(picture.pixels_mut());
    if not_finite + negative > 0 {
        let all = picture.pixels().len();
        let message = format!(
            "{not_finite} of {all} texels of {} are infinite or no numbers and count as black; {negative} have negative components, which count as 0",
            path.display()
        );
        params.note(at(FindingKind::Value, message).label("of this picture").warning());
    }
    EmissionMap::new(picture.width(), picture.pixels())
        .map_err(|e| at(FindingKind::Value, format!("{}: {e}", path.display())).error())
}
