//! `roughdiffuse` of version 0.6: matt surfaces made of V-shaped cavities, such as clay or plaster.

use super::textures::uniform;
use super::{BsdfPlugin, Number, color, number, parts};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader};
use crate::scene::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// A rough diffuse reflector.
#[derive(Clone, Debug)]
pub struct RoughDiffuseDesc {
    /// Albedo of the facets.
    pub reflectance: SpectrumTexture,
    /// Root mean square slope, a number: √2 times the σ of the model.
    pub alpha: SpectrumTexture,
    /// Light that meets two facets is left out, and the rest is approximated.
    pub use_fast_approx: bool,
}

impl BsdfPlugin for RoughDiffuseDesc {
    const NAME: &'static str = "roughdiffuse";
    const OTHER_DIFFUSE: bool = true;

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        params.default("alpha", 0.2);
        let alpha = match number(reader, params, "alpha")? {
            None => Spectrum::Constant(0.2).into(),
            Some(Number::Varying(texture)) => texture,
            Some(Number::Uniform(v)) if v >= 0.0 => Spectrum::Constant(v as f32).into(),
            Some(Number::Uniform(_)) => {
                return Err(params.error("alpha", "a roughness is not negative").error());
            }
        };
        Ok(Self {
            reflectance: color(reader, params, "reflectance", 0.5)?,
            alpha,
            use_fast_approx: params.boolean("use_fast_approx", false)?,
        })
    }

    parts! { albedo: reflectance }

    fn number(&self, name: &str) -> Option<f32> {
        uniform(&self.alpha).filter(|_| name == "alpha")
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
