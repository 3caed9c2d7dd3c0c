//! `principledthin`: leaves, paper and panes by parameters like those of `principled`.

use super::ior::is_ior;
use super::principled::read_lobes;
use super::values::{Number, color, number, share};
use super::{Params, Reader};
use crate::scene::desc::{LobeTexture, PrincipledLobes, PrincipledThinDesc};
use crate::scene::diagnostic::SceneError;
use crate::spectrum::Spectrum;

pub(super) fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<PrincipledThinDesc, SceneError> {
    let mut lobes = PrincipledLobes::new(1.5);
    let mut textures = read_lobes(&mut lobes, reader, params, PrincipledLobes::SHARED)?;
    match number(reader, params, "eta")? {
        None => {}
        Some(Number::Uniform(eta)) if is_ior(eta) => lobes.eta = eta as f32,
        Some(Number::Uniform(_)) => {
            let message = "an index of refraction is above 0 and not above 1000";
            return Err(params.error("eta", message).error());
        }
        Some(Number::Varying(texture)) => {
            let eta = LobeTexture::new(|lobes| &mut lobes.eta, [1e-3, 1e3], texture, &mut lobes.eta);
            textures.push(eta);
        }
    }
    params.without_effect(&[
        "specular_reflectance_sampling_rate",
        "specular_transmittance_sampling_rate",
        "diffuse_reflectance_sampling_rate",
        "diffuse_transmittance_sampling_rate",
    ]);
    Ok(PrincipledThinDesc {
        base_color: color(reader, params, "base_color", 0.5)?,
        transmittance: Spectrum::Constant(1.0).into(),
        spec_trans: share(reader, params, "spec_trans", 1.0)?,
        diff_trans: share(reader, params, "diff_trans", 2.0)?,
        lobes,
        textures,
    })
}
