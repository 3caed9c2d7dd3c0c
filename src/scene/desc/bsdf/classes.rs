//! Classifies materials by their parameters.

use super::{BsdfDesc, DiffuseDesc};
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// Classes of scattering, by which the effects that a scene needs are planned.
impl BsdfDesc {
    /// A grey material of this albedo.
    pub fn grey(albedo: f32) -> Self {
        DiffuseDesc { reflectance: Spectrum::Constant(albedo).into() }.into()
    }

    /// The material that a lenient run shows in place of an unsupported one.
    pub(crate) fn magenta() -> Self {
        DiffuseDesc { reflectance: Spectrum::reflectance_rgb([0.9, 0.0, 0.9]).into() }.into()
    }

    /// True for a material with a diffuse part.
    pub(crate) fn is_diffuse(&self) -> bool {
        self.parts().albedo.is_some() || self.is_other_diffuse()
    }

    /// True for a material with a delta component, such as a smooth coat.
    pub(crate) fn is_delta(&self) -> bool {
        self.is_specular() && self.roughness().is_none()
    }

    /// True for a material with a rough specular part.
    pub(crate) fn is_glossy(&self) -> bool {
        self.is_specular() && self.roughness().is_some()
    }

    /// True for a material with a specular part, smooth or rough, that reflects or transmits anything. A black coat counts: it takes
    /// light from its base.
    pub(crate) fn is_specular(&self) -> bool {
        let parts = self.parts();
        let has_factor = parts.reflection.is_some() || parts.transmission.is_some();
        has_factor && !self.is_other_diffuse() && !self.is_black()
    }

    /// True for a material that lets light through.
    pub(crate) fn transmits(&self) -> bool {
        self.parts().transmission.is_some_and(|factor| !factor.is_black())
    }

    /// True for a material that is coloured by thin-film interference.
    pub(crate) fn is_iridescent(&self) -> bool {
        matches!(self, Self::Principled(desc) if desc.thin_film.as_ref().is_some_and(|film| !film.weight.is_black()))
    }

    /// True for a material without a diffuse part whose factors are all black. A coating never is: the material under it may be seen.
    pub(crate) fn is_black(&self) -> bool {
        let parts = self.parts();
        parts.albedo.is_none()
            && parts.absorption.is_none()
            && [parts.reflection, parts.transmission].into_iter().flatten().all(SpectrumTexture::is_black)
    }

    /// Indices of refraction behind the surface and in front of it, if they are evaluated at every wavelength.
    pub(crate) fn spectral_indices(&self) -> Option<[&Ior; 2]> {
        let parts = self.parts();
        Some([parts.int_ior?, parts.ext_ior?]).filter(|_| self.has_spectral_index())
    }

    /// True for a material that rays pass straight through, at least at some points.
    pub(crate) fn has_holes(&self) -> bool {
        match self {
            Self::Null(_) => true,
            Self::Mask(mask) => mask.opacity != Spectrum::Constant(1.0),
            _ => false,
        }
    }
}
