//! `blendbsdf`, `mixturebsdf` and `mask`: materials made of other materials.

use super::{BsdfPlugin, parts};
use crate::scene::desc::ids::BsdfId;
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::Spectrum;

/// Most one-sided materials that one material can be made of.
pub const MOST_PARTS: usize = 4;

/// Two materials in a ratio that may vary over the surface.
#[derive(Clone, Debug)]
pub struct BlendDesc {
    /// Share of the second, from 0 to 1: [`SpectrumTexture::scalar`].
    pub weight: SpectrumTexture,
    /// The two materials.
    pub bsdfs: [BsdfId; 2],
}

impl BsdfPlugin for BlendDesc {
    const NAME: &'static str = "blendbsdf";

    parts! { share: weight }

    fn number(&self, name: &str) -> Option<f32> {
        self.weight.constant_scalar().filter(|_| name == "weight")
    }

    fn set_number(&mut self, _name: &str, value: f32) {
        self.weight = Spectrum::Constant(value).into();
    }

    fn nested(&self) -> Vec<BsdfId> {
        self.bsdfs.to_vec()
    }
}

/// Several materials with constant weights.
#[derive(Clone, Debug)]
pub struct MixtureDesc {
    /// The materials with their weights, at least 0, which are normalised by their sum. A reader that finds weights of less than 1 in all
    /// adds a black material for the rest.
    pub parts: Vec<(BsdfId, f32)>,
}

/// Names of the weights, by which they are edited.
const WEIGHTS: [&str; MOST_PARTS] = ["weight_1", "weight_2", "weight_3", "weight_4"];

impl MixtureDesc {
    /// The materials with their normalised weights, which add up to 1, or are all 0 if every weight is.
    pub fn shares(&self) -> impl Iterator<Item = (BsdfId, f32)> {
        let sum: f32 = self.parts.iter().map(|(_, weight)| weight).sum();
        // Weights of a file add up to 1 already, except for rounding.
        let scale = if sum <= 0.0 || (sum - 1.0).abs() < 1e-6 { 1.0 } else { 1.0 / sum };
        self.parts.iter().map(move |(bsdf, weight)| (*bsdf, weight * scale))
    }
}

impl BsdfPlugin for MixtureDesc {
    const NAME: &'static str = "mixturebsdf";

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

/// A material with an opacity: where it is transparent, rays pass straight through.
#[derive(Clone, Debug)]
pub struct MaskDesc {
    /// The material where it is opaque.
    pub bsdf: BsdfId,
    /// Opacity, from 0 to 1: [`SpectrumTexture::scalar`].
    pub opacity: SpectrumTexture,
}

impl BsdfPlugin for MaskDesc {
    const NAME: &'static str = "mask";

    parts! { share: opacity }

    fn number(&self, name: &str) -> Option<f32> {
        self.opacity.constant_scalar().filter(|_| name == "opacity")
    }

    fn set_number(&mut self, _name: &str, value: f32) {
        self.opacity = Spectrum::Constant(value).into();
    }

    fn nested(&self) -> Vec<BsdfId> {
        vec![self.bsdf]
    }
}
