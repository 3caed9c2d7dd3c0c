//! `distribution` and `alpha`: the parameters that all rough materials share. `alpha` may be a texture.

use crate::scene::desc::texture::{SpectrumTexture, TexturePoint};

/// Distribution of the microfacets of a rough surface: Mitsuba's `distribution` and `alpha`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness {
    /// The family of distributions.
    pub facets: Facets,
    /// Root mean square slope (for Beckmann) along the two tangents.
    pub alpha: [f32; 2],
}

/// A family of distributions of microfacet normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facets {
    /// Gaussian slopes.
    Beckmann,
    /// Long tails (Trowbridge and Reitz).
    Ggx,
}

impl Roughness {
    /// `alpha`, or `alpha_u` and `alpha_v` where they differ.
    pub(super) fn number(&self, name: &str) -> Option<f32> {
        let [u, v] = self.alpha;
        match (name, u == v) {
            ("alpha", true) | ("alpha_u", false) => Some(u),
            ("alpha_v", false) => Some(v),
            _ => None,
        }
    }

    /// Changes `alpha`, `alpha_u` or `alpha_v`.
    pub(super) fn set_number(&mut self, name: &str, value: f32) {
        match name {
            "alpha" => self.alpha = [value; 2],
            "alpha_u" => self.alpha[0] = value,
            _ => self.alpha[1] = value,
        }
    }
}

/// Roughness that varies over a surface; each value is at least 0.0001, as in Mitsuba.
#[derive(Clone, Debug)]
pub enum AlphaTexture {
    /// The same along both tangents.
    Isotropic(SpectrumTexture),
    /// Different along the two tangents.
    Anisotropic([SpectrumTexture; 2]),
}

impl AlphaTexture {
    /// The roughness along the two tangents at a point.
    pub fn at(&self, at: &TexturePoint) -> [f32; 2] {
        match self {
            Self::Isotropic(alpha) => [alpha.scalar(at); 2],
            Self::Anisotropic(alphas) => alphas.each_ref().map(|alpha| alpha.scalar(at)),
        }
    }

    /// The textures.
    pub(super) fn textures(&self) -> Vec<&SpectrumTexture> {
        match self {
            Self::Isotropic(alpha) => vec![alpha],
            Self::Anisotropic(alphas) => alphas.iter().collect(),
        }
    }

    /// The textures, mutably.
    pub(super) fn textures_mut(&mut self) -> Vec<&mut SpectrumTexture> {
        match self {
            Self::Isotropic(alpha) => vec![alpha],
            Self::Anisotropic(alphas) => alphas.iter_mut().collect(),
        }
    }
}

/// Implements the methods of [`BsdfPlugin`](super::BsdfPlugin) about roughness by the fields `roughness`, which has its mean if it varies, and
/// `alpha`, its texture.
macro_rules! varying_roughness {
    () => {
        fn roughness(&self) -> Option<crate::scene::desc::bsdf::Roughness> {
            Some(self.roughness)
        }

        fn number(&self, name: &str) -> Option<f32> {
            self.roughness.number(name).filter(|_| self.alpha.is_none())
        }

        fn set_number(&mut self, name: &str, value: f32) {
            self.roughness.set_number(name, value);
        }

        fn alpha(&self) -> Option<&crate::scene::desc::bsdf::AlphaTexture> {
            self.alpha.as_deref()
        }

        fn alpha_mut(&mut self) -> Option<&mut crate::scene::desc::bsdf::AlphaTexture> {
            self.alpha.as_deref_mut()
        }
    };
}
pub(super) use varying_roughness;
