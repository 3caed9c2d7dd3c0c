//! Colours and numbers of materials, which may be textures: how they are read, and all those of a material.

use std::sync::Arc;

use super::{BsdfDesc, BsdfParts};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::mitsuba::{Params, Reader, read_texture};
use crate::scene::texture::{AttributeTexture, SpectrumTexture, TexturePoint};
use crate::scene::volume::VolumeTexture;
use crate::spectrum::Spectrum;

/// A reflectance or transmittance, with its default.
pub(super) fn color(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    name: &'static str,
    default: f32,
) -> Result<SpectrumTexture, SceneError> {
    params.default(name, default);
    let given = read_texture(reader, params, name)?;
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
    let texture = read_texture(reader, params, name)?.map(SpectrumTexture::into_scalar);
    Ok(texture.map(|texture| match texture.varies() {
        true => Number::Varying(texture),
        false => Number::Uniform(texture.mean_scalar().into()),
    }))
}

/// The value of a number that does not vary.
pub(super) fn uniform(number: &SpectrumTexture) -> Option<f32> {
    (!number.varies()).then(|| number.scalar(&TexturePoint::default()))
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

/// All colours and factors.
fn colors_of<T, S, I>(parts: BsdfParts<T, S, I>) -> impl Iterator<Item = T> {
    let BsdfParts { albedo, reflection, transmission, absorption, share, .. } = parts;
    [albedo, reflection, transmission, absorption, share].into_iter().flatten()
}

impl BsdfDesc {
    /// All colours, factors and textures of numbers.
    pub(crate) fn textures(&self) -> Vec<&SpectrumTexture> {
        let parts = self.parts();
        colors_of(parts).chain(self.scalars()).collect()
    }

    /// The mesh attributes that its textures ask for, to change.
    pub(crate) fn for_each_attribute(&mut self, mut visit: impl FnMut(&mut AttributeTexture)) {
        let parts = self.parts_mut();
        colors_of(parts).flat_map(SpectrumTexture::attributes_mut).for_each(&mut visit);
        self.scalars_mut().into_iter().flat_map(SpectrumTexture::attributes_mut).for_each(visit);
    }

    /// The textures over space in its textures, to change.
    pub(crate) fn for_each_volume(&mut self, mut visit: impl FnMut(&mut Arc<VolumeTexture>)) {
        if !self.textures().into_iter().any(SpectrumTexture::asks_place) {
            return;
        }
        colors_of(self.parts_mut()).flat_map(SpectrumTexture::volumes_mut).for_each(&mut visit);
        self.scalars_mut().into_iter().flat_map(SpectrumTexture::volumes_mut).for_each(visit);
    }

    /// True for a material with a texture that depends on where a surface lies.
    pub(crate) fn asks_place(&self) -> bool {
        self.textures().into_iter().any(SpectrumTexture::asks_place)
    }

    /// Replaces every texture by its mean.
    pub(crate) fn flatten(&mut self) {
        let parts = self.parts_mut();
        for texture in
            [parts.albedo, parts.reflection, parts.transmission, parts.absorption].into_iter().flatten()
        {
            *texture = texture.mean().into();
        }
        if let Some(share) = parts.share {
            *share = SpectrumTexture::from(share.mean()).grey();
        }
        for number in self.scalars_mut() {
            *number = Spectrum::Constant(number.mean_scalar()).into();
        }
    }

    /// True for a material with a texture.
    pub(crate) fn is_textured(&self) -> bool {
        self.textures().into_iter().any(SpectrumTexture::varies)
    }
}
