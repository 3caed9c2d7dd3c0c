//! `principledthin`: leaves, paper and panes by parameters like those of `principled`.

use super::dielectric::is_ior;
use super::principled::{ETA, ONE, SHARED, share};
use super::textures::uniform;
use super::{BsdfParts, BsdfPlugin, LobeTexture, Number, PrincipledLobes, Roughness, color, number};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader};
use crate::scene::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// The thin principled material of Burley (2015) as Mitsuba 3 has it: both sides look alike.
#[derive(Clone, Debug)]
pub struct PrincipledThinDesc {
    /// Albedo of the diffuse parts, colour of what is let through.
    pub base_color: SpectrumTexture,
    /// Factor on all that is let through: 1, or 0 where the effect `transmission` is taken out.
    pub transmittance: SpectrumTexture,
    /// Share of the microfacets in everything, a number.
    pub spec_trans: SpectrumTexture,
    /// Twice the share of the diffuse part that is let through: a number from 0 to 2.
    pub diff_trans: SpectrumTexture,
    /// The parameters that it shares with `principled`; there is neither metal nor coat.
    pub lobes: PrincipledLobes,
    /// Those of `lobes` that vary; there they have their means, or 1 for a mesh attribute.
    pub textures: Vec<LobeTexture>,
}

impl BsdfPlugin for PrincipledThinDesc {
    const NAME: &'static str = "principledthin";

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let mut lobes = PrincipledLobes::new(1.5);
        let mut textures = lobes.read(reader, params, SHARED)?;
        match number(reader, params, "eta")? {
            None => {}
            Some(Number::Uniform(eta)) if is_ior(eta) => lobes.eta = eta as f32,
            Some(Number::Uniform(_)) => {
                let message = "an index of refraction is above 0 and not above 1000";
                return Err(params.error("eta", message).error());
            }
            Some(Number::Varying(texture)) => {
                let eta = LobeTexture::new(|lobes| &mut lobes.eta, [1e-3, 1e3], texture, &mut lobes.eta);
                textures.push(eta);
            }
        }
        params.without_effect(&[
            "specular_reflectance_sampling_rate",
            "specular_transmittance_sampling_rate",
            "diffuse_reflectance_sampling_rate",
            "diffuse_transmittance_sampling_rate",
        ]);
        Ok(Self {
            base_color: color(reader, params, "base_color", 0.5)?,
            transmittance: Spectrum::Constant(1.0).into(),
            spec_trans: share(reader, params, "spec_trans", 1.0)?,
            diff_trans: share(reader, params, "diff_trans", 2.0)?,
            lobes,
            textures,
        })
    }

    fn parts(&self) -> BsdfParts<&SpectrumTexture, &Spectrum, &Ior> {
        BsdfParts {
            albedo: Some(&self.base_color),
            reflection: Some(&ONE),
            transmission: self.lets_through().then_some(&self.transmittance),
            ..Default::default()
        }
    }

    fn parts_mut(&mut self) -> BsdfParts<&mut SpectrumTexture, &mut Spectrum, &mut Ior> {
        let through = self.lets_through();
        BsdfParts {
            albedo: Some(&mut self.base_color),
            transmission: through.then_some(&mut self.transmittance),
            ..Default::default()
        }
    }

    fn roughness(&self) -> Option<Roughness> {
        Some(self.lobes.facets(self.lobes.roughness))
    }

    fn number(&self, name: &str) -> Option<f32> {
        match name {
            "spec_trans" => uniform(&self.spec_trans),
            "diff_trans" => uniform(&self.diff_trans),
            _ => [SHARED, ETA].iter().find_map(|known| self.lobes.number(known, &self.textures, name)),
        }
    }

    fn set_number(&mut self, name: &str, value: f32) {
        match name {
            "spec_trans" => self.spec_trans = Spectrum::Constant(value).into(),
            "diff_trans" => self.diff_trans = Spectrum::Constant(value).into(),
            _ => [SHARED, ETA].iter().for_each(|known| self.lobes.set_number(known, name, value)),
        }
    }

    fn scalars(&self) -> Vec<&SpectrumTexture> {
        let lobes = self.textures.iter().map(|varying| &varying.texture);
        lobes.chain([&self.spec_trans, &self.diff_trans]).collect()
    }

    fn scalars_mut(&mut self) -> Vec<&mut SpectrumTexture> {
        let lobes = self.textures.iter_mut().map(|varying| &mut varying.texture);
        lobes.chain([&mut self.spec_trans, &mut self.diff_trans]).collect()
    }
}

impl PrincipledThinDesc {
    fn lets_through(&self) -> bool {
        !self.spec_trans.is_black() || !self.diff_trans.is_black()
    }
}
