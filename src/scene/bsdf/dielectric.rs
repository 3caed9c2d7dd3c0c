//! `dielectric` and `roughdielectric`: an interface between two transparent media, and how an index of refraction is read.

use super::roughness::{ReadRoughness, varying_roughness};
use super::{AlphaTexture, BsdfPlugin, Roughness, color, parts};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Question, Reader, shorten};
use crate::scene::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// A smooth interface between two transparent media.
#[derive(Clone, Debug)]
pub struct DielectricDesc {
    /// Index on the side the normal points away from.
    pub int_ior: Ior,
    /// Index on the side the normal points to.
    pub ext_ior: Ior,
    /// Factor on reflection, 1 in nature.
    pub specular_reflectance: SpectrumTexture,
    /// Factor on transmission, 1 in nature.
    pub specular_transmittance: SpectrumTexture,
}

impl BsdfPlugin for DielectricDesc {
    const NAME: &'static str = "dielectric";

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self {
            int_ior: abbe_number(params, ior(params, "int_ior", "bk7")?)?,
            ext_ior: ior(params, "ext_ior", "air")?,
            specular_reflectance: color(reader, params, "specular_reflectance", 1.0)?,
            specular_transmittance: color(reader, params, "specular_transmittance", 1.0)?,
        })
    }

    parts! {
        reflection: specular_reflectance,
        transmission: specular_transmittance,
        int_ior: int_ior,
        ext_ior: ext_ior,
    }
}

/// A rough interface between two transparent media of different index.
#[derive(Clone, Debug)]
pub struct RoughDielectricDesc {
    /// Index on the side the normal points away from.
    pub int_ior: Ior,
    /// Index on the side the normal points to.
    pub ext_ior: Ior,
    /// Factor on reflection, 1 in nature.
    pub specular_reflectance: SpectrumTexture,
    /// Factor on transmission, 1 in nature.
    pub specular_transmittance: SpectrumTexture,
    /// Its microfacets.
    pub roughness: Roughness,
    /// Their roughness where it varies; `roughness` has its mean, or 1 for a mesh attribute.
    pub alpha: Option<Box<AlphaTexture>>,
}

impl BsdfPlugin for RoughDielectricDesc {
    const NAME: &'static str = "roughdielectric";

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let DielectricDesc { int_ior, ext_ior, specular_reflectance, specular_transmittance } =
            DielectricDesc::read(reader, params)?;
        if int_ior == ext_ior {
            let message = "both sides of a rough interface have the same index of refraction";
            let help = "without a difference light goes straight through: use `dielectric`";
            return Err(params.error("int_ior", message).help(help).error());
        }
        let ReadRoughness { roughness, alpha } = ReadRoughness::read(reader, params)?;
        Ok(Self { int_ior, ext_ior, specular_reflectance, specular_transmittance, roughness, alpha })
    }

    parts! {
        reflection: specular_reflectance,
        transmission: specular_transmittance,
        int_ior: int_ior,
        ext_ior: ext_ior,
    }

    varying_roughness! {}
}

/// An index of refraction: a number, or the name of a medium.
pub(super) fn ior(params: &Params<'_>, name: &'static str, default: &str) -> Result<Ior, SceneError> {
    let by_name = |medium: &str| {
        Ior::named(medium).ok_or_else(|| {
            let message = format!("no index of refraction is known for `{}`", shorten(medium));
            let found = params.error(name, message);
            found.help("give a number: <float name=\"int_ior\" value=\"1.5\"/>").error()
        })
    };
    params.ask(name, || Question::Value(&["float", "string"]));
    params.default(name, default);
    match params.get(name).map(|e| e.tag.name) {
        None => by_name(default),
        Some("string") => by_name(&params.string(name)?.unwrap_or_default()),
        Some(_) => {
            let n = params.float(name)?.unwrap_or(1.0);
            if is_ior(n) {
                return Ok(Ior::Constant(n as f32));
            }
            Err(params.error(name, "an index of refraction is above 0 and not above 1000").error())
        }
    }
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

/// True for a number that can be an index of refraction.
pub(crate) fn is_ior(n: f64) -> bool {
    n > 0.0 && n <= 1e3
}
