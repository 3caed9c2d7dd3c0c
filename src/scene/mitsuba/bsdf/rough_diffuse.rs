//! `roughdiffuse` of version 0.6: matt surfaces made of V-shaped cavities, such as clay or plaster.

use super::values::{Number, color, number};
use super::{Params, Reader};
use crate::scene::desc::RoughDiffuseDesc;
use crate::scene::diagnostic::SceneError;
use crate::spectrum::Spectrum;

pub(super) fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<RoughDiffuseDesc, SceneError> {
    params.default("alpha", 0.2);
    let alpha = match number(reader, params, "alpha")? {
        None => Spectrum::Constant(0.2).into(),
        Some(Number::Varying(texture)) => texture,
        Some(Number::Uniform(v)) if v >= 0.0 => Spectrum::Constant(v as f32).into(),
        Some(Number::Uniform(_)) => {
            return Err(params.error("alpha", "a roughness is not negative").error());
        }
    };
    Ok(RoughDiffuseDesc {
        reflectance: color(reader, params, "reflectance", 0.5)?,
        alpha,
        use_fast_approx: params.boolean("use_fast_approx", false)?,
    })
}
