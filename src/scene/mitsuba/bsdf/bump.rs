//! `normalmap` and `bumpmap`: a picture tilts the shading frame of a nested material.

use super::mixed::warn_of_lost_dispersion;
use super::{Params, Reader};
use crate::scene::desc::texture::{BitmapTexture, SpectrumTexture};
use crate::scene::desc::{BsdfId, BumpDesc, BumpMapDesc, NormalMapDesc};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::mitsuba::document::ElementId;
use crate::scene::mitsuba::texture;

pub(super) fn normal_map(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<NormalMapDesc, SceneError> {
    let named = params.get_id("normalmap");
    let others = if named.is_none() { params.objects("texture") } else { Vec::new() };
    let id = match (named, others.as_slice()) {
        (Some(named), _) => named,
        // It has no name in version 0.6, and exporters give it others.
        (None, [(only, span)]) => {
            let message = "the texture of a normalmap is called `normalmap`: the only one here is taken";
            let found = reader.document.finding(FindingKind::Parameter, *span, message);
            params.note(found.advice());
            *only
        }
        (None, _) => {
            let found = params.fault(FindingKind::Missing, "a normalmap needs the texture `normalmap`");
            return Err(found.help("add <texture name=\"normalmap\" type=\"bitmap\">").error());
        }
    };
    let normals = picture(reader, params, id)?;
    Ok(NormalMapDesc { normals, bump: bump(reader, params)? })
}

pub(super) fn bump_map(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<BumpMapDesc, SceneError> {
    // Its name is free in Mitsuba 3, and missing in version 0.6.
    let [(id, _)] = *params.objects("texture").as_slice() else {
        let found = params.fault(FindingKind::Parameter, "a bumpmap has one texture, of heights");
        return Err(found.help("add <texture type=\"bitmap\">").error());
    };
    let heights = picture(reader, params, id)?;
    let scale = params.float("scale")?.unwrap_or(1.0) as f32;
    Ok(BumpMapDesc { heights, scale, bump: bump(reader, params)? })
}

/// True for a material that has a bump, or of which a part does.
fn has_bump(reader: &Reader<'_>, id: BsdfId) -> bool {
    let bsdf = &reader.lists.bsdfs[id.0 as usize];
    bsdf.bump().is_some() || bsdf.nested().into_iter().any(|id| has_bump(reader, id))
}

/// The picture of a map.
fn picture(reader: &mut Reader<'_>, params: &Params<'_>, id: ElementId) -> Result<BitmapTexture, SceneError> {
    let span = reader.document.element(id).span;
    let refuse = |message: String| reader.document.finding(FindingKind::Parameter, span, message);
    if reader.document.element(id).tag.name != "texture" {
        let found = refuse(format!("a {} is a picture", params.plugin()));
        return Err(found.help("give a <texture type=\"bitmap\">").error());
    }
    let SpectrumTexture::Bitmap(bitmap) = texture::shared(reader, id)? else {
        let found = reader.document.finding(
            FindingKind::Parameter,
            span,
            format!("a {} is a picture: no other texture has what it needs", params.plugin()),
        );
        return Err(found.help("give a <texture type=\"bitmap\">").error());
    };
    if bitmap.bitmap.is_decoded() {
        let message = format!("this {} is decoded from sRGB as if it were a colour", params.plugin());
        let help = "add <boolean name=\"raw\" value=\"true\"/> to the texture: Mitsuba refuses it otherwise";
        reader.warn(reader.document.finding(FindingKind::Parameter, span, message).help(help).advice());
    }
    Ok(bitmap)
}

/// Reads the parameters that normal maps and bump maps share.
fn bump(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<BumpDesc, SceneError> {
    let [inner] = *params.objects("bsdf").as_slice() else {
        let message = format!("a {} has one bsdf, whose normals it tilts", params.plugin());
        return Err(params.fault(FindingKind::Parameter, message).error());
    };
    let bsdf = reader.bsdf(inner.0)?;
    warn_of_lost_dispersion(reader, params, bsdf, inner.1);
    if has_bump(reader, bsdf) {
        let message = "a map of normals or heights within another one is not supported";
        let found = reader.document.finding(FindingKind::Plugin, params.span(), message);
        return Err(found.help("leave one of them out, or make one map of both").error());
    }
    Ok(BumpDesc {
        bsdf,
        flip_invalid_normals: params.boolean("flip_invalid_normals", true)?,
        use_shadowing_function: params.boolean("use_shadowing_function", true)?,
    })
}
