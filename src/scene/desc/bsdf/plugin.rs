//! The interface of the descriptions of bsdfs.

use super::bump::BumpDesc;
use super::coating::CoatDesc;
use super::parts::BsdfParts;
use super::roughness::{AlphaTexture, Roughness};
use crate::scene::desc::ids::BsdfId;
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// What the description of a bsdf plugin says of itself, so that others need not know the plugin.
pub(crate) trait BsdfPlugin: Sized {
    /// Mitsuba's name of the plugin.
    const NAME: &'static str;

    /// The index of refraction counts at every wavelength; otherwise at the sodium line only.
    const SPECTRAL_INDEX: bool = true;

    /// It spreads light diffusely and does nothing else, but not as Lambert's reflector: as a diffuse part it is known by all methods, and
    /// only code for every model traces it.
    const OTHER_DIFFUSE: bool = false;

    /// The parameters that others may ask for.
    fn parts(&self) -> BsdfParts<&SpectrumTexture, &Spectrum, &Ior>;

    /// The parameters that others may change.
    fn parts_mut(&mut self) -> BsdfParts<&mut SpectrumTexture, &mut Spectrum, &mut Ior>;

    /// Roughness of the specular part; `None` for a smooth or a diffuse material.
    fn roughness(&self) -> Option<Roughness> {
        None
    }

    /// The roughness where it varies.
    fn alpha(&self) -> Option<&AlphaTexture> {
        None
    }

    /// The same, to change.
    fn alpha_mut(&mut self) -> Option<&mut AlphaTexture> {
        None
    }

    /// The roughness differs between the tangents, if only somewhere.
    fn is_brushed(&self) -> bool {
        match self.alpha() {
            Some(alpha) => matches!(alpha, AlphaTexture::Anisotropic(_)),
            None => self.roughness().is_some_and(|roughness| roughness.alpha[0] != roughness.alpha[1]),
        }
    }

    /// The textures that numbers are read from, other than those of `parts`.
    fn scalars(&self) -> Vec<&SpectrumTexture> {
        self.alpha().map_or_else(Vec::new, AlphaTexture::textures)
    }

    /// The same, to change.
    fn scalars_mut(&mut self) -> Vec<&mut SpectrumTexture> {
        self.alpha_mut().map_or_else(Vec::new, AlphaTexture::textures_mut)
    }

    /// A number by its name in Mitsuba, where it is the same all over the surface.
    fn number(&self, _name: &str) -> Option<f32> {
        None
    }

    /// Changes a number that [`number`](Self::number) has.
    fn set_number(&mut self, _name: &str, _value: f32) {}

    /// The materials that this one is made of.
    fn nested(&self) -> Vec<BsdfId> {
        self.bump().map(|bump| bump.bsdf).into_iter().collect()
    }

    /// How it tilts the frame of the one that it is made of; `None` for what is no map of normals or heights.
    fn bump(&self) -> Option<&BumpDesc> {
        None
    }

    /// The layer that it lays over the one that it is made of; `None` for what is no coat.
    fn coat(&self) -> Option<CoatDesc<'_>> {
        None
    }
}
