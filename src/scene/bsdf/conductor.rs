//! `conductor` and `roughconductor`: metals, and how the index of a metal is read.

use glam::Vec4;

use super::dielectric::ior;
use super::roughness::{ReadRoughness, varying_roughness};
use super::{AlphaTexture, BsdfPlugin, Roughness, color, parts};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader, Role, read_spectrum, shorten};
use crate::scene::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior, metals};

/// The sodium line, at which indices are stated, nm.
const SODIUM: f32 = 589.3;

/// A smooth metal.
#[derive(Clone, Debug)]
pub struct ConductorDesc {
    /// Real part of the index of refraction.
    pub eta: Spectrum,
    /// Imaginary part; η = 0 with k = 1 reflects everything (`material="none"`).
    pub k: Spectrum,
    /// Factor on reflection, 1 in nature.
    pub specular_reflectance: SpectrumTexture,
}

impl BsdfPlugin for ConductorDesc {
    const NAME: &'static str = "conductor";

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let (eta, k) = metal(reader, params)?;
        Ok(Self { eta, k, specular_reflectance: color(reader, params, "specular_reflectance", 1.0)? })
    }

    parts! { reflection: specular_reflectance, eta: eta, k: k }
}

/// A rough metal.
#[derive(Clone, Debug)]
pub struct RoughConductorDesc {
    /// Real part of the index of refraction.
    pub eta: Spectrum,
    /// Imaginary part.
    pub k: Spectrum,
    /// Factor on reflection, 1 in nature.
    pub specular_reflectance: SpectrumTexture,
    /// Its microfacets.
    pub roughness: Roughness,
    /// Their roughness where it varies; `roughness` has its mean, or 1 for a mesh attribute.
    pub alpha: Option<Box<AlphaTexture>>,
}

impl BsdfPlugin for RoughConductorDesc {
    const NAME: &'static str = "roughconductor";

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let (eta, k) = metal(reader, params)?;
        let specular_reflectance = color(reader, params, "specular_reflectance", 1.0)?;
        let ReadRoughness { roughness, alpha } = ReadRoughness::read(reader, params)?;
        Ok(Self { eta, k, specular_reflectance, roughness, alpha })
    }

    parts! { reflection: specular_reflectance, eta: eta, k: k }

    varying_roughness! {}
}

/// The complex index η + i k of a metal, relative to `ext_eta` in front of it, which version 0.6 of the format had.
fn metal(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<(Spectrum, Spectrum), SceneError> {
    let (eta, k) = index(reader, params)?;
    if !params.has("ext_eta") {
        return Ok((eta, k));
    }
    let outside = ior(params, "ext_eta", "vacuum")?.eval(Vec4::splat(SODIUM)).x;
    Ok((eta.scaled(1.0 / outside), k.scaled(1.0 / outside)))
}

/// The index of the metal in vacuum: by the name of a `material`, or as `eta` and `k`.
fn index(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<(Spectrum, Spectrum), SceneError> {
    let material = params.string("material")?;
    let given = params.has("eta") || params.has("k");
    match material.as_deref().filter(|m| *m != "none") {
        Some(_) if given => {
            Err(params.error("material", "either `material` or `eta` and `k`, not both").error())
        }
        Some(name) => metals::named(name).ok_or_else(|| {
            let found = params.error("material", format!("no metal `{}` is known", shorten(name)));
            found.help("give `eta` and `k`, or a name such as Au, Ag, Al, Cu, or `none`").error()
        }),
        None => {
            let mut index = |name, default| {
                params.default(name, default);
                let given = read_spectrum(reader, params, name, Role::Unbounded)?;
                Ok(given.unwrap_or(Spectrum::Constant(default)))
            };
            Ok((index("eta", 0.0)?, index("k", 1.0)?))
        }
    }
}
