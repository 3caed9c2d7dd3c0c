//! `principled`: diffuse, metallic, glassy and coated materials by one set of parameters, most of them from 0 to 1.

use super::ior::is_ior;
use super::thin_film;
use super::values::{Number, color, cut, number, share};
use super::{Params, Reader};
use crate::scene::desc::{LobeParameter, LobeTexture, PrincipledDesc, PrincipledLobes};
use crate::scene::diagnostic::SceneError;

pub(super) fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<PrincipledDesc, SceneError> {
    let base_color = color(reader, params, "base_color", 0.5)?;
    let spec_trans = share(reader, params, "spec_trans", 1.0)?;
    let mut lobes = PrincipledLobes::new(eta(params, !spec_trans.is_black())?);
    let mut textures = read_lobes(&mut lobes, reader, params, PrincipledLobes::SHARED)?;
    textures.extend(read_lobes(&mut lobes, reader, params, PrincipledLobes::COATED)?);
    let thin_film = thin_film::read(reader, params)?;
    params.without_effect(&[
        "main_specular_sampling_rate",
        "clearcoat_sampling_rate",
        "diffuse_reflectance_sampling_rate",
    ]);
    Ok(PrincipledDesc { base_color, spec_trans, lobes, textures, thin_film })
}

/// The relative index: `eta`, or from `specular` with 0.5 for glass. A material that lets light through has an index other than 1.
fn eta(params: &Params<'_>, transmits: bool) -> Result<f32, SceneError> {
    let Some(eta) = params.float("eta")? else {
        let specular = params.float("specular")?.map_or(0.5, |v| cut(params, "specular", v, 1.0));
        let specular = if transmits { specular.max(1e-3) } else { specular };
        return Ok(2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0);
    };
    if params.has("specular") {
        return Err(params.error("specular", "either `eta` or `specular`, which say the same").error());
    }
    if !is_ior(eta) {
        return Err(params.error("eta", "an index of refraction is above 0 and not above 1000").error());
    }
    Ok(if transmits && (eta - 1.0).abs() < 1e-3 { 1.001 } else { eta as f32 })
}

/// Reads the numbers of a file, each from 0 to 1, and returns those that vary.
pub(super) fn read_lobes(
    lobes: &mut PrincipledLobes,
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    parameters: &[(&'static str, LobeParameter)],
) -> Result<Vec<LobeTexture>, SceneError> {
    let mut textures = Vec::new();
    for &(name, parameter) in parameters {
        let value = parameter(lobes);
        match number(reader, params, name)? {
            None => {}
            Some(Number::Uniform(v)) => *value = cut(params, name, v, 1.0),
            Some(Number::Varying(texture)) => {
                textures.push(LobeTexture::new(parameter, [0.0, 1.0], texture, value));
            }
        }
    }
    Ok(textures)
}
