//! `dielectric` and `roughdielectric`: an interface between two transparent media.

use super::ior::ior;
use super::roughness::ReadRoughness;
use super::values::color;
use super::{Params, Reader};
use crate::scene::desc::{DielectricDesc, RoughDielectricDesc};
use crate::scene::diagnostic::SceneError;
use crate::spectrum::dispersion::Ior;

pub(super) fn smooth(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<DielectricDesc, SceneError> {
    Ok(DielectricDesc {
        int_ior: abbe_number(params, ior(params, "int_ior", "bk7")?)?,
        ext_ior: ior(params, "ext_ior", "air")?,
        specular_reflectance: color(reader, params, "specular_reflectance", 1.0)?,
        specular_transmittance: color(reader, params, "specular_transmittance", 1.0)?,
    })
}

pub(super) fn rough(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<RoughDielectricDesc, SceneError> {
    let DielectricDesc { int_ior, ext_ior, specular_reflectance, specular_transmittance } =
        smooth(reader, params)?;
    if int_ior == ext_ior {
        let message = "both sides of a rough interface have the same index of refraction";
        let help = "without a difference light goes straight through: use `dielectric`";
        return Err(params.error("int_ior", message).help(help).error());
    }
    let ReadRoughness { roughness, alpha } = ReadRoughness::read(reader, params)?;
    Ok(RoughDielectricDesc {
        int_ior,
        ext_ior,
        specular_reflectance,
        specular_transmittance,
        roughness,
        alpha,
    })
}

/// The index inside with the dispersion that `int_abbe` gives it: the Abbe number V = (n_d − 1) / (n_F − n_C), an own parameter.
fn abbe_number(params: &Params<'_>, inside: Ior) -> Result<Ior, SceneError> {
    let Some(abbe) = params.float("int_abbe")? else { return Ok(inside) };
    let Ior::Constant(n_d) = inside else {
        let message =
            "`int_abbe` goes with an `int_ior` that is a number: media by name have their own dispersion";
        return Err(params.error("int_abbe", message).error());
    };
    // A NaN is no Abbe number, either.
    if !(1.0..=1e6).contains(&abbe) {
        let message = "an Abbe number is from 1 to 1000000, and of glass from 20 to 90";
        return Err(params.error("int_abbe", message).error());
    }
    Ok(Ior::of_abbe_number(n_d, abbe as f32))
}
