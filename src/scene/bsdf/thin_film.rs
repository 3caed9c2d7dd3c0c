//! A film on the facets of `principled` that is as thin as light is long: soap, oil on water, the tint of heated steel. Mitsuba has
//! none; its three parameters are named as in OpenPBR.

use super::textures::uniform;
use super::{Number, number};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader};
use crate::scene::texture::SpectrumTexture;
use crate::spectrum::Spectrum;

/// The thickest film, in nm: of a thicker one no eye sees the colours.
const THICKEST: f64 = 1e5;

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

/// Names of the numbers.
const WEIGHT: &str = "thin_film_weight";
const THICKNESS: &str = "thin_film_thickness";
const ETA: &str = "thin_film_eta";

impl ThinFilmDesc {
    /// Reads the film of a material; none where it covers nothing.
    pub(super) fn read(
        reader: &mut Reader<'_>,
        params: &Params<'_>,
    ) -> Result<Option<Box<Self>>, SceneError> {
        let weight = super::principled::share(reader, params, WEIGHT, 1.0)?;
        params.default(THICKNESS, 400);
        params.default(ETA, 1.3);
        let thickness = match number(reader, params, THICKNESS)? {
            None => Spectrum::Constant(400.0).into(),
            Some(Number::Varying(texture)) => texture,
            Some(Number::Uniform(v)) if (0.0..=THICKEST).contains(&v) => Spectrum::Constant(v as f32).into(),
            Some(Number::Uniform(_)) => {
                let message = "the thickness of a film is from 0 to 100000 nm";
                return Err(params.error(THICKNESS, message).error());
            }
        };
        let eta = params.float(ETA)?.unwrap_or(1.3);
        if !(1.0..=10.0).contains(&eta) {
            let message = "the index of a film is from 1 to 10, relative to what is in front of it";
            return Err(params.error(ETA, message).error());
        }
        Ok((!weight.is_black()).then(|| Box::new(Self { weight, thickness, eta: eta as f32 })))
    }

    /// One of its numbers by its name, where it does not vary.
    pub(super) fn number(&self, name: &str) -> Option<f32> {
        match name {
            WEIGHT => uniform(&self.weight),
            THICKNESS => uniform(&self.thickness),
            ETA => Some(self.eta),
            _ => None,
        }
    }

    /// Changes one of its numbers.
    pub(super) fn set_number(&mut self, name: &str, value: f32) {
        match name {
            WEIGHT => self.weight = Spectrum::Constant(value).into(),
            THICKNESS => self.thickness = Spectrum::Constant(value).into(),
            ETA => self.eta = value,
            _ => {}
        }
    }
}
