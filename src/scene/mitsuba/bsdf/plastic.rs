//! `plastic` and `roughplastic`: a transparent coat over a diffuse base.

use super::ior::ior;
use super::roughness::ReadRoughness;
use super::values::color;
use super::{Params, Reader};
use crate::scene::desc::{PlasticDesc, RoughPlasticDesc};
use crate::scene::diagnostic::SceneError;

pub(super) fn smooth(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<PlasticDesc, SceneError> {
    Ok(PlasticDesc {
        int_ior: ior(params, "int_ior", "polypropylene")?,
        ext_ior: ior(params, "ext_ior", "air")?,
        diffuse_reflectance: color(reader, params, "diffuse_reflectance", 0.5)?,
        specular_reflectance: color(reader, params, "specular_reflectance", 1.0)?,
        nonlinear: params.boolean("nonlinear", false)?,
    })
}

pub(super) fn rough(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<RoughPlasticDesc, SceneError> {
    let (int_ior, ext_ior) = (ior(params, "int_ior", "polypropylene")?, ior(params, "ext_ior", "air")?);
    if int_ior == ext_ior {
        let message = "a coat has another index of refraction than what is around it";
        return Err(params.error("int_ior", message).help("without a coat it is `diffuse`").error());
    }
    let roughness = ReadRoughness::read(reader, params)?.uniform(params);
    if roughness.alpha[0] != roughness.alpha[1] {
        let found = params.error("alpha_u", "the coat of a plastic is as rough along as across");
        return Err(found.help("give one `alpha`").error());
    }
    Ok(RoughPlasticDesc {
        int_ior,
        ext_ior,
        diffuse_reflectance: color(reader, params, "diffuse_reflectance", 0.5)?,
        specular_reflectance: color(reader, params, "specular_reflectance", 1.0)?,
        nonlinear: params.boolean("nonlinear", false)?,
        roughness,
    })
}
