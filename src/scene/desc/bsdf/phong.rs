//! `phong` of version 0.6: a lobe around the mirror direction over a diffuse part.

use super::{BsdfPlugin, Facets, Roughness, parts};
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::Spectrum;

/// A modified Phong reflector.
#[derive(Clone, Debug)]
pub struct PhongDesc {
    /// Exponent of the lobe, a number from 0 to [`SHARPEST_PHONG`].
    pub exponent: SpectrumTexture,
    /// Factor on the lobe.
    pub specular_reflectance: SpectrumTexture,
    /// Albedo of the diffuse part.
    pub diffuse_reflectance: SpectrumTexture,
}

/// Largest exponent: the lobe is .08° wide. Single precision does not tell directions in a much narrower one apart.
pub const SHARPEST_PHONG: f32 = 1e6;

impl BsdfPlugin for PhongDesc {
    const NAME: &'static str = "phong";

    parts! { albedo: diffuse_reflectance, reflection: specular_reflectance }

    /// That of microfacets with a lobe as wide.
    fn roughness(&self) -> Option<Roughness> {
        let alpha = (2.0 / (self.exponent.mean_scalar() + 2.0)).sqrt();
        Some(Roughness { facets: Facets::Beckmann, alpha: [alpha; 2] })
    }

    fn number(&self, name: &str) -> Option<f32> {
        self.exponent.constant_scalar().filter(|_| name == "exponent")
    }

    fn set_number(&mut self, _name: &str, value: f32) {
        self.exponent = Spectrum::Constant(value).into();
    }

    fn scalars(&self) -> Vec<&SpectrumTexture> {
        vec![&self.exponent]
    }

    fn scalars_mut(&mut self) -> Vec<&mut SpectrumTexture> {
        vec![&mut self.exponent]
    }
}
