//! A film on the facets of `principled` whose thickness is of the order of a wavelength: soap, oil on water, the tint of heated steel.
//! Mitsuba has none; its three parameters are named as in OpenPBR.

use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::Spectrum;

/// A film of a transparent medium on facets.
#[derive(Clone, Debug)]
pub struct ThinFilmDesc {
    /// Share of the facets that it covers, a number.
    pub weight: SpectrumTexture,
    /// Its thickness in nm, a number.
    pub thickness: SpectrumTexture,
    /// Its index of refraction over that of the medium in front of it, at least 1.
    pub eta: f32,
}

impl ThinFilmDesc {
    /// Name of the parameter [`weight`](Self::weight).
    pub(crate) const WEIGHT: &str = "thin_film_weight";

    /// Name of the parameter [`thickness`](Self::thickness).
    pub(crate) const THICKNESS: &str = "thin_film_thickness";

    /// Name of the parameter [`eta`](Self::eta).
    pub(crate) const ETA: &str = "thin_film_eta";

    /// One of its numbers by its name, where it does not vary.
    pub(super) fn number(&self, name: &str) -> Option<f32> {
        match name {
            Self::WEIGHT => self.weight.constant_scalar(),
            Self::THICKNESS => self.thickness.constant_scalar(),
            Self::ETA => Some(self.eta),
            _ => None,
        }
    }

    /// Changes one of its numbers.
    pub(super) fn set_number(&mut self, name: &str, value: f32) {
        match name {
            Self::WEIGHT => self.weight = Spectrum::Constant(value).into(),
            Self::THICKNESS => self.thickness = Spectrum::Constant(value).into(),
            Self::ETA => self.eta = value,
            _ => {}
        }
    }
}
