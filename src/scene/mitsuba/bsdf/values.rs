//! Colours and numbers of materials, which may be textures.

use super::{Params, Reader};
use crate::scene::desc::texture::SpectrumTexture;
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::mitsuba::texture;
use crate::spectrum::Spectrum;

/// A reflectance or transmittance, with its default.
pub(super) fn color(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    name: &'static str,
    default: f32,
) -> Result<SpectrumTexture, SceneError> {
    params.default(name, default);
    let given = texture::read(reader, params, name)?;
    Ok(given.unwrap_or(Spectrum::Constant(default).into()))
}

/// A number of a material.
pub(super) enum Number {
    /// The same all over a surface.
    Uniform(f64),
    /// By a texture.
    Varying(SpectrumTexture),
}

/// The number `name`, if it is given: also as a colour, of which the luminance counts, or by a texture.
pub(super) fn number(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    name: &'static str,
) -> Result<Option<Number>, SceneError> {
    let colored = |tag: &str| matches!(tag, "texture" | "spectrum" | "rgb" | "srgb");
    if !params.get(name).is_some_and(|e| colored(e.tag.name)) {
        return Ok(params.float(name)?.map(Number::Uniform));
    }
    let texture = texture::read(reader, params, name)?.map(SpectrumTexture::into_scalar);
    Ok(texture.map(|texture| match texture.varies() {
        true => Number::Varying(texture),
        false => Number::Uniform(texture.mean_scalar().into()),
    }))
}

/// Says that a lobe and the diffuse part under it add up to more than all light: together they count as all of it then.
pub(super) fn warn_of_more_than_one(
    params: &Params<'_>,
    specular: &SpectrumTexture,
    diffuse: &SpectrumTexture,
) {
    let [specular, diffuse] = [specular, diffuse].map(|texture| texture.mean().reflected_rgb());
    if specular.into_iter().zip(diffuse).any(|(s, d)| s + d > 1.001) {
        let message = "`specular_reflectance` and `diffuse_reflectance` add up to more than 1: where they do, both are scaled to 1";
        params.note(params.fault(FindingKind::Value, message).warning());
    }
}

/// A number from 0 to `most`, which may vary; 0 unless given.
pub(super) fn share(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    name: &'static str,
    most: f64,
) -> Result<SpectrumTexture, SceneError> {
    Ok(match number(reader, params, name)? {
        None => Spectrum::Constant(0.0).into(),
        Some(Number::Uniform(v)) => Spectrum::Constant(cut(params, name, v, most)).into(),
        Some(Number::Varying(texture)) => texture,
    })
}

/// A number cut to the range from 0 to `most`, with a warning.
pub(super) fn cut(params: &Params<'_>, name: &'static str, v: f64, most: f64) -> f32 {
    let cut = v.clamp(0.0, most);
    if cut != v {
        let found = params.error(name, format!("`{name}` is from 0 to {most}: it counts as {cut}"));
        params.note(found.help("other values have no meaning in this material").warning());
    }
    cut as f32
}
