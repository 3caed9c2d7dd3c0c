//! `blendbsdf`, `mixturebsdf` and `mask`: materials made of other materials.

use super::{Params, Reader};
use crate::scene::desc::texture::SpectrumTexture;
use crate::scene::desc::{BlendDesc, BsdfDesc, BsdfId, MOST_PARTS, MaskDesc, MixtureDesc};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::mitsuba::source::Span;
use crate::scene::mitsuba::texture;
use crate::scene::mitsuba::value::numbers;
use crate::spectrum::{Spectrum, dispersion::Ior};

pub(super) fn blend(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<BlendDesc, SceneError> {
    let [first, second] = *params.objects("bsdf").as_slice() else {
        return Err(params.fault(FindingKind::Parameter, "a blend is made of two bsdfs").error());
    };
    if !params.has("weight") {
        let found =
            params.fault(FindingKind::Missing, "a blend needs `weight`, the share of its second bsdf");
        return Err(found.help("add <float name=\"weight\" value=\"0.5\"/>").error());
    }
    let weight = share(reader, params, "weight")?;
    let bsdfs = [reader.bsdf(first.0)?, reader.bsdf(second.0)?];
    check_size(reader, params, &bsdfs)?;
    warn_of_lost_dispersion(reader, params, bsdfs[0], first.1);
    warn_of_lost_dispersion(reader, params, bsdfs[1], second.1);
    Ok(BlendDesc { weight, bsdfs })
}

pub(super) fn mixture(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<MixtureDesc, SceneError> {
    let nested = params.objects("bsdf");
    let Some(list) = params.string("weights")? else {
        let found = params.fault(FindingKind::Missing, "a mixture needs `weights`, one for each bsdf");
        return Err(found.help("add <string name=\"weights\" value=\"0.5, 0.5\"/>").error());
    };
    let weights =
        numbers(&list.replace(';', " ")).map_err(|message| params.error("weights", message).error())?;
    if weights.len() != nested.len() {
        let message = format!("{} weights for {} bsdfs", weights.len(), nested.len());
        return Err(params.error("weights", message).help("each bsdf has one weight").error());
    }
    let sum: f64 = weights.iter().sum();
    if weights.iter().any(|weight| *weight < 0.0) || sum <= 0.0 {
        let message = "weights are not negative, and their sum is more than 0";
        return Err(params.error("weights", message).error());
    }
    if sum > 1.0 + LEAST_REST {
        let found =
            params.error("weights", format!("these weights add up to {sum:.3}: they are scaled to 1"));
        params.note(found.help("otherwise the surface would return more light than arrives").warning());
    }
    params.without_effect(&["ensure_energy_conservation"]);
    let rest = 1.0 - sum;
    let whole = if rest < LEAST_REST { sum } else { 1.0 };
    let mut parts = Vec::new();
    for ((id, span), weight) in nested.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0) {
        let bsdf = reader.bsdf(id)?;
        warn_of_lost_dispersion(reader, params, bsdf, span);
        parts.push((bsdf, (weight / whole) as f32));
    }
    if rest >= LEAST_REST {
        parts.push((reader.default_bsdf(true), rest as f32));
    }
    let all: Vec<BsdfId> = parts.iter().map(|(bsdf, _)| *bsdf).collect();
    if rest >= LEAST_REST && all.iter().map(|id| size(reader, *id)).sum::<usize>() > MOST_PARTS {
        let message = format!(
            "this material is made of more than {MOST_PARTS} others, with the black one for the {rest:.3} that its weights leave of 1"
        );
        return Err(params
            .fault(FindingKind::Limit, message)
            .help("weights that add up to 1 need none")
            .error());
    }
    check_size(reader, params, &all)?;
    Ok(MixtureDesc { parts })
}

pub(super) fn mask(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<MaskDesc, SceneError> {
    let [inner] = *params.objects("bsdf").as_slice() else {
        return Err(params.fault(FindingKind::Parameter, "a mask has one bsdf").error());
    };
    let opacity = share(reader, params, "opacity")?;
    let bsdf = reader.bsdf(inner.0)?;
    check_size(reader, params, &[bsdf])?;
    Ok(MaskDesc { bsdf, opacity })
}

/// A rest smaller than this is a rounding of the weights.
const LEAST_REST: f64 = 1e-3;

/// A number from 0 to 1, half if it is not given, or a texture of such numbers. A colour counts by its luminance.
fn share(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    name: &'static str,
) -> Result<SpectrumTexture, SceneError> {
    let given = texture::read(reader, params, name)?.unwrap_or(Spectrum::Constant(0.5).into());
    if let SpectrumTexture::Uniform(spectrum) = &given
        && !spectrum.is_constant()
    {
        let message = format!("`{name}` is the same for all colours: the luminance of this one is taken");
        params.note(params.error(name, message).advice());
        return Ok(given.grey());
    }
    Ok(given)
}

/// Says that within a blend or a map an index of refraction is the same at all wavelengths.
pub(super) fn warn_of_lost_dispersion(reader: &Reader<'_>, params: &Params<'_>, id: BsdfId, span: Span) {
    let mut bsdf = &reader.lists.bsdfs[id.0 as usize];
    while let BsdfDesc::Mask(mask) = bsdf {
        bsdf = &reader.lists.bsdfs[mask.bsdf.0 as usize];
    }
    let indices = bsdf.spectral_indices().filter(|_| bsdf.transmits());
    if indices.is_some_and(|indices| indices.into_iter().any(Ior::is_dispersive)) {
        let message = "within another material glass does not disperse: its index counts at the sodium line";
        params.note(reader.document.finding(FindingKind::Parameter, span, message).advice());
    }
}

/// Refuses a material that is made of too many others.
fn check_size(reader: &Reader<'_>, params: &Params<'_>, bsdfs: &[BsdfId]) -> Result<(), SceneError> {
    if bsdfs.iter().map(|id| size(reader, *id)).sum::<usize>() <= MOST_PARTS {
        return Ok(());
    }
    let message = format!("this material is made of more than {MOST_PARTS} others");
    Err(params.fault(FindingKind::Limit, message).error())
}

/// The number of materials that one side of a material is made of. What is nested was read before and is not too large.
fn size(reader: &Reader<'_>, id: BsdfId) -> usize {
    let bsdf = &reader.lists.bsdfs[id.0 as usize];
    let sizes = bsdf.nested().into_iter().map(|id| size(reader, id));
    let size = if matches!(bsdf, BsdfDesc::TwoSided(_)) { sizes.max() } else { sizes.reduce(|a, b| a + b) };
    size.unwrap_or(1)
}
