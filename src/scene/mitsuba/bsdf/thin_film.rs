//! The thin film on the facets of `principled`.

use super::values::{Number, number, share};
use super::{Params, Reader};
use crate::scene::desc::ThinFilmDesc;
use crate::scene::diagnostic::SceneError;
use crate::spectrum::Spectrum;

/// The thickest film, in nm: of a thicker one no eye sees the colours.
const THICKEST: f64 = 1e5;

/// Reads the film of a material; none where it covers nothing.
pub(super) fn read(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
) -> Result<Option<Box<ThinFilmDesc>>, SceneError> {
    let weight = share(reader, params, ThinFilmDesc::WEIGHT, 1.0)?;
    params.default(ThinFilmDesc::THICKNESS, 400);
    params.default(ThinFilmDesc::ETA, 1.3);
    let thickness = match number(reader, params, ThinFilmDesc::THICKNESS)? {
        None => Spectrum::Constant(400.0).into(),
        Some(Number::Varying(texture)) => texture,
        Some(Number::Uniform(v)) if (0.0..=THICKEST).contains(&v) => Spectrum::Constant(v as f32).into(),
        Some(Number::Uniform(_)) => {
            let message = "the thickness of a film is from 0 to 100000 nm";
            return Err(params.error(ThinFilmDesc::THICKNESS, message).error());
        }
    };
    let eta = params.float(ThinFilmDesc::ETA)?.unwrap_or(1.3);
    if !(1.0..=10.0).contains(&eta) {
        let message = "the index of a film is from 1 to 10, relative to what is in front of it";
        return Err(params.error(ThinFilmDesc::ETA, message).error());
    }
    Ok((!weight.is_black()).then(|| Box::new(ThinFilmDesc { weight, thickness, eta: eta as f32 })))
}
