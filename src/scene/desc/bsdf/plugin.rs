//! The interface of the descriptions of bsdfs.

use super::bump::BumpDesc;
use super::coating::CoatDesc;
use super::parts::BsdfParts;
use super::roughness::{AlphaTexture, Roughness};
use crate::scene::desc::ids::BsdfId;
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// The interface of the description of a bsdf plugin, so that other code need not know the plugin.
pub(crate) trait BsdfPlugin: Sized {
    /// Mitsuba's name of the plugin.
    const NAME: &'static str;

    /// The index of refraction is evaluated at every wavelength; otherwise at the sodium line only.
    const SPECTRAL_INDEX: bool = true;

    /// It is purely diffuse, but not Lambertian. All integrators treat it as diffuse; the code that is specialised for scenes of
    /// Lambertian surfaces does not trace it.
    const OTHER_DIFFUSE: bool = false;

    /// The parameters by meaning.
    fn parts(&self) -> BsdfParts<&SpectrumTexture, &Spectrum, &Ior>;

    /// The parameters by meaning, mutably.
    fn parts_mut(&mut self) -> BsdfParts<&mut SpectrumTexture, &mut Spectrum, &mut Ior>;

    /// Roughness of the specular part; `None` for a smooth or a diffuse material.
    fn roughness(&self) -> Option<Roughness> {
        None
    }

    /// The texture of the roughness, if it varies.
    fn alpha(&self) -> Option<&AlphaTexture> {
        None
    }

    /// The same, to change.
    fn alpha_mut(&mut self) -> Option<&mut AlphaTexture> {
        None
    }

    /// True for anisotropic roughness, if only at some points.
    fn is_brushed(&self) -> bool {
        match self.alpha() {
            Some(alpha) => matches!(alpha, AlphaTexture::Anisotropic(_)),
            None => self.roughness().is_some_and(|roughness| roughness.alpha[0] != roughness.alpha[1]),
        }
    }

    /// The textures of scalar parameters, other than those in [`parts`](Self::parts).
    fn scalars(&self) -> Vec<&SpectrumTexture> {
        self.alpha().map_or_else(Vec::new, AlphaTexture::textures)
    }

    /// The same, to change.
    fn scalars_mut(&mut self) -> Vec<&mut SpectrumTexture> {
        self.alpha_mut().map_or_else(Vec::new, AlphaTexture::textures_mut)
    }

    /// A scalar parameter by its name in Mitsuba, if it is constant over the surface.
    fn number(&self, _name: &str) -> Option<f32> {
        None
    }

    /// Changes a parameter for which [`number`](Self::number) returns a value.
    fn set_number(&mut self, _name: &str, _value: f32) {}

    /// The materials nested in this one.
    fn nested(&self) -> Vec<BsdfId> {
        self.bump().map(|bump| bump.bsdf).into_iter().collect()
    }

    /// The perturbation of the shading frame, for a normal map or a bump map.
    fn bump(&self) -> Option<&BumpDesc> {
        None
    }

    /// The coat over the nested material, for a coating.
    fn coat(&self) -> Option<CoatDesc<'_>> {
        None
    }
}
