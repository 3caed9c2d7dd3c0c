//! `coating` and `roughcoating` of version 0.6: a layer of a transparent medium over any other material.

use super::ior::ior;
use super::mixed::warn_of_lost_dispersion;
use super::roughness::ReadRoughness;
use super::values::color;
use crate::scene::desc::texture::SpectrumTexture;
use crate::scene::desc::{BsdfDesc, BsdfId, CoatingDesc, RoughCoatingDesc};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::mitsuba::params::Params;
use crate::scene::mitsuba::reader::{Reader, Role};
use crate::scene::mitsuba::{spectrum, texture};
use crate::spectrum::Spectrum;

pub(super) fn smooth(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<CoatingDesc, SceneError> {
    let [inner] = *params.objects("bsdf").as_slice() else {
        let message = format!("a `{}` has one bsdf, which it coats", params.plugin());
        return Err(params.fault(FindingKind::Parameter, message).error());
    };
    params.without_effect(&["specular_sampling_weight"]);
    let (int_ior, ext_ior) = (ior(params, "int_ior", "bk7")?, ior(params, "ext_ior", "air")?);
    params.default("thickness", 1);
    let thickness = params.float("thickness")?.unwrap_or(1.0);
    if thickness < 0.0 {
        return Err(params.error("thickness", "a coat is not thinner than 0").error());
    }
    params.default("sigma_a", 0);
    let sigma_a = absorption(reader, params)?;
    let specular_reflectance = color(reader, params, "specular_reflectance", 1.0)?;
    let bsdf = reader.bsdf(inner.0)?;
    warn_of_lost_dispersion(reader, params, bsdf, inner.1);
    if is_coated(reader, bsdf) {
        let found = params.fault(FindingKind::Plugin, "a coat over another coat is not supported");
        return Err(found.help("leave one of them out").error());
    }
    if has_holes(reader, bsdf) {
        let message = "where the bsdf in this coat has holes the coat has them, too";
        params.note(params.fault(FindingKind::Parameter, message).advice());
    }
    let thickness = thickness.min(f64::from(f32::MAX)) as f32;
    Ok(CoatingDesc { bsdf, int_ior, ext_ior, thickness, sigma_a, specular_reflectance })
}

pub(super) fn rough(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<RoughCoatingDesc, SceneError> {
    let coating = smooth(reader, params)?;
    let roughness = ReadRoughness::read(reader, params)?.uniform(params);
    if roughness.alpha[0] != roughness.alpha[1] {
        let found = params.error("alpha_u", "a coat is as rough along as across");
        return Err(found.help("give one `alpha`").error());
    }
    Ok(RoughCoatingDesc { coating, roughness })
}

/// `sigma_a`: a spectrum without bound, or a texture; nothing unless given.
fn absorption(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<SpectrumTexture, SceneError> {
    let is_texture = params.get("sigma_a").is_some_and(|element| element.tag.name == "texture");
    let given = if is_texture {
        texture::read(reader, params, "sigma_a")?
    } else {
        spectrum::read(reader, params, "sigma_a", Role::Unbounded)?.map(SpectrumTexture::Uniform)
    };
    Ok(given.unwrap_or(Spectrum::Constant(0.0).into()))
}

/// True for a material that has a coat, or of which a part does.
fn is_coated(reader: &Reader<'_>, id: BsdfId) -> bool {
    any(reader, id, |bsdf| bsdf.coat().is_some())
}

/// True for a material that has holes, or of which a part does.
fn has_holes(reader: &Reader<'_>, id: BsdfId) -> bool {
    any(reader, id, BsdfDesc::has_holes)
}

fn any(reader: &Reader<'_>, id: BsdfId, is: fn(&BsdfDesc) -> bool) -> bool {
    let bsdf = &reader.lists.bsdfs[id.0 as usize];
    is(bsdf) || bsdf.nested().into_iter().any(|id| any(reader, id, is))
}
