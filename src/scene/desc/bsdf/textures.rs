//! All textures of a material, of its colours and of its scalar parameters.

use std::sync::Arc;

use super::{BsdfDesc, BsdfParts};
use crate::scene::desc::texture::{AttributeTexture, SpectrumTexture};
use crate::scene::desc::volume::VolumeTexture;
use crate::spectrum::Spectrum;

/// All colours and factors.
fn colors_of<T, S, I>(parts: BsdfParts<T, S, I>) -> impl Iterator<Item = T> {
    let BsdfParts { albedo, reflection, transmission, absorption, share, .. } = parts;
    [albedo, reflection, transmission, absorption, share].into_iter().flatten()
}

impl BsdfDesc {
    /// All textures: of colours, factors and scalar parameters.
    pub(crate) fn textures(&self) -> Vec<&SpectrumTexture> {
        let parts = self.parts();
        colors_of(parts).chain(self.scalars()).collect()
    }

    /// Visits the mesh attributes in its textures, mutably.
    pub(crate) fn for_each_attribute(&mut self, mut visit: impl FnMut(&mut AttributeTexture)) {
        let parts = self.parts_mut();
        colors_of(parts).flat_map(SpectrumTexture::attributes_mut).for_each(&mut visit);
        self.scalars_mut().into_iter().flat_map(SpectrumTexture::attributes_mut).for_each(visit);
    }

    /// Visits the volumes in its textures, mutably.
    pub(crate) fn for_each_volume(&mut self, mut visit: impl FnMut(&mut Arc<VolumeTexture>)) {
        if !self.textures().into_iter().any(SpectrumTexture::asks_place) {
            return;
        }
        colors_of(self.parts_mut()).flat_map(SpectrumTexture::volumes_mut).for_each(&mut visit);
        self.scalars_mut().into_iter().flat_map(SpectrumTexture::volumes_mut).for_each(visit);
    }

    /// True for a material with a texture that depends on the position in space.
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
