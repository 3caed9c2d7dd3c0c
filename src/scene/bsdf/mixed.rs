//! `blendbsdf` and `mask`: materials made of other materials.

use super::{BsdfDesc, BsdfPlugin, color, parts};
use crate::scene::desc::BsdfId;
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::mitsuba::{ElementId, Params, Reader, Span};
use crate::scene::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// Most one-sided materials that one material can be made of.
pub const MOST_PARTS: usize = 4;

/// Two materials in a fixed ratio.
#[derive(Clone, Debug)]
pub struct BlendDesc {
    /// Share of the second, from 0 to 1.
    pub weight: f32,
    /// The two.
    pub bsdfs: [BsdfId; 2],
}

impl BsdfPlugin for BlendDesc {
    const NAME: &'static str = "blendbsdf";

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let [first, second] = *params.objects("bsdf").as_slice() else {
            return Err(params.fault(FindingKind::Parameter, "a blend is made of two bsdfs").error());
        };
        if !params.has("weight") {
            let found =
                params.fault(FindingKind::Missing, "a blend needs `weight`, the share of its second bsdf");
            return Err(found.help("add <float name=\"weight\" value=\"0.5\"/>").error());
        }
        let weight = number(reader, params, "weight", 0.5)?;
        let bsdfs = [part(reader, first)?, part(reader, second)?];
        check_size(reader, params, &bsdfs)?;
        Ok(Self { weight, bsdfs })
    }

    parts! {}

    fn nested(&self) -> Vec<BsdfId> {
        self.bsdfs.to_vec()
    }
}

/// A material with holes finer than anything: what meets one goes straight through.
#[derive(Clone, Debug)]
pub struct MaskDesc {
    /// The material between the holes.
    pub bsdf: BsdfId,
    /// Its share of the surface.
    pub opacity: f32,
    /// What the holes let through: the rest, or 0 where the effect `transmission` is taken out.
    pub transparency: SpectrumTexture,
}

impl BsdfPlugin for MaskDesc {
    const NAME: &'static str = "mask";

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let [inner] = *params.objects("bsdf").as_slice() else {
            return Err(params.fault(FindingKind::Parameter, "a mask has one bsdf").error());
        };
        let opacity = number(reader, params, "opacity", 0.5)?;
        let bsdf = part(reader, inner)?;
        check_size(reader, params, &[bsdf])?;
        Ok(Self { bsdf, opacity, transparency: Spectrum::Constant(1.0 - opacity).into() })
    }

    parts! { transmission: transparency }

    fn nested(&self) -> Vec<BsdfId> {
        vec![self.bsdf]
    }
}

/// A number from 0 to 1, also as a grey.
fn number(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    name: &'static str,
    default: f32,
) -> Result<f32, SceneError> {
    match color(reader, params, name, default)? {
        SpectrumTexture::Uniform(Spectrum::Constant(v)) => Ok(v.clamp(0.0, 1.0)),
        _ => Err(params
            .error(name, format!("`{name}` is one number from 0 to 1, the same for all colours"))
            .error()),
    }
}

/// A nested material. Within a mixture an index of refraction is the same at all wavelengths.
fn part(reader: &mut Reader<'_>, (id, span): (ElementId, Span)) -> Result<BsdfId, SceneError> {
    let id = super::read(reader, id)?;
    let bsdf = &reader.lists.bsdfs[id.0 as usize];
    let indices = bsdf.spectral_indices().filter(|_| bsdf.transmits());
    if indices.is_some_and(|indices| indices.into_iter().any(Ior::is_dispersive)) {
        let message = "within another material glass does not disperse: its index counts at the sodium line";
        reader.warn(reader.document.finding(FindingKind::Parameter, span, message).advice());
    }
    Ok(id)
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
