//! `blendbsdf`, `mixturebsdf` and `mask`: materials made of other materials.

use super::textures::uniform;
use super::{BsdfDesc, BsdfPlugin, parts};
use crate::scene::desc::BsdfId;
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::mitsuba::{Params, Reader, Span, numbers, read_texture};
use crate::scene::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// Most one-sided materials that one material can be made of.
pub const MOST_PARTS: usize = 4;

/// Two materials in a ratio that may vary over the surface.
#[derive(Clone, Debug)]
pub struct BlendDesc {
    /// Share of the second, from 0 to 1: [`SpectrumTexture::scalar`].
    pub weight: SpectrumTexture,
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
        let weight = share(reader, params, "weight")?;
        let bsdfs = [super::read(reader, first.0)?, super::read(reader, second.0)?];
        check_size(reader, params, &bsdfs)?;
        warn_of_lost_dispersion(reader, params, bsdfs[0], first.1);
        warn_of_lost_dispersion(reader, params, bsdfs[1], second.1);
        Ok(Self { weight, bsdfs })
    }

    parts! { share: weight }

    fn number(&self, name: &str) -> Option<f32> {
        uniform(&self.weight).filter(|_| name == "weight")
    }

    fn set_number(&mut self, _name: &str, value: f32) {
        self.weight = Spectrum::Constant(value).into();
    }

    fn nested(&self) -> Vec<BsdfId> {
        self.bsdfs.to_vec()
    }
}

/// Several materials, each with the same share all over the surface.
#[derive(Clone, Debug)]
pub struct MixtureDesc {
    /// The materials with their weights from 0, which count in proportion; those of a file add up to 1. What a file leaves of 1 is black.
    pub parts: Vec<(BsdfId, f32)>,
}

/// Names of the weights, by which they are edited.
const WEIGHTS: [&str; MOST_PARTS] = ["weight_1", "weight_2", "weight_3", "weight_4"];

impl MixtureDesc {
    /// The materials with their shares, which add up to 1; all of them are 0 where no weight is more.
    pub fn shares(&self) -> impl Iterator<Item = (BsdfId, f32)> {
        let sum: f32 = self.parts.iter().map(|(_, weight)| weight).sum();
        // Weights of a file are shares already, but for their rounding.
        let scale = if sum <= 0.0 || (sum - 1.0).abs() < 1e-6 { 1.0 } else { 1.0 / sum };
        self.parts.iter().map(move |(bsdf, weight)| (*bsdf, weight * scale))
    }
}

/// A rest smaller than this is a rounding of the weights.
const LEAST_REST: f64 = 1e-3;

impl BsdfPlugin for MixtureDesc {
    const NAME: &'static str = "mixturebsdf";

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
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
            let bsdf = super::read(reader, id)?;
            warn_of_lost_dispersion(reader, params, bsdf, span);
            parts.push((bsdf, (weight / whole) as f32));
        }
        if rest >= LEAST_REST {
            parts.push((super::default(reader, true), rest as f32));
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
        Ok(Self { parts })
    }

    parts! {}

    fn number(&self, name: &str) -> Option<f32> {
        let named = WEIGHTS.iter().zip(&self.parts).find(|(known, _)| **known == name);
        named.map(|(_, (_, weight))| *weight)
    }

    fn set_number(&mut self, name: &str, value: f32) {
        let named = WEIGHTS.iter().zip(&mut self.parts).find(|(known, _)| **known == name);
        named.into_iter().for_each(|(_, (_, weight))| *weight = value);
    }

    fn nested(&self) -> Vec<BsdfId> {
        self.parts.iter().map(|(bsdf, _)| *bsdf).collect()
    }
}

/// A material with holes: a ray that meets one goes straight on.
#[derive(Clone, Debug)]
pub struct MaskDesc {
    /// The material between the holes.
    pub bsdf: BsdfId,
    /// Its share of the surface, from 0 to 1: [`SpectrumTexture::scalar`].
    pub opacity: SpectrumTexture,
}

impl BsdfPlugin for MaskDesc {
    const NAME: &'static str = "mask";

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let [inner] = *params.objects("bsdf").as_slice() else {
            return Err(params.fault(FindingKind::Parameter, "a mask has one bsdf").error());
        };
        let opacity = share(reader, params, "opacity")?;
        let bsdf = super::read(reader, inner.0)?;
        check_size(reader, params, &[bsdf])?;
        Ok(Self { bsdf, opacity })
    }

    parts! { share: opacity }

    fn number(&self, name: &str) -> Option<f32> {
        uniform(&self.opacity).filter(|_| name == "opacity")
    }

    fn set_number(&mut self, _name: &str, value: f32) {
        self.opacity = Spectrum::Constant(value).into();
    }

    fn nested(&self) -> Vec<BsdfId> {
        vec![self.bsdf]
    }
}

impl BsdfDesc {
    /// True for a material that rays pass straight, at least here and there.
    pub(crate) fn has_holes(&self) -> bool {
        match self {
            Self::Null(_) => true,
            Self::Mask(mask) => mask.opacity != Spectrum::Constant(1.0),
            _ => false,
        }
    }
}

/// A number from 0 to 1, half if it is not given, or a texture of such numbers. A colour counts by its luminance.
fn share(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    name: &'static str,
) -> Result<SpectrumTexture, SceneError> {
    let given = read_texture(reader, params, name)?.unwrap_or(Spectrum::Constant(0.5).into());
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
