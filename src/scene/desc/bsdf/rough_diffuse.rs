//! `roughdiffuse` of version 0.6: matt surfaces made of V-shaped cavities, such as clay or plaster.

use super::{BsdfPlugin, parts};
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::Spectrum;

/// A rough diffuse reflector.
#[derive(Clone, Debug)]
pub struct RoughDiffuseDesc {
    /// Albedo of the facets.
    pub reflectance: SpectrumTexture,
    /// Root mean square slope, a number: √2 times the σ of the model.
    pub alpha: SpectrumTexture,
    /// Interreflection between facets is left out, and the rest is approximated.
    pub use_fast_approx: bool,
}

impl BsdfPlugin for RoughDiffuseDesc {
    const NAME: &'static str = "roughdiffuse";
    const OTHER_DIFFUSE: bool = true;

    parts! { albedo: reflectance }

    fn number(&self, name: &str) -> Option<f32> {
        self.alpha.constant_scalar().filter(|_| name == "alpha")
    }

    fn set_number(&mut self, _name: &str, value: f32) {
        self.alpha = Spectrum::Constant(value).into();
    }

    fn scalars(&self) -> Vec<&SpectrumTexture> {
        vec![&self.alpha]
    }

    fn scalars_mut(&mut self) -> Vec<&mut SpectrumTexture> {
        vec![&mut self.alpha]
    }
}
