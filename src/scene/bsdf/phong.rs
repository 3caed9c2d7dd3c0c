//! `phong` of version 0.6: a lobe around the mirror direction over a diffuse part.

use super::textures::{uniform, warn_of_more_than_one};
use super::{BsdfPlugin, Facets, Number, Roughness, color, number, parts};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader};
use crate::scene::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

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

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        params.default("exponent", 30);
        let exponent = match number(reader, params, "exponent")? {
            None => Spectrum::Constant(30.0).into(),
            Some(Number::Varying(texture)) => texture,
            Some(Number::Uniform(v)) => {
                let most = f64::from(SHARPEST_PHONG);
                if v < 0.0 {
                    return Err(params.error("exponent", "an exponent is not negative").error());
                }
                if v > most {
                    let found = params.error("exponent", format!("this exponent counts as {most}"));
                    params.note(found.help("a mirror is a `conductor`").warning());
                }
                Spectrum::Constant(v.min(most) as f32).into()
            }
        };
        let specular_reflectance = color(reader, params, "specular_reflectance", 0.2)?;
        let diffuse_reflectance = color(reader, params, "diffuse_reflectance", 0.5)?;
        warn_of_more_than_one(params, &specular_reflectance, &diffuse_reflectance);
        params.without_effect(&["specular_sampling_weight"]);
        Ok(Self { exponent, specular_reflectance, diffuse_reflectance })
    }

    parts! { albedo: diffuse_reflectance, reflection: specular_reflectance }

    /// That of microfacets with a lobe as wide.
    fn roughness(&self) -> Option<Roughness> {
        let alpha = (2.0 / (self.exponent.mean_scalar() + 2.0)).sqrt();
        Some(Roughness { facets: Facets::Beckmann, alpha: [alpha; 2] })
    }

    fn number(&self, name: &str) -> Option<f32> {
        uniform(&self.exponent).filter(|_| name == "exponent")
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
