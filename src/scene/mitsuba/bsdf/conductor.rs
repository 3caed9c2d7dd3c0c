//! `conductor` and `roughconductor`: metals, and how the index of a metal is read.

use glam::Vec4;

use super::ior::ior;
use super::roughness::ReadRoughness;
use super::values::color;
use crate::scene::desc::{ConductorDesc, RoughConductorDesc};
use crate::scene::diagnostic::{SceneError, shorten};
use crate::scene::mitsuba::params::Params;
use crate::scene::mitsuba::reader::{Reader, Role};
use crate::scene::mitsuba::spectrum;
use crate::spectrum::{Spectrum, metals};

/// The sodium line, at which indices are stated, nm.
const SODIUM: f32 = 589.3;

pub(super) fn smooth(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<ConductorDesc, SceneError> {
    let (eta, k) = metal(reader, params)?;
    Ok(ConductorDesc { eta, k, specular_reflectance: color(reader, params, "specular_reflectance", 1.0)? })
}

pub(super) fn rough(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<RoughConductorDesc, SceneError> {
    let (eta, k) = metal(reader, params)?;
    let specular_reflectance = color(reader, params, "specular_reflectance", 1.0)?;
    let ReadRoughness { roughness, alpha } = ReadRoughness::read(reader, params)?;
    Ok(RoughConductorDesc { eta, k, specular_reflectance, roughness, alpha })
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
                let given = spectrum::read(reader, params, name, Role::Unbounded)?;
                Ok(given.unwrap_or(Spectrum::Constant(default)))
            };
            Ok((index("eta", 0.0)?, index("k", 1.0)?))
        }
    }
}
